"""From where a marker's place is measured on a face with callipers or tape, and how exact that is.

Data     q[a]  points that everybody finds on a face: corners of the eyes, wings and tip of the nose, corners of the
               mouth, chin; each has a letter, the same on both sides
         x     a marker, n the skin's normal there;  d[a] = |x - q[a]|
         u[a]  direction from q[a] to x, in the skin's plane, of length 1;  U its rows for two points
Error    of the place when each distance is off by 1 mm: sqrt(tr (U^T U)^-1), sqrt(2) where the two meet at 90 degrees
Choice   of the two points of least error, DULL times their mean distance added, of the marker's own side and the
         middle; a marker and its mirror image are measured from the same two points, those of least sum for both
"""

from itertools import combinations
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from capture_plan.anatomy.eye_corners import eye_corners
from capture_plan.anatomy.regions import FaceRegions
from capture_plan.layout.record import Landmark
from capture_plan.rig import Rig

DULL = 0.02  # of error for a millimetre of tape
LEAST_MM = 6.0  # what lies nearer is measured by eye
BESIDE_TIP = 0.2  # pupil distances in height from the tip of the nose: where its wings are
SINGULAR = 1e-3


class TapePoint(NamedTuple):
    """A point that is found on every face; `side` is the subject's own, 'middle' between them."""

    letter: str
    name: str
    side: str
    position: tuple[float, float, float]


class Measure(NamedTuple):
    """Straight distances of a marker from two points, millimetres; `error_mm` is what 1 mm of tape does to its
    place, and `middle` whether the marker has no side of its own."""

    points: tuple[TapePoint, TapePoint]
    mm: tuple[float, float]
    error_mm: float
    middle: bool


def tape_points(rig: Rig, regions: FaceRegions) -> tuple[TapePoint, ...]:
    """The points that were found on this face, each letter on the left and on the right or once in the middle."""
    anchors, found = regions.anchors, []
    x = rig.neutral.astype(float)
    for (end, side), corner in sorted(eye_corners(rig, anchors).items(), key=lambda item: item[0][::-1]):
        found.append(("b" if end == "inner" else "a", f"{end} corner of the eye", side, x[corner]))
    if "eyes" in anchors.found and "mouth" in anchors.found:
        level = np.abs(x[:, 1] - anchors.nose_tip[1]) < BESIDE_TIP * anchors.pupils
        nose = np.flatnonzero(rig.skin & level & (regions.of_vertex == regions.names.index("nose")))
        for side, sign in (("left", 1), ("right", -1)):
            wing = nose[sign * (x[nose, 0] - anchors.midline) > 0]
            if len(wing):
                found.append(("c", "wing of the nose", side, x[wing[(sign * x[wing, 0]).argmax()]]))
        found += [("d", "corner of the mouth", "left", anchors.corner_left)]
        found += [("d", "corner of the mouth", "right", anchors.corner_right)]
        found += [("e", "tip of the nose", "middle", anchors.nose_tip)]
        found += [("f", "chin", "middle", anchors.chin)] if anchors.chin_sure else []
    return tuple(
        TapePoint(letter, name, side, (float(p[0]), float(p[1]), float(p[2]))) for letter, name, side, p in found
    )


def measured_from(
    landmark: Landmark,
    normal: Float[np.ndarray, " 3"],
    points: tuple[TapePoint, ...],
    twin: tuple[Landmark, Float[np.ndarray, " 3"]] | None = None,
) -> Measure | None:
    """The two points to measure a marker from; None where fewer than two are found. `twin` is its mirror image with the
    skin's normal there: both are measured from the same points, where there are two that serve both."""
    own = _measures(landmark, normal, points)
    if not own:
        return None
    other = _measures(*twin, points) if twin else {}
    both = {letters: _cost(own[letters]) + _cost(other[letters]) for letters in own if letters in other}
    costs = both or {letters: _cost(one) for letters, one in own.items()}
    return own[min(costs, key=costs.__getitem__)]


def _measures(
    landmark: Landmark, normal: Float[np.ndarray, " 3"], points: tuple[TapePoint, ...]
) -> dict[tuple[str, ...], Measure]:
    """Every pair of points that gives the place of a marker, by its letters and, where the marker lies in the middle,
    their sides."""
    x, middle = np.array(landmark.position), landmark.side == "middle"
    own = [p for p in points if p.side in (landmark.side, "middle") or middle]
    away = {p: float(np.linalg.norm(x - p.position)) for p in own}
    made = {}
    for a, b in combinations([p for p in own if away[p] >= LEAST_MM], 2):
        error = _error(x, normal, (a, b))
        if np.isfinite(error):
            letters = tuple(f"{p.letter} {p.side}" if middle else p.letter for p in (a, b))
            made[letters] = Measure((a, b), (away[a], away[b]), error, middle)
    return made


def _cost(measure: Measure) -> float:
    return measure.error_mm + DULL * sum(measure.mm) / 2


def _error(x: Float[np.ndarray, " 3"], normal: Float[np.ndarray, " 3"], pair: tuple[TapePoint, TapePoint]) -> float:
    U = x - np.array([p.position for p in pair])
    U = U / np.linalg.norm(U, axis=1, keepdims=True)
    U = U - np.outer(U @ normal, normal)  # what lies along the normal moves no distance on the skin
    gram = U @ U.T
    if np.linalg.det(gram) < SINGULAR:
        return np.inf
    return float(np.sqrt(np.trace(np.linalg.inv(gram))))
