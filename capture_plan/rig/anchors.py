"""Where eyes, mouth, nose, chin and ears are, on any face: from the holes of its skin, else from human proportions.

Data     surface of the face with its border loops: two mirrored ones are the lid openings, the one below on the
         midline is the mouth. A skin that a person narrowed has borders of its own, which are no openings: the
         surface is that skin and what the rig itself shows to be skin around it
Order    eyes: lid openings, else eyeballs, else proportions of the head
         mouth: its opening, else where blendshapes stretch the midline, else 1.1 pupil distances below the eyes
         nose tip: most forward on the midline between eyes and mouth; chin: most forward and low below the mouth
         ears: furthest to the side, between brow and mouth, behind the eyes, with more of the head behind them
Unit     the pupil distance; proportions are those of the four heads measured here and only stand in where holes lack
"""

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from capture_plan.mesh import half_edges, pieces
from capture_plan.mesh.mirror import mirror_plane
from capture_plan.rig.record import Rig
from capture_plan.rig.skin import find_skin, is_ball

EYE_SPREAD = 0.42  # pupil distance over the breadth of the moving face
MOUTH_BELOW_EYES, MOUTH_WIDTH = 1.1, 0.8  # of the pupil distance
EARS_WITHIN = 1.9  # pupil distances from the midline: four human heads have 1.4, a fox's whiskers 2.2
SAME_FACE = 0.5  # of the given skin; where less is found to be skin, the search went astray and the person is right
REMEMBERED = 8  # rigs of a session; the search for skin casts rays
BEHIND_EARS = 0.4  # pupil distances that a head goes on; a mask ends with what is furthest to its side
COMPACT = 0.45  # least over largest extent of an eyeball; half a ball has 0.5, a lash strip 0.3


@dataclass(frozen=True, eq=False)
class Anchors:
    """Points of the face in millimetres, the subject's own sides; `lids` and `lips` are border vertices of the surface.

    `found` names the anchors that geometry gave; the others are human proportions.
    """

    midline: float
    eye_left: Float[np.ndarray, " 3"]
    eye_right: Float[np.ndarray, " 3"]
    mouth: Float[np.ndarray, " 3"]
    corner_left: Float[np.ndarray, " 3"]
    corner_right: Float[np.ndarray, " 3"]
    nose_tip: Float[np.ndarray, " 3"]
    chin: Float[np.ndarray, " 3"]
    ear_left: Float[np.ndarray, " 3"]
    ear_right: Float[np.ndarray, " 3"]
    lids: Int[np.ndarray, " a"]
    lips: Int[np.ndarray, " b"]
    found: tuple[str, ...]

    @property
    def pupils(self) -> float:
        """Distance between the eye centres, millimetres: the unit of all proportions."""
        return float(np.linalg.norm(self.eye_left - self.eye_right))


@lru_cache(maxsize=REMEMBERED)
def face_surface(rig: Rig) -> Bool[np.ndarray, " v"]:
    """The skin of a rig and, where a person narrowed it, the skin around it: what borders and shapes are read from."""
    found = find_skin(rig.neutral, rig.triangles, rig.deltas, rig.parts, rig.part_names)
    surface = rig.skin | found if found[rig.skin].mean() >= SAME_FACE else rig.skin.copy()
    surface.flags.writeable = False
    return surface


@lru_cache(maxsize=REMEMBERED)
def face_anchors(rig: Rig) -> Anchors:
    """The anchors of a rig's face; proportions fill in what its mesh does not show."""
    return surface_anchors(replace(rig, skin=face_surface(rig)))


