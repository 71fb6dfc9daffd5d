"""Which label belongs to which place in the columns beside the face, so that no two leader lines cross.

Data       p[i]      points to be named, millimetres on the page
           a[s]      anchors: free places for a label's end of the line; at least as many as points
Cost       c[i, s] = d (1 + d^2 / LONG^2) with d = |p_i - a_s|, and NEAR for each other point that the line touches
Model      the assignment of least total cost; then, while two lines cross, exchange their anchors
Ends       two crossing lines are the diagonals of a convex quadrilateral, and two opposite sides of it are together
           shorter: each exchange shortens the total length, of which there are finitely many.
"""

import numpy as np
from jaxtyping import Float, Int
from scipy.optimize import linear_sum_assignment

from capture_plan.errors import PlanError

NEAR_MM, NEAR = 2.2, 40.0  # a line closer than a marker's radius to another marker seems to name that one
LONG_MM = 60.0  # beyond this many lines together may be longer, to spare one a way across the face


def assign_anchors(points: Float[np.ndarray, "n 2"], anchors: Float[np.ndarray, "s 2"]) -> Int[np.ndarray, " n"]:
    """The anchor of each point, an index.

    Raises:
        PlanError: there are fewer anchors than points.
    """
    if len(anchors) < len(points):
        raise PlanError(f"{len(points)} labels but room for {len(anchors)}: take a larger paper or fewer landmarks")
    if len(points) == 0:
        return np.zeros(0, dtype=int)
    _, chosen = linear_sum_assignment(_cost(points, anchors))
    while (pair := _first_crossing(points, anchors[chosen])) is not None:
        i, j = pair
        chosen[i], chosen[j] = chosen[j], chosen[i]
    return chosen


def crossings(starts: Float[np.ndarray, "n 2"], ends: Float[np.ndarray, "n 2"]) -> Int[np.ndarray, "c 2"]:
    """Pairs of segments that cross in a point inside both."""

    def turn(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> np.ndarray:
        return (b[..., 0] - a[..., 0]) * (c[..., 1] - a[..., 1]) - (b[..., 1] - a[..., 1]) * (c[..., 0] - a[..., 0])

    a, b, c, d = starts[:, None], ends[:, None], starts[None], ends[None]
    crossing = (turn(a, b, c) * turn(a, b, d) < 0) & (turn(c, d, a) * turn(c, d, b) < 0)
    return np.argwhere(np.triu(crossing, 1))


def _first_crossing(points: Float[np.ndarray, "n 2"], ends: Float[np.ndarray, "n 2"]) -> tuple[int, int] | None:
    found = crossings(points, ends)
    length = np.linalg.norm(points - ends, axis=1)
    for i, j in found.tolist():
        exchanged = np.linalg.norm(points[i] - ends[j]) + np.linalg.norm(points[j] - ends[i])
        if exchanged < length[i] + length[j]:  # always so but for rounding, which must not exchange for ever
            return i, j
    return None


def _cost(points: Float[np.ndarray, "n 2"], anchors: Float[np.ndarray, "s 2"]) -> Float[np.ndarray, "n s"]:
    line = anchors[None] - points[:, None]  # n s 2
    length = np.linalg.norm(line, axis=2)
    other = points[None] - points[:, None]  # n j 2: from point i to point j
    along = np.einsum("nsx,njx->nsj", line, other) / np.maximum(length**2, 1e-9)[:, :, None]
    nearest = other[:, None] - np.clip(along, 0, 1)[..., None] * line[:, :, None]
    touched = (np.linalg.norm(nearest, axis=3) < NEAR_MM) & (along > 0)
    touched &= ~np.eye(len(points), dtype=bool)[:, None]
    return length * (1 + (length / LONG_MM) ** 2) + NEAR * touched.sum(axis=2)
