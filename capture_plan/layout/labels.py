"""Which dots a tracker may take for each other: one that follows each to the nearest dot of the next picture.

Data      p_a(t)     where dot a lies in frame t, in a camera's picture (pixels) or in space (millimetres)
Followed  a is found again where |p_a(t+1) - p_a(t)| < |p_b(t+1) - p_a(t)| for every other dot b
Promised  where D_ab > 2 d, with D_ab the distance of the two in a frame and d the longer of their two steps to it: then
          |p_b(t+1) - p_a(t)| >= D_ab - d > d
Sweep     a transition takes `SECONDS` in a straight way between two poses: between `PER_FRAME` samples a frame the
          distance falls by no more than half of how the two move against each other, and d is the longest of all steps
Slip      where the head may slip before the camera, the least of all its stances counts
Margin    (D - 2 d) / 2: how far each of the two may be off, or be found off, and still be told; millimetres at the
          nearer depth. The least of all pairs is the layout's
"""

from collections.abc import Iterator, Sequence

import numpy as np
from jaxtyping import Bool, Float
from msgspec import Struct

from capture_plan.camera import Camera
from capture_plan.layout.dot_contact import NEUTRAL, Poses
from capture_plan.layout.record import Landmark
from capture_plan.layout.unread import pose_views
from capture_plan.rig import Rig
from capture_plan.visibility import SEEN

FPS, SECONDS = 60.0, 0.3  # of a picture; how long an expression takes to come, quick ones of people who talk
PER_FRAME = 2
IN_SPACE = ""  # in place of a camera


class Confusable(Struct, frozen=True, forbid_unknown_fields=True):
    """Two dots that may be taken for each other on the way between two poses, and by how much: a margin, millimetres,
    below 0."""

    dots: tuple[str, str]
    between: tuple[str, str]
    margin_mm: float


class Labels(Struct, frozen=True, forbid_unknown_fields=True):
    """How surely dots are told from each other in a camera's pictures, or in space: the least margin (mm), whose it is
    and between which poses, and all pairs whose margin is not above 0, each at its worst."""

    camera: str
    margin_mm: float
    dots: tuple[str, str]
    between: tuple[str, str]
    confusable: tuple[Confusable, ...] = ()


def label_margins(
    rig: Rig, markers: Sequence[Landmark], poses: Poses, cameras: Sequence[Camera], dot_mm: float
) -> tuple[Labels, ...]:
    """Of each camera, or in space where none are known: from the neutral to every pose, and from each to the next."""
    if len(markers) < 2 or not poses:
        return ()
    at, names = [m.vertex for m in markers], [NEUTRAL, *poses]
    weights = np.array([[pose.get(name, 0.0) for name in rig.names] for pose in poses.values()])
    moved = np.tensordot(weights, rig.deltas[:, at].astype(float), 1)
    places = rig.neutral[at] + np.concatenate([np.zeros((1, len(at), 3)), moved])  # (e m 3)
    ways = [(0, e) for e in range(1, len(names))] + [(e, e + 1) for e in range(1, len(names) - 1)]
    if not cameras:
        return (_least(IN_SPACE, markers, names, ((way, _space(places, way)) for way in ways)),)
    seen = np.isin(pose_views(rig, markers, poses, cameras, dot_mm=dot_mm).how, SEEN)
    return tuple(
        _least(camera.name, markers, names, ((way, _picture(places, way, camera, seen[:, c])) for way in ways))
        for c, camera in enumerate(cameras)
    )


def followed_margin(points: Float[np.ndarray, "t m d"]) -> Float[np.ndarray, "m m"]:
    """The least D - 2 d over the frames of a recording, of every pair; where it is above 0 both are followed."""
    step = np.linalg.norm(np.diff(points, axis=0), axis=2)  # (t-1 m)
    margin = np.full((points.shape[1],) * 2, np.inf)
    for after, d in zip(points[1:], step, strict=True):
        apart = np.linalg.norm(after[:, None] - after[None], axis=2)
        margin = np.fmin(margin, apart - 2 * np.fmax(d[:, None], d[None]))
    np.fill_diagonal(margin, np.inf)
    return margin


