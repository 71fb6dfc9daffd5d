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
SAFE = (
    1.2  # a frame is at most so much longer than its share of `EVERY` samples: ways are straight, lenses bend a little
)


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
            pairs = _near_in(camera, points, there, places[0], asked_mm, spacing_mm)
            found.append(pairs[picture_margins(camera, points, there, pairs) <= asked_mm])
    u, v = at[np.unique(np.concatenate(found), axis=0)].T
    return paired(u, v, count)


def _near_in(
    camera: Camera,
    points: Float[np.ndarray, "s n 3"],
    seen: Bool[np.ndarray, " n"],
    neutral: Float[np.ndarray, "n 3"],
    asked_mm: float,
    spacing_mm: float,
) -> Int[np.ndarray, "p 2"]:
    """Pairs that may have no more than the asked margin in the picture of one of the camera's stances: the first shows
    two dots no farther apart than any, but for the extent of what that moves all dots by."""
    every = points[::EVERY]
    shown = [one.project(every.reshape(-1, 3)).reshape(*every.shape[:2], 2) for one in camera.stances]
    some = np.flatnonzero(seen & np.all([np.isfinite(one).all(axis=(0, 2)) for one in shown], axis=0))
    if len(some) < 2:
        return np.empty((0, 2), dtype=int)
    reach = 0.0
    for stance, pixels in zip(camera.stances, shown, strict=True):
        depth = ((points[:, some] - stance.position) @ stance.rotation[2]).min()
        moved = (pixels - shown[0])[:, some].reshape(-1, 2)
        steps = np.linalg.norm(np.diff(pixels[:, some], axis=0), axis=2).max() * PER_FRAME / EVERY
        asked = 2 * asked_mm * stance.intrinsics[0, 0] / depth
        reach = max(reach, asked + SAFE * REACH * steps + float(np.linalg.norm(np.ptp(moved, axis=0))))
    return some[_within(neutral[some], shown[0][:, some], reach, spacing_mm)]


def _near(
    neutral: Float[np.ndarray, "n 3"], points: Float[np.ndarray, "s n 3"], asked: float, spacing_mm: float
) -> Int[np.ndarray, "p 2"]:
    """Pairs that may have no more than the asked margin in space."""
    steps = np.linalg.norm(np.diff(points, axis=0), axis=2)
    d = np.lib.stride_tricks.sliding_window_view(steps, PER_FRAME, axis=0).sum(axis=2).max(initial=0.0)
    return _within(neutral, points[::EVERY], 2 * asked + REACH * d, spacing_mm)


def _within(
    neutral: Float[np.ndarray, "n 3"], points: Float[np.ndarray, "s n d"], reach: float, spacing_mm: float
) -> Int[np.ndarray, "p 2"]:
    """Pairs that keep the spacing and come within a distance of each other in one of some samples."""
    n, found = len(neutral), [np.empty(0, dtype=int)]
    for one in points if n > 1 else ():
        i, j = KDTree(one).query_pairs(reach, output_type="ndarray").T
        apart = np.square(neutral[i] - neutral[j]).sum(axis=1) >= spacing_mm**2
        found.append(i[apart] * n + j[apart])
    return np.stack(np.divmod(np.unique(np.concatenate(found)), max(n, 1)), axis=1)
