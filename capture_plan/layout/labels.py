"""Which dots a tracker may take for each other: one that follows each to the nearest dot of the next picture.

Data      p_a(t)     where dot a lies in frame t, in a camera's picture (pixels) or in space (millimetres)
Followed  a is found again where |p_a(t+1) - p_a(t)| < |p_b(t+1) - p_a(t)| for every other dot b
Promised  where D_ab > 2 d, with D_ab the distance of the two in a frame and d the longer of their two steps to it: then
          |p_b(t+1) - p_a(t)| >= D_ab - d > d
Sweep     a transition takes `SECONDS` in a straight way between two poses: between `PER_FRAME` samples a frame the
          distance falls by no more than half of how the two move against each other, and d is the longest of all steps
Take      the recorded frames as they are, at their own rate
Slip      where the head may slip before the camera, the least of all its stances counts
Margin    (D - 2 d) / 2: how far each of the two may be off, or be found off, and still be told; millimetres at the
          nearer depth. The least of all pairs is the layout's
"""

from collections.abc import Mapping, Sequence

import numpy as np
from jaxtyping import Bool, Float, Int
from msgspec import Struct

from capture_plan.camera import Camera
from capture_plan.layout.dot_contact import NEUTRAL, Poses
from capture_plan.layout.record import Landmark
from capture_plan.layout.unread import vertex_views
from capture_plan.rig import Rig
from capture_plan.shell.takes import Takes
from capture_plan.visibility import SEEN

FPS, SECONDS = 60.0, 0.3  # of a picture; how long an expression takes to come, quick ones of people who talk
PER_FRAME = 2
IN_SPACE = ""  # in place of a camera


class Confusable(Struct, frozen=True, forbid_unknown_fields=True):
    """Two dots that may be taken for each other on the way between two poses, or from one frame of a take to the next,
    and by how much: a margin, millimetres, not above the one that is asked for."""

    dots: tuple[str, str]
    between: tuple[str, str]
    margin_mm: float


class Labels(Struct, frozen=True, forbid_unknown_fields=True):
    """How surely dots are told from each other in a camera's pictures, or in space: the least margin (mm), whose it is
    and between which poses, and all pairs that have no larger one than is asked for, each at its worst. Of a take it
    holds the name, and between which of its frames, counted from 0."""

    camera: str
    margin_mm: float
    dots: tuple[str, str]
    between: tuple[str, str]
    confusable: tuple[Confusable, ...] = ()
    take: str = ""


def label_margins(
    rig: Rig,
    markers: Sequence[Landmark],
    poses: Poses,
    cameras: Sequence[Camera],
    *,
    dot_mm: float,
    asked_mm: float = 0.0,
) -> tuple[Labels, ...]:
    """Of each camera, or in space where none are known: from the neutral to every pose, and from each to the next."""
    if len(markers) < 2 or not poses:
        return ()
    at = np.array([m.vertex for m in markers], dtype=int)
    pairs = np.stack(np.triu_indices(len(at), 1), axis=1)
    margins, whose = pair_margins(rig, at, pairs, poses, cameras, dot_mm=dot_mm)
    of = (NEUTRAL, *poses)
    moments = [(of[start], of[end]) for start, end in transitions(len(poses))]
    names = [camera.name for camera in cameras] or [IN_SPACE]
    return tuple(
        _least(name, markers, pairs, margins[c], [moments[w] for w in whose[c]], asked_mm)
        for c, name in enumerate(names)
    )


def take_labels(
    markers: Sequence[Landmark], takes: Takes, cameras: Sequence[Camera], *, asked_mm: float = 0.0
) -> tuple[Labels, ...]:
    """Of each take and camera, or in space: from each frame to the next; of a camera the dots that it reads in some
    expression of the plan."""
    found = []
    for take in (one.sequence for person in takes.subjects for one in person.recordings):
        points = take.places(np.array([m.vertex for m in markers], dtype=int))
        for c, camera in enumerate(cameras or [None]):
            some = [i for i, m in enumerate(markers) if camera is None or m.views[c].share > 0]
            own, scale = points[:, some], np.ones(len(some))
            if camera is not None:
                depth = ((own - camera.position) @ camera.rotation[2]).min(axis=0)
                scale = depth / camera.intrinsics[0, 0]
                own = camera.project(own.reshape(-1, 3)).reshape(*own.shape[:2], 2)
            there = np.isfinite(own).all(axis=(0, 2))
            some, own, scale = np.array(some)[there], own[:, there], scale[there]
            if len(some) < 2 or len(own) < 2:
                continue
            pairs = np.stack(np.triu_indices(len(some), 1), axis=1)
            margin, frame = followed_margin(own, pairs)
            mm = margin * scale[pairs].min(axis=1) / 2
            moments = [(str(t), str(t + 1)) for t in frame.tolist()]
            name = camera.name if camera else IN_SPACE
            least = _least(name, [markers[i] for i in some], pairs, mm, moments, asked_mm, take.name)
            found.append(least)
    return tuple(found)


