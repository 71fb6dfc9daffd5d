"""Files of a folder that are no whole blendshapes: left out and named, while at least half of the files are whole.

Letters: k files, v vertices.
"""

from collections.abc import Callable

import numpy as np
from jaxtyping import Float

from capture_plan.errors import RigError
from capture_plan.progress import track
from capture_plan.rig.formats.naming import listed
from capture_plan.rig.formats.source import Source

ENOUGH = 0.5  # of the files of blendshapes


class OtherMeshError(RigError):
    """A file has the neutral's vertices in other faces: its order means something else, and so may that of all."""


def whole_deltas(
    neutral: Float[np.ndarray, "v 3"], paths: list[Source], read: Callable[[Source], Float[np.ndarray, "v 3"]]
) -> tuple[list[Source], Float[np.ndarray, "k v 3"], str]:
    """The files that are whole, what they add to the neutral, and the sentence that names the others.

    `read` raises a RigError for a file that is not. RigError where too few are, or where one is of another mesh.
    """
    deltas = np.empty((len(paths), *neutral.shape), dtype=np.float32)
    kept: list[Source] = []
    broken: list[RigError] = []
    for path in track(paths, "Reading blendshapes"):
        try:
            deltas[len(kept)] = read(path) - neutral
        except OtherMeshError:
            raise
        except RigError as error:
            broken.append(error)
        else:
            kept.append(path)
    if len(kept) < ENOUGH * len(paths):
        raise broken[0]
    return kept, deltas[: len(kept)], told_of(broken)


def told_of(broken: list[RigError]) -> str:
    """The sentence about files that were left out; each error begins with the name of its file, and ends in advice."""
    if not broken:
        return ""
    reasons = [str(error).rpartition(": ")[0] or str(error) for error in broken]
    advice = "export them again, or move away what is no blendshape"
    return f"files that are no whole blendshapes were left out, {advice}: {listed(reasons)}"
