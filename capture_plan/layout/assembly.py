"""All of a layout that follows from what was decided: which sites, by which program, in which order.

The planner writes a layout through here, and the check takes the decisions out of a plan and sends them through here
again: nothing in a plan can then say what its decisions do not mean on this rig.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from operator import itemgetter

import numpy as np
from jaxtyping import Int
from msgspec import structs
from msgspec.structs import replace

from capture_plan.errors import PlanError
from capture_plan.layout.costs import RESOLUTION, costs, to_cover
from capture_plan.layout.face import SIXTY_EIGHT, USUAL, Face
from capture_plan.layout.farthest import candidates, farthest_points
from capture_plan.layout.head_sites import pose_error
from capture_plan.layout.lower_bound import fewest_for, shares_of
from capture_plan.layout.motion_design import fit_of
from capture_plan.layout.naming import name_head_markers, name_landmarks
from capture_plan.layout.observation import Observation, error_against_budget
from capture_plan.layout.predict import Performance, performances, predictions
from capture_plan.layout.problem import NOTHING, Task
from capture_plan.layout.record import Bound, ErrorBound, HeadPose, Information, Layout, MotionFit, Program, Reference
from capture_plan.layout.settings import ORDERED, LayoutSettings, Method
from capture_plan.layout.sites import Sites
from capture_plan.layout.spacing import taken_by
from capture_plan.rig import Rig
from capture_plan.shell.takes import Takes

SINGLE_COVER = "single set cover"
EVEN = "dots spread evenly"
TARGETS = (SIXTY_EIGHT, EVEN)
NO_SHARES = ErrorBound(0.0, (), ())


@dataclass(frozen=True, eq=False)
class Solved:
    """Sites that a program chose, in ascending order, and the proven lower limit of what they cost."""

    sites: Int[np.ndarray, " n"]
    bound: float


@dataclass(frozen=True, eq=False)
class Decided:
    """What solvers and searches decided.

    `programs` choose the landmarks, or all stand in `further`, from the most telling to the first to be spared, where
    the method chooses them as one set. `head` and `known`, other layouts by name, are vertices.
    `certificate`, `error_bound` and `target_bound` are as in `Layout`.
    """

    method: Method
    programs: tuple[Solved, ...]
    further: Int[np.ndarray, " n"]
    head: Int[np.ndarray, " h"]
    known: dict[str, Int[np.ndarray, " _"]]
    certificate: Bound
    error_bound: ErrorBound | None
    target_bound: ErrorBound | None

    @property
    def rounds(self) -> tuple[Solved, ...]:
        """The programs whose sites are landmarks."""
        return () if self.method in ORDERED else self.programs

    @property
    def chosen(self) -> Int[np.ndarray, " n"]:
        """All sites that carry landmarks, (n)."""
        return np.concatenate([*(program.sites for program in self.rounds), self.further])


def follow(task: Task, decided: Decided, takes: Takes | None = None) -> Layout:
    """The layout of these decisions. `task` is without the sites that head markers shut out."""
    face, settings, sites, observation = task.face, task.settings, task.sites, task.observation
    chosen = decided.chosen
    numbers = [n for n, program in enumerate(decided.rounds) for _ in program.sites] + [None] * len(decided.further)
    order, round_of = _in_order(face.rig, sites, chosen, numbers)
    landmarks = name_landmarks(face, settings, order, round_of)
    message = sites.members(chosen) if decided.method in ORDERED else order[:0]
    name_at = {m.vertex: m.name for m in landmarks}
    given = performances(observation, takes)
    covered = sites.covers(settings.epsilon)[:, chosen].any(axis=1)
    references = {name: reference(observation, at, given) for name, at in decided.known.items()}
    return Layout(
        method=decided.method,
        landmarks=landmarks,
        programs=_programs(task, decided),
        certificate=decided.certificate,
        uncovered=tuple(face.used[k] for k in np.flatnonzero(~covered)),
        information=observation.information(order),
        references=references,
        head=name_head_markers(face, settings, decided.head),
        head_pose=head_pose(face, decided.head, settings.noise_mm) if len(decided.head) else None,
        order=tuple(name_at[vertex] for vertex in message.tolist()),
        curve_mm=tuple(np.round(error_against_budget(observation, message), 4).tolist()),
        error_bound=decided.error_bound,
        target_landmarks=target_landmarks(task, decided, target_of(references)[1]),
        target_bound=decided.target_bound,
        motion=motion_fit(face, takes, order, message, decided.known) if takes else None,
        predictions=predictions(observation, order, given),
    )


def decided_in(layout: Layout, task: Task) -> Decided:
    """What the layout says was decided, as far as the task has sites for it.

    Raises:
        PlanError: the task has none for any of its landmarks.
    """
    site_of = {int(vertex): s for s, pair in enumerate(task.sites.vertices) for vertex in pair}

    def sites(vertices: list[int]) -> Int[np.ndarray, " n"]:
        found = dict.fromkeys(site_of[vertex] for vertex in vertices if vertex in site_of)
        return np.array(list(found), dtype=int)

    programs = tuple(Solved(np.sort(sites(list(program.vertices))), program.bound) for program in layout.programs)
    vertex_of = {m.name: m.vertex for m in layout.landmarks}
    if layout.method in ORDERED:
        further = sites([vertex_of[name] for name in layout.order if name in vertex_of])
    else:
        every = sites([m.vertex for m in layout.landmarks])
        further = np.setdiff1d(every, np.concatenate([NOTHING, *(program.sites for program in programs)]))
    if not any(m.vertex in site_of for m in layout.landmarks):
        raise PlanError("no landmark of the plan stands where one may under its settings: plan again")
    known = {SINGLE_COVER: np.unique(np.array(layout.references[SINGLE_COVER].vertices, dtype=int))}
    return Decided(
        method=layout.method,
        programs=programs,
        further=further,
        head=np.array([m.vertex for m in layout.head], dtype=int),
        known=points_of(task.face) | known,
        certificate=in_order(layout.certificate, task.face.used),
        error_bound=layout.error_bound,
        target_bound=layout.target_bound,
    )


def in_order(certificate: Bound, used: tuple[str, ...]) -> Bound:
    """The certificate with blendshapes in the order of the rig."""
    prices = dict(zip(certificate.blendshapes, certificate.weights, strict=True))
    named = tuple(name for name in used if name in prices)
    return Bound(named, tuple(prices[name] for name in named), certificate.landmarks)


def points_of(face: Face) -> dict[str, Int[np.ndarray, " _"]]:
    """Vertices of 68 points, where the face has eyes and mouth to lay them on, and of as many dots spread evenly."""
    subset = candidates(face)
    even = farthest_points(subset, min(USUAL, len(subset.vertices)), seed=0)
    return ({} if face.points68 is None else {SIXTY_EIGHT: face.points68}) | {EVEN: even}


def single_cover_settings(settings: LayoutSettings) -> LayoutSettings:
    """The settings of the paper's single cover: without spacing or constraints."""
    return replace(settings, method="cover", number=None, budget=None, pins=(), relaxed_for=None, spacing_mm=0.0)


