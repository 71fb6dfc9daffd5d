"""Does a layout hold beyond what it was chosen from: Le et al. 2013, sections 6.1, 6.2 and 6.4.

Recovery   M markers at random, each displaced by uniform numbers in [-10, 10] mm per axis and frame; the shell follows;
           the optimiser sees the shell alone and has to find the markers
Left out   subjects d = 1..D on meshes of their own; map_d, a vertex of d for each of the first; a layout from all
           others, on the first's vertices, is put onto d by map_d and measured there
Folds      the frames in five contiguous parts; a layout from four is measured on the fifth
Each layout from several subjects bends the first's shell while it is chosen, with the motions carried there by map_d:
the paper solves each subject's own weights.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from msgspec import Struct
from scipy.optimize import linear_sum_assignment
from scipy.spatial import KDTree
from scipy.spatial.distance import cdist

from capture_plan.errors import RigError
from capture_plan.layout.correspond import correspond
from capture_plan.layout.shell.evaluate import METHODS, OURS, motion_error
from capture_plan.layout.shell.model import Shell
from capture_plan.layout.shell.motion import Motion, together
from capture_plan.layout.shell.optimise import optimise
from capture_plan.layout.shell.paper import ITERATIONS, Descent
from capture_plan.layout.shell.take import Take

STARTS = 5  # Fig. 3
MOST_MM = 10.0  # Le et al. 2013, section 6.1
FRAMES = 40  # of a simulation, where the paper names no number: enough for 100 markers to move on their own
FOLDS = 5  # section 6.4
EXACT_TAIL_MM = 1e-6  # a simulated motion has no noise: an error below is that of rounding


class Recovery(Struct, frozen=True):
    """A simulated layout and what was found of it: RMSE, markers found to the vertex, and the mean distance, mm."""

    markers: int
    seed: int
    rmse_mm: float
    hit: int
    apart_mm: float


class LeftOut(Struct, frozen=True):
    """A subject rebuilt from a layout of the others, and from one of its own; millimetres."""

    subject: str
    markers: int
    others_mm: float
    own_mm: float


class Folds(Struct, frozen=True):
    """RMSE of frames that the layout was not chosen from, millimetres, one for each part; and from its own frames."""

    method: str
    markers: int
    unseen_mm: tuple[float, ...]
    chosen_from_mm: tuple[float, ...]

    @property
    def mean_mm(self) -> float:
        return float(np.mean(self.unseen_mm))

    @property
    def sd_mm(self) -> float:
        return float(np.std(self.unseen_mm))


@dataclass(frozen=True, eq=False)
class OnFirst:
    """A subject's take, and its vertex for each of the first subject's."""

    take: Take
    map: Int[np.ndarray, " v"]


def on_first(first: Take, other: Take) -> OnFirst:
    """A subject on a mesh of its own: the first's head laid onto it, each vertex to the nearest of the subject's shell.

    Raises:
        RigError: the two heads cannot be laid onto each other.
    """
    at, places = correspond(first.rig, other.rig).head
    tree, laid = KDTree(other.shell.vertices), KDTree(first.rig.neutral[at])
    # skin that is no part of the laid surface goes where the nearest that is goes
    there = places[laid.query(first.shell.vertices)[1]]
    return OnFirst(other, np.asarray(tree.query(there)[1]))


def simulation_recovery(shell: Shell, count: int, seed: int, *, joint: bool = False) -> Recovery:
    """One simulated layout of `count` markers, looked for; `joint` moves neighbours in twos where single moves miss."""
    rng, free = np.random.default_rng(seed), ~shell.fixed
    truth = rng.choice(np.flatnonzero(free), count, replace=False)
    moved = rng.uniform(-MOST_MM, MOST_MM, (count, 3 * FRAMES))
    motion = Motion(shell.weights(truth) @ moved / np.sqrt(FRAMES), np.ones(len(free)))
    found = optimise(shell, motion, count, candidates=free, tail_mm=EXACT_TAIL_MM)
    if joint and found.rmse_mm > EXACT_TAIL_MM:
        found = optimise(shell, motion, count, candidates=free, joint=True, tail_mm=EXACT_TAIL_MM)
    H = np.array(found.markers)
    apart = cdist(shell.vertices[H], shell.vertices[truth])
    return Recovery(
        markers=count,
        seed=seed,
        rmse_mm=found.rmse_mm,
        hit=len(np.intersect1d(H, truth)),
        apart_mm=float(apart[linear_sum_assignment(apart)].mean()),
    )


def descents(take: Take, count: int, *, starts: int = STARTS) -> Float[np.ndarray, "s i"]:
    """RMSE (mm) of the paper's algorithm after each iteration, from random starts on (Le et al. 2013, Fig. 3).

    It stays where it is when an iteration moved nothing.
    """
    may, motion = np.flatnonzero(take.candidates), take.motion.compressed()
    curves = np.empty((starts, ITERATIONS + 1))
    for n in range(starts):
        rng = np.random.default_rng(n)
        descent = Descent(take.shell, motion, rng.choice(may, count, replace=False))
        curves[n, 0] = descent.error
        for i in range(ITERATIONS):
            one_iteration(descent, may, rng)
            curves[n, i + 1] = descent.error
    return np.sqrt(curves / motion.weights.sum())


def one_iteration(descent: Descent, may: Int[np.ndarray, " n"], rng: np.random.Generator) -> None:
    """Every marker once to the vertex of its expected trajectory, or to a free one at random where another stands."""
    for j in range(len(descent.markers)):
        v = descent.nearest(j, may)
        if v != descent.markers[j]:
            taken = v in descent.markers
            descent.move(j, int(rng.choice(np.setdiff1d(may, descent.markers))) if taken else v)
    descent.refresh()


def leave_one_out(subjects: Sequence[OnFirst], count: int) -> tuple[LeftOut, ...]:
    """Every subject once."""
    if len(subjects) < 2:
        raise RigError(f"{len(subjects)} subjects: give at least two to leave one out")
    return tuple(_left_out(subjects, d, count) for d in range(len(subjects)))


def _left_out(subjects: Sequence[OnFirst], d: int, count: int) -> LeftOut:
    first, tested = subjects[0].take, subjects[d].take
    training = together([one.take.motion.at(one.map) for n, one in enumerate(subjects) if n != d])
    there = subjects[d].map
    # a vertex of the tested subject stands for one marker only, and none on its rim
    once = np.zeros(len(there), dtype=bool)
    once[np.unique(there, return_index=True)[1]] = True
    may = first.candidates & once & tested.candidates[there]
    H = np.array(optimise(first.shell, training, count, candidates=may).markers)
    own = optimise(tested.shell, tested.motion, count, candidates=tested.candidates)
    return LeftOut(tested.rig.name, count, motion_error(tested.shell, tested.motion, there[H]), own.rmse_mm)


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
