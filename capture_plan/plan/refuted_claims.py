"""What no certificate proves and a second look may refute: programs, the order of landmarks, the single set cover.

Program    f costs sum_s cost[s] f[s] >= bound. No site of its answer can be left out where all blendshapes and limits
           are kept without it, or the answer costs less than the bound
Order      the last of the first n landmarks, or pairs, is the one that is missed least, for every n
Default    no site can be left out while the goal is reached, and none with room lowers an error above the target by
           more than twice what is worth its while (`studio`)
Single     the paper's cover, of any site and without wishes, sees every blendshape, and none that is at hand is smaller
"""

from dataclasses import replace as dataclass_replace

import numpy as np
from jaxtyping import Int
from msgspec.structs import replace

from capture_plan.layout.follow import SINGLE_COVER, Decided, Solved, decided_in, program_costs, rows_of, target_of
from capture_plan.layout.gains import gains_at
from capture_plan.layout.search import Search
from capture_plan.layout.settings import BY_ERROR
from capture_plan.layout.studio import WORTHWHILE, Goal, ceiling
from capture_plan.layout.task import Task, search_of
from capture_plan.plan.claims import TOLERANCE, Claim, claim
from capture_plan.plan.record import Plan

SEVERAL = ("trivial", "distance")  # methods that ask for several sites of each blendshape
NO_ROWS = np.empty((0, 0), dtype=bool)
AS_GOOD = 1e-6  # share of a loss by which rounding may turn the order of two sites


def refuted_claims(plan: Plan, task: Task) -> list[Claim]:
    """Every claim that a second look may refute."""
    decided = decided_in(plan.layout, task)
    claims = [single_cover_claim(plan, task)]
    if decided.programs and decided.method not in SEVERAL:
        claims.append(spared_claim(task, decided))
    if decided.method == "studio":
        claims += studio_claims(plan, task, decided)
    return [*claims, order_claim(task, decided)] if decided.method in BY_ERROR else claims


def studio_claims(plan: Plan, task: Task, decided: Decided) -> list[Claim]:
    """The default has no landmark too many; and none too few, where the expressions are those that it was made for."""
    chosen, (name, target_mm) = tuple(decided.further.tolist()), target_of(plan.layout.references)
    goal = Goal(search_of(task, len(task.sites.size)), target_mm)
    without = [tuple(other for other in chosen if other != site) for site in chosen]
    spare = sum(bool(rest) and goal.enough(rest, than=chosen) for rest in without)
    least = f"no landmark can be left out of the default and all of it be as good beside {name}"
    claims = [claim(least, not spare, f"{spare} of {len(chosen)} places can")]
    if plan.packing.kept is None and not plan.packing.edits.names:
        gain = best_gain(task.apart_in(plan.packing.poses), decided) if goal.error(chosen) > target_mm else 0.0
        more = f"the default reaches the error of {name}, or another landmark is not worth its while"
        found = f"{goal.error(chosen):.3f} mm against {target_mm:.3f} mm, another would take {gain:.1%} of it"
        claims.append(claim(more, gain < 2 * WORTHWHILE, found))
    return claims


def best_gain(task: Task, decided: Decided) -> float:
    """Share of the error that another landmark takes at most, where one has room below the ceiling."""
    chosen = tuple(decided.further.tolist())
    cover = int(task.sites.size[decided.programs[0].sites].sum()) if decided.programs else 0
    search = search_of(task, ceiling(cover, task.observation.full_rank))
    among, gains = search.next(chosen), search.gains(chosen)
    squared = float(np.sum(search.observation.gram * gains.C))
    each = gains.all(among) / search.size[among]
    return float(each.max(initial=0.0)) / (2 * squared)  # the square falls twice as fast


def spared_claim(task: Task, decided: Decided) -> Claim:
    """The first program, to which all limits apply, has no answer that costs less with one site left out."""
    program, rows = decided.programs[0], rows_of(task, decided)[0]
    covers = task.sites.covers(task.settings.epsilon)[rows]
    spared = []
    for site in program.sites.tolist():
        rest = program.sites[program.sites != site]
        if covers[:, rest].any(axis=1).all() and not any(limit.shortfall(rest) for limit in task.limits):
            fewer = dataclass_replace(decided, programs=(Solved(rest, program.bound),))
            spared += [site] if program_costs(task, fewer)[0] < program.bound - TOLERANCE else []
    found = f"{len(spared)} of {len(program.sites)} can"
    return claim("no site of the first program can be left out below its bound", not spared, found)


def order_claim(task: Task, decided: Decided) -> Claim:
    """The landmarks stand in the order in which they are missed."""
    order, search = decided.further, Search(task.observation, task.sites, NO_ROWS, None, 0)
    wrong = [n for n in range(2, len(order) + 1) if not missed_least(search, order[:n])]
    found = (
        f"{len(order)} places" if not wrong else f"not so at {', '.join(map(str, wrong[:3]))} of {len(order)} places"
    )
    return claim("each landmark of the order is missed least of those up to it", not wrong, found)


def missed_least(search: Search, kept: Int[np.ndarray, " n"]) -> bool:
    """Whether the last site is the one that is missed least, for each of its landmarks."""
    C = search.observation.covariance(search.sites.members(kept))
    gains = gains_at(search.observation, search.all_rows[kept], C)
    lost = np.array([gains.loss(search.rows((site,))) / search.size[site] for site in kept.tolist()])
    return bool(lost[-1] <= lost.min() + AS_GOOD * np.abs(lost).max())


def single_cover_claim(plan: Plan, task: Task) -> Claim:
    """The single set cover is one, and where its number counts first no larger than the covers in this plan."""
    layout, plain = plan.layout, replace(task.settings, pins=(), relaxed_for=None, spacing_mm=0.0)
    sites = task.face.sites(plain)
    covers = sites.covers(plain.epsilon)

    def missed(vertices: tuple[int, ...]) -> int:
        at = np.isin(sites.vertices, vertices).all(axis=1)
        return int((covers.any(axis=1) & ~covers[:, at].any(axis=1)).sum())

    said = layout.references[SINGLE_COVER].vertices
    others = [tuple(m.vertex for m in layout.landmarks), *(program.vertices for program in layout.programs)]
    fewest = min((len(one) for one in others if not missed(one)), default=len(said))
    counts = task.settings.weights != "paper"
    return claim(
        f"the {SINGLE_COVER} sees every blendshape, with no more landmarks than any cover of this plan",
        not missed(said) and (len(said) <= fewest or not counts),
        f"{len(said)} landmarks, {missed(said)} blendshapes missed; the fewest here are {fewest}",
    )
