"""Inspect a plan's layout: what it sees, what it confuses, why each landmark is there, and how much it forgives.

Everything is computed from the rig and the landmarks' vertices. Lengths are in millimetres, angles in degrees.
"""

import numpy as np
from jaxtyping import Bool
from msgspec import Struct

from capture_plan.evaluation.alternatives import Alternative, alternatives
from capture_plan.evaluation.identifiability import (
    Mix,
    Reason,
    Separator,
    Sight,
    blind_spots,
    confusable,
    reasons,
    separators,
    shares,
    sights,
    weakest_mixes,
)
from capture_plan.evaluation.layout_similarity import Similarity, similarities
from capture_plan.evaluation.monte_carlo import Trial, trials
from capture_plan.evaluation.rings import rings_of
from capture_plan.evaluation.robustness import (
    EXTENT_MM,
    Loss,
    Substitute,
    Tolerance,
    free_for,
    losses,
    substitutes,
    tolerances,
)
from capture_plan.evaluation.tangent_chart import Chart, flatten
from capture_plan.layout.face import Face, see_face
from capture_plan.layout.predict import performances, predictions
from capture_plan.layout.record import Information, MotionFit, Prediction
from capture_plan.layout.settings import LayoutSettings
from capture_plan.mesh import vertex_normals
from capture_plan.plan.inputs import PlanInputs, inputs_for
from capture_plan.plan.record import Plan
from capture_plan.rig import Rig
from capture_plan.shell.takes import Takes

ALTERNATIVES = 3  # other layouts that are looked for
MIXES = 5  # the weakest ones; the strong ones are no news


class MarkerReport(Struct, frozen=True):
    """One landmark: why it is there, how far its dot may sit from its place, and what happens without it.

    `ring_mm` is how far it may stand off while every other dot does so within its own ring, as the pages draw it
    (`evaluation.rings`). `unnoticed` and `measured` are of this dot alone, while all others stand at their places: the
    solver takes it for one at its place, or is told the true one. `substitute_label` is the place of the substitute in
    words, `substitute_source_vertex` its number in the artist's file.
    """

    name: str
    label: str
    reason: Reason
    ring_mm: float
    unnoticed: Tolerance
    measured: Tolerance
    lost: Loss
    substitute: Substitute | None
    substitute_label: str
    substitute_source_vertex: int | None


class TakeReport(Struct, frozen=True):
    """What a recorded take loses by the layout, and without each landmark, in the order of `markers`, millimetres."""

    fit: MotionFit
    without_mm: tuple[float, ...]


class Inspection(Struct, frozen=True):
    """What `capture-plan inspect` says; indices of landmarks count from 0 in the order of `markers`.

    `blind_of_68` are blendshapes that no point of the 68-point reference sees at the plan's epsilon; none where the rig
    has no face to lay 68 points on. `take` is there where the plan has one. `draft` is what does not hold of the plan.
    """

    rig: str
    epsilon: float
    information: Information
    predictions: tuple[Prediction, ...]
    singular_values_mm: tuple[float, ...]
    weakest: tuple[Mix, ...]
    blendshapes: tuple[Sight, ...]
    separators: tuple[Separator, ...]
    separator_labels: tuple[str, ...]
    blind: tuple[str, ...]
    blind_of_68: tuple[str, ...] | None
    markers: tuple[MarkerReport, ...]
    two_lost: tuple[Loss, ...]
    trials: tuple[Trial, ...]
    others: tuple[Alternative, ...]
    alike: tuple[Similarity, ...]
    take: TakeReport | None
    draft: tuple[str, ...] = ()


