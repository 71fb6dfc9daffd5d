"""Which eye a blendshape turns, and which way, from geometry: the eyeballs say it, else the lids that follow them.

Data      d[k, v]   deltas, millimetres; +x is the subject's left; eyes at e
Eyeball   d = t + omega x r about its middle, least squares: omega_y > 0 turns the eye to the subject's left,
          omega_x < 0 upwards; a ball that turns by less than LEAST_DEGREES does not turn. Where the eyes are sure, a
          ball is none that lies elsewhere (buttons, beads) or is a speck (highlights); and one that turns alone tells
          nothing where the skin around both eyes moves
Lids      nearly all of |d|^2 lies around an eye, and its mean direction is sideways: lids follow an eye that turns to
          the side, and nothing else moves them so. Up and down they cannot tell from a blink: only eyeballs say that
Sign      a name that says gaze needs no place of the eyes: the direction of what moves tells it
None where no sign speaks. What moves more of the face than its eyes is no gaze.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Bool, Float

from capture_plan.face.anchors import eyeballs
from capture_plan.face.reading import face_reading
from capture_plan.mesh import vertex_areas
from capture_plan.mesh.mirror import mirror_plane
from capture_plan.names.movements import movement_of
from capture_plan.once import once
from capture_plan.rig import Rig

Way = Literal["left", "right", "up", "down"]
SAID = ("gaze left", "gaze right", "gaze in", "gaze out")
LEAST_DEGREES = 2.0  # a blink rocks a ball by less; gaze turns it by 10 and more
SPECK = 0.15  # of the pupil distance: eyeballs have 0.35 and more
AROUND = 0.45  # of the pupil distance: the lids, not the brow nor the nose
ALONE = 0.9  # of |d|^2 around the eyes: looks on four heads have 0.99, sneers and squints up to 0.9
ASIDE, UPRIGHT = 0.6, 0.45  # of the mean direction: looks have 0.75 and more sideways, squints as much up as sideways
SAID_ASIDE = 0.5  # the same, where the name already says gaze


@dataclass(frozen=True)
class Gaze:
    """`eye` is 1 the subject's left, -1 the right, 0 both; `way` the subject's own; `strength` only ranks like ones."""

    eye: int
    way: Way
    strength: float


@once
def gazes(rig: Rig) -> dict[str, Gaze]:
    """The blendshapes that turn eyes, by name."""
    return {name: gaze for k, name in enumerate(rig.names) if (gaze := _gaze(rig, k)) is not None}


def sideways(rig: Rig) -> dict[str, Gaze]:
    """Those that turn one eye to a side."""
    return {name: gaze for name, gaze in gazes(rig).items() if gaze.eye and gaze.way in ("left", "right")}


def outwards(gaze: Gaze) -> bool:
    """Whether an eye turns away from the nose."""
    return gaze.way == {1: "left", -1: "right"}.get(gaze.eye)


def _gaze(rig: Rig, k: int) -> Gaze | None:
    turned = _turned_balls(rig, k)
    if turned and (not _moves_skin(rig, k) or (_share_around_eyes(rig, k) >= ALONE and _same_eyes(rig, k, turned))):
        return _from_turns(turned)
    return _from_name(rig, k) or _from_lids(rig, k)


def _turned_balls(rig: Rig, k: int) -> dict[int, Float[np.ndarray, " 2"]]:
    """Degrees to the subject's left and upwards of the ball that turns most on either side, where one turns."""
    found = {}
    for ball, side in _balls(rig):
        r = rig.neutral[ball] - rig.neutral[ball].mean(axis=0)
        turn = _turn(r, rig.deltas[k, ball].astype(float))
        if np.linalg.norm(turn) >= LEAST_DEGREES and np.linalg.norm(turn) > np.linalg.norm(found.get(side, (0.0, 0.0))):
            found[side] = turn
    return found


@once
def _balls(rig: Rig) -> list[tuple[Bool[np.ndarray, " v"], int]]:
    """The vertices of every eyeball, and 1 for one on the subject's left, -1 on the right."""
    x0 = mirror_plane(rig.neutral)
    return [(ball, 1 if rig.neutral[ball, 0].mean() > x0 else -1) for ball in eyeballs(rig) if _of_an_eye(rig, ball)]


def _of_an_eye(rig: Rig, ball: Bool[np.ndarray, " v"]) -> bool:
    """Whether a ball is as large as an eye and lies at one; so is every ball where the eyes are in doubt."""
    eyes = face_reading(rig).eyes
    if eyes.left is None or eyes.right is None or not eyes.sure:
        return True
    places = np.array([eyes.left, eyes.right])
    u = float(np.linalg.norm(places[0] - places[1]))
    away = np.linalg.norm((rig.neutral[ball].mean(axis=0) - places)[:, :2], axis=1).min()
    return bool(away < AROUND * u and np.ptp(rig.neutral[ball], axis=0).max() > SPECK * u)