def pair_margins(
    rig: Rig,
    at: Int[np.ndarray, " n"],
    pairs: Int[np.ndarray, "p 2"],
    poses: Poses,
    cameras: Sequence[Camera],
    *,
    dot_mm: float,
) -> tuple[Float[np.ndarray, "c p"], Int[np.ndarray, "c p"]]:
    """The least margin (mm) of pairs of the dots at these vertices, in each camera or, without any, in space; and in
    which of the transitions."""
    weights = np.array([[pose.get(name, 0.0) for name in rig.names] for pose in poses.values()])
    moved = np.tensordot(weights, rig.deltas[:, at].astype(float), 1)
    places = rig.neutral[at] + np.concatenate([np.zeros((1, len(at), 3)), moved])  # (e n 3)
    seen = np.ones((len(places), max(len(cameras), 1), len(at)), dtype=bool)
    if cameras:
        seen = np.isin(vertex_views(rig, at, poses, cameras, dot_mm=dot_mm).how, SEEN)
    worst = np.full((seen.shape[1], len(pairs)), np.inf)
    whose = np.zeros(worst.shape, dtype=int)
    for w, (start, end) in enumerate(transitions(len(poses))):
        points = samples(places[start], places[end])
        there = seen[start] | seen[end]
        for c in range(len(worst)):
            margin = (
                picture_margins(cameras[c], points, there[c], pairs) if cameras else swept_margins(points, pairs) / 2
            )
            nearer = margin < worst[c]
            worst[c, nearer], whose[c, nearer] = margin[nearer], w
    return worst, whose


def followed_margin(
    points: Float[np.ndarray, "t m d"], pairs: Int[np.ndarray, "p 2"]
) -> tuple[Float[np.ndarray, " p"], Int[np.ndarray, " p"]]:
    """The least D - 2 d over the frames of a recording, of pairs; where it is above 0 both are followed. And after
    which frame it is so small."""
    step = np.linalg.norm(np.diff(points, axis=0), axis=2)  # (t-1 m)
    margin, frame = np.full(len(pairs), np.inf), np.zeros(len(pairs), dtype=int)
    i, j = pairs.T
    for t, (after, d) in enumerate(zip(points[1:], step, strict=True)):
        now = np.linalg.norm(after[i] - after[j], axis=1) - 2 * np.fmax(d[i], d[j])
        nearer = now < margin
        margin[nearer], frame[nearer] = now[nearer], t
    return margin, frame


def moment_words(between: tuple[str, str], of: Labels, shots: Mapping[str, str]) -> str:
    """'shot 21 (E15) to shot 22 (E16), boom top', or 'smile, frame 12, boom top'."""
    start, end = (shots.get(pose, pose) for pose in between)
    when = f"{of.take}, frame {between[1]}" if of.take else f"{start} to {end}"
    return f"{when}, {of.camera}" if of.camera else when


def transitions(count: int) -> list[tuple[int, int]]:
    """Transitions between the neutral, 0, and so many poses: to each, and from each to the next."""
    return [(0, e) for e in range(1, count + 1)] + [(e, e + 1) for e in range(1, count)]


def samples(start: Float[np.ndarray, "n 3"], end: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "s n 3"]:
    """The way between two poses, `PER_FRAME` times in each frame of it."""
    s = np.linspace(0, 1, round(FPS * SECONDS * PER_FRAME) + 1)[:, None, None]
    return start + s * (end - start)


def swept_margins(points: Float[np.ndarray, "s n d"], pairs: Int[np.ndarray, "p 2"]) -> Float[np.ndarray, " p"]:
    """D - 2 d of pairs, over all phases that frames may have: D is lowered by half of what the two move against each
    other between samples, d is the longest way of `PER_FRAME` samples."""
    i, j = pairs.T
    between = points[:, i] - points[:, j]
    slack = np.linalg.norm(np.diff(between, axis=0), axis=2).max(axis=0) / 2
    steps = np.linalg.norm(np.diff(points, axis=0), axis=2)  # (s-1 n)
    frames = np.lib.stride_tricks.sliding_window_view(steps, PER_FRAME, axis=0).sum(axis=2).max(axis=0)
    return np.linalg.norm(between, axis=2).min(axis=0) - slack - 2 * np.maximum(frames[i], frames[j])


def picture_margins(
    camera: Camera, points: Float[np.ndarray, "s n 3"], seen: Bool[np.ndarray, " n"], pairs: Int[np.ndarray, "p 2"]
) -> Float[np.ndarray, " p"]:
    """Margins in millimetres, infinite of pairs that the camera does not see both; the least of its stances."""
    least = np.full(len(pairs), np.inf)
    for stance in camera.stances:
        pixels = stance.project(points.reshape(-1, 3)).reshape(*points.shape[:2], 2)
        there = seen & np.isfinite(pixels).all(axis=(0, 2))
        some = there[pairs].all(axis=1)
        depth = ((points - stance.position) @ stance.rotation[2]).min(axis=0)
        mm = depth[pairs[some]].min(axis=1) / stance.intrinsics[0, 0]
        margin = swept_margins(np.where(there[None, :, None], pixels, 0), pairs[some]) * mm / 2
        least[some] = np.minimum(least[some], margin)
    return least


def _least(
    camera: str,
    markers: Sequence[Landmark],
    pairs: Int[np.ndarray, "p 2"],
    margins: Float[np.ndarray, " p"],
    between: Sequence[tuple[str, str]],
    asked_mm: float,
    take: str = "",
) -> Labels:
    """The worst of all pairs, and those that have no more than is asked for."""
    order = np.argsort(margins, kind="stable")

    def told(n: int) -> Confusable:
        i, j = pairs[n].tolist()
        return Confusable((markers[i].name, markers[j].name), between[n], round(float(margins[n]), 3))

    worst = told(int(order[0]))
    bad = tuple(told(int(n)) for n in order if margins[n] <= asked_mm)
    return Labels(camera, worst.margin_mm, worst.dots, worst.between, bad, take)
