"""Does the search find what is there, and does a layout hold on frames it never saw: Le et al. 2013, 6.1 and 6.4.

Recovery   M markers at random, each displaced by uniform numbers in [-10, 10] mm per axis and frame; the shell follows;
           the optimiser sees the shell alone and has to find the markers
Folds      the frames in five contiguous parts; a layout from four is measured on the fifth
Descent    the published algorithm from random starts: its error after every step, its layout after every iteration
"""

import numpy as np
from jaxtyping import Int
from msgspec import Struct
from scipy.optimize import linear_sum_assignment
from scipy.spatial.distance import cdist

from capture_plan.errors import RigError
from capture_plan.evaluation.le2013.methods import METHODS, OURS, motion_error
from capture_plan.evaluation.le2013.published_algorithm import ITERATIONS, Descent, optimise_as_published
from capture_plan.shell.model import Shell
from capture_plan.shell.motion import Motion
from capture_plan.shell.optimise import MarkerProblem, optimise
from capture_plan.shell.take import Take

STARTS = 5  # Fig. 3
MOST_MM = 10.0  # Le et al. 2013, section 6.1
FRAMES = 40  # of a simulation, where the paper names no number: enough for 100 markers to move on their own
FOLDS = 5  # section 6.4
EXACT_TAIL_MM = 1e-6  # a simulated motion has no noise: an error below is that of rounding


class Recovery(Struct, frozen=True):
    """A simulated layout and what was found of it: RMSE, markers found to the vertex, and the mean distance, mm.

    `planted` and `found` are vertices of the shell.
    """

    markers: int
    seed: int
    rmse_mm: float
    hit: int
    apart_mm: float
    planted: tuple[int, ...]
    found: tuple[int, ...]


class Descents(Struct, frozen=True):
    """The published algorithm with M markers: RMSE (mm) before and after every step, one row for each start.

    `layouts` are the rig's vertices of the first start, before and after each iteration, which is M steps.
    """

    markers: int
    errors_mm: tuple[tuple[float, ...], ...]
    layouts: tuple[tuple[int, ...], ...]

    @property
    def by_iteration_mm(self) -> tuple[tuple[float, ...], ...]:
        """Errors after each whole round over all markers, millimetres, for each run."""
        return tuple(row[:: self.markers] for row in self.errors_mm)


class Folds(Struct, frozen=True):
    """RMSE of frames that the layout was not chosen from, millimetres, one for each part; and from its own frames."""

    method: str
    markers: int
    unseen_mm: tuple[float, ...]
    chosen_from_mm: tuple[float, ...]

    @property
    def mean_mm(self) -> float:
        """Mean error of the frames left out, millimetres."""
        return float(np.mean(self.unseen_mm))

    @property
    def sd_mm(self) -> float:
        """Standard deviation of the errors of the frames left out, millimetres."""
        return float(np.std(self.unseen_mm))


def simulation_recovery(shell: Shell, count: int, seed: int, *, joint: bool = False) -> Recovery:
    """One simulated layout of `count` markers, looked for; `joint` moves neighbours in twos where single moves miss."""
    planted, motion = simulated(shell, count, seed)
    found = optimise(MarkerProblem([(shell, motion)], ~shell.fixed, tail_mm=EXACT_TAIL_MM), count, joint=joint)
    return recovered(shell, planted, np.array(found.markers), found.rmse_mm, seed)


def recovery_as_published(shell: Shell, count: int, seed: int) -> Recovery:
    """One simulated layout of `count` markers, looked for by the paper's algorithm from ten starts."""
    planted, motion = simulated(shell, count, seed)
    found = optimise_as_published(shell, motion, count, candidates=~shell.fixed, tail_mm=EXACT_TAIL_MM)
    return recovered(shell, planted, np.array(found.markers), found.rmse_mm, seed)


def simulated(shell: Shell, count: int, seed: int) -> tuple[Int[np.ndarray, " m"], Motion]:
    """Markers anywhere on the shell and what it does when each moves on its own."""
    rng = np.random.default_rng(seed)
    planted = rng.choice(np.flatnonzero(~shell.fixed), count, replace=False)
    moved = rng.uniform(-MOST_MM, MOST_MM, (count, 3 * FRAMES))
    return planted, Motion(shell.weights(planted) @ moved / np.sqrt(FRAMES), np.ones(len(shell.fixed)))


def recovered(
    shell: Shell, planted: Int[np.ndarray, " m"], found: Int[np.ndarray, " m"], rmse_mm: float, seed: int
) -> Recovery:
    """How far what was found is from what was planted, each marker beside its own."""
    apart = cdist(shell.vertices[found], shell.vertices[planted])
    return Recovery(
        markers=len(planted),
        seed=seed,
        rmse_mm=rmse_mm,
        hit=len(np.intersect1d(found, planted)),
        apart_mm=float(apart[linear_sum_assignment(apart)].mean()),
        planted=tuple(planted.tolist()),
        found=tuple(found.tolist()),
    )


def descents(take: Take, count: int, *, starts: int = STARTS) -> Descents:
    """The paper's algorithm from random starts on (Le et al. 2013, Fig. 3)."""
    runs = [one_descent(take, count, seed) for seed in range(starts)]
    return Descents(count, tuple(errors for errors, _ in runs), runs[0][1])


def one_descent(take: Take, count: int, seed: int) -> tuple[tuple[float, ...], tuple[tuple[int, ...], ...]]:
    """The error before and after every step, millimetres, and the rig's vertices before and after every iteration."""
    may, motion, rng = np.flatnonzero(take.candidates), take.motion.compressed(), np.random.default_rng(seed)
    descent = Descent(take.shell, motion, rng.choice(may, count, replace=False))
    errors, layouts = [descent.error], [tuple(take.at[descent.markers].tolist())]
    for _ in range(ITERATIONS):
        errors += one_iteration(descent, may, rng)
        layouts.append(tuple(take.at[descent.markers].tolist()))
    return tuple(np.sqrt(np.array(errors) / motion.weights.sum()).tolist()), tuple(layouts)


def one_iteration(descent: Descent, may: Int[np.ndarray, " n"], rng: np.random.Generator) -> list[float]:
    """Every marker once to the vertex of its expected trajectory, or to a free one at random where another stands.

    The squared error after each; where nothing moves it stays as it is.
    """
    errors = []
    for j in range(len(descent.markers)):
        v = descent.nearest(j, may)
        if v != descent.markers[j]:
            taken = v in descent.markers
            descent.move(j, int(rng.choice(np.setdiff1d(may, descent.markers))) if taken else v)
        errors.append(descent.error)
    descent.refresh()
    return errors


def five_fold(take: Take, count: int, *, method: str = OURS) -> Folds:
    """The layouts of one method from four fifths of a take, each on the last fifth; of several draws the mean."""
    parts = np.array_split(np.arange(len(take.sequence)), FOLDS)
    if not all(len(part) for part in parts):
        raise RigError(f"{take.sequence.name} has {len(take.sequence)} frames: {FOLDS} parts need at least {FOLDS}")
    unseen, seen = [], []
    for n, part in enumerate(parts):
        training = take.over(np.concatenate([other for i, other in enumerate(parts) if i != n]))
        test, layouts = take.over(part), METHODS[method](take, training, count)
        unseen.append(float(np.mean([motion_error(take.shell, test, H) for H in layouts])))
        seen.append(float(np.mean([motion_error(take.shell, training, H) for H in layouts])))
    return Folds(method, count, tuple(unseen), tuple(seen))
