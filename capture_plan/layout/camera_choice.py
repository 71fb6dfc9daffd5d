"""Which n of given places for cameras measure a layout best: an exact program with a bound.

Data       H_c (k k)   what camera c tells of the weights: sum over landmarks m of B_m' L_cm B_m (`camera.precision`)
           R (q c)     which cameras read a landmark in an expression, a row for each; each row needs v cameras, or as
                       many as read it at all
Problem    min f(x) = tr(G (sum_c x_c H_c + I / tau²)^-1)  over x in {0, 1},  sum x = n,  R x >= v
Relaxed    x in [0, 1]: f is convex, so that at any x   f(y) >= f(x) + g (y - x),   g_c = -tr(H_c C G C)
           and the least of the right side over the relaxed y bounds f from below; x goes on towards that y (Frank &
           Wolfe 1956), and the best bound of all steps is kept
Search     branch on the share nearest to a half; cameras whose reduced cost lifts the bound beyond the best choice are
           fixed; greedy choices and exchanges of one camera give the best choice. It ends proved to `GAP`, or in time
"""

from collections.abc import Sequence
from dataclasses import dataclass
from heapq import heappop, heappush
from time import monotonic
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int
from ortools.sat.python import cp_model
from scipy.optimize import linprog

from capture_plan.errors import InfeasibleError
from capture_plan.layout.observation import PRIOR_SD
from capture_plan.solver import solve

GAP, STEPS, SECONDS = 0.01, 60, 5.0  # of the error; of Frank & Wolfe in a node; of the search
SCALE = 10**6  # of linear costs in the program that finds a choice which keeps the rows
WORK = 3.0


class Chosen(NamedTuple):
    """Indices of cameras, the upper estimate of the error (mm) with them, and what no choice of as many is below."""

    at: tuple[int, ...]
    error_mm: float
    bound_mm: float

    @property
    def gap(self) -> float:
        """How much more than the bound, as a share."""
        return self.error_mm / self.bound_mm - 1


@dataclass(frozen=True, eq=False)
class CameraProblem:
    """H, G and the rows that have to be kept; `need[q]` cameras of row q at least."""

    H: Float[np.ndarray, "c k k"]
    G: Float[np.ndarray, "k k"]
    rows: Bool[np.ndarray, "q c"]
    need: Int[np.ndarray, " q"]

    @classmethod
    def of(
        cls,
        H: Float[np.ndarray, "c k k"],
        G: Float[np.ndarray, "k k"],
        reads: Bool[np.ndarray, "q c"],
        views: int,
    ) -> "CameraProblem":
        """The problem; rows that another one implies are left out."""
        rows = np.unique(reads, axis=0)
        need = np.minimum(rows.sum(axis=1), views)
        rows, need = rows[need > 0], need[need > 0]
        implied = np.zeros(len(rows), dtype=bool)
        for q, (row, least) in enumerate(zip(rows, need, strict=True)):
            inside = ~(rows & ~row).any(axis=1) & (need >= least) & ~implied
            inside[q] = False
            implied[q] = inside.any()
        return cls(H, G, rows[~implied], need[~implied])

    def error2(self, at: Sequence[int]) -> float:
        """f of a choice, square millimetres."""
        return float(np.sum(self.G * self._covariance(self.H[list(at)].sum(axis=0))))

    def _covariance(self, told: Float[np.ndarray, "k k"]) -> Float[np.ndarray, "k k"]:
        return np.linalg.inv(told + np.eye(len(self.G)) / PRIOR_SD**2)

    def look(self, x: Float[np.ndarray, " c"]) -> tuple[float, Float[np.ndarray, " c"]]:
        """f and its gradient at shares x."""
        C = self._covariance(np.tensordot(x, self.H, 1))
        M = C @ self.G @ C
        return float(np.sum(self.G * C)), -(self.H.reshape(len(self.H), -1) @ M.ravel())

    def keeps(self, at: Sequence[int]) -> bool:
        """Whether a choice keeps all rows."""
        return bool((self.rows[:, list(at)].sum(axis=1) >= self.need).all())