def inspect_plan(plan: Plan, inputs: Rig | PlanInputs) -> Inspection:
    """The layout of `plan` on its rig, with the inputs that it was made from.

    Raises:
        PlanError: the plan's settings name a file that is not among the inputs.

    Example:
        >>> found = inspect_plan(read_plan("hero.plan.json"), sample_rig())
        >>> len(found.markers) == found.information.landmarks
        True
    """
    given, settings = inputs_for(inputs, plan.settings, carried=plan.cameras), plan.settings.landmarks
    rig, takes = given.rig, given.takes
    face = see_face(rig, plan.audit.used, given.cameras, given.zones)
    vertices = np.array([m.vertex for m in plan.layout.landmarks])
    observation = face.observation(settings.noise_mm, settings.dot_mm)
    covers = shares(face, settings, vertices) >= settings.epsilon
    seen = sights(observation, vertices, face.used)
    more = separators(face, settings, vertices, confusable(seen))
    charts = flatten(rig.neutral, vertex_normals(rig.neutral, rig.triangles), face.graph, vertices, extent_mm=EXTENT_MM)
    regions = face.regions
    return Inspection(
        rig=rig.name,
        epsilon=settings.epsilon,
        information=observation.information(vertices),
        predictions=predictions(observation, vertices, performances(observation, takes)),
        singular_values_mm=tuple(np.linalg.svd(observation.response(vertices), compute_uv=False).tolist()),
        weakest=weakest_mixes(observation, vertices, face.used, count=MIXES),
        blendshapes=seen,
        separators=more,
        separator_labels=tuple(regions.label(one.vertex) for one in more),
        blind=blind_spots(face, settings, vertices),
        blind_of_68=blind_of_68(face, settings),
        markers=marker_reports(plan, face, charts, covers),
        two_lost=losses(observation, vertices, covers, face.used, at_once=2),
        trials=trials(observation, vertices, rig.neutral, charts),
        others=alternatives(face, settings, plan.layout, count=ALTERNATIVES, takes=takes, poses=plan.poses),
        alike=similarities(rig, vertices) if face.points68 is not None else (),
        take=take_report(plan, takes),
        draft=plan.draft,
    )


def take_report(plan: Plan, takes: Takes | None) -> TakeReport | None:
    """What the takes of the plan lose; None where there are none."""
    fit = plan.layout.motion
    if fit is None or takes is None:
        return None
    vertices = np.array([m.vertex for m in plan.layout.landmarks])
    return TakeReport(fit, tuple(takes.error(np.delete(vertices, m)) for m in range(len(vertices))))


def blind_of_68(face: Face, settings: LayoutSettings) -> tuple[str, ...] | None:
    """Blendshapes that the 68 points of iBUG do not see; None where the rig has no face to lay them on."""
    return None if face.points68 is None else blind_spots(face, settings, face.points68)


def marker_reports(
    plan: Plan, face: Face, charts: tuple[Chart, ...], covers: Bool[np.ndarray, "k m"]
) -> tuple[MarkerReport, ...]:
    """Reason, ring, tolerance alone, loss and substitute of every landmark."""
    settings, rig = plan.settings.landmarks, face.rig
    observation, epsilon = face.observation(settings.noise_mm, settings.dot_mm), settings.epsilon
    largest = np.where(face.allowed(settings), face.displacement, 0).max(axis=1)
    vertices = np.array([m.vertex for m in plan.layout.landmarks])
    tolerated = tolerances(observation, vertices, charts, covers, largest, epsilon)
    free = free_for(face.graph, vertices, settings.spacing_mm) & face.free(settings)
    instead = substitutes(observation, vertices, charts, covers, largest, epsilon, free)
    lost = losses(observation, vertices, covers, face.used, at_once=1)
    why = reasons(face, settings, vertices)
    rings = rings_of(rig, face.used, settings, plan.layout.landmarks, face.cameras).mm
    regions = face.regions
    return tuple(
        MarkerReport(
            name=landmark.name,
            label=landmark.label,
            reason=why[m],
            ring_mm=rings[landmark.name],
            unnoticed=tolerated[m][0],
            measured=tolerated[m][1],
            lost=lost[m],
            substitute=(other := instead[m]),
            substitute_label=regions.label(other.vertex) if other else "",
            substitute_source_vertex=int(rig.source_index[other.vertex]) if other else None,
        )
        for m, landmark in enumerate(plan.layout.landmarks)
    )
