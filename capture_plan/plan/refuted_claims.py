"""What no certificate proves and a second look may refute: programs, the order of landmarks, the single set cover.

Program    f costs sum_s cost[s] f[s] >= bound. No site of its answer can be left out where all blendshapes and limits
           are kept without it, or the answer costs less than the bound
Order      the last of the first n landmarks, or pairs, is the one that is missed least, for every n
Single     the paper's cover, of any site and without wishes, sees every blendshape, and none that is at hand is smaller
"""

from dataclasses import replace as dataclass_replace

import numpy as np
from jaxtyping import Int
from msgspec.structs import replace

from capture_plan.layout.follow import SINGLE_COVER, Decided, Solved, decided_in, program_costs, rows_of
from capture_plan.layout.gains import gains_at
from capture_plan.layout.search import Search
from capture_plan.layout.settings import BY_ERROR
from capture_plan.layout.task import Task
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
    return [*claims, order_claim(task, decided)] if decided.method in BY_ERROR else claims


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
    layout, plain = plan.layout, replace(task.settings, pins=(), spacing_mm=0.0)
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