def choose(problem: CameraProblem, count: int, *, seconds: float = SECONDS) -> Chosen:
    """The best `count` cameras.

    Raises:
        InfeasibleError: no choice of as many keeps all rows.
    """
    n, c = min(count, len(problem.H)), len(problem.H)
    free = np.full(c, -1)  # 1 chosen, 0 left out
    root = relax(problem, n, free)
    if root is None:
        raise InfeasibleError(too_few(problem, n))
    best = improved(problem, first_choice(problem, n, root))
    known, end = problem.error2(best), monotonic() + seconds
    heap: list[tuple[float, int, Int[np.ndarray, " c"], Relaxed]] = [(root.bound, 0, free, root)]
    number, floor = 1, root.bound
    while heap:
        bound, _, fixed, here = heappop(heap)
        floor = bound
        if np.sqrt(known / max(bound, 1e-300)) - 1 <= GAP or monotonic() > end:
            break
        fixed = fixed_by_cost(fixed, here, n, known)
        share = np.where(fixed < 0, np.abs(here.x - 0.5), np.inf)
        if not np.isfinite(share).any():
            continue
        j = int(share.argmin())
        for side in (1, 0):
            branch = fixed.copy()
            branch[j] = side
            below = relax(problem, n, branch)
            if below is None or below.bound >= known:
                continue
            rounded = np.argsort(-below.x, kind="stable")[:n].tolist()
            if problem.keeps(rounded) and (found := problem.error2(rounded)) < known:
                best = improved(problem, tuple(rounded))
                known = min(problem.error2(best), found)
            heappush(heap, (max(below.bound, bound), number, branch, below))
            number += 1
    else:
        floor = known
    floor = min(floor, known)
    return Chosen(tuple(sorted(best)), float(np.sqrt(known)), float(np.sqrt(floor)))


class Relaxed(NamedTuple):
    """Shares of cameras, a bound of f, and the line that proves it: f(y) >= base + slope y."""

    x: Float[np.ndarray, " c"]
    bound: float
    base: float
    slope: Float[np.ndarray, " c"]


def relax(problem: CameraProblem, n: int, fixed: Int[np.ndarray, " c"]) -> Relaxed | None:
    """The relaxed problem where some cameras are chosen (1) or left out (0); None where rows or numbers forbid it."""
    start = least_of(problem, np.zeros(len(fixed)), n, fixed)
    if start is None:
        return None
    x, best = start, None
    for step in range(STEPS):
        f, g = problem.look(x)
        y = least_of(problem, g, n, fixed)
        if y is None:
            return None
        bound = f + float(g @ (y - x))
        if best is None or bound > best.bound:
            best = Relaxed(x, bound, f - float(g @ x), g)
        if f - bound < GAP / 4 * f:
            break
        x = x + _step(problem, x, y - x, f, float(g @ (y - x)), step) * (y - x)
    return best._replace(x=x) if best else None


def _step(problem: CameraProblem, x: np.ndarray, way: np.ndarray, f: float, slope: float, step: int) -> float:
    """How far to go: halved until the error falls enough (Armijo), 2 / (step + 2) where it never does."""
    t = 1.0
    for _ in range(6):
        if problem.look(x + t * way)[0] <= f + 0.3 * t * slope:
            return t
        t /= 2
    return 2 / (step + 2) / 8