def target_of(references: Mapping[str, Information]) -> tuple[str, float]:
    """The layout that ours has to equal, by name, and its error, mm: the better of 68 points and of dots spread evenly.

    Points that tell less than dots anywhere lie wrong on this face and are no target.
    """
    return min(((name, references[name].error_mm) for name in TARGETS if name in references), key=itemgetter(1))


def target_landmarks(task: Task, decided: Decided, target_mm: float) -> int | None:
    """`Layout.target_landmarks`; None too where the method states no bounds. Without a certificate all that no shares
    prove is left."""
    if decided.error_bound is None:
        return None
    shares = shares_of(task.sites, decided.target_bound or NO_SHARES)
    return fewest_for(task.observation, task.sites, shares, target_mm=target_mm, limits=task.limits)


def most_of(settings: LayoutSettings, method: Method, landmarks: int) -> int:
    """How many landmarks the error bound of a layout speaks of: its budget, or as many as it has."""
    return (settings.budget or settings.number or landmarks) if method == "budget" else landmarks


def reference(observation: Observation, vertices: Int[np.ndarray, " m"], given: Sequence[Performance]) -> Reference:
    """Another layout, what it is worth, and the error to expect of some performances."""
    information = observation.information(vertices)
    expected = predictions(observation, vertices, given)
    return Reference(**structs.asdict(information), vertices=tuple(vertices.tolist()), predictions=expected)