def surface_anchors(rig: Rig) -> Anchors:
    """The anchors of a face whose skin is all of its surface."""
    x0 = mirror_plane(rig.neutral[rig.skin])
    loops = border_loops(rig.triangles[rig.skin[rig.triangles].all(axis=1)])
    eyes, lids, found = _eyes(rig, loops, x0)
    unit = float(np.linalg.norm(eyes[0] - eyes[1]))
    mouth, corners, lips, how = _mouth(rig, loops, eyes.mean(axis=0), unit, x0)
    points = rig.neutral[rig.skin]
    middle = points[np.abs(points[:, 0] - x0) < 0.15 * unit]
    drop = eyes[0, 1] - mouth[1]
    between = middle[(middle[:, 1] < eyes[0, 1] - 0.1 * drop) & (middle[:, 1] > mouth[1] + 0.2 * drop)]
    below = middle[(middle[:, 1] < mouth[1] - 0.3 * drop) & (middle[:, 1] > mouth[1] - 0.95 * drop)]
    nose = _furthest(between, (0, 0, 1), mouth + np.array([0, 0.5 * drop, 0.3 * unit]))
    chin = _furthest(below, (0, -1, 1), mouth - np.array([0, 0.65 * drop, 0]))
    beside = points[
        (points[:, 1] > mouth[1] + 0.2 * drop)
        & (points[:, 1] < eyes[0, 1] + 0.5 * unit)
        & (points[:, 2] < eyes[0, 2] - 0.5 * unit)
    ]
    aside = [eyes.mean(axis=0) + unit * np.array([side * 1.4, -0.3, -1.4]) for side in (1, -1)]
    ears = [_furthest(beside, (side, 0, 0), point) for side, point in zip((1, -1), aside, strict=True)]
    goes_on = points[:, 2].min() < min(ear[2] for ear in ears) - BEHIND_EARS * unit
    if goes_on and max(abs(ear[0] - x0) for ear in ears) < EARS_WITHIN * unit:
        how += ("ears",)
    else:
        ears = aside
    return Anchors(
        midline=x0,
        eye_left=eyes[0],
        eye_right=eyes[1],
        mouth=mouth,
        corner_left=corners[0],
        corner_right=corners[1],
        nose_tip=nose,
        chin=chin,
        ear_left=ears[0],
        ear_right=ears[1],
        lids=lids,
        lips=lips,
        found=found + how,
    )


def border_loops(triangles: Int[np.ndarray, "f 3"]) -> list[Int[np.ndarray, " _"]]:
    """Vertices of each connected border of the triangles, the longest border first."""
    edge, count = np.unique(np.sort(half_edges(triangles), axis=1), axis=0, return_counts=True)
    edge = edge[count == 1]
    vertex, index = np.unique(edge, return_inverse=True)
    index = index.reshape(edge.shape)
    graph = coo_array((np.ones(len(edge), dtype=bool), index.T), shape=(len(vertex),) * 2)
    count, label = connected_components(graph, directed=False)
    return sorted((vertex[label == i] for i in range(count)), key=lambda loop: (-len(loop), loop[0]))


def eyeballs(rig: Rig) -> list[Bool[np.ndarray, " v"]]:
    """Pieces outside the skin that are balls or half balls, the largest first."""
    piece = pieces(rig.triangles, len(rig.neutral))
    outside = np.unique(piece[rig.triangles[:, 0]][~rig.skin[rig.triangles[:, 0]]])
    found = [piece == i for i in outside if (piece == i).sum() >= 12]
    found = [eye for eye in found if not rig.skin[eye].any() and _is_compact_ball(rig.neutral[eye])]
    return sorted(found, key=lambda eye: -float(np.prod(np.ptp(rig.neutral[eye], axis=0))))


def _is_compact_ball(points: Float[np.ndarray, "v 3"]) -> bool:
    extent = np.ptp(points, axis=0)
    return bool(extent.min() > COMPACT * extent.max()) and is_ball(points)


def _eyes(
    rig: Rig, loops: list[Int[np.ndarray, " _"]], x0: float
) -> tuple[Float[np.ndarray, "2 3"], Int[np.ndarray, " a"], tuple[str, ...]]:
    """Centres of the left and the right eye, the border of the lids, and how they were found."""
    shapes = [(rig.neutral[loop], loop) for loop in loops if len(loop) >= 6]
    if pair := _mirrored_pair(shapes, x0):
        (left, a), (right, b) = pair
        return np.stack([_middle(left), _middle(right)]), np.sort(np.r_[a, b]), ("eyes",)
    shapes = [(rig.neutral[eye], np.flatnonzero(eye)) for eye in eyeballs(rig)]
    nothing = np.empty(0, dtype=np.int64)
    if pair := _mirrored_pair(shapes, x0):
        front = [np.r_[_middle(points)[:2], points[:, 2].max()] for points, _ in pair]
        return np.stack(front), nothing, ("eyes",)
    moving = rig.displacement.max(axis=0)
    face = rig.neutral[rig.skin & (moving > 0.05 * moving.max())] if moving.any() else rig.neutral[rig.skin]
    low, high = np.percentile(face, 1, axis=0), np.percentile(face, 99, axis=0)
    unit = EYE_SPREAD * (high[0] - low[0]) or EYE_SPREAD * float(np.ptp(rig.neutral, axis=0).max())
    y = low[1] + 0.66 * (high[1] - low[1])  # the moving face reaches from below the chin to the brows
    return np.array([[x0 + side * unit / 2, y, high[2] - 0.5 * unit] for side in (1, -1)]), nothing, ()


