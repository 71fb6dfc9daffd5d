"""What a method promises of its landmarks, asked again without a solver.

studio     no site can be left out while the goal is reached, and none with room lowers an error above the target by
           more than twice what is worth its while
budget     a cover is stated where the budget pays for one; no room for another landmark is left unused
both       no exchange of a landmark, or pair, lowers the error by more than is worth its while
adaptive   no further round would find blendshapes to cover
A greedy look (`exchange`) refutes; where it finds nothing and nothing is proved, `unchecked` says so.
"""

import numpy as np

from capture_plan.layout.assembly import Decided, target_of
from capture_plan.layout.constraint_rows import Limit
from capture_plan.layout.costs import to_cover
from capture_plan.layout.exchange import Search
from capture_plan.layout.problem import Task, search_of
from capture_plan.layout.second_look import greedy_cover
from capture_plan.layout.settings import BY_ERROR
from capture_plan.layout.spacing import taken_by
from capture_plan.layout.studio import LEAST_GAIN, Goal, ceiling
from capture_plan.plan.claims import Claim, claim
from capture_plan.plan.record import Plan

NO_COVER = "no cover of all blendshapes is within the budget"
NO_ROUND = "no further round has anything to cover"


def promise_claims(plan: Plan, task: Task, decided: Decided, apart: Task) -> list[Claim]:
    """What the method that answers promises, as far as it can be asked; in `apart` no dots meet in an expression."""
    if decided.method == "adaptive":
        return rounds_claims(task, decided)
    if decided.method not in BY_ERROR:
        return []
    claims = studio_claims(plan, task, decided) if decided.method == "studio" else []
    if not plan.packing.as_made:  # landmarks were chosen for other expressions
        return claims
    claims += budget_claims(plan, apart, decided) if decided.method == "budget" else []
    return [*claims, exchange_claim(apart, decided)]


def studio_claims(plan: Plan, task: Task, decided: Decided) -> list[Claim]:
    """The default has no landmark too many; and none too few, where the expressions are those that it was made for."""
    chosen, (name, target_mm) = tuple(decided.further.tolist()), target_of(plan.layout.references)
    goal = Goal(search_of(task, len(task.sites.size)), target_mm)
    without = [tuple(other for other in chosen if other != site) for site in chosen]
    spare = sum(bool(rest) and goal.enough(rest, than=chosen) for rest in without)
    least = f"no landmark can be left out of the default and all of it be as good beside {name}"
    claims = [claim(least, not spare, f"{spare or 'none'} of {len(chosen)} places can")]
    if plan.packing.as_made:
        gain = best_gain(task.apart_in(plan.poses), decided) if goal.error(chosen) > target_mm else 0.0
        more = f"the default reaches the error of {name}, or another landmark is not worth its while"
        found = f"{goal.error(chosen):.3f} mm against {target_mm:.3f} mm, another would take {gain:.1%} of it"
        claims.append(claim(more, gain < 2 * LEAST_GAIN, found))
    return claims


def best_gain(task: Task, decided: Decided) -> float:
    """Share of the error that another landmark takes at most, where one has room below the ceiling."""
    chosen = tuple(decided.further.tolist())
    cover = int(task.sites.size[decided.programs[0].sites].sum()) if decided.programs else 0
    search = search_of(task, ceiling(cover, task.observation.full_rank))
    subset, gains = search.next(chosen), search.gains(chosen)
    squared = float(np.sum(search.observation.gram * gains.C))
    each = gains.all(subset) / search.size[subset]
    return float(each.max(initial=0.0)) / (2 * squared)  # the square falls twice as fast


def budget_claims(plan: Plan, task: Task, decided: Decided) -> list[Claim]:
    """A cover is stated where there is one, and the budget is spent."""
    most = task.settings.budget or task.settings.number or len(plan.layout.landmarks)
    claims, chosen = [], tuple(decided.further.tolist())
    if not decided.programs:
        least, found = plan.layout.certificate.landmarks, greedy_cover(search_of(task, most))
        if least > most or found is not None:
            message = f"at least {least} landmarks are needed, the budget is {most}"
            at_hand = f"; {search_of(task, most).landmarks(found)} landmarks see all" if found is not None else ""
            claims.append(claim(NO_COVER, found is None, message + at_hand))
    left = len(search_of(task, most, covered=False).next(chosen))
    return [*claims, claim("the budget is spent as far as there is room", not left, f"{left} places have room")]


def exchange_claim(task: Task, decided: Decided) -> Claim:
    """No landmark, or pair, stands where another of as many tells clearly more, as many mixes distinguished."""
    chosen = tuple(decided.further.tolist())
    search = search_of(task, int(task.sites.size[decided.further].sum()), covered=bool(decided.programs))
    goal, gains = Goal(search, 0.0), search.gains(chosen)
    error, rank, better = goal.error(chosen), goal.rank(chosen), []
    for site in chosen:
        rest = tuple(other for other in chosen if other != site)
        for new in search.instead(gains, search.everywhere, (site,), rest, int(search.size[site]))[:1].tolist():
            other = (*rest, new)
            better += [site] if goal.error(other) < (1 - LEAST_GAIN) * error and goal.rank(other) >= rank else []
    found = f"{len(better) or 'none'} of {len(chosen)} places have a better one"
    return claim(f"no other place in one's stead lowers the error by {LEAST_GAIN:.0%}", not better, found)


def rounds_claims(task: Task, decided: Decided) -> list[Claim]:
    """The rounds end where nothing is left to cover, or none of what is left can be."""
    chosen, sites = np.concatenate([program.sites for program in decided.programs]), task.sites
    if len(decided.programs) == task.settings.rounds:
        return [claim(NO_ROUND, holds=True, found=f"{task.settings.rounds} rounds, as asked for")]
    free = ~taken_by(chosen, task.spacing, len(sites.size))
    rows = to_cover(sites, task.settings, chosen, free, task.limits)
    if not len(rows):
        return [claim(NO_ROUND, holds=True, found=f"{len(decided.programs)} rounds")]
    shut = Limit("what earlier rounds took", (~free).astype(int), most=0)
    left = (*(limit.after(chosen) for limit in task.limits), shut)
    covers = sites.covers(task.settings.epsilon)[rows]
    found = greedy_cover(Search(task.observation, sites, covers, task.spacing, int(sites.size.sum()), left))
    message = f"{len(rows)} blendshapes are crowded and {len(found or ())} more sites see them"
    return [] if found is None else [claim(NO_ROUND, holds=False, found=message)]
