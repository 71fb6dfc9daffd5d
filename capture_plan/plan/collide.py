"""What a plan keeps apart because it would run through itself on the mesh."""

import numpy as np

from capture_plan.cache import Arrays, cached, code_digest, digest
from capture_plan.expressions.collision import colliding_pairs
from capture_plan.expressions.compatibility import performed_together
from capture_plan.expressions.settings import PackingSettings
from capture_plan.reader.read_cache import ROOMS, everything_of
from capture_plan.rig import Rig

COLLIDING = (*ROOMS, "curves", "transfer", "anatomy", "sequence", "expressions")
ENTRIES = 64  # a few kilobytes each


def collide(rig: Rig, used: tuple[str, ...], settings: PackingSettings) -> tuple[tuple[str, str], ...]:
    """Blendshapes whose surfaces run through each other when performed at once; none where anything goes.

    Cached on disk by all that it depends on, so that the same rig is tried once.
    """
    if not settings.poseable:
        return ()
    together = performed_together(rig, used) if settings.paired else ()

    def found() -> Arrays:
        return {"pairs": np.array(colliding_pairs(rig, used, together), dtype=str).reshape(-1, 2)}

    name = digest([code_digest(*COLLIDING), repr((used, together)), *everything_of(rig)])
    return tuple((a, b) for a, b in cached(found, "collisions", name, entries=ENTRIES)["pairs"].tolist())
