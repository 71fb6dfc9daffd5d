"""Set cover: brute force, exact reductions, bounds."""

from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import csr_array

from capture_plan.errors import InfeasibleError
from capture_plan.layout.constraint_rows import Limit
from capture_plan.layout.costs import RESOLUTION
from capture_plan.layout.cover import best, dual_prices, solve_cover
from capture_plan.layout.infeasibility import possible, smallest_clash
from capture_plan.layout.presolve import essential_rows, undominated
from capture_plan.layout.program import IntegerProgram, branch
from capture_plan.layout.second_look import Room, cheaper
from capture_plan.layout.sites import Sites
from capture_plan.layout.spacing import Spacing


def random_program(seed, k=5, s=9):
    rng = np.random.default_rng(seed)
    covers = rng.random((k, s)) < 0.35
    covers[np.arange(k), rng.integers(0, s, k)] = True
    return covers, np.round(rng.uniform(0.5, 2, s), 2), rng.integers(1, 3, s)


def apart(cliques, s=9):
    """A spacing that keeps the sites of every clique apart, known in pairs and not in balls."""
    near = np.eye(s)
    for clique in cliques:
        near[np.ix_(clique, clique)] = 1
    sites = Sites(np.stack([np.arange(s)] * 2, axis=1), np.ones((1, s)), np.ones(s))
    return Spacing(csr_array(near * 4.0), sites, 5.0)


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
            solve_cover(covers, cost, spacing=apart([clique]))
    else:
        found = solve_cover(covers, cost, spacing=apart([clique]))
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


def random_wishes(seed, s=9):
    """A pin, a keep-out, a cap and a number, each now and then."""
    rng = np.random.default_rng(seed)
    size = rng.integers(1, 3, s)
    some = [
        Limit("pin", np.eye(s, dtype=int)[rng.integers(s)], least=1),
        Limit("zone", (rng.random(s) < 0.2).astype(int), most=0),
        Limit("cap", size * (rng.random(s) < 0.5), most=int(rng.integers(1, 4))),
        Limit("number", size, *[int(rng.integers(2, 8))] * 2),
    ]
    return [limit for limit in some if rng.random() < 0.6]


@given(st.integers(0, 10**6))
@settings(max_examples=150, deadline=None)
def test_pins_keep_outs_caps_numbers_spacing_and_demands_together_are_as_cheap_as_the_best_of_all_subsets(seed):
    covers, cost, _ = random_program(seed)
    rng = np.random.default_rng(seed)
    spacing = apart([rng.choice(9, 3, replace=False), rng.choice(9, 2, replace=False)])
    constraints, demand = random_wishes(seed), rng.integers(1, 3, 5) if rng.random() < 0.3 else np.ones(5, dtype=int)
    close = spacing.table.toarray() & ~np.eye(9, dtype=bool)

    def keeps_all(subset):
        at = np.array(subset)
        retained = not close[np.ix_(at, at)].any() and (covers[:, at].sum(axis=1) >= demand).all()
        return retained and all(limit.shortfall(at) == 0 for limit in constraints)

    subsets = [list(subset) for n in range(1, 10) for subset in combinations(range(9), n)]
    prices = [cost[subset].sum() for subset in subsets if keeps_all(subset)]
    if not prices:
        with pytest.raises(InfeasibleError, match=r"cannot be had together|reach every blendshape"):
            solve_cover(covers, cost, demand=demand, spacing=spacing, limits=constraints)
        return
    found = solve_cover(covers, cost, demand=demand, spacing=spacing, limits=constraints)
    assert keeps_all(found.chosen)
    assert found.proven_optimal
    assert found.objective == pytest.approx(min(prices), abs=1e-6)


@given(st.integers(0, 10**6))
@settings(max_examples=60, deadline=None)
def test_what_is_left_of_a_wish_misses_as_much_as_the_whole_with_what_was_chosen_before(seed):
    rng = np.random.default_rng(seed)
    before, more = np.split(rng.permutation(9), [int(rng.integers(5))])
    amount, most = rng.integers(0, 3, 9), [None, 0, 3, 30][int(rng.integers(4))]
    total = int(amount[before].sum())
    constraint = Limit("some", amount, least=int(rng.integers(0, 8)), most=None if most is None else most + total)
    assert constraint.after(before).shortfall(more) == constraint.shortfall(np.concatenate([before, more]))


