"""Where eyes are by their lids: which openings may be theirs, when eyeballs know better, and what speaks against them.

Letters    p  pupil distance;  e  the places that all signs together take for the eyes
Around     openings whose middles lie further than NEAR_OPENING p from e are the eyes' only where one of them goes
           around e or passes within BY p: a brow or a lash drawn above is a strip beside it, and a closed eye a slit
Apart      eyes that were drawn onto lids or eyeballs NEAR p from e and more: one of the two is wrong, so neither is
           sure; eyes that were right lay 0.25 p away at most
"""

import numpy as np
from jaxtyping import Float, Int

from capture_plan.face.points import NEAR
from capture_plan.face.shape import Shape, middle_of_box
from capture_plan.names.arkit import Side
from capture_plan.rig.understood import Sign

NEAR_OPENING = 0.2  # pupil distances from an eye to the middle of its opening
BY = 0.1  # pupil distances; drawn brows of two avatars pass at 0.16 to 0.23
WIDER_LIDS = 1.065  # times as far apart as the eyeballs: lids of human scans 1.06 at most, drawn wide 1.07 to 1.10
SHUT, LID_VERTICES = 0.2, 6  # height of an eye over its width: eleven faces 0.33 and more, half shut 0.16
ROUND, HALF_A_BALL, BALL_VERTICES = 0.85, 0.4, 12  # height over width, depth over width


def around(openings: list[Float[np.ndarray, "_ 3"]], places: Float[np.ndarray, "2 3"]) -> bool:
    """Whether one of the openings goes around one of two places, or close by, as seen from the front."""
    by = BY * float(np.linalg.norm(places[0] - places[1]))
    boxes = [(points.min(axis=0)[:2] - by, points.max(axis=0)[:2] + by) for points in openings]
    return any(bool(((low < e[:2]) & (e[:2] < high)).all()) for low, high in boxes for e in places)


def against_eyes(eyes: Float[np.ndarray, "2 3"], places: Float[np.ndarray, "2 3"]) -> tuple[Sign, ...]:
    """What speaks against eyes that were drawn onto the mesh from the `places` of all signs; depth counts half."""
    p = float(np.linalg.norm(places[0] - places[1]))
    apart = float(np.linalg.norm((eyes - places) * [1, 1, 0.5], axis=1).max())
    if apart <= NEAR * p:
        return ()
    return (Sign("the lids or eyeballs that lie nearest", f"{apart:.0f} mm from what the other signs say", -1.0),)


def before_the_balls(shape: Shape, lids: Float[np.ndarray, "2 3"]) -> Float[np.ndarray, "2 3"]:
    """Middles of the lid openings, or the places of the eyeballs where these lie clearly nearer to each other: lids
    that reach far round a face have their middle beside the pupil."""
    p = float(np.linalg.norm(lids[0] - lids[1]))
    aside = shape.neutral[:, 0] - lids[:, 0].mean()
    halves = [shape.neutral[shape.called_eyes & (sign * aside > 0)] for sign in (1, -1)]
    if min(map(len, halves)) < BALL_VERTICES or not all(_round(half, p) for half in halves):
        return lids
    balls = np.stack([np.append(middle_of_box(half)[:2], eye[2]) for half, eye in zip(halves, lids, strict=True)])
    near = np.linalg.norm(balls - lids, axis=1).max() < NEAR_OPENING * p
    return balls if near and np.linalg.norm(balls[0] - balls[1]) * WIDER_LIDS < p else lids


def _round(eye: Float[np.ndarray, "n 3"], p: float) -> bool:
    """Whether a part is round as seen from the front, deep, and not wider than an eye."""
    x, y, z = np.ptp(eye, axis=0)
    return bool(ROUND < x / max(y, 1e-9) < 1 / ROUND and z > HALF_A_BALL * x and x < p)


def lid_gaps(
    neutral: Float[np.ndarray, "v 3"], lids: Int[np.ndarray, " n"], x0: float
) -> dict[Side, tuple[float, float]]:
    """Height in the middle and width of the opening between the lids of each eye that has a border, millimetres."""
    sides: tuple[tuple[Side, int], ...] = (("left", 1), ("right", -1))
    found: dict[Side, tuple[float, float]] = {}
    for side, sign in sides:
        border = neutral[lids[sign * (neutral[lids, 0] - x0) > 0]]
        if len(border) < LID_VERTICES:
            continue
        low, high = float(border[:, 0].min()), float(border[:, 0].max())
        middle = border[np.abs(border[:, 0] - (low + high) / 2) < (high - low) / 4, 1]
        if len(middle):
            found[side] = float(np.ptp(middle)), high - low
    return found


def shut(gap: tuple[float, float]) -> bool:
    """Whether lids so far apart, over such a width, are closed or nearly so."""
    return gap[0] < SHUT * gap[1]
