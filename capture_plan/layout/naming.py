"""Landmarks as people on set speak of them: numbered from the top down, named by place."""

from collections import Counter
from collections.abc import Sequence

import numpy as np
from jaxtyping import Float, Int

from capture_plan.camera import deviations
from capture_plan.layout.face import Face
from capture_plan.layout.head_sites import head_candidates
from capture_plan.layout.quality import importance_weights
from capture_plan.layout.record import Landmark, Role, Side, View
from capture_plan.layout.settings import LayoutSettings
from capture_plan.visibility import WORDS

SIDES: dict[int, Side] = {1: "left", 0: "middle", -1: "right"}
FIRST = (0, None)  # the first program, or all landmarks as one set
HEAD: Role = "head"


def name_landmarks(
    face: Face, settings: LayoutSettings, vertices: Int[np.ndarray, " m"], rounds: list[int | None]
) -> tuple[Landmark, ...]:
    """A record for each of `vertices`, in their order; `rounds[m]` is the program that chose it."""
    roles: list[Role] = ["primary" if number in FIRST else "backup" for number in rounds]
    return _records(face, settings, vertices, rounds, roles, "M", face.visibility)


def name_head_markers(face: Face, settings: LayoutSettings, vertices: Int[np.ndarray, " m"]) -> tuple[Landmark, ...]:
    """A record for each head marker; they are numbered apart from the landmarks."""
    if not len(vertices):
        return ()
    seen = seen_with_the_head(face)
    return _records(face, settings, vertices, [None] * len(vertices), (HEAD,) * len(vertices), "H", seen)


def seen_with_the_head(face: Face) -> Float[np.ndarray, " v"]:
    """How well skin is seen, also where it stays still and head markers may stand."""
    found, seen = head_candidates(face, face.cameras), face.visibility.copy()
    seen[found.vertices] = found.visibility
    return seen


def _records(
    face: Face,
    settings: LayoutSettings,
    vertices: Int[np.ndarray, " m"],
    rounds: list[int | None],
    roles: Sequence[Role],
    letter: str,
    seen: Float[np.ndarray, " v"],
) -> tuple[Landmark, ...]:
    rig, visibility = face.rig, seen[vertices]
    relative = face.relative_displacement(settings)[:, vertices]
    w = importance_weights(relative, visibility, settings.alpha)
    covers = relative >= settings.epsilon
    regions = face.regions
    labels = _count_up([regions.label(vertex) for vertex in vertices.tolist()])
    landmarks = []
    for m, vertex in enumerate(vertices.tolist()):
        triangle = int(np.flatnonzero((rig.triangles == vertex).any(axis=1))[0])
        landmarks.append(
            Landmark(
                name=f"{letter}{m + 1:02d}",
                label=labels[m],
                region=regions.region(vertex),
                side=SIDES[int(regions.side[vertex])],
                role=roles[m],
                vertex=vertex,
                source_vertex=int(rig.source_index[vertex]),
                position=tuple(np.round(rig.neutral[vertex], 3).tolist()),
                triangle=triangle,
                barycentric=tuple((rig.triangles[triangle] == vertex).astype(float).tolist()),
                blendshapes=tuple(face.used[k] for k in np.flatnonzero(covers[:, m])),
                quality=round(float(w[covers[:, m], m].mean()) if covers[:, m].any() else 2.0, 4),
                visibility=round(float(visibility[m]), 4),
                round=rounds[m],
                views=views_of(face, settings, vertex),
                measured_mm=measured_mm(face, settings, vertex),
            )
        )
    return tuple(landmarks)


def views_of(face: Face, settings: LayoutSettings, vertex: int) -> tuple[View, ...]:
    """What every known camera sees of a marker at a vertex."""
    if not face.cameras:
        return ()
    found, n = face.views(settings.dot_mm), int(face.rig.skin[:vertex].sum())
    views = []
    for c, camera in enumerate(found.cameras):
        unread = found.first_unread(c, n)
        why, when = (WORDS[unread[0]], ("neutral", *face.used)[unread[1]]) if unread else ("", "")
        pixels, share = round(float(found.pixels[c, n]), 2), round(float(found.share[c, n]), 4)
        views.append(View(camera, unread is None, pixels, share, why, when))
    return tuple(views)


def measured_mm(face: Face, settings: LayoutSettings, vertex: int) -> tuple[float, ...]:
    """Standard deviations of a marker's place at a vertex as the cameras measure it; see `Landmark`."""
    if not face.cameras:
        return ()
    found = deviations(face.told(settings.dot_mm)[[vertex]])[0]
    return tuple(np.round(found[np.isfinite(found)], 4).tolist())


def _count_up(labels: list[str]) -> list[str]:
    """'left brow' stays where it is the only one and becomes 'left brow 1', 'left brow 2' where it is not."""
    total, seen = Counter(labels), Counter()
    numbered = []
    for label in labels:
        seen[label] += 1
        numbered.append(f"{label} {seen[label]}" if total[label] > 1 else label)
    return numbered