def _same_eyes(rig: Rig, k: int, turned: dict[int, Float[np.ndarray, " 2"]]) -> bool:
    """Whether the skin moves around those eyes that turn, and around no other as well."""
    near = _around(rig)
    if near is None or len(turned) > 1:
        return True
    e, _, _ = _moved(rig, k)
    other = sum(e[at].sum() for side, at in near.items() if side not in turned)
    return bool(other < (1 - ALONE) * e.sum())


def _turn(r: Float[np.ndarray, "v 3"], d: Float[np.ndarray, "v 3"]) -> Float[np.ndarray, " 2"]:
    """(omega_y, -omega_x) in degrees of the least squares d = t + omega x r."""
    # sum r x (d - t) = (sum |r|^2 I - r r^T) omega
    moment = np.cross(r, d - d.mean(axis=0)).sum(axis=0)
    omega = np.linalg.lstsq((r**2).sum() * np.eye(3) - r.T @ r, moment, rcond=None)[0]
    return np.degrees([omega[1], -omega[0]])


def _from_turns(turned: dict[int, Float[np.ndarray, " 2"]]) -> Gaze | None:
    ways: dict[int, Way] = {side: _way(float(left), float(up)) for side, (left, up) in turned.items()}
    if len(set(ways.values())) > 1:
        return None  # eyes that part or cross: no look to one side
    strength = float(max(np.linalg.norm(turn) for turn in turned.values()))
    return Gaze(next(iter(ways)) if len(ways) == 1 else 0, next(iter(ways.values())), strength)


def _from_name(rig: Rig, k: int) -> Gaze | None:
    """What a name that says gaze means by the way in which its eye's skin moves."""
    said = movement_of(dict(rig.meanings).get(rig.names[k], rig.names[k]))
    if said is None or said.kind not in SAID or not _moves_skin(rig, k):
        return None
    e, middle, along = _moved(rig, k)
    if abs(along[0]) < SAID_ASIDE:
        return None
    side = 1 if middle[0] > mirror_plane(rig.neutral) else -1
    return Gaze(side, "left" if along[0] > 0 else "right", float(e.sum()))


def _from_lids(rig: Rig, k: int) -> Gaze | None:
    if not _moves_skin(rig, k) or (near := _around(rig)) is None:
        return None
    e, _, along = _moved(rig, k)
    shares = {side: e[at].sum() / e.sum() for side, at in near.items()}
    if sum(shares.values()) < ALONE or abs(along[0]) < ASIDE or abs(along[1]) > UPRIGHT:
        return None
    alone = next((side for side, share in shares.items() if share >= ALONE), 0)
    return Gaze(alone, "left" if along[0] > 0 else "right", float(e.sum()))


def _way(left: float, up: float) -> Way:
    if abs(left) >= abs(up):
        return "left" if left > 0 else "right"
    return "up" if up > 0 else "down"


def _moved(rig: Rig, k: int) -> tuple[Float[np.ndarray, " v"], Float[np.ndarray, " 3"], Float[np.ndarray, " 3"]]:
    """Squared movement of the skin by area, its middle, and its mean direction, as long as it is of one mind."""
    length = rig.displacement[k].astype(float)
    e = _areas(rig) * length**2 * rig.skin
    unit = rig.deltas[k] / np.where(length > 0, length, 1)[:, None]
    return e, e @ rig.neutral / e.sum(), e @ unit / e.sum()


def _moves_skin(rig: Rig, k: int) -> bool:
    return bool((_areas(rig) * rig.displacement[k] * rig.skin).any())


@once
def _areas(rig: Rig) -> Float[np.ndarray, " v"]:
    return vertex_areas(rig.neutral, rig.triangles)


def _share_around_eyes(rig: Rig, k: int) -> float:
    near = _around(rig)
    if near is None:
        return 0.0
    e, _, _ = _moved(rig, k)
    return float(sum(e[at].sum() for at in near.values()) / e.sum())


@once
def _around(rig: Rig) -> dict[int, Bool[np.ndarray, " v"]] | None:
    """The skin around either eye, seen from the front; None where the eyes are in doubt."""
    eyes = face_reading(rig).eyes
    if eyes.left is None or eyes.right is None or not eyes.sure:
        return None
    u = float(np.linalg.norm(np.subtract(eyes.left, eyes.right)))
    return {
        side: rig.skin & (np.hypot(*(rig.neutral[:, :2] - np.array(eye[:2])).T) < AROUND * u)
        for side, eye in ((1, eyes.left), (-1, eyes.right))
    }