def head_pose(face: Face, head: Int[np.ndarray, " h"], noise_mm: float) -> HeadPose:
    """What a pose fitted to the head markers is worth over the moving skin."""
    return pose_error(face.rig.neutral[head], face.rig.neutral[face.moving_skin], noise_mm)


def motion_fit(
    face: Face,
    takes: Takes,
    vertices: Int[np.ndarray, " m"],
    messages: Int[np.ndarray, " n"],
    known: dict[str, Int[np.ndarray, " _"]],
) -> MotionFit:
    """What takes lose by landmarks, in the order that they were told in if any, and by known layouts."""
    fit = fit_of(takes, face.used, messages if len(messages) else vertices, ordered=len(messages) > 0)
    return replace(fit, references_mm={name: round(takes.error(np.unique(at)), 5) for name, at in known.items()})


def required_rows(task: Task, decided: Decided) -> list[Int[np.ndarray, " r"]]:
    """The blendshapes that every program is about: all that can be reached, or in later rounds what is crowded."""
    if decided.method != "adaptive":
        return [task.reachable] * len(decided.programs)
    found, chosen = [], NOTHING
    for program in decided.programs:
        free = ~taken_by(chosen, task.spacing, len(task.sites.visibility))
        found.append(to_cover(task.sites, task.settings, chosen, free, task.limits))
        chosen = np.concatenate([chosen, program.sites])
    return found


def program_costs(task: Task, decided: Decided) -> list[float]:
    """What the sites of every program cost; under a budget they count."""
    counts = decided.method in ORDERED
    settings: LayoutSettings = replace(task.settings, weights="count") if counts else task.settings
    prices = [
        np.rint(costs(task.sites, settings, rows, program.sites) / RESOLUTION)
        for program, rows in zip(decided.programs, required_rows(task, decided), strict=True)
    ]
    return [int(price.sum()) * RESOLUTION for price in prices]


def _programs(task: Task, decided: Decided) -> tuple[Program, ...]:
    found = zip(decided.programs, required_rows(task, decided), program_costs(task, decided), strict=True)
    return tuple(
        Program(
            landmarks=int(task.sites.size[program.sites].sum()),
            blendshapes=tuple(task.face.used[k] for k in rows),
            objective=round(cost, 4),
            bound=round(program.bound, 4),
            proven_optimal=round(program.bound, 4) >= round(cost, 4),
            vertices=tuple(task.sites.members(program.sites).tolist()),
        )
        for program, rows, cost in found
    )


def _in_order(
    rig: Rig, sites: Sites, chosen: Int[np.ndarray, " n"], numbers: list[int | None]
) -> tuple[Int[np.ndarray, " m"], list[int | None]]:
    """Vertices of all landmarks from the top of the face down, partners side by side, and the round of each."""
    height = rig.neutral[sites.vertices[chosen], 1].mean(axis=1)
    order = np.lexsort((chosen, -np.round(height, 3)))
    vertices = sites.members(chosen[order])
    round_of = [numbers[i] for i in order for _ in range(sites.size[chosen[i]])]
    return vertices, round_of
