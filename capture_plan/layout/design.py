"""From a rig to a layout: where landmarks may stand, which program chooses them, and what they are worth.

The line of thought: skin that moves and is seen in every expression gives the sites; the set cover of these is the
fewest landmarks that any layout needs; the chosen method answers; what it chose is numbered, named and measured beside
the layouts that people know.
"""

import numpy as np
from jaxtyping import Bool, Int
from msgspec.structs import replace

from capture_plan.errors import InfeasibleError, RigError
from capture_plan.layout.budget import spend_budget
from capture_plan.layout.cover import Cover, dual_prices
from capture_plan.layout.empirical import place_ibug68
from capture_plan.layout.face import Face
from capture_plan.layout.multicover import Spacing, adaptive_cover, best_cover
from capture_plan.layout.naming import name_landmarks
from capture_plan.layout.record import Bound, Layout, Program, Worth
from capture_plan.layout.repair import repair
from capture_plan.layout.settings import LayoutSettings
from capture_plan.layout.sites import Sites
from capture_plan.layout.worth import Observation, error_against_budget
from capture_plan.mesh import surface_graph
from capture_plan.rig import Rig

SINGLE_COVER = "single set cover"
SIXTY_EIGHT = "68 points (iBUG)"


def design_layout(face: Face, settings: LayoutSettings) -> Layout:
    """The layout that `settings` ask for.

    Raises:
        InfeasibleError: no skin is seen well enough, no landmarks reach every blendshape at this spacing, or the
            budget does not pay for a single site.
    """
    sites = face.sites(settings)
    covers = sites.covers(settings.epsilon)
    reachable = np.flatnonzero(covers.any(axis=1))
    if not len(reachable):
        raise InfeasibleError(f"no vertex that is seen moves by {settings.epsilon} of any blendshape: lower epsilon")
    observation = face.observation(settings.noise_mm)
    everywhere = np.arange(len(sites.visibility))
    single = best_cover(sites, settings, reachable, everywhere, None)
    references = sixty_eight(face, observation) | {SINGLE_COVER: observation.worth(sites.members(single.chosen))}
    target_mm = references[SIXTY_EIGHT].error_mm if SIXTY_EIGHT in references else settings.noise_mm
    if settings.method == "budget":
        rounds, chosen = _within_budget(face, sites, settings, reachable, observation)
        numbers: list[int | None] = [None] * len(chosen)
    else:
        rounds, added = _choose(face, sites, settings, single, observation, target_mm)
        chosen = np.concatenate([*(cover.chosen for cover in rounds), added])
        numbers = [n for n, cover in enumerate(rounds) for _ in cover.chosen] + [None] * len(added)
    order, round_of = _in_order(face.rig, sites, chosen, numbers)
    landmarks = name_landmarks(face, settings, order, round_of)
    told = sites.members(chosen) if settings.method == "budget" else order[:0]
    name_at = {m.vertex: m.name for m in landmarks}
    return Layout(
        method=settings.method,
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
        minimum=minimum_landmarks(sites, settings, reachable),
        certificate=certify([face.used[k] for k in reachable], covers[reachable], sites.size),
        uncovered=tuple(face.used[k] for k in np.flatnonzero(~covers[:, chosen].any(axis=1))),
        worth=observation.worth(order),
        references=references,
        order=tuple(name_at[vertex] for vertex in told.tolist()),
        curve_mm=tuple(np.round(error_against_budget(observation, told), 4).tolist()),
    )


def sixty_eight(face: Face, observation: Observation) -> dict[str, Worth]:
    """What 68 points are worth on this face; nothing where it has no eyes and mouth to lay them on."""
    try:
        return {SIXTY_EIGHT: observation.worth(place_ibug68(face.rig))}
    except RigError:
        return {}


def _choose(
    face: Face, sites: Sites, settings: LayoutSettings, single: Cover, observation: Observation, target_mm: float
) -> tuple[list[Cover], Int[np.ndarray, " a"]]:
    """The covers and the repair that the method asks for."""
    if settings.method == "cover":
        return [single], np.empty(0, dtype=int)
    spacing = spacing_on(face.rig, sites, settings)
    rounds = adaptive_cover(sites, settings, spacing)
    if settings.method == "adaptive":
        return rounds, np.empty(0, dtype=int)
    chosen = np.concatenate([cover.chosen for cover in rounds])
    return rounds, repair(observation, sites, chosen, target_mm=target_mm, spacing=spacing)


def _within_budget(
    face: Face, sites: Sites, settings: LayoutSettings, rows: Int[np.ndarray, " r"], observation: Observation
) -> tuple[list[Cover], Int[np.ndarray, " n"]]:
    """The sites that the budget buys, and the fewest landmarks of a cover at the spacing where it pays for them."""
    assert settings.budget is not None, "settings of this method carry a budget"
    spacing, everywhere = spacing_on(face.rig, sites, settings), np.arange(len(sites.visibility))
    fewest = best_cover(sites, replace(settings, weights="count"), rows, everywhere, spacing)
    start = best_cover(sites, replace(settings, weights="lexicographic"), rows, everywhere, spacing)
    covers = sites.covers(settings.epsilon)[rows]
    chosen = spend_budget(observation, sites, covers, start.chosen, budget=settings.budget, spacing=spacing)
    return [fewest] if fewest.objective <= settings.budget else [], chosen


def spacing_on(rig: Rig, sites: Sites, settings: LayoutSettings) -> Spacing | None:
    """The spacing along the skin that `settings` ask for, if any."""
    skin = rig.triangles[rig.skin[rig.triangles].all(axis=1)]
    return Spacing(surface_graph(rig.neutral, skin), sites, settings.spacing_mm) if settings.spacing_mm else None


def _in_order(
    rig: Rig, sites: Sites, chosen: Int[np.ndarray, " n"], numbers: list[int | None]
) -> tuple[Int[np.ndarray, " m"], list[int | None]]:
    """Vertices of all landmarks from the top of the face down, partners side by side, and the round of each."""
    height = rig.neutral[sites.vertices[chosen], 1].mean(axis=1)
    order = np.lexsort((chosen, -np.round(height, 3)))
    vertices = sites.members(chosen[order])
    round_of = [numbers[i] for i in order for _ in range(sites.size[chosen[i]])]
    return vertices, round_of


def minimum_landmarks(sites: Sites, settings: LayoutSettings, rows: Int[np.ndarray, " r"]) -> int:
    """Fewest landmarks of any cover by these sites, spacing left aside."""
    counting = replace(settings, weights="count")
    return round(best_cover(sites, counting, rows, np.arange(len(sites.visibility)), None).bound)


def certify(names: list[str], covers: Bool[np.ndarray, "k s"], size: Int[np.ndarray, " s"]) -> Bound:
    """A lower bound on the number of landmarks with its dual prices, checkable without a solver."""
    prices = dual_prices(covers, size)
    priced = np.flatnonzero(prices > 0)
    return Bound(
        blendshapes=tuple(names[k] for k in priced),
        weights=tuple(float(prices[k]) for k in priced),
        landmarks=int(np.ceil(prices.sum() - 1e-9)),
    )
