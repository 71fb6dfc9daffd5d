"""Where to put cameras for a layout: which of given places measure it best, and what one more camera buys."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Int

from capture_plan.anatomy.performed_deltas import performed_deltas
from capture_plan.camera import Camera, told
from capture_plan.errors import InfeasibleError
from capture_plan.face.blocking import opaque_triangles
from capture_plan.layout.camera_choice import CameraProblem, Chosen, choose
from capture_plan.layout.design import design_layout
from capture_plan.layout.dot_contact import NO_POSES, Poses
from capture_plan.layout.face import Face, see_face
from capture_plan.layout.record import Layout
from capture_plan.layout.settings import LayoutSettings
from capture_plan.layout.unread import pose_deltas
from capture_plan.progress import track
from capture_plan.rig import Rig
from capture_plan.visibility import Sight, camera_views

MOST_ROUNDS, WORTH = 6, 1e-3  # of alternating; of the error, that another round has to bring


@dataclass(frozen=True)
class Placed:
    """The best choice of so many cameras."""

    count: int
    cameras: tuple[Camera, ...]
    error_mm: float
    bound_mm: float


@dataclass(frozen=True)
class Placement:
    """The best choices, fewest cameras first; `too_few` are numbers that no choice of places will do with, `hidden`
    vertices that fewer places than asked for read in some expression, whichever are chosen."""

    places: int
    views: int
    best: tuple[Placed, ...]
    too_few: tuple[int, ...]
    hidden: tuple[int, ...]


def camera_problem(
    rig: Rig,
    used: tuple[str, ...],
    vertices: Int[np.ndarray, " m"],
    places: Sequence[Camera],
    *,
    dot_mm: float,
    views: int,
    poses: Poses = NO_POSES,
) -> tuple[CameraProblem, tuple[int, ...]]:
    """The choice among places for landmarks at vertices, that are read with every blendshape and in every pose; and the
    vertices that fewer than `views` places read in one of these."""
    deltas = np.concatenate([performed_deltas(rig, used), pose_deltas(rig, poses)]) if poses else None
    alone = performed_deltas(rig, used) if deltas is None else deltas
    found = camera_views(rig.neutral, alone, opaque_triangles(rig), vertices, places, dot_mm=dot_mm)
    B = rig.deltas[rig.rows(used)][:, vertices].astype(float)  # (k m 3)
    H = []
    for c, camera in enumerate(places):
        L = told([camera], rig.neutral[vertices], found.share[[c]])
        H.append(np.einsum("kmi,mij,lmj->kl", B, L, B))
    reads = found.how == Sight.READ  # (e c m)
    hidden = vertices[(reads.sum(axis=1) < views).any(axis=0)]
    gram = Face(rig, used, np.zeros(len(rig.neutral))).observation(1.0).gram
    rows = reads.transpose(0, 2, 1).reshape(-1, len(places))
    return CameraProblem.of(np.array(H), gram, rows, views), tuple(hidden.tolist())


def place_cameras(
    rig: Rig,
    used: tuple[str, ...],
    vertices: Int[np.ndarray, " m"],
    places: Sequence[Camera],
    counts: Sequence[int],
    *,
    dot_mm: float,
    views: int = 2,
    poses: Poses = NO_POSES,
) -> Placement:
    """The best choices of so many cameras among `places` for landmarks at vertices, every landmark read by `views` of
    them at once in every expression, where as many places read it.

    Raises:
        InfeasibleError: no number of these does.
    """
    problem, hidden = camera_problem(rig, used, vertices, places, dot_mm=dot_mm, views=views, poses=poses)
    best, too_few, last = [], [], None
    for count in track(list(counts), "Choosing cameras"):
        try:
            chosen = choose(problem, count)
        except InfeasibleError as error:
            too_few.append(count)
            last = error
            continue
        best.append(_placed(count, chosen, places))
    if not best:
        raise InfeasibleError(str(last) if last else "no number of cameras is asked for")
    return Placement(len(places), views, tuple(best), tuple(too_few), hidden)


def _placed(count: int, chosen: Chosen, places: Sequence[Camera]) -> Placed:
    return Placed(count, tuple(places[c] for c in chosen.at), chosen.error_mm, chosen.bound_mm)


def alternate(
    rig: Rig,
    used: tuple[str, ...],
    settings: LayoutSettings,
    places: Sequence[Camera],
    count: int,
    layout: Layout,
    *,
    views: int = 2,
    poses: Poses = NO_POSES,
) -> tuple[Layout, Placed]:
    """Cameras for a layout, a layout for these cameras, and so on until neither improves the error by `WORTH`."""
    kept: tuple[Layout, Placed] | None = None
    for _ in range(MOST_ROUNDS):
        at = np.array([m.vertex for m in layout.landmarks])
        found = place_cameras(rig, used, at, places, [count], dot_mm=settings.dot_mm, views=views, poses=poses).best[0]
        if kept and found.error_mm > kept[1].error_mm * (1 - WORTH):
            break
        kept = layout, found
        layout = design_layout(see_face(rig, used, found.cameras), settings, poses=poses)
    if kept is None:
        raise InfeasibleError("no cameras are chosen")
    return kept


def placement_lines(found: Placement, names: dict[int, str]) -> list[str]:
    """What each number of cameras gives, and what the next buys, a sentence a line."""
    one = "" if found.views == 1 else f" by {found.views} cameras at once"
    lines = []
    if found.hidden:
        hidden = ", ".join(names.get(vertex, str(vertex)) for vertex in found.hidden)
        lines.append(f"Fewer than {found.views} of the {found.places} places read {hidden} in some expression.")
    if found.too_few:
        few = ", ".join(map(str, found.too_few))
        lines.append(f"Proved: no {few} of these places read every landmark{one} in every expression.")
    for placed, after in zip(found.best, [*found.best[1:], None], strict=True):
        gap = placed.error_mm / placed.bound_mm - 1
        where = ", ".join(camera.name for camera in placed.cameras)
        line = f"{placed.count} cameras: {placed.error_mm:.3f} mm (upper estimate), "
        line += f"proved within {gap:.1%} of the best {placed.count} of {found.places} places: {where}."
        if after and after.count == placed.count + 1:
            line += f" One more takes {placed.error_mm - after.error_mm:.3f} mm off it."
        lines.append(line)
    return lines