def least_of(
    problem: CameraProblem, g: Float[np.ndarray, " c"], n: int, fixed: Int[np.ndarray, " c"]
) -> Float[np.ndarray, " c"] | None:
    """The relaxed y of least g y: the n cheapest cameras where these keep the rows, else by a linear program."""
    y = (fixed == 1).astype(float)
    left = n - int(y.sum())
    open_ = np.flatnonzero(fixed < 0)
    if left < 0 or left > len(open_):
        return None
    cheap = open_[np.argsort(g[open_], kind="stable")[:left]]
    y[cheap] = 1
    if (problem.rows @ y >= problem.need).all():
        return y
    bounds = np.stack([(fixed == 1).astype(float), (fixed != 0).astype(float)], axis=1)
    answer = linprog(
        g,
        A_ub=-problem.rows.astype(float),
        b_ub=-problem.need.astype(float),
        A_eq=np.ones((1, len(g))),
        b_eq=[n],
        bounds=bounds,
        method="highs",
    )
    return answer.x if answer.status == 0 else None


def fixed_by_cost(fixed: Int[np.ndarray, " c"], here: Relaxed, n: int, known: float) -> Int[np.ndarray, " c"]:
    """Cameras left out, or chosen, because the other way lies beyond the best choice: on the line of a node, without
    its rows, the n cheapest cameras cost least, and one more or less of them costs the difference to the next."""
    open_, left = np.flatnonzero(fixed < 0), n - int((fixed == 1).sum())
    order = open_[np.argsort(here.slope[open_], kind="stable")]
    cheap, dear = order[:left], order[left:]
    if not len(cheap) or not len(dear):
        return fixed
    least = here.base + float(here.slope[fixed == 1].sum() + here.slope[cheap].sum())
    out = fixed.copy()
    out[dear[least + here.slope[dear] - here.slope[cheap[-1]] > known]] = 0
    out[cheap[least + here.slope[dear[0]] - here.slope[cheap] > known]] = 1
    return out


def first_choice(problem: CameraProblem, n: int, root: Relaxed) -> tuple[int, ...]:
    """A choice that keeps the rows, near the relaxed one.

    Raises:
        InfeasibleError: there is none.
    """
    nearest = np.argsort(-root.x, kind="stable")[:n].tolist()
    if problem.keeps(nearest):
        return tuple(nearest)
    model = cp_model.CpModel()
    x = [model.new_bool_var("") for _ in problem.H]
    model.add(sum(x) == n)
    for row, need in zip(problem.rows, problem.need.tolist(), strict=True):
        model.add(sum(x[c] for c in np.flatnonzero(row)) >= need)
    model.minimize(sum(round(-SCALE * share) * one for share, one in zip(root.x.tolist(), x, strict=True)))
    solver, status = solve(model, work_limit=WORK)
    if status not in (cp_model.OPTIMAL, cp_model.FEASIBLE):
        raise InfeasibleError(too_few(problem, n))
    return tuple(c for c, one in enumerate(x) if solver.value(one))


def improved(problem: CameraProblem, at: tuple[int, ...]) -> tuple[int, ...]:
    """Exchanges of one camera for another as long as one lowers the error."""
    best, known = list(at), problem.error2(at)
    while True:
        told, found = problem.H[best].sum(axis=0), None
        others = np.setdiff1d(np.arange(len(problem.H)), best)
        for place in range(len(best)):
            without = told - problem.H[best[place]]
            C = np.linalg.inv(without + problem.H[others] + np.eye(len(problem.G)) / PRIOR_SD**2)
            errors = np.einsum("kl,clk->c", problem.G, C)
            for j in np.argsort(errors, kind="stable"):
                if errors[j] >= known * (1 - 1e-9):
                    break
                change = [*best[:place], int(others[j]), *best[place + 1 :]]
                if problem.keeps(change):
                    found, known = change, float(errors[j])
                    break
        if found is None:
            return tuple(best)
        best = found


def too_few(problem: CameraProblem, n: int) -> str:
    """Why no choice of n cameras will do."""
    most = int(problem.need.max(initial=0))
    return (
        f"no {n} of these {len(problem.H)} places read every landmark with {most} cameras in every expression: take "
        "more cameras, ask for fewer views, or give other places"
    )
