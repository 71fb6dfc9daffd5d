"""Which vertices must not carry a dot both, because a tracker might take the two for each other (`labels.py`).

Asked     a margin m: D - 2 d > 2 m in every transition, in every camera that sees both or, without any, in space
Looked up pairs that keep the spacing and come within 2 m + `REACH` d of each other in one of some samples, d the
          longest step of a frame: 2 d of the margin, d / 2 of its slack, and what two dots move in half the time
          between two of those samples
"""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.sparse import csr_array
from scipy.spatial import KDTree

from capture_plan.camera import Camera
from capture_plan.layout.contact_pairs import paired
from capture_plan.layout.labels import PER_FRAME, picture_margins, samples, swept_margins, transitions
from capture_plan.progress import track

EVERY = 3  # of the samples
REACH = 2.5 + EVERY / PER_FRAME


def untold_in(
    places: Float[np.ndarray, "e n 3"],
    seen: Bool[np.ndarray, "e c n"],
    at: Int[np.ndarray, " n"],
    count: int,
    cameras: Sequence[Camera],
    *,
    spacing_mm: float,
    asked_mm: float,
) -> csr_array:
    """Pairs of the vertices `at`, of `count`, that keep the spacing and have no larger margin than is asked for; (v v)
    of 0 and 1.

    `places` of the vertices in the neutral and in the poses, in the order of their transitions; `seen` by each camera.
    """
    found = [np.empty((0, 2), dtype=int)]
    for start, end in track(transitions(len(places) - 1), "Telling dots apart"):
        points = samples(places[start], places[end])
        if not cameras:
            pairs = _near(places[0], points, asked_mm, spacing_mm)
            found.append(pairs[swept_margins(points, pairs) / 2 <= asked_mm])
        for c, camera in enumerate(cameras):
            there = seen[start, c] | seen[end, c]
            for stance in camera.stances:
                pixels = stance.project(points.reshape(-1, 3)).reshape(*points.shape[:2], 2)
                some = np.flatnonzero(there & np.isfinite(pixels).all(axis=(0, 2)))
                depth = ((points[:, some] - stance.position) @ stance.rotation[2]).min(initial=np.inf)
                asked = asked_mm * stance.intrinsics[0, 0] / depth
                pairs = some[_near(places[0][some], pixels[:, some], asked, spacing_mm)]
                found.append(pairs[picture_margins(stance, points, there, pairs) <= asked_mm])
    u, v = at[np.unique(np.concatenate(found), axis=0)].T
    return paired(u, v, count)


def _near(
    neutral: Float[np.ndarray, "n 3"], points: Float[np.ndarray, "s n d"], asked: float, spacing_mm: float
) -> Int[np.ndarray, "p 2"]:
    """Pairs that keep the spacing and may have no more than the asked margin, in the unit of the points."""
    n = len(neutral)
    if n < 2:
        return np.empty((0, 2), dtype=int)
    steps = np.linalg.norm(np.diff(points, axis=0), axis=2)
    d = np.lib.stride_tricks.sliding_window_view(steps, PER_FRAME, axis=0).sum(axis=2).max()
    found = []
    for one in points[::EVERY]:
        i, j = KDTree(one).query_pairs(2 * asked + REACH * d, output_type="ndarray").T
        apart = np.square(neutral[i] - neutral[j]).sum(axis=1) >= spacing_mm**2
        found.append(i[apart] * n + j[apart])
    return np.stack(np.divmod(np.unique(np.concatenate(found)), n), axis=1)
