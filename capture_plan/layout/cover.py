"""Set cover: the cheapest sites that reach every blendshape (Zell & McDonnell 2022, eq. 5).

Data       c[k, s]    site s is a candidate for blendshape k; every k has one
           a[s]       cost of site s; n[s] landmarks that it places, 1 or 2
           Q          cliques: sets of sites any two of which stand too close to each other
Variables  f[s]       site s is chosen
Model      min  sum_s a[s] f[s]
           s.t. sum_s c[k, s] f[s] >= demand  for every k that has so many candidates, else all of them
                sum_{s in q} f[s] <= 1        for every q in Q
                sum_s n[s] f[s] <= limit      where the number of landmarks is settled already
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int
from ortools.sat.python import cp_model
from scipy.optimize import linprog

from capture_plan.errors import InfeasibleError
from capture_plan.layout.reduce import essential_rows, undominated

RESOLUTION = 1e-4  # costs are compared to four decimals: finer differences of quality mean nothing on a face
WORK_LIMIT = 20.0  # CP-SAT's deterministic time, about seconds: the same input gives the same answer on any machine
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
    size: Int[np.ndarray, " s"],
    *,
    cliques: Sequence[Int[np.ndarray, " _"]] = (),
    limit: int | None = None,
    demand: int = 1,
) -> Cover:
    """The cheapest cover, solved on the sites and rows that matter.

    Raises:
        InfeasibleError: no cover keeps the cliques and the limit, or none was found within `WORK_LIMIT`.
    """
    free = np.ones(len(cost), dtype=bool)
    for clique in cliques:
        free[clique] = False
    rows, kept = np.arange(len(covers)), np.arange(len(cost))
    if demand == 1:  # two landmarks for a blendshape may both be of one kind: nothing is dominated
        rows = essential_rows(covers)
        criteria = [cost] if limit is None else [cost, size]
        kept = undominated(covers[rows], np.array(criteria, dtype=float), free)
        rows = rows[essential_rows(covers[np.ix_(rows, kept)])]
    price = np.rint(cost / RESOLUTION).astype(np.int64)

    model = cp_model.CpModel()
    f = {s: model.new_bool_var(f"f{s}") for s in kept.tolist()}
    for k in rows.tolist():
        able = [f[s] for s in kept[covers[k, kept]].tolist()]
        if demand == 1:
            model.add_bool_or(able)
        else:
            model.add(sum(able) >= min(demand, len(able)))
    for clique in cliques:
        model.add_at_most_one([f[s] for s in clique.tolist() if s in f])
    if limit is not None:
        model.add(sum(int(size[s]) * f[s] for s in f) <= limit)
    model.minimize(sum(int(price[s]) * f[s] for s in f))

    solver = cp_model.CpSolver()
    solver.parameters.num_workers = 1
    solver.parameters.linearization_level = 2
    solver.parameters.random_seed = 0
    solver.parameters.max_deterministic_time = WORK_LIMIT
    status = solver.solve(model)
    if status == cp_model.UNKNOWN:
        raise InfeasibleError(f"no cover was found in {WORK_LIMIT:g} units of work: lower spacing_mm or raise epsilon")
    if status not in (cp_model.OPTIMAL, cp_model.FEASIBLE):
        raise InfeasibleError(
            "no landmarks reach every blendshape at this distance from each other: lower spacing_mm or epsilon"
        )
    chosen = np.array([s for s in f if solver.boolean_value(f[s])], dtype=int)
    return Cover(
        np.arange(len(covers)),
        chosen,
        solver.objective_value * RESOLUTION,
        solver.best_objective_bound * RESOLUTION,
        status == cp_model.OPTIMAL,
    )


def dual_prices(covers: Bool[np.ndarray, "k s"], size: Int[np.ndarray, " s"]) -> Float[np.ndarray, " k"]:
    """Prices y >= 0 with sum_k c[k, s] y[k] <= n[s] for every site: any cover has at least sum_k y[k] landmarks.

    The optimum of the dual linear program, shrunk by a rounding step so that the printed digits keep the limits.
    """
    rows = essential_rows(covers)
    kept = undominated(covers[rows], size[None].astype(float), np.ones(len(size), dtype=bool))
    answer = linprog(
        -np.ones(len(rows)), A_ub=covers[np.ix_(rows, kept)].T.astype(float), b_ub=size[kept], method="highs"
    )
    y = np.zeros(len(covers))
    y[rows] = np.floor(np.clip(answer.x, 0, None) * (1 - 1e-9) * 10**DUAL_DIGITS) / 10**DUAL_DIGITS
    return y
