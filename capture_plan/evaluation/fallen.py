"""What to do when a dot falls off: carry on or put it back, where another may stand instead, and which two are missed.

Carry on   every blendshape keeps a landmark and the upper estimate of the error grows by a tenth at most
Instead    the nearest other place of which the same is true, clear of the spot and of every other dot
Together   two dots, each of which may be lost alone, that may not both be
"""

from collections.abc import Sequence

import numpy as np
from msgspec import Struct

from capture_plan.camera import Camera
from capture_plan.evaluation.identifiability import shares
from capture_plan.evaluation.robustness import EXTENT_MM, free_for, losses, substitutes
from capture_plan.evaluation.tangent_chart import flatten
from capture_plan.layout.face import see_face
from capture_plan.layout.record import Landmark
from capture_plan.layout.settings import LayoutSettings
from capture_plan.mesh import vertex_normals
from capture_plan.rig import Rig


class Fallen(Struct, frozen=True):
    """One dot that fell off: whether to carry on, which blendshapes nobody sees without it, by which factor the error
    grows, and how far away along the skin, millimetres, and in which direction another may stand instead."""

    name: str
    carry_on: bool
    unseen: tuple[str, ...]
    factor: float
    instead_mm: float | None
    direction: str


class Falling(Struct, frozen=True):
    """Every dot by itself, and the pairs that must not both fall, those that cost most first."""

    alone: tuple[Fallen, ...]
    together: tuple[tuple[str, str], ...]


def falling(
    rig: Rig,
    used: tuple[str, ...],
    settings: LayoutSettings,
    landmarks: Sequence[Landmark],
    cameras: tuple[Camera, ...] = (),
) -> Falling:
    """What to do when landmarks fall off; what stands in for one is read by as many `cameras` as any other.

    Example:
        >>> plan = read_plan("hero.plan.json")
        >>> found = falling(sample_rig(), plan.audit.used, plan.settings.landmarks, plan.layout.landmarks)
        >>> len(found.alone) == len(plan.layout.landmarks)
        True
    """
    if not landmarks:
        return Falling((), ())
    face, vertices = see_face(rig, used, cameras), np.array([landmark.vertex for landmark in landmarks])
    observation = face.observation(settings.noise_mm, settings.dot_mm)
    covers = shares(face, settings, vertices) >= settings.epsilon
    before = observation.error(observation.covariance(vertices))
    lost = losses(observation, vertices, covers, used, at_once=1)
    charts = flatten(rig.neutral, vertex_normals(rig.neutral, rig.triangles), face.graph, vertices, extent_mm=EXTENT_MM)
    largest = np.where(face.allowed(settings), face.displacement, 0).max(axis=1)
    free = free_for(face.graph, vertices, settings.spacing_mm) & face.free(settings)
    others = substitutes(observation, vertices, charts, covers, largest, settings.epsilon, free)
    alone = tuple(
        Fallen(
            landmark.name,
            loss.carry_on,
            loss.uncovered,
            loss.error_mm / before,
            None if other is None else other.distance_mm,
            "" if other is None else other.direction,
        )
        for landmark, loss, other in zip(landmarks, lost, others, strict=True)
    )
    spared = {m for m, one in enumerate(alone) if one.carry_on}
    pairs = losses(observation, vertices, covers, used, at_once=2) if len(landmarks) > 1 else ()
    bad = [loss for loss in pairs if not loss.carry_on and set(loss.landmarks) <= spared]
    bad.sort(key=lambda loss: (-len(loss.uncovered), -loss.error_mm, loss.landmarks))
    names = [landmark.name for landmark in landmarks]
    return Falling(alone, tuple((names[loss.landmarks[0]], names[loss.landmarks[1]]) for loss in bad))
