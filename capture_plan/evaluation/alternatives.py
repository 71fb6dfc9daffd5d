"""Other layouts that are as good: what a person can have instead without a loss that anybody could measure.

Each next one is the best answer to the same settings that leaves a fifth of the places of every layout before it
(`constraints.differences`). It counts when it is within 1 % of the first: in the cost of the program for a cover, in
number and upper estimate of the error otherwise, in the error of the take where the first was chosen for one.
"""

import numpy as np
from msgspec import Struct

from capture_plan.errors import InfeasibleError
from capture_plan.layout.design import design_layout
from capture_plan.layout.dot_contact import NO_POSES, Poses
from capture_plan.layout.face import Face
from capture_plan.layout.record import Layout
from capture_plan.layout.settings import LayoutSettings
from capture_plan.progress import track
from capture_plan.shell.takes import Takes

AS_GOOD = 0.01


class Alternative(Struct, frozen=True):
    """Another layout: its landmarks by vertex, how much worse it is than the first (0.01 is 1 %, negative: better), and
    the places of the first that it leaves, by name, with those that it takes instead, in words; what a take loses."""

    vertices: tuple[int, ...]
    landmarks: int
    error_mm: float
    worse: float
    leaves: tuple[str, ...]
    takes: tuple[str, ...]
    lost_mm: float | None = None

    @property
    def as_good(self) -> bool:
        """Whether it is within 1 %."""
        return self.worse <= AS_GOOD


def alternatives(
    face: Face,
    settings: LayoutSettings,
    layout: Layout,
    *,
    count: int,
    takes: Takes | None = None,
    poses: Poses = NO_POSES,
) -> tuple[Alternative, ...]:
    """The `count` next best, the first that is not as good the last; `takes` and `poses` are those of the layout."""
    found: list[Alternative] = []
    known = [[m.vertex for m in layout.landmarks]]
    for _ in track(range(count), "Looking for other layouts", total=count):
        try:
            other = design_layout(face, settings, unlike=known, takes=takes, poses=poses)
        except InfeasibleError:
            break
        found.append(compared(face, settings, layout, other))
        known.append([m.vertex for m in other.landmarks])
        if not found[-1].as_good:
            break
    return tuple(found)


def compared(face: Face, settings: LayoutSettings, layout: Layout, other: Layout) -> Alternative:
    """How another layout differs from the first."""
    radius = max(settings.spacing_mm, settings.dot_mm)

    def away(ours: Layout, theirs: Layout) -> list[int]:
        covered = face.around(np.array([m.vertex for m in theirs.landmarks]), radius)
        return [i for i, m in enumerate(ours.landmarks) if not covered[m.vertex]]

    return Alternative(
        vertices=tuple(m.vertex for m in other.landmarks),
        landmarks=len(other.landmarks),
        error_mm=other.information.error_mm,
        worse=round(_loss(layout, other), 4),
        leaves=tuple(layout.landmarks[i].name for i in away(layout, other)),
        takes=tuple(other.landmarks[i].label for i in away(other, layout)),
        lost_mm=other.motion.rmse_mm if other.motion else None,
    )


def _loss(layout: Layout, other: Layout) -> float:
    """By what share the other is worse than the first."""
    if layout.method in ("cover", "trivial", "distance"):
        return other.programs[0].objective / layout.programs[0].objective - 1
    if layout.method == "motion" and layout.motion and other.motion:
        return other.motion.rmse_mm / max(layout.motion.rmse_mm, 1e-9) - 1
    number = len(other.landmarks) / len(layout.landmarks)
    return max(number, other.information.error_mm / max(layout.information.error_mm, 1e-9)) - 1
