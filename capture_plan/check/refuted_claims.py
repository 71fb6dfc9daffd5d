"""What no certificate proves and a second look may refute: programs, the order of landmarks, the single set cover.

Program    no answer that leaves a site out, or exchanges one or two for another, costs less, whether
           the bound proves it or not; of methods that ask for several sites of each blendshape, each has them
Order      the last of the first n landmarks, or pairs, is the one that is missed least, for every n
Single     the paper's cover, of any site and without constraints, sees every blendshape, none that is at hand is
           smaller, and no exchange makes it cheaper
What a method promises besides is asked in `promise_claims`.
"""

import numpy as np
from jaxtyping import Int

from capture_plan.check.promise_claims import promise_claims
from capture_plan.layout.assembly import SINGLE_COVER, Decided, required_rows, single_cover_settings
from capture_plan.layout.costs import RESOLUTION
from capture_plan.layout.exchange import Search
from capture_plan.layout.gains import gains_at
from capture_plan.layout.problem import NOTHING, Task
from capture_plan.layout.second_look import Room, cheaper, prices, ranked
from capture_plan.layout.settings import BY_ERROR, ORDERED
from capture_plan.layout.spacing import taken_by
from capture_plan.plan.claims import TOLERANCE, Claim, claim
from capture_plan.plan.record import Plan

SEVERAL = ("trivial", "distance")  # methods that ask for several sites of each blendshape
NO_ROWS = np.empty((0, 0), dtype=bool)
AS_GOOD = 1e-6  # share of a loss by which rounding may turn the order of two sites


def refuted_claims(plan: Plan, task: Task, decided: Decided) -> list[Claim]:
    """Every claim that a second look may refute; `decided` is what the plan's layout says was."""
    known = plan.packing.as_made and decided.method in BY_ERROR
    apart = task.apart_in(plan.poses) if known else task
    claims = [single_cover_claim(plan, task), *promise_claims(plan, task, decided, apart)]
    if decided.programs and decided.method not in SEVERAL:
        claims.append(program_claim(plan, apart, decided))
    elif decided.programs:
        claims.append(several_claim(task, decided))
    return [*claims, order_claim(task, decided)] if decided.method in BY_ERROR else claims


def program_claim(plan: Plan, task: Task, decided: Decided) -> Claim:
    """No program has a cheaper answer that one exchange leads to."""
    below = [n + 1 for n in range(len(decided.programs)) if costs_less(plan, task, decided, n)]
    found = f"program {', '.join(map(str, below))} has one" if below else "none has one"
    return claim("no exchange of sites makes a program cheaper", not below, found)


def several_claim(task: Task, decided: Decided) -> Claim:
    """Every blendshape has as many sites as the method asks for, or as it has room for."""
    covers = task.sites.covers(task.settings.epsilon)[np.ix_(task.reachable, decided.programs[0].sites)]
    short = int((covers.sum(axis=1) < task.demand).sum())
    what = f"every blendshape has {task.settings.rounds} places, or as many as it has room for"
    return claim(what, not short, f"{short} of {len(covers)} have fewer")


def costs_less(plan: Plan, task: Task, decided: Decided, number: int) -> bool:
    """Whether a program costs less with a site left out, or one site for one or two of it, and no more landmarks.

    In `task` no dots meet in an expression, but where these have been edited since: there sites are left out alone.
    """
    counts, program, rows = decided.method in ORDERED, decided.programs[number], required_rows(task, decided)[number]
    known = plan.packing.as_made or not counts
    before = np.concatenate([NOTHING, *(one.sites for one in decided.programs[:number])])
    free = ~taken_by(before, task.spacing, len(task.sites.size))
    covers = task.sites.covers(task.settings.epsilon)[rows]
    room = Room(covers, free, task.spacing, [limit.after(before) for limit in task.limits])
    size = task.sites.size
    price = size if counts else RESOLUTION * prices(task.sites, task.settings, rows)
    most, chosen = int(size[program.sites].sum()), program.sites
    floor = price[chosen].sum() - TOLERANCE
    if any(price[rest].sum() < floor for rest in room.spared(chosen)):
        return True
    few = most if task.settings.weights == "lexicographic" and not counts else np.inf
    return known and any(
        (np.where(size[subset] + size[rest].sum() <= few, price[subset], np.inf) + price[rest].sum() < floor).any()
        for rest, subset in room.exchanges(chosen)
    )


def order_claim(task: Task, decided: Decided) -> Claim:
    """The landmarks stand in the order in which they are missed."""
    order, search = decided.further, Search(task.observation, task.sites, NO_ROWS, None, 0)
    wrong = [n for n in range(2, len(order) + 1) if not missed_least(search, order[:n])]
    found = (
        f"{len(order)} places" if not wrong else f"not so at {', '.join(map(str, wrong[:3]))} of {len(order)} places"
    )
    return claim("each landmark of the order is missed least of those up to it", not wrong, found)


def missed_least(search: Search, retained: Int[np.ndarray, " n"]) -> bool:
    """Whether the last site is the one that is missed least, for each of its landmarks."""
    C = search.observation.covariance(search.sites.members(retained))
    gains = gains_at(search.observation, search.all_rows[retained], C)
    lost = np.array([gains.loss(search.rows((site,))) / search.size[site] for site in retained.tolist()])
    return bool(lost[-1] <= lost.min() + AS_GOOD * np.abs(lost).max())


def single_cover_claim(plan: Plan, task: Task) -> Claim:
    """The single set cover is one, where its number counts first no larger than the covers in this plan, and as cheap
    as any that an exchange leads to."""
    layout, plain = plan.layout, single_cover_settings(task.settings)
    sites = task.face.sites(plain)
    covers, said = sites.covers(plain.epsilon), layout.references[SINGLE_COVER].vertices
    rows = np.flatnonzero(covers.any(axis=1))

    def sites_in(vertices: tuple[int, ...]) -> Int[np.ndarray, " n"]:
        return np.flatnonzero(np.isin(sites.vertices, vertices).all(axis=1))

    def missed(vertices: tuple[int, ...]) -> int:
        return int((~covers[np.ix_(rows, sites_in(vertices))].any(axis=1)).sum())

    others = [tuple(m.vertex for m in layout.landmarks), *(program.vertices for program in layout.programs)]
    fewest = min((len(one) for one in others if not missed(one)), default=len(said))
    fewer = task.settings.weights != "paper" and len(said) > fewest
    at, holds, found = sites_in(said), not missed(said) and not fewer, "no exchange makes it cheaper"
    if holds and sorted(sites.members(at).tolist()) != sorted(said):
        holds, found = False, "not all of them stand where one may"
    elif holds:
        everywhere = Room(covers[rows], np.ones(len(sites.size), dtype=bool), None)
        holds = cheaper(everywhere, ranked(sites, plain, rows), at) is None
        found = found if holds else "an exchange makes it cheaper"
    return claim(
        f"the {SINGLE_COVER} sees every blendshape, with no more landmarks than any cover of this plan",
        holds,
        f"{len(said)} landmarks, {missed(said)} blendshapes missed; the fewest here are {fewest}; {found}",
    )
