"""From a rig to a layout: where landmarks may stand, which program chooses them, and what they are worth.

The line of thought: skin that moves and is seen in every expression gives the sites; the set cover of these is the
fewest landmarks that any layout needs; the chosen method answers; what it chose is numbered, named and measured beside
the layouts that people know.
"""

from dataclasses import dataclass
from dataclasses import replace as dataclass_replace

import numpy as np
from jaxtyping import Bool, Int
from msgspec.structs import replace

from capture_plan.errors import InfeasibleError
from capture_plan.layout.budget import spend_budget
from capture_plan.layout.cover import Cover, dual_prices
from capture_plan.layout.face import Face
from capture_plan.layout.limits import Limit, open_under
from capture_plan.layout.multicover import adaptive_cover, best_cover
from capture_plan.layout.naming import name_landmarks
from capture_plan.layout.record import Bound, Layout, Program, Worth
from capture_plan.layout.repair import repair
from capture_plan.layout.settings import LayoutSettings, Method, Weights
from capture_plan.layout.sites import Sites
from capture_plan.layout.spacing import Spacing
from capture_plan.layout.wishes import wishes
from capture_plan.layout.worth import Observation, error_against_budget
from capture_plan.rig import Rig

SINGLE_COVER = "single set cover"
SIXTY_EIGHT = "68 points (iBUG)"
NOTHING = np.empty(0, dtype=int)


def design_layout(face: Face, settings: LayoutSettings) -> Layout:
    """The layout that `settings` ask for.

    Raises:
        InfeasibleError: no skin is seen well enough, no landmarks reach every blendshape at this spacing, or the
            budget does not pay for a single site.
    """
    sites = face.sites(settings)
    limits = wishes(face, settings, sites)
    covers = sites.covers(settings.epsilon)
    open_ = np.flatnonzero(open_under(limits, NOTHING, len(sites.visibility)))
    reachable = np.flatnonzero(covers[:, open_].any(axis=1))
    if not len(reachable):
        raise InfeasibleError(f"no vertex that is seen moves by {settings.epsilon} of any blendshape: lower epsilon")
    observation = face.observation(settings.noise_mm)
    task = Task(face, settings, sites, limits, reachable, open_, face.spacing(sites, settings.spacing_mm), observation)
    references = sixty_eight(face, observation) | {SINGLE_COVER: single_cover_worth(face, settings, observation)}
    target_mm = references[SIXTY_EIGHT].error_mm if SIXTY_EIGHT in references else settings.noise_mm
    method, rounds, added = choose(task, target_mm)
    chosen = np.concatenate([*(cover.chosen for cover in rounds), added]) if method != "budget" else added
    numbers: list[int | None] = [None] * len(added)
    if method != "budget":
        numbers = [n for n, cover in enumerate(rounds) for _ in cover.chosen] + numbers
    order, round_of = _in_order(face.rig, sites, chosen, numbers)
    landmarks = name_landmarks(face, settings, order, round_of)
    told = sites.members(chosen) if method == "budget" else order[:0]
    name_at = {m.vertex: m.name for m in landmarks}
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
        certificate=certify([face.used[k] for k in reachable], covers[np.ix_(reachable, open_)], sites.size[open_]),
        uncovered=tuple(face.used[k] for k in np.flatnonzero(~covers[:, chosen].any(axis=1))),
        worth=observation.worth(order),
        references=references,
        order=tuple(name_at[vertex] for vertex in told.tolist()),
        curve_mm=tuple(np.round(error_against_budget(observation, told), 4).tolist()),
    )


def sixty_eight(face: Face, observation: Observation) -> dict[str, Worth]:
    """What 68 points are worth on this face; nothing where it has no eyes and mouth to lay them on."""
    return {} if face.points68 is None else {SIXTY_EIGHT: observation.worth(face.points68)}


def single_cover_worth(face: Face, settings: LayoutSettings, observation: Observation) -> Worth:
    """What the paper's single cover is worth, without spacing or wishes."""
    plain = replace(settings, method="cover", number=None, budget=None, pins=(), spacing_mm=0.0)
    sites = face.sites(plain)
    rows = np.flatnonzero(sites.covers(plain.epsilon).any(axis=1))
    return observation.worth(sites.members(best_cover(sites, plain, rows, all_of(sites), None).chosen))


