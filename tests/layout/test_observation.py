"""What landmarks are worth: rank, prediction against simulation, what a further site would bring."""

from dataclasses import replace

import numpy as np
import pytest

from capture_plan.layout.gains import error_gains, rank_gains, site_rows
from capture_plan.layout.observation import PRIOR_SD, Observation
from capture_plan.layout.sites import Sites

RNG = np.random.default_rng(5)
K, V = 6, 40
DELTAS = RNG.normal(size=(K, V, 3)).astype(np.float32)


@pytest.fixture
def observation():
    return Observation(DELTAS, np.ones(V, dtype=bool), noise_mm=0.5)


@pytest.fixture
def sites():
    pairs = np.stack([np.arange(0, 20), np.arange(20, 40)], axis=1)
    pairs[:4, 1] = pairs[:4, 0]  # four singles
    return Sites(pairs, np.ones((K, 20)), np.ones(20))


def test_the_predicted_error_is_what_simulated_measurements_show(observation):
    vertices = np.array([3, 17, 30])
    rng = np.random.default_rng(1)
    w = rng.normal(scale=PRIOR_SD, size=(K, 4000))
    B = observation.response(vertices)
    y = B @ w + rng.normal(scale=0.5, size=(9, 4000))
    estimate = observation.covariance(vertices) @ B.T @ y / 0.5**2
    off = np.einsum("kvx,kt->vxt", DELTAS, estimate - w)
    simulated = np.sqrt((off**2).sum(axis=1).mean())
    assert observation.error(observation.covariance(vertices)) == pytest.approx(simulated, rel=0.02)


def test_more_landmarks_never_hurt(observation):
    order = RNG.permutation(V)
    errors = [observation.error(observation.covariance(order[:m])) for m in range(1, 12)]
    assert (np.diff(errors) < 0).all()


def test_without_landmarks_the_error_is_what_the_prior_leaves(observation):
    nothing = observation.covariance(np.empty(0, dtype=int))
    assert observation.error(nothing) == pytest.approx(PRIOR_SD * np.sqrt(np.trace(observation.gram)))


def test_one_landmark_has_rank_three(observation):
    information = observation.information(np.array([8]))
    assert (information.landmarks, information.rank, information.full_rank) == (1, 3, K)


@pytest.mark.parametrize("unit", [0.1, 1.0, 30.0])
def test_the_condition_is_that_of_the_response_whatever_the_unit(observation, unit):
    scaled = replace(observation, deltas=observation.deltas * np.float32(unit))
    at = np.arange(0, V, 4)
    assert scaled.information(at).condition == pytest.approx(np.linalg.cond(observation.response(at)), abs=0.06)


def test_a_rig_with_a_dependent_blendshape_has_less_than_full_rank():
    deltas = DELTAS.copy()
    deltas[5] = deltas[0] - 0.5 * deltas[1]
    assert Observation(deltas, np.ones(V, dtype=bool), 0.2).full_rank == K - 1


def test_the_closed_form_of_a_gain_is_the_recomputed_difference(observation, sites):
    start = np.array([0])
    C = observation.covariance(sites.members(start))
    gains = error_gains(observation, site_rows(sites, DELTAS), C)
    before = observation.error(C) ** 2
    for site in range(1, 20):
        after = observation.error(observation.covariance(sites.members(np.array([0, site])))) ** 2
        assert gains[site] == pytest.approx(before - after, rel=1e-9)


def test_sites_answer_only_to_mixes_that_nobody_sees(observation, sites):
    A = site_rows(sites, DELTAS)
    assert rank_gains(observation, A, np.array([0, 1])).max() == 0  # 6 coordinates already tell 6 blendshapes
    gains = rank_gains(observation, A, np.array([0]))
    assert gains[0] == pytest.approx(0, abs=1e-9)
    assert (gains[1:] > 0).all()
