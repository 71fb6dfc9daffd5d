"""Weights from noisy landmarks: the exact minimiser, the truth without noise, and honest scores."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.optimize import lsq_linear

from capture_plan.curves.random_mixes import random_mixes
from capture_plan.layout.box_least_squares import HALVINGS, _lower, solve_bounded
from capture_plan.layout.observation import PRIOR_SD, Observation
from capture_plan.layout.weight_recovery import (
    measurement_noise,
    reconstruct,
    recover_unbounded,
    recover_weights,
    single_blendshapes,
)

K, V = 7, 30
DELTAS = np.random.default_rng(3).normal(size=(K, V, 3)).astype(np.float32)
NAMES = tuple(f"shape{k}" for k in range(K))
SPREAD = np.arange(0, V, 3)


@pytest.fixture
def observation():
    return Observation(DELTAS, np.ones(V, dtype=bool), noise_mm=0.2)


@given(
    seed=st.integers(0, 10_000), rows=st.integers(2, 14), k=st.integers(1, 12), noise=st.sampled_from([0.05, 0.2, 1.0])
)
@settings(max_examples=40, deadline=None)
def test_the_weights_are_those_of_the_reference_solver(seed, rows, k, noise):
    rng = np.random.default_rng(seed)
    B = rng.normal(size=(rows, k)) * rng.uniform(0.1, 5, size=k)
    y = rng.normal(size=(4, rows)) * 3
    regularised = np.vstack([B, np.eye(k) * noise / PRIOR_SD])
    for found, one in zip(recover_weights(B, y, noise_mm=noise), y, strict=True):
        expected = lsq_linear(regularised, np.r_[one, np.zeros(k)], (0, 1), method="bvls", tol=1e-14).x
        assert found == pytest.approx(expected, abs=1e-6)


@given(seed=st.integers(0, 10_000))
@settings(max_examples=30, deadline=None)
def test_a_step_is_halved_until_it_lowers_the_objective_and_no_further(seed):
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(5, 5))
    H, g, w = root @ root.T + 0.1 * np.eye(5), rng.normal(size=(6, 5)), rng.uniform(size=(6, 5))
    y = w @ H - g
    steps = -y * rng.uniform(0.1, 50, (6, 1))  # downhill, and mostly too far
    for w_t, y_t, p, d in zip(w, y, steps, _lower(H, w, y, steps), strict=True):
        shorter = [np.clip(w_t + p * 0.5**halving, 0, 1) - w_t for halving in range(HALVINGS)]
        assert d == pytest.approx(next(step for step in shorter if step @ y_t + step @ H @ step / 2 < 0))


@given(seed=st.integers(0, 10_000))
@settings(max_examples=30, deadline=None)
def test_no_weight_can_move_to_a_better_place_inside_its_bounds(seed):
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(9, 9))
    H, g = root @ root.T + 0.01 * np.eye(9), 5 * rng.normal(size=(6, 9))
    w = solve_bounded(H, g)
    assert w.min() >= 0
    assert w.max() <= 1
    slope = w @ H - g
    assert np.abs(slope[(w > 0) & (w < 1)]).max(initial=0) < 1e-6
    assert slope[w == 0].min(initial=0) > -1e-6
    assert slope[w == 1].max(initial=0) < 1e-6


@given(seed=st.integers(0, 10_000))
@example(seed=202)  # a step that changes little is not the last
@settings(max_examples=20, deadline=None)
def test_frames_that_creep_are_solved_alone_to_the_same_answer(seed):
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(9, 4))  # few landmarks: most mixes in doubt
    H, g = root @ root.T + 1e-4 * np.eye(9), 5 * rng.normal(size=(6, 9))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("capture_plan.layout.box_least_squares.MOST_STEPS", 1)
        alone = solve_bounded(H, g)
    together = solve_bounded(H, g)

    def cost(w):
        return np.sum(w * (w @ H / 2 - g), axis=1)

    np.testing.assert_allclose(cost(alone), cost(together), rtol=1e-9, atol=1e-9)


def test_one_weight_is_the_quotient_held_in_its_bounds():
    H, g = np.array([[2.0]]), np.array([[-1.0], [1.0], [3.0]])
    assert solve_bounded(H, g)[:, 0] == pytest.approx([0, 0.5, 1])


def test_many_frames_answer_like_one_at_a_time(observation):
    B = observation.response(SPREAD)
    y = random_mixes(K, frames=50, seed=2) @ B.T + 0.5 * measurement_noise(SPREAD, frames=50, seed=2)
    together = recover_weights(B, y, noise_mm=0.5)
    alone = np.concatenate([recover_weights(B, one[None], noise_mm=0.5) for one in y])
    assert together == pytest.approx(alone, abs=1e-7)


def test_the_truth_comes_back_without_noise_where_the_rank_is_full(observation):
    for truth in (single_blendshapes(K), random_mixes(K, frames=20, seed=1)):
        score = reconstruct(observation, NAMES, SPREAD, truth, noise_mm=0.0, seed=0)
        assert score.weight_mae < 1e-5
        assert score.max_mm < 1e-3


def test_with_less_than_full_rank_the_truth_is_lost_even_without_noise(observation):
    truth = random_mixes(K, frames=20, seed=1)
    assert reconstruct(observation, NAMES, SPREAD[:2], truth, noise_mm=0.0, seed=0).rmse_mm > 0.01


def test_more_noise_is_never_better(observation):
    truth = random_mixes(K, frames=200, seed=4)
    scores = [reconstruct(observation, NAMES, SPREAD, truth, noise_mm=n, seed=0) for n in (0.0, 0.1, 0.2, 0.5, 1.0)]
    assert (np.diff([score.rmse_mm for score in scores]) > 0).all()
    assert (np.diff([score.weight_mae for score in scores]) > 0).all()


def test_the_error_of_the_skin_is_the_posed_difference(observation):
    truth = random_mixes(K, frames=30, seed=6)
    score = reconstruct(observation, NAMES, SPREAD, truth, noise_mm=0.5, seed=9)
    B = observation.response(SPREAD)
    y = truth @ B.T + 0.5 * measurement_noise(SPREAD, frames=30, seed=9)
    off = np.einsum("tk,kvx->tvx", recover_weights(B, y, noise_mm=0.5) - truth, DELTAS)
    distance = np.linalg.norm(off, axis=2)
    assert score.rmse_mm == pytest.approx(np.sqrt((distance**2).mean()), abs=1e-4)
    assert score.max_mm == pytest.approx(distance.max(), abs=1e-3)


def test_the_worst_blendshape_is_the_one_nobody_sees():
    deltas = DELTAS.copy()
    deltas[4, SPREAD] = 0
    blind = Observation(deltas, np.ones(V, dtype=bool), 0.2)
    score = reconstruct(blind, NAMES, SPREAD, single_blendshapes(K), noise_mm=0.1, seed=0)
    assert score.worst == "shape4"


def test_a_vertex_is_measured_equally_wrong_in_every_layout():
    both, one = (measurement_noise(np.array(v), frames=5, seed=1) for v in ([4, 9], [9]))
    assert np.array_equal(both[:, 3:], one)


def test_mixes_have_three_to_eight_blendshapes_and_repeat_with_their_seed():
    mixes = random_mixes(20, frames=100, seed=5)
    active = (mixes > 0).sum(axis=1)
    assert (active.min(), active.max()) == (3, 8)
    assert np.array_equal(mixes, random_mixes(20, frames=100, seed=5))


@given(seed=st.integers(0, 10_000), rows=st.integers(2, 14), k=st.integers(1, 12))
@settings(max_examples=30, deadline=None)
def test_without_bounds_the_weights_are_those_of_regularised_least_squares(seed, rows, k):
    rng = np.random.default_rng(seed)
    B, y = rng.normal(size=(rows, k)), 3 * rng.normal(size=(4, rows))
    regularised = np.vstack([B, np.eye(k) * 0.3 / PRIOR_SD])
    expected = np.linalg.lstsq(regularised, np.vstack([y.T, np.zeros((k, 4))]), rcond=None)[0].T
    assert recover_unbounded(B, y, noise_mm=0.3) == pytest.approx(expected, abs=1e-9)


def test_bounds_help_where_weights_are_between_them(observation):
    score = reconstruct(observation, NAMES, SPREAD[:4], random_mixes(K, frames=300, seed=4), noise_mm=1.0, seed=0)
    assert score.rmse_mm < score.unbounded.rmse_mm
    assert score.weight_mae < score.unbounded.weight_mae


def test_where_no_bound_is_reached_both_solvers_say_the_same(observation):
    truth = np.full((5, K), 0.5)
    score = reconstruct(observation, NAMES, SPREAD, truth, noise_mm=0.01, seed=0)
    assert score.rmse_mm == pytest.approx(score.unbounded.rmse_mm)
