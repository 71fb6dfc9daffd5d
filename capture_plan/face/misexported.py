"""Blendshapes that were exported wrongly, by where their vertices lie: none of them is a movement of the face.

Data           x[v]  neutral, d[k, v]  deltas, y[v] = x + d[k] the blendshape's own vertices, all from the file's origin
               s     <x, y> / <x, x>, cosine <x, y> / (|x| |y|), S the diagonal of the mesh
Displacements  AT_ORIGIN of the vertices lie at the origin, and |y| is small beside |x|: y is the delta itself
Positions      d is nearly x itself, of which no movement of a face is near: d is where the vertices lie
Unit           y = s x with a cosine of ALIKE and s far from 1
Shifted        d is one and the same shift for half of the vertices: not even a neck stays where it was
Order          neighbours go each their own way (`face/channels.py`), where other blendshapes move surfaces; or all
               vertices have another order, so that most edges of the mesh are longer
"""

from collections.abc import Iterator
from typing import Literal, NamedTuple

import numpy as np
from jaxtyping import Float

from capture_plan.face.channels import reordered, scrambled
from capture_plan.face.flying import flying
from capture_plan.face.moving import NOISE_MM
from capture_plan.formats.raw import are_positions
from capture_plan.names.movements import movements_of
from capture_plan.once import once
from capture_plan.rig import Rig

Fault = Literal["displacements", "positions", "unit", "beside", "order"]
AT_ORIGIN, ORIGIN = 0.1, 1e-4  # of the vertices; of S: what a blendshape leaves still has no displacement at all
SMALL = 0.3  # |y| / |x|: displacements of an open jaw on a head around the origin have 0.1
ALIKE, UNIT = 0.99, 2.0  # cosine; times as large or as small: no character's head grows so much
SHIFTED, ONE_SHIFT = 0.5, 0.02  # of the vertices; of the shift: they differ in by no more
NEAR_MM = 20.0  # of a whole mesh with the rim of its neck: heads that nod bend it
MOVES_HEADS = ("head turn", "body", "hide or shrink", "hair or clothes")


class Words(NamedTuple):
    """What is said of one blendshape with a fault and of several, and what to do about one and about several."""

    one: str
    several: str
    change: str
    change_several: str


SAYS: dict[Fault, Words] = {
    "displacements": Words(
        "holds displacements, not positions: its vertices lie around the origin of the file",
        "hold displacements, not positions: their vertices lie around the origin of the file",
        "Add the neutral to its vertices, or export the whole face in this pose.",
        "Add the neutral to their vertices, or export the whole face in each pose.",
    ),
    "positions": Words(
        "holds positions, where offsets from the neutral belong",
        "hold positions, where offsets from the neutral belong",
        "Subtract the neutral from it.",
        "Subtract the neutral from them.",
    ),
    "unit": Words(
        "is in another unit",
        "are in another unit",
        "Export it in the unit of the neutral.",
        "Export them in the unit of the neutral.",
    ),
    "beside": Words(
        "stands beside the neutral",
        "stand beside the neutral",
        "Move it to where the neutral stands.",
        "Move them to where the neutral stands.",
    ),
    "order": Words(
        "has lost its vertex order: single vertices fly while their neighbours stay",
        "have lost their vertex order: single vertices fly while their neighbours stay",
        "Export it again from the neutral's own mesh, with 'keep vertex order' on.",
        "Export them again from the neutral's own mesh, with 'keep vertex order' on.",
    ),
}


class Misexported(NamedTuple):
    """A blendshape with its fault; `why` says it as the rest of a sentence: 'is in another unit (x0.1)'."""

    name: str
    fault: Fault
    why: str


@once
def misexported(rig: Rig) -> tuple[Misexported, ...]:
    """The blendshapes of a rig that were exported wrongly, in its order."""
    return tuple(_found(rig))


def _found(rig: Rig) -> Iterator[Misexported]:
    S = float(np.linalg.norm(np.ptp(rig.neutral, axis=0)))
    moving = (rig.displacement.max(axis=1) >= NOISE_MM) & ~flying(rig.neutral, rig.triangles, rig.deltas)
    order = scrambled(rig.triangles, rig.deltas, rig.displacement) & moving
    whole = reordered(rig.neutral, rig.triangles, rig.deltas)
    for k, movement in enumerate(movements_of(rig.names)):
        if not moving[k] or (movement is not None and movement.kind in MOVES_HEADS):
            continue
        if found := _placed(rig.neutral, rig.deltas[k].astype(float), S):
            fault, figure = found
            yield Misexported(rig.names[k], fault, SAYS[fault].one + (f" ({figure})" if figure else ""))
        elif whole[k] or (order[k] and not order[moving].all()):
            yield Misexported(rig.names[k], "order", SAYS["order"].one)


def _placed(x: Float[np.ndarray, "v 3"], d: Float[np.ndarray, "v 3"], S: float) -> tuple[Fault, str] | None:
    """What is wrong with where the vertices of a blendshape lie, with a figure for it."""
    y = x + d
    xy, xx, yy = (float(np.einsum("vx,vx->", a, b)) for a, b in ((x, y), (x, x), (y, y)))
    away = np.linalg.norm(y, axis=1)
    at_origin = (away <= ORIGIN * S).mean() >= AT_ORIGIN and away.max() > ORIGIN * S
    if at_origin and yy < SMALL**2 * xx:
        return "displacements", ""
    if are_positions(x, d):
        return "positions", ""
    s = xy / xx if xx > 0 else 1.0
    if xy >= ALIKE * np.sqrt(xx * yy) and not 1 / UNIT < s < UNIT:
        return "unit", f"x{s:.3g}"
    t = np.median(d, axis=0)
    far = float(np.linalg.norm(t))
    if far >= NEAR_MM and (np.linalg.norm(d - t, axis=1) <= ONE_SHIFT * far).mean() >= SHIFTED:
        return "beside", f"by {far:.0f} mm"
    return None
