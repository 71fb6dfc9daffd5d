"""The published algorithm, against its own formulas and against ours."""

import numpy as np
import pytest

from capture_plan.evaluation.le2013.published_algorithm import (
    Descent,
    optimise_as_published,
    paper_move_seconds,
    visited,
)
from capture_plan.shell import MarkerProblem, optimise
from capture_plan.shell.elimination_order import order_of, summary_of
from tests.shell.test_shell_model import some_markers
from tests.shell.test_shell_optimise import smooth_motion
from tests.shell.test_shell_state import SHELLS, shell_of


@pytest.fixture(params=SHELLS)
def shell(request):
    return SHELLS[request.param]()


def test_the_expected_trajectory_is_the_least_squares_one(shell):
    H, motion = some_markers(shell, 6), smooth_motion(shell)
    motion = motion.weighted(np.random.default_rng(0).uniform(0.5, 2, len(motion.rows)))
    descent, W, Y = Descent(shell, motion, H), shell.weights(H), motion.rows
    for j in range(len(H)):
        others = np.delete(np.arange(len(H)), j)
        R_j, root = Y - W[:, others] @ Y[H[others]], np.sqrt(motion.weights)
        h = np.linalg.lstsq((root * W[:, j])[:, None], root[:, None] * R_j, rcond=None)[0][0]
        may = np.flatnonzero(~shell.fixed)
        nearest = may[np.square(Y[may] - h).sum(axis=1).argmin()]
        assert descent.nearest(j, may) == nearest


def test_a_move_gives_what_the_new_weights_miss(shell):
    H, motion = some_markers(shell, 6), smooth_motion(shell)
    descent = Descent(shell, motion, H)
    free = np.setdiff1d(np.flatnonzero(~shell.fixed), H)
    to = int(free[shell.piece[free] == shell.piece[H[2]]][7])
    descent.move(2, to)
    moved = H.copy()
    moved[2] = to
    R = motion.rows - shell.weights(moved) @ motion.rows[moved]
    assert np.allclose(descent.R, R, atol=1e-9 * abs(motion.rows).max())


def test_the_best_of_all_layouts_that_were_visited_is_kept():
    """And the moves among them that made things worse are counted."""
    shell, rng = shell_of(True), np.random.default_rng(3)
    motion, may = smooth_motion(shell, 20), np.flatnonzero(~shell.fixed)
    published = optimise_as_published(shell, motion, 6, candidates=~shell.fixed, seed=3, starts=2, tail_mm=0.0)
    layouts, moves, uphill = [], 0, 0
    for _ in range(2):
        start = rng.choice(may, 6, replace=False)
        path = [start, *(markers for markers, _ in visited(Descent(shell, motion.compressed(0.0), start), may, rng))]
        errors = [motion.rmse_mm(shell.weights(H), H) for H in path]
        layouts += errors[1:]
        moves, uphill = moves + len(path) - 1, uphill + int((np.diff(errors) > 0).sum())
    assert published.rmse_mm == pytest.approx(min(layouts), rel=1e-9)
    assert (published.moves, published.uphill) == (moves, uphill)
    assert 0 < uphill < moves


@pytest.mark.parametrize("seed", range(4))
def test_no_two_markers_ever_share_a_vertex(seed):
    """Where another one stands already, as where one movement is all there is, a free vertex is drawn."""
    shell, rng = shell_of(True), np.random.default_rng(seed)
    may = rng.choice(np.flatnonzero(~shell.fixed), 12, replace=False)
    descent = Descent(shell, smooth_motion(shell, 1, seed), may[:9])
    layouts = [markers for markers, _ in visited(descent, may, rng)]
    assert len(layouts) > 10
    assert all(len(set(H.tolist())) == 9 and set(H.tolist()) <= set(may.tolist()) for H in layouts)


def test_exact_moves_end_below_the_published_algorithm():
    shell = shell_of(True)
    motion = smooth_motion(shell, 30)
    published = optimise_as_published(shell, motion, 8, candidates=~shell.fixed, tail_mm=0.0)
    assert (
        optimise(MarkerProblem([(shell, motion)], candidates=~shell.fixed, tail_mm=0.0), 8).rmse_mm < published.rmse_mm
    )


def test_a_factorisation_for_each_move_takes_time():
    shell = shell_of(True)
    assert paper_move_seconds(shell, np.array([10, 20]), times=2) > 0


def test_sparing_by_the_small_matrices_is_sparing_by_the_weights(shell):
    motion, H = smooth_motion(shell), some_markers(shell, 9)
    order, errors = order_of([summary_of(shell, motion, H)], np.zeros(len(H), dtype=bool))
    for m in range(4, len(H) + 1):
        first = H[order[:m]]
        assert errors[m - 1] == pytest.approx(motion.squared_error(shell.weights(first), first), rel=1e-9)
