"""The algorithm of Le et al. 2013, as published, for comparison: block coordinate descent over trajectories.

Data      shell, motion Y, s; M random vertices H; R = Y - W Y_H
Marker j  1. R_j = R + W_j Y_j',  expected trajectory  h = R_j' S W_j / (W_j' S W_j)      (eq. 12, which is transposed
             in print)
          2. the vertex whose trajectory is nearest to h; a random free one where another marker stands there
          3. W of the new layout
Stop      no marker changed in an iteration, or 10 iterations; 10 starts. The error can go up: the best layout of all
          that were visited is kept.

The weights come from columns of G, not from factors that are updated: the layouts are the same, minutes instead of
hours. What a factorisation for each move costs is timed by `paper_move_seconds`.
"""

import time
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Int
from scipy.sparse import csc_array
from scipy.sparse.linalg import splu

from capture_plan.progress import track
from capture_plan.shell.model import Shell
from capture_plan.shell.motion import TAIL_MM, Motion

STARTS, ITERATIONS = 10, 10  # Le et al. 2013, section 5


@dataclass(frozen=True)
class PaperResult:
    """`rmse_mm` is over all that was given; `moves` of a marker in all starts, of which `uphill` made it worse."""

    markers: tuple[int, ...]
    rmse_mm: float
    moves: int
    uphill: int


class Descent:
    """K, B and R of a layout whose markers go wherever the nearest trajectory is."""

    def __init__(self, shell: Shell, motion: Motion, markers: Int[np.ndarray, " m"]) -> None:
        self.shell, self.motion, self.markers = shell, motion, markers.copy()
        self.norms = np.einsum("vr,vr->v", motion.rows, motion.rows)
        self.refresh()

    def refresh(self) -> None:
        """Compute the rows of all markers from scratch."""
        KC, self.B = self.shell.bordered(self.markers)
        self.KC = np.asfortranarray(KC)
        Y_H = self.motion.rows[self.markers]
        self.R = self.motion.rows - self.KC @ (self.B[:, : len(Y_H)] @ Y_H)

    @property
    def error(self) -> float:
        """The squared error E of the layout, mm^2."""
        return float(np.einsum("vr,vr,v->", self.R, self.R, self.motion.weights))

    def nearest(self, j: int, candidates: Int[np.ndarray, " n"]) -> int:
        """Steps 1 and 2: the vertex nearest to the expected trajectory of marker number j, occupied or not."""
        w, Y = self.KC @ self.B[:, j], self.motion.rows
        sw = self.motion.weights * w
        h = (sw @ self.R + (sw @ w) * Y[self.markers[j]]) / (sw @ w)
        return int(candidates[(self.norms - 2 * Y @ h)[candidates].argmin()])

    def move(self, j: int, v: int) -> None:
        """Step 3: drop and add, as `State` does it, of R alone."""
        Y = self.motion.rows
        m, w, q = len(self.markers), self.KC @ self.B[:, j], self.B[j, j]
        rho = self.B[j, :m] @ Y[self.markers] / q
        b = self.B - np.outer(self.B[j], self.B[j]) / q
        column = self.shell.columns(np.array([v]))[:, 0]
        # g = G_H[:, v] without marker j, whose row and column of b are 0
        g = column - self.KC @ (b @ self.KC[v])
        r = self.R[v] + w[v] * rho
        self.R += np.stack([w, -g / g[v]], axis=1) @ np.stack([rho, r])
        self.markers[j], self.KC[:, j] = v, column
        self.B = self.shell.inverted(self.markers, self.KC)


def optimise_as_published(
    shell: Shell,
    motion: Motion,
    count: int,
    *,
    candidates: Bool[np.ndarray, " v"],
    seed: int = 0,
    starts: int = STARTS,
    tail_mm: float = TAIL_MM,
) -> PaperResult:
    """The best layout of some random starts."""
    rng, small, may = np.random.default_rng(seed), motion.compressed(tail_mm), np.flatnonzero(candidates)
    best, least, moves, uphill = may[:count], np.inf, 0, 0
    for _ in track(range(starts), "Descents as published"):
        descent = Descent(shell, small, rng.choice(may, count, replace=False))
        before = descent.error
        for markers, E in visited(descent, may, rng):
            moves, uphill, before = moves + 1, uphill + (before < E), E
            if least > E:
                best, least = markers, E
    return PaperResult(tuple(best.tolist()), motion.rmse_mm(shell.weights(best), best), moves, uphill)


def visited(
    descent: Descent, may: Int[np.ndarray, " n"], rng: np.random.Generator
) -> Iterator[tuple[Int[np.ndarray, " m"], float]]:
    """The layouts of one descent, after each move, and their errors."""
    for _ in range(ITERATIONS):
        moved = False
        for j in range(len(descent.markers)):
            v = descent.nearest(j, may)
            if v == descent.markers[j]:
                continue
            if v in descent.markers:
                v = int(rng.choice(np.setdiff1d(may, descent.markers)))
            descent.move(j, v)
            moved = True
            yield descent.markers.copy(), descent.error
        if not moved:
            return
        descent.refresh()


def paper_move_seconds(shell: Shell, markers: Int[np.ndarray, " m"], *, times: int = 1) -> float:
    """Processor seconds of W from a factorisation of A with its markers' rows taken out, as each move needs it."""
    rest = np.setdiff1d(np.flatnonzero(~shell.fixed), markers)
    A = shell.stiffness
    start = time.process_time()
    for _ in range(times):
        right = A[rest][:, markers].toarray()
        solver = splu(
            csc_array(A[rest][:, rest]),
            permc_spec="MMD_AT_PLUS_A",
            diag_pivot_thresh=0,
            options={"SymmetricMode": True},
        )
        for j in range(len(markers)):
            solver.solve(-right[:, j])
    return (time.process_time() - start) / times
