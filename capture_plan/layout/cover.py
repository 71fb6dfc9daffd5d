"""Set cover: the cheapest sites that reach every blendshape (Zell & McDonnell 2022, eq. 5), under any constraints.

Data       c[k, s]    site s is a candidate for blendshape k; every k has one
           a[s]       cost of site s; n[s] landmarks that it places, 1 or 2
           T, L       sites too close to each other, and named limits (`program`)
Reduced    rows that others imply and sites that others dominate are left out where no constraint can tell them apart
Proved     with z the relaxed optimum and d the reduced costs, the best choice among the sites with d <= gap is the best
           of all once it costs at most z + gap: first few sites, then as many as that answer demands
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.optimize import linprog
from scipy.sparse import csr_array

from capture_plan.errors import InfeasibleError
from capture_plan.layout.constraint_rows import Limit
from capture_plan.layout.costs import RESOLUTION
from capture_plan.layout.infeasibility import clash_words
from capture_plan.layout.presolve import essential_rows, undominated
from capture_plan.layout.program import WORK_LIMIT, IntegerProgram, ProgramAnswer, branch, relax
from capture_plan.layout.spacing import Spacing
from capture_plan.solver import UndecidedError

FIRST_SITES, FIRST_SHARE = 300, 6  # sites that the first branching is about, and for each that the relaxation chooses
MOST_SITES = 4000  # where so many are not enough for a proof, the gap is stated
DUAL_DIGITS = 6


@dataclass(frozen=True, eq=False)
class Cover:
    """Chosen sites in ascending order for the given rows, their cost, and a lower limit on the cost of any cover."""

    rows: Int[np.ndarray, " r"]
    chosen: Int[np.ndarray, " n"]
    objective: float
    bound: float
    proven_optimal: bool


def solve_cover(
    covers: Bool[np.ndarray, "k s"],
    cost: Float[np.ndarray, " s"],
    *,
    demand: Int[np.ndarray, " k"] | int = 1,
    spacing: Spacing | None = None,
    limits: Sequence[Limit] = (),
) -> Cover:
    """The cheapest choice with `demand` sites at least for every blendshape that keeps spacing and limits.

    Raises:
        InfeasibleError: there is none, with the constraints that clash, or none was found within `WORK_LIMIT`.
    """
    s = len(cost)
    cliques = spacing.balls if spacing else csr_array((0, s), dtype=bool)
    close = spacing.table if spacing else csr_array((s, s), dtype=bool)
    least = np.broadcast_to(demand, len(covers))
    rows, retained = essential(covers, cost, least, close, limits)
    price = np.rint(cost / RESOLUTION).astype(np.int64)
    whole = IntegerProgram(covers[rows], price, least[rows], cliques, close, tuple(limits))
    program = whole.restricted_to(retained)
    try:
        answer = best(program)
    except UndecidedError:
        raise InfeasibleError(
            f"no landmarks were found that keep all constraints within {WORK_LIMIT:g} units of work: "
            "loosen one, or lower spacing_mm"
        ) from None
    if answer is None:
        raise InfeasibleError(clash_words(whole))
    chosen = retained[answer.chosen]
    return Cover(
        np.arange(len(covers)),
        chosen,
        answer.cost * RESOLUTION,
        answer.bound * RESOLUTION,
        answer.bound >= answer.cost,
    )


def essential(
    covers: Bool[np.ndarray, "k s"],
    cost: Float[np.ndarray, " s"],
    demand: Int[np.ndarray, " k"],
    close: csr_array,
    limits: Sequence[Limit],
) -> tuple[Int[np.ndarray, " r"], Int[np.ndarray, " n"]]:
    """Rows and sites that matter: sites that no limit shuts out, and where each may stand for another, the best."""
    s = len(cost)
    open_ = np.ones(s, dtype=bool)
    for limit in limits:
        open_ &= (limit.amount == 0) | (limit.most != 0)
    if demand.max() > 1 or any(limit.least > 0 for limit in limits):
        return np.arange(len(covers)), np.flatnonzero(open_)
    rows = essential_rows(covers)
    lonely = np.diff(close.indptr) <= 1
    amounts = [limit.amount for limit in limits if limit.most]
    at = np.flatnonzero(open_)
    retained = at[undominated(covers[np.ix_(rows, at)], np.array([cost, *amounts], dtype=float)[:, at], lonely[at])]
    return rows[essential_rows(covers[np.ix_(rows, retained)])], retained


def best(program: IntegerProgram) -> ProgramAnswer | None:
    """The cheapest choice with its bound, None where there is none.

    Raises:
        UndecidedError: no choice was found and none was ruled out within the work limit.
    """
    relaxed = relax(program)
    if relaxed is None:
        return None
    floor, order = in_units(relaxed.bound, program.unit), np.sort(relaxed.reduced)
    few = min(len(order), max(FIRST_SITES, int(FIRST_SHARE * relaxed.chosen)))
    most = float(order[min(len(order), MOST_SITES) - 1])
    gap, answer = max(0.0, float(order[few - 1])), None
    while True:
        near = np.flatnonzero(relaxed.reduced <= gap + 1e-6 * max(1.0, relaxed.bound))
        hint = np.searchsorted(near, answer.chosen).tolist() if answer else []
        found = attempt(program.restricted_to(near), hint, raises=len(near) == len(order))
        if found is None and len(near) == len(order):
            return None
        if found is None and answer is None:
            gap = float(order[-1])
            continue
        if found is not None:
            # a choice with any other site costs more than the gap
            elsewhere = found.cost if len(near) == len(order) else in_units(relaxed.bound + gap, program.unit)
            answer = ProgramAnswer(
                near[found.chosen], found.cost, min(found.cost, max(floor, min(found.bound, elsewhere)))
            )
        assert answer is not None
        wanted = min(float(answer.cost - relaxed.bound), most)
        if answer.bound >= answer.cost or found is None or found.bound < found.cost or wanted <= gap:
            return answer
        gap = wanted


def in_units(cost: float, unit: int) -> int:
    """The least whole number of units that costs as much."""
    return unit * int(np.ceil(cost / unit - 1e-6))


def attempt(program: IntegerProgram, hint: list[int], *, raises: bool) -> ProgramAnswer | None:
    """`branch`; where the work runs out and sites are left to try, there is no answer yet."""
    try:
        return branch(program, hint)
    except UndecidedError:
        if raises:
            raise
        return None


def dual_prices(covers: Bool[np.ndarray, "k s"], size: Int[np.ndarray, " s"]) -> Float[np.ndarray, " k"]:
    """Prices y >= 0 with sum_k c[k, s] y[k] <= n[s] for every site: any cover has at least sum_k y[k] landmarks.

    The optimum of the dual linear program, shrunk by a rounding step so that the printed digits keep the limits.
    """
    rows = essential_rows(covers)
    retained = undominated(covers[rows], size[None].astype(float), np.ones(len(size), dtype=bool))
    answer = linprog(
        -np.ones(len(rows)), A_ub=covers[np.ix_(rows, retained)].T.astype(float), b_ub=size[retained], method="highs"
    )
    y = np.zeros(len(covers))
    y[rows] = np.floor(np.clip(answer.x, 0, None) * (1 - 1e-9) * 10**DUAL_DIGITS) / 10**DUAL_DIGITS
    return y