def _samples(places: Float[np.ndarray, "e m 3"], way: tuple[int, int]) -> Float[np.ndarray, "s m 3"]:
    s = np.linspace(0, 1, round(FPS * SECONDS * PER_FRAME) + 1)[:, None, None]
    return places[way[0]] + s * (places[way[1]] - places[way[0]])


def _margins(points: Float[np.ndarray, "s m d"]) -> Float[np.ndarray, "m m"]:
    """D - 2 d of every pair, over all phases that frames may have: D is lowered by half of what the two move against
    each other between samples, d is the longest way of `PER_FRAME` samples."""
    between = points[:, :, None] - points[:, None]
    apart = np.linalg.norm(between, axis=3)
    slack = np.linalg.norm(np.diff(between, axis=0), axis=3).max(axis=0) / 2
    steps = np.linalg.norm(np.diff(points, axis=0), axis=2)  # (s-1 m)
    frames = np.lib.stride_tricks.sliding_window_view(steps, PER_FRAME, axis=0).sum(axis=2).max(axis=0)
    margin = apart.min(axis=0) - slack - 2 * np.maximum(frames[:, None], frames[None])
    np.fill_diagonal(margin, np.inf)
    return margin


def _space(places: Float[np.ndarray, "e m 3"], way: tuple[int, int]) -> Float[np.ndarray, "m m"]:
    return _margins(_samples(places, way)) / 2


def _picture(
    places: Float[np.ndarray, "e m 3"], way: tuple[int, int], camera: Camera, seen: Bool[np.ndarray, "e m"]
) -> Float[np.ndarray, "m m"]:
    """Margins in millimetres of pairs that the camera sees at either end of the way, the least of its stances."""
    points = _samples(places, way)
    return np.minimum.reduce([_margins_in(stance, points, seen[way[0]] | seen[way[1]]) for stance in camera.stances])


def _margins_in(
    camera: Camera, points: Float[np.ndarray, "s m 3"], seen: Bool[np.ndarray, " m"]
) -> Float[np.ndarray, "m m"]:
    pixels = camera.project(points.reshape(-1, 3)).reshape(*points.shape[:2], 2)
    there = seen & np.isfinite(pixels).all(axis=(0, 2))
    depth = ((points - camera.position) @ camera.rotation[2]).min(axis=0)
    mm = np.minimum(depth[:, None], depth[None]) / camera.intrinsics[0, 0]
    margin = _margins(np.where(there[None, :, None], pixels, 0)) * mm / 2
    return np.where(there[:, None] & there[None], margin, np.inf)


def _least(
    camera: str,
    markers: Sequence[Landmark],
    names: Sequence[str],
    found: Iterator[tuple[tuple[int, int], Float[np.ndarray, "m m"]]],
) -> Labels:
    """The worst of all ways."""
    worst, whose = np.full((len(markers),) * 2, np.inf), np.zeros((len(markers), len(markers), 2), dtype=int)
    for way, margin in found:
        nearer = margin < worst
        worst[nearer], whose[nearer] = margin[nearer], way
    a, b = np.triu_indices(len(markers), 1)
    order = np.argsort(worst[a, b], kind="stable")

    def told(n: int) -> tuple[tuple[str, str], tuple[str, str], float]:
        i, j = int(a[n]), int(b[n])
        start, end = (str(names[e]) for e in whose[i, j])
        return (markers[i].name, markers[j].name), (start, end), round(float(worst[i, j]), 3)

    dots, between, margin = told(int(order[0]))
    bad = [told(int(n)) for n in order if worst[a[n], b[n]] <= 0]
    return Labels(camera, margin, dots, between, tuple(Confusable(*one) for one in bad))
