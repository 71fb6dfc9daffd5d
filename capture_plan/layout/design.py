"""From a rig to a layout: where landmarks may stand, which program chooses them, and what they are worth.

The line of thought: skin that moves and is seen in every expression gives the sites; the set cover of these is the
fewest landmarks that any layout needs; the chosen method answers; what it chose is numbered, named and measured beside
the layouts that people know.
"""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Int
from msgspec.structs import replace

from capture_plan.layout.by_motion import fit_of
from capture_plan.layout.cover import dual_prices
from capture_plan.layout.face import SIXTY_EIGHT, Face
from capture_plan.layout.head import pose_error
from capture_plan.layout.head_choice import choose_head_markers
from capture_plan.layout.methods import choose
from capture_plan.layout.multicover import best_cover
from capture_plan.layout.naming import name_head_markers, name_landmarks
from capture_plan.layout.record import Bound, ErrorBound, HeadPose, Layout, MotionFit, Program
from capture_plan.layout.relaxation import error_bound
from capture_plan.layout.settings import ORDERED, LayoutSettings
from capture_plan.layout.shell.takes import Takes
from capture_plan.layout.sites import Sites
from capture_plan.layout.task import NOTHING, Task, task_of
from capture_plan.layout.worth import error_against_budget
from capture_plan.rig import Rig

SINGLE_COVER = "single set cover"


def design_layout(
    face: Face,
    settings: LayoutSettings,
    *,
    takes: Takes | None = None,
    former: Layout | None = None,
    unlike: Sequence[Sequence[int]] = (),
) -> Layout:
    """The layout that `settings` ask for.

    A `former` layout is where a budget starts again from, so that little changes; every layout of `unlike`, given by
    its vertices, is to be left in some places (`wishes.differences`). What `takes` lose by the layout is measured.

    Raises:
        InfeasibleError: no skin is seen well enough, the wishes clash, or the budget does not pay for a single site.
    """
    task = task_of(face, settings, unlike)
    head = NOTHING
    if settings.head_markers:
        head = choose_head_markers(face, settings, task.sites, task.limits, task.reachable)
        task = task.beside(head)
    sites, observation = task.sites, task.observation
    known = known_layouts(face, settings)
    references = {name: observation.worth(vertices) for name, vertices in known.items()}
    target_mm = references[SIXTY_EIGHT].error_mm if SIXTY_EIGHT in references else settings.noise_mm
    method, rounds, added = choose(task, target_mm, former, takes)
    covered = [] if method in ORDERED else rounds
    chosen = np.concatenate([*(cover.chosen for cover in covered), added])
    numbers = [n for n, cover in enumerate(covered) for _ in cover.chosen] + [None] * len(added)
    order, round_of = _in_order(face.rig, sites, chosen, numbers)
    landmarks = name_landmarks(face, settings, order, round_of, method)
    told = sites.members(chosen) if method in ORDERED else order[:0]
    name_at = {m.vertex: m.name for m in landmarks}
    covers = sites.covers(settings.epsilon)
    return Layout(
        method=method,
        landmarks=landmarks,
        programs=tuple(
            Program(
                landmarks=int(sites.size[cover.chosen].sum()),
                blendshapes=tuple(face.used[k] for k in cover.rows),
                objective=round(cover.objective, 4),
                bound=round(cover.bound, 4),
                proven_optimal=cover.proven_optimal,
            )
            for cover in rounds
        ),
        minimum=minimum_landmarks(task),
        certificate=certify(task),
        uncovered=tuple(face.used[k] for k in np.flatnonzero(~covers[:, chosen].any(axis=1))),
        worth=observation.worth(order),
        references=references,
        head=name_head_markers(face, settings, head),
        head_pose=head_pose(face, head, settings.noise_mm) if len(head) else None,
        order=tuple(name_at[vertex] for vertex in told.tolist()),
        curve_mm=tuple(np.round(error_against_budget(observation, told), 4).tolist()),
        error_bound=bound_of(task, former) if method == "budget" else None,
        motion=motion_fit(face, takes, order, told, known) if takes else None,
    )


