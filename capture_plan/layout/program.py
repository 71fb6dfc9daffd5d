"""The integer program behind every layout that is proved, its linear relaxation and its solution.

Data       c[k, s]    site s is a candidate for blendshape k;  demand, sites that every k needs at least
           a[s]       cost of site s, a whole number
           T[s, t]    sites s and t stand too close to each other; Q cliques of such sites, many pairs in few rows
           L          limits: least <= amount . f <= most, each with a name (`limits`)
Variables  f[s]       site s is chosen
Model      min  sum_s a[s] f[s]
           s.t. sum_s c[k, s] f[s] >= demand            for every k
                sum_{s in q} f[s] <= 1                  for every q in Q, and every pair in T that no q holds
                least <= sum_s amount[s] f[s] <= most   for every limit
Relaxed    0 <= f <= 1, without the lone pairs: its optimum z bounds the program from below, and a choice with site s
           costs at least z + d[s], d the reduced costs. On faces z is nearly the answer: few sites are left to try
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float, Int
from ortools.sat.python import cp_model
from scipy.optimize import linprog
from scipy.sparse import csr_array, triu, vstack

from capture_plan.layout.constraint_rows import Limit
from capture_plan.solver import UndecidedError, solve

WORK_LIMIT = 2.0  # CP-SAT's deterministic time, about seconds: the same input gives the same answer on any machine


@dataclass(frozen=True, eq=False)
class IntegerProgram:
    """One program; `cliques` (q s) and `close` (s s) are boolean, empty where sites may stand as they like."""

    covers: Bool[np.ndarray, "k s"]
    cost: Int[np.ndarray, " s"]
    demand: Int[np.ndarray, " k"]
    cliques: csr_array
    close: csr_array
    limits: tuple[Limit, ...]

    def restricted_to(self, sites: Int[np.ndarray, " n"]) -> "IntegerProgram":
        """The program with these sites only."""
        limits = tuple(Limit(one.name, one.amount[sites], one.least, one.most) for one in self.limits)
        cliques = csr_array(self.cliques[:, sites])
        cliques = csr_array(cliques[np.diff(cliques.indptr) > 1])
        close = csr_array(self.close[sites][:, sites])
        return IntegerProgram(self.covers[:, sites], self.cost[sites], self.demand, cliques, close, limits)

    @property
    def lone_pairs(self) -> Int[np.ndarray, "n 2"]:
        """Close pairs that stand in no clique together."""
        held = (self.cliques.T.astype(np.float32) @ self.cliques.astype(np.float32)).astype(bool)
        lone = triu(self.close.astype(np.int8) - self.close.multiply(held).astype(np.int8), k=1)
        return np.argwhere(lone.toarray() > 0) if lone.nnz else np.empty((0, 2), dtype=int)

    @cached_property
    def unit(self) -> int:
        """All costs are multiples of it, and so is the cost of any choice."""
        return max(1, int(np.gcd.reduce(self.cost)))


@dataclass(frozen=True, eq=False)
class Relaxation:
    """Optimum of the relaxed program, how many sites it chooses in all, and what it costs more at least to choose each
    site (negative: to leave it)."""

    bound: float
    chosen: float
    reduced: Float[np.ndarray, " s"]


@dataclass(frozen=True, eq=False)
class ProgramAnswer:
    """Chosen sites in ascending order, their cost, and a lower limit on the cost of any choice."""

    chosen: Int[np.ndarray, " n"]
    cost: int
    bound: int


def relax(program: IntegerProgram) -> Relaxation | None:
    """The linear relaxation, None where even that has no solution."""
    s = len(program.cost)
    rows: list = [csr_array(-program.covers.astype(float)), program.cliques.astype(float)]
    ends = [-program.demand.astype(float), np.ones(len(program.cliques.indptr) - 1)]
    for limit in program.limits:
        amount = csr_array(limit.amount[None].astype(float))
        if limit.least > 0:
            rows.append(-amount)
            ends.append(np.array([-float(limit.least)]))
        if limit.most is not None:
            rows.append(amount)
            ends.append(np.array([float(limit.most)]))
    A, b = vstack(rows, format="csr"), np.concatenate(ends)
    answer = linprog(program.cost.astype(float), A_ub=A, b_ub=b, bounds=np.tile([0.0, 1.0], (s, 1)), method="highs")
    if answer.status == 2:  # infeasible
        return None
    assert answer.status == 0, answer.message
    return Relaxation(
        float(answer.fun), float(answer.x.sum()), np.asarray(answer.lower.marginals + answer.upper.marginals)
    )


def branch(program: IntegerProgram, hint: Sequence[int] = ()) -> ProgramAnswer | None:
    """The cheapest choice, None where there is none.

    Raises:
        UndecidedError: neither a choice nor a proof that there is none within `WORK_LIMIT`.
    """
    model = cp_model.CpModel()
    f = [model.new_bool_var(f"f{s}") for s in range(len(program.cost))]
    for row, least in zip(program.covers, program.demand.tolist(), strict=True):
        candidates = [f[s] for s in np.flatnonzero(row).tolist()]
        model.add_bool_or(candidates) if least == 1 else model.add(sum(candidates) >= least)
    for q in range(len(program.cliques.indptr) - 1):
        model.add_at_most_one([f[s] for s in _row(program.cliques, q)])
    for s, t in program.lone_pairs.tolist():
        model.add_at_most_one([f[s], f[t]])
    for limit in program.limits:
        total = cp_model.LinearExpr.weighted_sum(f, limit.amount.tolist())
        model.add_linear_constraint(total, limit.least, cp_model.INT32_MAX if limit.most is None else limit.most)
    model.minimize(cp_model.LinearExpr.weighted_sum(f, (program.cost // program.unit).tolist()))
    for s in hint:
        model.add_hint(f[s], True)

    solver, status = solve(model, work_limit=WORK_LIMIT)
    if status == cp_model.UNKNOWN:
        raise UndecidedError
    if status not in (cp_model.OPTIMAL, cp_model.FEASIBLE):
        return None
    chosen = np.array([s for s, one in enumerate(f) if solver.boolean_value(one)], dtype=int)
    bound = round(np.ceil(solver.best_objective_bound - 1e-6)) * program.unit
    return ProgramAnswer(chosen, int(program.cost[chosen].sum()), bound)


def _row(table: csr_array, q: int) -> list[int]:
    """Columns of row q."""
    return table.indices[table.indptr[q] : table.indptr[q + 1]].tolist()