@given(st.integers(0, 10**6))
@settings(max_examples=60, deadline=None)
def test_a_clash_names_wishes_of_which_each_is_needed(seed):
    covers, _cost, _ = random_program(seed)
    spacing = apart([np.random.default_rng(seed).choice(9, 6, replace=False)])
    limits = tuple(random_wishes(seed))
    program = IntegerProgram(covers, np.ones(9, dtype=int), np.ones(5, dtype=int), spacing.balls, spacing.table, limits)
    if branch(program) is not None:
        return
    by_name = {limit.name: limit for limit in limits}
    clash = [by_name.get(name, name) for name in smallest_clash(program)]
    assert not possible(program, clash)
    for constraint in clash:
        assert possible(program, [other for other in clash if other is not constraint])


@pytest.mark.parametrize("seed", range(12))
def test_a_proof_by_reduced_costs_is_about_all_sites_though_few_are_tried(seed, monkeypatch):
    """With 10 of 40 sites tried first, the answer is as cheap as where all are tried at once."""
    covers, cost, _size = random_program(seed, k=12, s=40)
    rng = np.random.default_rng(seed)
    near = apart([rng.choice(40, 8, replace=False) for _ in range(8)], s=40)
    price = np.rint(cost / RESOLUTION).astype(int)
    program = IntegerProgram(covers, price, np.ones(12, dtype=int), near.balls, near.table, ())
    monkeypatch.setattr("capture_plan.layout.cover.FIRST_SITES", 10)
    monkeypatch.setattr("capture_plan.layout.cover.FIRST_SHARE", 0)
    whole, found = branch(program), best(program)
    assert whole is not None
    assert found is not None
    assert found.bound == found.cost == price[found.chosen].sum() == whole.cost
    assert covers[:, found.chosen].any(axis=1).all()
    assert not (near.table.toarray() & ~np.eye(40, dtype=bool))[np.ix_(found.chosen, found.chosen)].any()


@given(st.integers(0, 10**6))
@settings(max_examples=15, deadline=None)
def test_a_second_look_finds_a_cheaper_choice_where_a_single_exchange_makes_one_and_only_there(seed):
    """One site for none, or one or two for one other: all tried."""
    covers, _cost, size = random_program(seed)
    rng = np.random.default_rng(seed)
    price, most = rng.integers(1, 9, 9), int(rng.integers(4, 12))
    spacing, limit = apart([rng.choice(9, 2, replace=False)]), Limit("few", size, most=most)
    close = spacing.table.toarray() & ~np.eye(9, dtype=bool)

    def holds(some):
        at = np.array(sorted(some), dtype=int)
        alone = not close[np.ix_(at, at)].any()
        return bool(alone and covers[:, at].any(axis=1).all() and limit.shortfall(at) == 0)

    every = [set(some) for n in range(1, 7) for some in combinations(range(9), n) if holds(some)]
    if not every:
        return
    chosen = every[int(rng.integers(len(every)))]
    fewer = [chosen - {site} for site in chosen]
    left = [*fewer, *(chosen - set(pair) for pair in combinations(chosen, 2))]
    others = [*fewer, *(rest | {site} for rest in left for site in set(range(9)) - rest)]
    better = [some for some in others if holds(some) and price[list(some)].sum() < price[list(chosen)].sum()]
    found = cheaper(Room(covers, np.ones(9, dtype=bool), spacing, [limit]), price, np.array(sorted(chosen)))
    assert (found is None) == (not better)
    assert found is None or set(found.tolist()) in better


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
    retained = undominated(covers[rows], cost[None], np.ones(9, dtype=bool))
    assert cheapest(covers[np.ix_(rows, retained)], cost[retained]) == pytest.approx(cheapest(covers, cost))


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