def _mirrored_pair(
    shapes: list[tuple[np.ndarray, np.ndarray]], x0: float
) -> tuple[tuple[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]] | None:
    """The widest (left, right) of two sets of points that mirror each other clear of the midline."""
    best, size = None, 0.0
    for left in shapes:
        for right in shapes:
            a, b = _middle(left[0]), _middle(right[0])
            width = min(np.ptp(left[0], axis=0).max(), np.ptp(right[0], axis=0).max())
            apart = a[0] - b[0]
            mirrored = np.linalg.norm(a - (b * [-1, 1, 1] + [2 * x0, 0, 0])) < 0.25 * width
            if mirrored and apart > width * 1.05 and width > size * 1.02:
                best, size = (left, right), float(width)
    return best


def _mouth(
    rig: Rig, loops: list[Int[np.ndarray, " _"]], eyes: Float[np.ndarray, " 3"], unit: float, x0: float
) -> tuple[Float[np.ndarray, " 3"], Float[np.ndarray, "2 3"], Int[np.ndarray, " b"], tuple[str, ...]]:
    """Centre and corners (left, right) of the mouth, the border of the lips, and how they were found."""
    for loop in sorted(loops, key=lambda loop: -np.ptp(rig.neutral[loop, 0])):
        points = rig.neutral[loop]
        centre, width = _middle(points), np.ptp(points[:, 0])
        below = 0.3 * unit < eyes[1] - centre[1] < 2.5 * unit
        if (
            below
            and abs(centre[0] - x0) < 0.15 * unit
            and 0.3 * unit < width < 2.5 * unit
            and centre[2] > eyes[2] - unit
        ):
            corners = points[[points[:, 0].argmax(), points[:, 0].argmin()]]
            front = points[np.argsort(np.abs(points[:, 0] - x0), kind="stable")[: max(2, len(points) // 5)]]
            return np.r_[x0, front[:, 1].mean(), front[:, 2].max()], corners, loop, ("mouth",)
    drop, how = _tear(rig, eyes, unit, x0)
    skin = rig.neutral[rig.skin]

    def forward(x: float) -> Float[np.ndarray, " 3"]:
        return skin[np.hypot(skin[:, 0] - x, skin[:, 1] - (eyes[1] - drop)).argsort()[:12]].max(axis=0)

    half = MOUTH_WIDTH * unit / 2
    points = [np.r_[x, eyes[1] - drop, forward(x)[2]] for x in (x0, x0 + half, x0 - half)]
    return points[0], np.stack(points[1:]), np.empty(0, dtype=np.int64), how


def _tear(rig: Rig, eyes: Float[np.ndarray, " 3"], unit: float, x0: float) -> tuple[float, tuple[str, ...]]:
    """How far below the eyes blendshapes stretch the midline, millimetres: the mean place, by squared stretch."""
    edge = np.unique(np.sort(half_edges(rig.triangles[rig.skin[rig.triangles].all(axis=1)]), axis=1), axis=0)
    place = rig.neutral[edge].mean(axis=1)
    fits = (np.abs(place[:, 0] - x0) < 0.2 * unit) & (place[:, 2] > eyes[2])
    fits &= (eyes[1] - place[:, 1] > 0.6 * unit) & (eyes[1] - place[:, 1] < 1.7 * unit)
    edge, place = edge[fits], place[fits]
    stretch = np.zeros(len(edge))
    for delta in rig.deltas:
        stretch = np.maximum(stretch, np.linalg.norm(delta[edge[:, 0]] - delta[edge[:, 1]], axis=1))
    if len(edge) == 0 or stretch.max() < 0.05 * unit:
        return MOUTH_BELOW_EYES * unit, ()
    return float(eyes[1] - np.average(place[:, 1], weights=stretch**2)), ("mouth",)


def _middle(points: Float[np.ndarray, "v 3"]) -> Float[np.ndarray, " 3"]:
    return (points.min(axis=0) + points.max(axis=0)) / 2


def _furthest(
    points: Float[np.ndarray, "v 3"], direction: tuple[int, int, int], otherwise: Float[np.ndarray, " 3"]
) -> Float[np.ndarray, " 3"]:
    return points[(points @ np.array(direction, dtype=float)).argmax()] if len(points) else otherwise


def interpupillary(rig: Rig) -> float | None:
    """Millimetres between the centres of the eyeballs, else of the lid openings; None where neither is found."""
    x0 = mirror_plane(rig.neutral[rig.skin])
    if pair := _mirrored_pair([(rig.neutral[eye], np.flatnonzero(eye)) for eye in eyeballs(rig)], x0):
        return float(np.linalg.norm(pair[0][0].mean(axis=0) - pair[1][0].mean(axis=0)))
    anchors = face_anchors(rig)
    return anchors.pupils if "eyes" in anchors.found else None