def head_pose(face: Face, head: Int[np.ndarray, " h"], noise_mm: float) -> HeadPose:
    """What a pose fitted to the head markers is worth over the moving skin."""
    return pose_error(face.rig.neutral[head], face.rig.neutral[face.moving_skin], noise_mm)


def motion_fit(
    face: Face,
    takes: Takes,
    vertices: Int[np.ndarray, " m"],
    told: Int[np.ndarray, " n"],
    known: dict[str, Int[np.ndarray, " _"]],
) -> MotionFit:
    """What takes lose by landmarks, in the order that they were told in if any, and by known layouts."""
    fit = fit_of(takes, face.used, told if len(told) else vertices, ordered=len(told) > 0)
    return replace(fit, references_mm={name: round(takes.error(np.unique(at)), 5) for name, at in known.items()})


def bound_of(task: Task, former: Layout | None) -> ErrorBound:
    """The least error that any layout of the budget under the wishes could predict."""
    budget = task.settings.budget or task.settings.number
    assert budget is not None, "a budget was spent"
    near = former.error_bound if former else None
    return error_bound(task.observation, task.sites, budget=budget, limits=task.limits, former=near)


def known_layouts(face: Face, settings: LayoutSettings) -> dict[str, Int[np.ndarray, " _"]]:
    """Vertices of 68 points, where the face has eyes and mouth to lay them on, and of the paper's single cover."""
    points = {} if face.points68 is None else {SIXTY_EIGHT: face.points68}
    return points | {SINGLE_COVER: papers_cover(face, settings)}


def papers_cover(face: Face, settings: LayoutSettings) -> Int[np.ndarray, " m"]:
    """The paper's single cover, without spacing or wishes."""
    key = (
        settings.symmetric,
        settings.weights,
        settings.epsilon,
        settings.alpha,
        settings.min_visibility,
    )
    if key not in face.single_covers:
        plain = replace(settings, method="cover", number=None, budget=None, pins=(), spacing_mm=0.0)
        sites = face.sites(plain)
        rows = np.flatnonzero(sites.covers(plain.epsilon).any(axis=1))
        chosen = best_cover(sites, plain, rows, all_of(sites), None).chosen
        face.single_covers[key] = sites.members(chosen)
    return face.single_covers[key]


def all_of(sites: Sites) -> Int[np.ndarray, " s"]:
    """Every site."""
    return np.arange(len(sites.visibility))


def _in_order(
    rig: Rig, sites: Sites, chosen: Int[np.ndarray, " n"], numbers: list[int | None]
) -> tuple[Int[np.ndarray, " m"], list[int | None]]:
    """Vertices of all landmarks from the top of the face down, partners side by side, and the round of each."""
    height = rig.neutral[sites.vertices[chosen], 1].mean(axis=1)
    order = np.lexsort((chosen, -np.round(height, 3)))
    vertices = sites.members(chosen[order])
    round_of = [numbers[i] for i in order for _ in range(sites.size[chosen[i]])]
    return vertices, round_of


def minimum_landmarks(task: Task) -> int:
    """Fewest landmarks of any cover by the open sites, spacing and other wishes left aside."""
    counting = replace(task.settings, method="cover", weights="count", number=None)
    return round(best_cover(task.sites, counting, task.reachable, task.open_, None).bound)


def certify(task: Task) -> Bound:
    """A lower bound on the number of landmarks with its dual prices, checkable without a solver."""
    covers = task.sites.covers(task.settings.epsilon)[np.ix_(task.reachable, task.open_)]
    prices = dual_prices(covers, task.sites.size[task.open_])
    priced = np.flatnonzero(prices > 0)
    return Bound(
        blendshapes=tuple(task.face.used[task.reachable[k]] for k in priced),
        weights=tuple(float(prices[k]) for k in priced),
        landmarks=int(np.ceil(prices.sum() - 1e-9)),
    )
