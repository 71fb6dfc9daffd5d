"""Set cover: brute force, exact reductions, bounds."""

from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import csr_array

from capture_plan.errors import InfeasibleError
from capture_plan.layout.cover import dual_prices, solve_cover
from capture_plan.layout.limits import Limit
from capture_plan.layout.reduce import essential_rows, undominated


def random_program(seed, k=5, s=9):
    rng = np.random.default_rng(seed)
    covers = rng.random((k, s)) < 0.35
    covers[np.arange(k), rng.integers(0, s, k)] = True
    return covers, np.round(rng.uniform(0.5, 2, s), 2), rng.integers(1, 3, s)


def as_rows(cliques, s=9):
    return csr_array([np.isin(np.arange(s), clique) for clique in cliques])


def cheapest(covers, cost, *, cliques=(), size=None, limit=None):
    """Try every subset of sites."""
    best = np.inf
    for n in range(1, covers.shape[1] + 1):
        for subset in combinations(range(covers.shape[1]), n):
            chosen = list(subset)
            apart = all(np.isin(chosen, clique).sum() <= 1 for clique in cliques)
            few = limit is None or size[chosen].sum() <= limit
            if apart and few and covers[:, chosen].any(axis=1).all():
                best = min(best, cost[chosen].sum())
    return best


@given(st.integers(0, 10**6))
@settings(max_examples=40, deadline=None)
def test_the_cover_is_as_cheap_as_the_best_of_all_subsets(seed):
    covers, cost, _size = random_program(seed)
    found = solve_cover(covers, cost)
    assert covers[:, found.chosen].any(axis=1).all()
    assert found.proven_optimal
    assert found.objective == pytest.approx(cost[found.chosen].sum())
    assert found.objective == pytest.approx(found.bound)
    assert found.objective == pytest.approx(cheapest(covers, cost))


@given(st.integers(0, 10**6))
@settings(max_examples=40, deadline=None)
def test_sites_that_stand_too_close_are_not_chosen_together(seed):
    covers, cost, _size = random_program(seed)
    clique = np.random.default_rng(seed).choice(9, 4, replace=False)
    best = cheapest(covers, cost, cliques=[clique])
    if np.isinf(best):
        with pytest.raises(InfeasibleError, match="cannot be had together"):
            solve_cover(covers, cost, cliques=as_rows([clique]))
    else:
        found = solve_cover(covers, cost, cliques=as_rows([clique]))
        assert np.isin(found.chosen, clique).sum() <= 1
        assert found.objective == pytest.approx(best)


@given(st.integers(0, 10**6))
@settings(max_examples=25, deadline=None)
def test_a_limit_on_landmarks_is_kept_at_the_least_cost(seed):
    covers, cost, size = random_program(seed)
    fewest = round(solve_cover(covers, size.astype(float)).objective)
    found = solve_cover(covers, cost, limits=[Limit("few", size, most=fewest)])
    assert size[found.chosen].sum() == fewest
    assert found.objective == pytest.approx(cheapest(covers, cost, size=size, limit=fewest))


def test_an_undecided_program_is_not_called_impossible(monkeypatch):
    monkeypatch.setattr("capture_plan.layout.program.WORK_LIMIT", 1e-9)
    rng = np.random.default_rng(0)
    covers = rng.random((60, 400)) < 0.08
    covers[np.arange(60), rng.integers(0, 400, 60)] = True
    with pytest.raises(InfeasibleError, match="no landmarks were found"):
        solve_cover(covers, rng.uniform(1, 2, 400))


def test_two_cheap_landmarks_do_not_replace_the_one_that_is_allowed():
    covers = np.array([[True, False, True], [False, True, True]])
    cost, size = np.array([0.1, 0.1, 5.0]), np.array([1, 1, 1])
    np.testing.assert_array_equal(solve_cover(covers, cost).chosen, [0, 1])
    np.testing.assert_array_equal(solve_cover(covers, cost, limits=[Limit("one", size, most=1)]).chosen, [2])


@given(st.integers(0, 10**6))
@settings(max_examples=40, deadline=None)
def test_reductions_keep_the_optimum(seed):
    covers, cost, _ = random_program(seed)
    rows = essential_rows(covers)
    kept = undominated(covers[rows], cost[None], np.ones(9, dtype=bool))
    assert cheapest(covers[np.ix_(rows, kept)], cost[kept]) == pytest.approx(cheapest(covers, cost))


def test_of_equal_sites_the_first_is_kept():
    covers = np.ones((2, 3), dtype=bool)
    np.testing.assert_array_equal(undominated(covers, np.ones((1, 3)), np.ones(3, dtype=bool)), [0])


def test_a_site_that_may_be_forbidden_dominates_nothing():
    covers = np.array([[True, True], [True, False]])
    np.testing.assert_array_equal(undominated(covers, np.ones((1, 2)), np.array([False, True])), [0, 1])


def test_a_row_with_more_candidates_is_implied():
    covers = np.array([[True, True, False], [True, False, False]])
    np.testing.assert_array_equal(essential_rows(covers), [1])


@given(st.integers(0, 10**6))
@settings(max_examples=40, deadline=None)
def test_dual_prices_are_a_certificate_and_never_exceed_the_optimum(seed):
    covers, _, size = random_program(seed)
    prices = dual_prices(covers, size)
    assert (prices >= 0).all()
    assert (prices @ covers <= size).all()
    assert prices.sum() <= solve_cover(covers, size.astype(float)).objective + 1e-9
