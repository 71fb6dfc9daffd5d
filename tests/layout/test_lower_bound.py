"""The least error that any layout can predict: below brute force, tight where there is no choice, checkable by hand."""

from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from capture_plan.layout.constraint_rows import Limit
from capture_plan.layout.lower_bound import (
    best_shares,
    bound_from,
    error_bound,
    fewest_for,
    relax_budget,
    shares_of,
    target_bound,
)
from capture_plan.layout.observation import Observation
from capture_plan.layout.sites import Sites

S = 9


def problem(seed, singles=3):
    """Nine random sites, the first of one landmark and the others of two, seen by five blendshapes."""
    rng = np.random.default_rng(seed)
    deltas = (rng.normal(size=(5, 2 * S, 3)) * rng.uniform(0.1, 2, size=(1, 2 * S, 1))).astype(np.float32)
    vertices = np.stack([np.arange(S), np.arange(S, 2 * S)], axis=1)
    vertices[:singles, 1] = vertices[:singles, 0]
    return Observation(deltas, np.ones(2 * S, dtype=bool), noise_mm=0.5), Sites(vertices, np.ones((5, S)), np.ones(S))


def least_error(observation, sites, budget, limits=()):
    """By trying every choice."""
    errors = [
        observation.error(observation.covariance(sites.members(np.array(chosen, dtype=int))))
        for n in range(budget + 1)
        for chosen in combinations(range(S), n)
        if sites.size[list(chosen)].sum() <= budget
        and not any(limit.shortfall(np.array(chosen, dtype=int)) for limit in limits)
    ]
    return min(errors)


def one(site, **ends):
    return Limit(f"site {site}", (np.arange(S) == site).astype(int), **ends)


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("budget", [1, 3, 5])
def test_no_choice_at_all_is_below_the_bound(seed, budget):
    observation, sites = problem(seed)
    assert error_bound(observation, sites, budget=budget).error_mm <= least_error(observation, sites, budget)


@pytest.mark.parametrize("seed", range(8))
def test_keep_outs_and_pins_raise_the_bound_and_no_choice_within_them_is_below_it(seed):
    observation, sites = problem(seed)
    free = error_bound(observation, sites, budget=5).error_mm
    least = least_error(observation, sites, 5)
    for limits in ((one(seed, most=0),), (one((seed + 1) % S, least=1),), (one(0, least=1), one(5, most=0))):
        bound = error_bound(observation, sites, budget=5, limits=limits).error_mm
        assert free * 0.997 <= bound <= least_error(observation, sites, 5, limits)
    several = tuple(one(site, most=0) for site in range(1, S))
    assert error_bound(observation, sites, budget=5, limits=several).error_mm > least


@given(lam=st.lists(st.floats(0, 3), min_size=S, max_size=S), seed=st.integers(0, 4))
@settings(max_examples=60, deadline=None)
def test_any_shares_whatever_prove_a_bound(lam, seed):
    observation, sites = problem(seed)
    assert bound_from(observation, sites, np.array(lam), budget=4) <= least_error(observation, sites, 4)


@pytest.mark.parametrize("seed", range(4))
def test_the_bound_is_reached_where_the_budget_pays_for_all(seed):
    observation, sites = problem(seed)
    everything = observation.error(observation.covariance(sites.members(np.arange(S))))
    assert error_bound(observation, sites, budget=int(sites.size.sum())).error_mm == pytest.approx(everything, abs=2e-4)


@pytest.mark.parametrize("seed", range(4))
def test_the_shares_keep_the_budget_and_are_the_best_there_are(seed):
    observation, sites = problem(seed)
    relaxed = relax_budget(observation, sites, 5, ())
    lam = best_shares(relaxed, relaxed.scaled(np.ones(len(relaxed.size))))
    assert sites.size @ lam <= 5 + 1e-3
    assert lam.max() <= 1
    f, g = relaxed.value(lam)
    assert relaxed.bound(f, g, lam) == pytest.approx(f, rel=0.01)


@pytest.mark.parametrize("seed", range(4))
def test_the_slope_is_that_of_the_error(seed):
    observation, sites = problem(seed)
    relaxed = relax_budget(observation, sites, 5, ())
    lam = np.random.default_rng(seed).uniform(0.1, 1, S)
    f, g = relaxed.value(lam)
    for s in range(S):
        more = relaxed.value(lam + 1e-6 * (np.arange(S) == s))[0]
        assert (f - more) / 1e-6 == pytest.approx(g[s], rel=1e-3)


@pytest.mark.parametrize("seed", range(4))
def test_the_certificate_gives_its_bound_again(seed):
    observation, sites = problem(seed)
    bound = error_bound(observation, sites, budget=4, limits=(one(3, most=0),))
    again = bound_from(observation, sites, shares_of(sites, bound), budget=4, limits=(one(3, most=0),))
    assert again == bound.error_mm
    assert 3 not in bound.vertices


def test_too_few_coordinates_for_the_blendshapes_leave_what_they_cannot_see():
    observation, sites = problem(1, singles=S)
    quiet = Observation(observation.deltas, observation.skin, noise_mm=1e-3)
    eigenvalues = np.linalg.eigvalsh(quiet.gram)
    bound = error_bound(quiet, sites, budget=1).error_mm
    assert bound >= 0.2 * np.sqrt(eigenvalues[:2].sum()) - 1e-4
    assert bound <= least_error(quiet, sites, 1)


@given(lam=st.lists(st.floats(0, 3), min_size=S, max_size=S), seed=st.integers(0, 4), reached=st.integers(1, 5))
@settings(max_examples=40, deadline=None)
def test_no_smaller_choice_reaches_what_any_shares_say_it_cannot(lam, seed, reached):
    observation, sites = problem(seed)
    target = least_error(observation, sites, reached)
    fewest = fewest_for(observation, sites, np.array(lam), target_mm=target)
    assert fewest <= reached


@pytest.mark.parametrize("seed", range(4))
def test_the_fewest_that_reach_a_target_are_stated_closely_and_none_where_all_sites_together_do_not(seed):
    observation, sites = problem(seed, singles=S)
    for reached in (3, 5):
        target = least_error(observation, sites, reached)
        lam = shares_of(sites, error_bound(observation, sites, budget=reached))
        fewest = fewest_for(observation, sites, lam, target_mm=target)
        assert reached - 1 <= fewest <= reached
        bound = bound_from(observation, sites, lam, budget=fewest - 1)
        assert bound > target >= bound_from(observation, sites, lam, budget=fewest)
    everything = observation.error(observation.covariance(sites.members(np.arange(S))))
    assert fewest_for(observation, sites, lam, target_mm=0.999 * everything) is None
    shut = tuple(one(site, most=0) for site in range(S - 1))
    assert fewest_for(observation, sites, lam, target_mm=1.001 * everything, limits=shut) is None


@pytest.mark.parametrize("seed", range(3))
def test_the_fewest_that_reach_a_target_do_not_depend_on_the_budget_of_the_first_certificate(seed):
    observation, sites = problem(seed, singles=S)
    target, numbers = least_error(observation, sites, 4), set()
    for budget in range(1, S + 1):
        found = target_bound(observation, sites, error_bound(observation, sites, budget=budget), target_mm=target)
        numbers.add(fewest := fewest_for(observation, sites, shares_of(sites, found), target_mm=target))
        assert found.error_mm == bound_from(observation, sites, shares_of(sites, found), budget=fewest)
    assert len(numbers) == 1
    assert max(numbers) <= 4
