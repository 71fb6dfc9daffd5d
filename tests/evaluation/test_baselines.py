"""Other people's layouts: as many vertices as asked for, allowed ones, the same every time."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import qr
from scipy.sparse import eye_array

from capture_plan.errors import InfeasibleError
from capture_plan.evaluation.baselines import BASELINES, GROUND, OMEGA, choose_baseline, nearest_to_centres
from capture_plan.layout.farthest import Candidates
from capture_plan.layout.pivoted_qr import Pivots
from capture_plan.registration.nonrigid_icp import graph_stiffness

SIDE = 9
RNG = np.random.default_rng(11)


def sheet():
    """A flat sheet of 81 vertices, 10 mm apart, whose border stays out; four blendshapes are smooth bumps."""
    x, y = np.meshgrid(np.arange(SIDE), np.arange(SIDE))
    neutral = np.stack([x.ravel(), y.ravel(), 0 * x.ravel()], axis=1) * 10.0
    corner = np.array([i * SIDE + j for i in range(SIDE - 1) for j in range(SIDE - 1)])
    triangles = np.concatenate(
        [np.stack([corner, corner + 1, corner + SIDE], 1), np.stack([corner + 1, corner + SIDE + 1, corner + SIDE], 1)]
    )
    inner = np.flatnonzero(((x % (SIDE - 1) > 0) & (y % (SIDE - 1) > 0)).ravel())
    centres = np.array([[20, 20], [60, 20], [20, 60], [60, 60]])
    fall = np.exp(-((neutral[None, :, :2] - centres[:, None]) ** 2).sum(axis=2) / 300)
    deltas = fall[:, :, None] * RNG.normal(size=(4, 1, 3))
    return Candidates(inner, deltas.astype(np.float32), neutral, triangles)


SHEET = sheet()


@pytest.mark.parametrize("name", BASELINES)
@given(count=st.integers(1, 49), seed=st.integers(0, 3))
@settings(max_examples=6, deadline=None)
def test_a_baseline_gives_that_many_different_allowed_vertices_again_and_again(name, count, seed):
    chosen = choose_baseline(name, SHEET, count, seed)
    assert len(set(chosen.tolist())) == count
    assert np.isin(chosen, SHEET.vertices).all()
    assert np.array_equal(chosen, choose_baseline(name, SHEET, count, seed))


@pytest.mark.parametrize("name", BASELINES)
def test_more_landmarks_than_candidates_are_refused(name):
    with pytest.raises(InfeasibleError, match="50 landmarks asked for, 49 vertices"):
        choose_baseline(name, SHEET, 50, 0)


@pytest.mark.parametrize(
    "name",
    [
        "random",
        "farthest point",
        "QR pivot",
        "SCO04 (surface error)",
        "LS-meshes (neutral)",
        "MSLS-meshes (our reading)",
    ],
)
def test_a_larger_budget_keeps_what_a_smaller_one_chose(name):
    assert np.array_equal(choose_baseline(name, SHEET, 12, 1)[:5], choose_baseline(name, SHEET, 5, 1))


def test_clusters_are_found_where_rows_are_clusters():
    rows = np.repeat(np.eye(4) * 10, 6, axis=0) + 0.1 * RNG.normal(size=(24, 4))
    assert sorted(nearest_to_centres(rows, 4, 0) // 6) == [0, 1, 2, 3]


def test_equal_rows_still_give_enough_vertices():
    assert len(set(nearest_to_centres(np.ones((9, 3)), 5, 0).tolist())) == 5


def test_farthest_points_lie_further_apart_than_random_ones():
    def nearest(name):
        p = SHEET.neutral[choose_baseline(name, SHEET, 6, 0)]
        return np.sort(np.linalg.norm(p[:, None] - p[None], axis=2), axis=1)[:, 1].min()

    assert nearest("farthest point") > nearest("random")


def test_qr_answers_to_every_mix_with_as_few_landmarks_as_there_can_be():
    chosen = choose_baseline("QR pivot", SHEET, 2, 0)
    assert np.linalg.matrix_rank(SHEET.rows_at(chosen).reshape(2, 4, 3).transpose(0, 2, 1).reshape(6, 4)) >= 2
    four = choose_baseline("QR pivot", SHEET, 4, 0)
    assert np.linalg.matrix_rank(SHEET.rows_at(four).reshape(4, 4, 3).transpose(0, 2, 1).reshape(12, 4)) == 4


def test_the_next_least_squares_mesh_landmark_is_where_a_solve_from_scratch_is_most_wrong():
    chosen = choose_baseline("SCO04 (surface error)", SHEET, 7, 0)
    v = len(SHEET.neutral)
    A = (graph_stiffness(SHEET.skin_triangles, v) + GROUND * eye_array(v)).toarray()
    X = SHEET.rows_at(np.arange(v))
    for m in range(1, 7):
        held, free = chosen[:m], np.setdiff1d(np.arange(v), chosen[:m])
        x = X.copy()
        x[free] = np.linalg.solve(A[np.ix_(free, free)], -A[np.ix_(free, held)] @ X[held])
        wrong = np.square(X - x).sum(axis=1)[SHEET.vertices]
        assert SHEET.vertices[wrong.argmax()] == chosen[m]


def test_the_next_qr_pivot_is_the_largest_once_the_first_ones_rows_are_projected_out():
    first, second = choose_baseline("QR pivot", SHEET, 2, 0)
    blocks = SHEET.rows.reshape(len(SHEET.vertices), 4, 3)
    Q = np.linalg.svd(blocks[SHEET.vertices == first][0], full_matrices=False)
    basis = Q[0][:, Q[1] > 1e-4 * Q[1][0]]
    left = blocks - basis @ (basis.T @ blocks)
    assert SHEET.vertices[np.square(left).sum(axis=(1, 2)).argmax()] == second


def test_the_next_landmark_of_a_soft_mesh_is_where_the_normal_equations_are_most_wrong():
    chosen = choose_baseline("LS-meshes (neutral)", SHEET, 7, 0)
    v = len(SHEET.neutral)
    A = (graph_stiffness(SHEET.skin_triangles, v) + GROUND * eye_array(v)).toarray()
    X = SHEET.neutral - SHEET.neutral.mean(axis=0)
    for m in range(7):
        W = np.zeros((v, v))
        W[chosen[:m], chosen[:m]] = OMEGA**2
        wrong = np.square(X - np.linalg.solve(A + W, W @ X)).sum(axis=1)[SHEET.vertices]
        assert wrong[SHEET.vertices == chosen[m]] == pytest.approx(wrong.max())


def test_what_moves_nothing_but_the_shape_changes_no_mesh_of_the_neutral():
    other = replace(SHEET, deltas=SHEET.deltas[::-1] * 3)
    name = "LS-meshes (neutral)"
    assert np.array_equal(choose_baseline(name, SHEET, 9, 0), choose_baseline(name, other, 9, 0))


def test_teleconnected_landmarks_stand_one_in_each_bump_first():
    chosen = choose_baseline("MSLS-meshes (our reading)", SHEET, 4, 0)
    centres = np.array([[20, 20], [60, 20], [20, 60], [60, 60]])
    nearest = np.linalg.norm(SHEET.neutral[chosen, None, :2] - centres, axis=2).argmin(axis=1)
    assert len(set(nearest)) >= 3


@pytest.mark.parametrize("seed", range(5))
def test_with_one_row_a_sensor_pivots_are_those_of_the_textbook(seed):
    X = np.random.default_rng(seed).normal(size=(30, 8))  # 30 sensors, 8 modes
    pivots, chosen = Pivots(X[:, None, :]), []
    for _ in range(8):
        chosen.append(pivots.take(np.setdiff1d(np.arange(30), chosen), np.ones(30, dtype=int)))
    assert chosen == qr(X.T, pivoting=True, mode="r")[-1][:8].tolist()
