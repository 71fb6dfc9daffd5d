"""The methods by which landmarks are chosen, each from a task to covers and further sites.

cover              one exact program
trivial, distance  the same with several sites for every blendshape: next to each other, at the spacing
adaptive           cover, take away what is chosen, cover again what is crowded (`multicover`)
studio             the fewest landmarks that tell as much as they should (`studio`); within a budget, if one binds
budget             the least upper estimate that so many landmarks buy (`budget`)
motion             the least error of a recorded take (`by_motion`)
"""

from dataclasses import replace as dataclass_replace

import numpy as np
from jaxtyping import Int
from msgspec.structs import replace

from capture_plan.errors import InfeasibleError
from capture_plan.layout.budget import keepable, replan, spend_budget
from capture_plan.layout.cover import Cover
from capture_plan.layout.exchange import Choice
from capture_plan.layout.motion_design import sites_for
from capture_plan.layout.multicover import adaptive_cover, best_cover
from capture_plan.layout.problem import NOTHING, Task, search_of
from capture_plan.layout.record import Layout
from capture_plan.layout.settings import Method, Weights
from capture_plan.layout.studio import ceiling, fewest, near
from capture_plan.shell.takes import Takes

Chosen = tuple[Method, list[Cover], Int[np.ndarray, " a"]]


def choose_by_method(task: Task, target_mm: float, former: Layout | None, takes: Takes | None) -> Chosen:
    """The method that answers, its covers, and the sites chosen as one set.

    Raises:
        InfeasibleError: the constraints clash, or a take is asked for that is not there.
    """
    settings = task.settings
    if settings.method == "motion":
        if takes is None:
            raise InfeasibleError("method 'motion' needs a recorded take: give --sequence, or 'sequences' in settings")
        return "motion", [], sites_for(task, takes)
    if settings.method == "budget":
        return "budget", *within_budget(task, former)
    if settings.method == "cover":
        return "cover", [cover_of(task, settings.weights)], NOTHING
    if settings.method in ("trivial", "distance"):
        return settings.method, [multiple_cover(task)], NOTHING
    if settings.method == "adaptive":
        return "adaptive", adaptive_cover(task.sites, settings, task.spacing, task.limits), NOTHING
    cover, chosen = enough_for(task, target_mm, former)
    if settings.budget and task.sites.size[chosen].sum() >= settings.budget:
        return "budget", *within_budget(task, former)  # a budget that binds is better spent as a whole
    return "studio", [cover], chosen


def cover_of(task: Task, weights: Weights, *, demand: Int[np.ndarray, " r"] | int = 1) -> Cover:
    """The best cover of all that can be reached that keeps spacing and constraints."""
    settings = replace(task.settings, weights=weights)
    everywhere = np.arange(
        len(task.sites.visibility)
    )  # what constraints shut out stays in, to be named where they clash
    return best_cover(task.sites, settings, task.reachable, everywhere, task.spacing, task.limits, demand=demand)


def multiple_cover(task: Task) -> Cover:
    """`rounds` sites for every blendshape, or as many as it has room for: next to each other, or at the spacing."""
    if task.settings.method == "trivial":
        alone = dataclass_replace(task, settings=replace(task.settings, spacing_mm=0.0))
        return cover_of(alone, task.settings.weights, demand=task.demand)
    return cover_of(task, task.settings.weights, demand=task.demand)


def enough_for(task: Task, target_mm: float, former: Layout | None) -> tuple[Cover, Int[np.ndarray, " n"]]:
    """The fewest landmarks of a cover under all constraints, and as few sites as were found that reach the target."""
    cover, start = cover_of(task, "count"), tuple(cover_of(task, "lexicographic").chosen.tolist())
    most = ceiling(int(task.sites.size[cover.chosen].sum()), task.observation.full_rank)
    search = search_of(task, most)
    if former:
        retained = keepable(search, sites_in(task, former))
        if not search.uncovered(retained):
            return cover, np.array(near(search, retained, target_mm), dtype=int)
    return cover, np.array(fewest(search, start, target_mm), dtype=int)


def sites_in(task: Task, former: Layout) -> Choice:
    """The sites of a former layout's landmarks."""
    retained = [m.vertex for m in former.landmarks]
    return tuple(np.flatnonzero(np.isin(task.sites.vertices, retained).any(axis=1)).tolist())


def within_budget(task: Task, former: Layout | None) -> tuple[list[Cover], Int[np.ndarray, " n"]]:
    """The fewest landmarks of a cover under all constraints where the budget pays for them, and the sites it buys."""
    budget = task.settings.budget or task.settings.number
    assert budget is not None, "settings of this method carry a budget"
    fewest = cover_of(task, "count")
    affordable = [fewest] if task.sites.size[fewest.chosen].sum() <= budget else []
    search = search_of(task, budget, covered=bool(affordable))
    if former:
        return affordable, replan(search, sites_in(task, former))
    start = cover_of(task, "lexicographic")
    chosen = spend_budget(
        task.observation,
        task.sites,
        task.sites.covers(task.settings.epsilon)[task.reachable],
        start.chosen,
        budget=budget,
        spacing=task.spacing,
        limits=task.limits,
    )
    return affordable, chosen
