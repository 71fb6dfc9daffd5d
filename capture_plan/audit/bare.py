"""Blendshapes that no marker can stand for: where they move the skin, no dot holds, or none is seen.

Data    d[k, v]  displacement of the skin, millimetres;  h[v] share of the hemisphere that sees a vertex of the neutral
Seen    h >= LEAST_SEEN, on the vertex and its mirror image
Clear   seen, and outside CLEAR_ZONES by their margins and half of a dot
Bare    the largest d[k] of the clear skin is less than STANDS_FOR of the largest of the seen skin
A cartoon's blink moves the lid alone, as a narrow edge of which all is lash line. The plan, which traces every
expression, has the last word (`layout.problem`).
"""

import numpy as np

from capture_plan.anatomy.delta_relations import Finding
from capture_plan.anatomy.zones import CLEAR_ZONES, DOT_MM, MARGINS_MM, ground_of
from capture_plan.rig.record import Rig

STANDS_FOR = 0.5  # of a blendshape's largest movement: skin that moves by less does not stand for it
LEAST_SEEN = 0.05  # of the hemisphere


def bare(rig: Rig, used: tuple[str, ...]) -> list[Finding]:
    """One finding for all blendshapes of `used` that no marker can stand for."""
    ground = ground_of(rig)
    seen = rig.skin & (ground.seen >= LEAST_SEEN)
    seen &= seen[ground.mirror]
    zones = [ground.zone(name, MARGINS_MM[name] + DOT_MM / 2) for name in CLEAR_ZONES]
    clear = seen & ~np.any([zone.mask for zone in zones], axis=0)
    d = rig.displacement[rig.rows(used)]
    most, left = (np.where(skin, d, 0).max(axis=1) for skin in (seen, clear))
    rows = np.flatnonzero(left < STANDS_FOR * most)
    if not len(rows):
        return []
    names = tuple(used[k] for k in rows)
    where = sorted({zone.name for zone in zones if (zone.mask & (d[rows] >= most[rows, None] / 2).any(axis=0)).any()})
    each = ", ".join(f"{used[k]} ({most[k]:.1f} mm, {left[k]:.1f} mm where dots hold)" for k in rows)
    message = f"no marker can stand for {each}: "
    message += f"half of the movement or more lies on the {' and '.join(where)}" if where else "the skin is hidden"
    advice = "Film it as well (a camera at the eyes reads a blink), or give the zone a smaller margin (--keep-out)."
    return [Finding("bare", names, message, advice, False)]