def all_of(sites: Sites) -> Int[np.ndarray, " s"]:
    """Every site."""
    return np.arange(len(sites.visibility))


@dataclass(frozen=True, eq=False)
class Task:
    """What one design is about: sites, wishes, the blendshapes that open sites reach, spacing, and what is measured."""

    face: Face
    settings: LayoutSettings
    sites: Sites
    limits: tuple[Limit, ...]
    reachable: Int[np.ndarray, " r"]
    open_: Int[np.ndarray, " o"]
    spacing: Spacing | None
    observation: Observation

    def cover(self, weights: Weights, *, demand: Int[np.ndarray, " r"] | int = 1) -> Cover:
        """The best cover of all that can be reached that keeps spacing and wishes."""
        settings = replace(self.settings, weights=weights)
        return best_cover(self.sites, settings, self.reachable, self.open_, self.spacing, self.limits, demand=demand)


def choose(task: Task, target_mm: float) -> tuple[Method, list[Cover], Int[np.ndarray, " a"]]:
    """The method that answers, its covers, and the sites that a repair or a budget chose."""
    settings = task.settings
    if settings.method == "budget":
        return "budget", *within_budget(task)
    if settings.method == "cover":
        return "cover", [task.cover(settings.weights)], NOTHING
    if settings.method in ("trivial", "distance"):
        return settings.method, [multiple_cover(task)], NOTHING
    rounds = adaptive_cover(task.sites, settings, task.spacing, task.limits)
    if settings.method == "adaptive":
        return "adaptive", rounds, NOTHING
    chosen = np.concatenate([cover.chosen for cover in rounds])
    added = repair(task.observation, task.sites, chosen, target_mm=target_mm, spacing=task.spacing, limits=task.limits)
    if settings.budget and task.sites.size[np.concatenate([chosen, added])].sum() >= settings.budget:
        return "budget", *within_budget(task)  # a budget that binds is better spent as a whole
    return "studio", rounds, added


def multiple_cover(task: Task) -> Cover:
    """`rounds` sites for every blendshape, or as many as it has room for: next to each other, or at the spacing."""
    rows = task.sites.covers(task.settings.epsilon)[np.ix_(task.reachable, task.open_)]
    if task.settings.method == "trivial":
        alone = dataclass_replace(task, spacing=None)
        return alone.cover(task.settings.weights, demand=np.minimum(rows.sum(axis=1), task.settings.rounds))
    room = np.array([room_for(task.spacing, task.open_[row], task.settings.rounds) for row in rows])
    return task.cover(task.settings.weights, demand=room)


def room_for(spacing: Spacing | None, candidates: Int[np.ndarray, " n"], most: int) -> int:
    """How many of the candidates fit beside each other, first come first served, `most` at most."""
    count, left = 0, candidates
    while len(left) and count < most:
        count += 1
        left = left[~spacing.close(left[:1])[0, left]] if spacing else left[1:]
    return count


def within_budget(task: Task) -> tuple[list[Cover], Int[np.ndarray, " n"]]:
    """The fewest landmarks of a cover under all wishes where the budget pays for them, and the sites that it buys."""
    budget = task.settings.budget or task.settings.number
    assert budget is not None, "settings of this method carry a budget"
    fewest, start = task.cover("count"), task.cover("lexicographic")
    chosen = spend_budget(
        task.observation,
        task.sites,
        task.sites.covers(task.settings.epsilon)[task.reachable],
        start.chosen,
        budget=budget,
        spacing=task.spacing,
    )
    return [fewest] if fewest.objective <= budget else [], chosen


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
    counting = replace(task.settings, weights="count", number=None)
    return round(best_cover(task.sites, counting, task.reachable, task.open_, None).bound)


def certify(names: list[str], covers: Bool[np.ndarray, "k s"], size: Int[np.ndarray, " s"]) -> Bound:
    """A lower bound on the number of landmarks with its dual prices, checkable without a solver."""
    prices = dual_prices(covers, size)
    priced = np.flatnonzero(prices > 0)
    return Bound(
        blendshapes=tuple(names[k] for k in priced),
        weights=tuple(float(prices[k]) for k in priced),
        landmarks=int(np.ceil(prices.sum() - 1e-9)),
    )
