"""From a rig to a layout: where landmarks may stand, which program chooses them, and what they are worth.

The line of thought: skin that moves and is seen in every expression gives the sites; the set cover of these is the
fewest landmarks that any layout needs; the chosen method answers; what it chose is numbered, named and measured beside
the layouts that people know.
"""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Int

from capture_plan.errors import InfeasibleError
from capture_plan.layout.assembly import (
    SINGLE_COVER,
    Decided,
    Solved,
    follow,
    most_of,
    points_of,
    single_cover_settings,
    target_of,
)
from capture_plan.layout.capacity import must_fit
from capture_plan.layout.cover import dual_prices
from capture_plan.layout.dot_contact import NO_POSES, Poses
from capture_plan.layout.face import Face
from capture_plan.layout.head_markers import choose_head_markers
from capture_plan.layout.lower_bound import error_bound, target_bound
from capture_plan.layout.methods import Chosen, choose_by_method
from capture_plan.layout.multicover import best_cover
from capture_plan.layout.problem import NOTHING, Task, task_of
from capture_plan.layout.record import Bound, ErrorBound, Layout
from capture_plan.layout.settings import BY_ERROR, LayoutSettings, Method
from capture_plan.layout.sites import Sites
from capture_plan.once import once
from capture_plan.shell.takes import Takes


def design_layout(
    face: Face,
    settings: LayoutSettings,
    *,
    takes: Takes | None = None,
    former: Layout | None = None,
    unlike: Sequence[Sequence[int]] = (),
    poses: Poses = NO_POSES,
) -> Layout:
    """The layout that `settings` ask for.

    A `former` layout is where a budget starts again from, so that little changes; every layout of `unlike`, given by
    its vertices, is to be left in some places (`constraints.differences`). What `takes` lose by the layout is measured.
    No dots meet in `poses` or in any blendshape alone, and cameras read all dots in `poses`; the bounds speak of all
    layouts, also of others.

    Raises:
        InfeasibleError: no skin is seen well enough, the constraints clash, or the budget does not pay for a single
            site or is more than fits.

    Example:
        >>> layout = design_layout(see_face(sample_rig()), LayoutSettings(method="budget", budget=16))
        >>> layout.information.landmarks, layout.information.noise_mm
        (16, 0.2)
    """
    task = task_of(face, settings, unlike)
    head = NOTHING
    if settings.head_markers:
        head = choose_head_markers(face, settings, task.sites, task.limits, task.reachable)
        task = task.with_head_markers(head)
    apart = task.apart_in(poses).read_in(poses)
    must_fit(task, apart)
    known = points_of(face) | {SINGLE_COVER: papers_cover(face, settings)}
    _, target_mm = target_of({name: task.observation.information(at) for name, at in known.items()})
    method, rounds, added = chosen_apart(task, apart, target_mm, former, takes)
    bound = bound_of(task, method, int(task.sites.size[added].sum()), former)
    decided = Decided(
        method=method,
        programs=tuple(Solved(cover.chosen, cover.bound) for cover in rounds),
        further=added,
        head=head,
        known=known,
        certificate=certify(task),
        error_bound=bound,
        target_bound=target_bound_of(task, bound, target_mm, former),
    )
    return follow(task, decided, takes)


def chosen_apart(
    task: Task,
    apart: Task,
    target_mm: float,
    former: Layout | None,
    takes: Takes | None,
) -> Chosen:
    """`choose_by_method` among layouts `apart`, of which no two dots meet when the face moves and cameras read all in
    the plan's expressions; among all where none keeps all constraints: a plan tells which dots meet or are not read
    (`dot_contact`, `unread`), and is better made than refused."""
    try:
        return choose_by_method(apart, target_mm, former, takes)
    except InfeasibleError:
        return choose_by_method(task, target_mm, former, takes)


def bound_of(task: Task, method: Method, landmarks: int, former: Layout | None) -> ErrorBound | None:
    """The least error that any layout of the budget, or of as many landmarks, could predict under the constraints."""
    if method not in BY_ERROR:
        return None
    budget = most_of(task.settings, method, landmarks)
    near = former.error_bound if former else None
    return error_bound(task.observation, task.sites, budget=budget, limits=task.limits, former=near)


def target_bound_of(task: Task, bound: ErrorBound | None, target_mm: float, former: Layout | None) -> ErrorBound | None:
    """The certificate of how few landmarks could reach the target under the constraints, whatever the budget."""
    if bound is None:
        return None
    start = (former.target_bound if former else None) or bound
    return target_bound(task.observation, task.sites, start, target_mm=target_mm, limits=task.limits)


def papers_cover(face: Face, settings: LayoutSettings) -> Int[np.ndarray, " m"]:
    """The paper's single cover, without spacing or constraints."""
    return _single_cover(face, single_cover_settings(settings))


@once
def _single_cover(face: Face, settings: LayoutSettings) -> Int[np.ndarray, " m"]:
    sites = face.sites(settings)
    rows = np.flatnonzero(sites.covers(settings.epsilon).any(axis=1))
    return np.sort(sites.members(best_cover(sites, settings, rows, all_of(sites), None).chosen))


def all_of(sites: Sites) -> Int[np.ndarray, " s"]:
    """Every site, open to all programs."""
    return np.arange(len(sites.visibility))


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
