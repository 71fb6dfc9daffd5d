"""The last exchanges: never worse on what they are judged by, the constraints kept, the closed form exact."""

import numpy as np
import pytest

from capture_plan.layout.budget import spend_budget
from capture_plan.layout.constraint_rows import Limit
from capture_plan.layout.exchange import BETTER, CLOSE, Search
from capture_plan.layout.observation import PRIOR_SD, Observation
from capture_plan.layout.polish import ROUNDS, covariances, mean_gains, mixes_error, polish
from capture_plan.layout.sites import Sites

K, S = 12, 40
NOBODY = np.empty(0, dtype=int)


def search_of(seed, limits=()):
    """Forty random sites, the first eight of one landmark, seen by twelve blendshapes; five landmarks."""
    rng = np.random.default_rng(seed)
    deltas = (rng.normal(size=(K, 2 * S, 3)) * rng.uniform(0.1, 2, size=(1, 2 * S, 1))).astype(np.float32)
    vertices = np.stack([np.arange(S), np.arange(S, 2 * S)], axis=1)
    vertices[:8, 1] = vertices[:8, 0]
    sites = Sites(vertices, np.ones((K, S)), np.ones(S))
    observation = Observation(deltas, np.ones(2 * S, dtype=bool), noise_mm=0.5)
    return Search(observation, sites, np.zeros((0, S), dtype=bool), None, 5, limits)


def best_of(search):
    chosen = spend_budget(
        search.observation, search.sites, search.covers, NOBODY, budget=5, spacing=None, limits=search.limits
    )
    return tuple(chosen.tolist())


@pytest.mark.parametrize("seed", range(3))
def test_a_polished_choice_is_no_worse_on_the_mixes_that_judge_it(seed):
    search = search_of(seed)
    chosen = best_of(search)
    polished = polish(search, [chosen], seed=7)
    judge = {"seed": 7 + ROUNDS}
    assert mixes_error(search, polished, **judge) <= mixes_error(search, chosen, **judge)
    assert search.landmarks(polished) == search.landmarks(chosen)


def test_the_better_of_two_starts_is_polished():
    search = search_of(0)
    good, bad = best_of(search), (8, 9)
    assert polish(search, [bad, good], seed=7) == polish(search, [good], seed=7)


def test_polishing_lowers_the_error_of_mixes_that_it_has_never_seen():
    before, after = 0.0, 0.0
    for seed in range(6):
        search = search_of(seed)
        chosen = best_of(search)
        before += mixes_error(search, chosen, seed=99)
        after += mixes_error(search, polish(search, [chosen], seed=7), seed=99)
    assert after < before


@pytest.mark.parametrize("share", [CLOSE, BETTER, 0.2])
@pytest.mark.parametrize("chosen", [(9, 30), (2, 9), (1, 12, 6)])
def test_rivals_are_the_sites_that_give_back_more_than_a_share_of_what_is_lost(chosen, share):
    search = search_of(4)

    def squared(some):
        return search.score(tuple(some))[2]

    expected = set()
    for site in chosen:
        rest = [other for other in chosen if other != site]
        lost = squared(rest) - squared(chosen)
        may = np.flatnonzero(search.open_to(tuple(rest)) & (search.size == search.size[site])).tolist()
        expected |= {one for one in may if squared(rest) - squared([*rest, one]) > (1 + share) * lost}
    assert set(search.rivals(chosen, share).tolist()) == expected


def test_polishing_keeps_the_wishes():
    pin = Limit("pin", (np.arange(S) == 30).astype(int), least=1)
    away = Limit("keep-out", (np.arange(S) % 2).astype(int), most=0)
    search = search_of(1, (pin, away))
    assert search.shortfall(polish(search, [best_of(search)], seed=3)) == 0


def test_the_gain_of_a_rival_is_the_recomputed_mean_difference():
    search = search_of(2)
    free = np.random.default_rng(0).uniform(size=(5, K)) < 0.5
    rest, G = (9, 3), search.observation.gram

    def mean_error(chosen):
        at = search.sites.members(np.array(chosen))
        return np.mean(np.sum(G * covariances(search.observation, at, free), axis=(1, 2)))

    C = covariances(search.observation, search.sites.members(np.array(rest)), free)
    gains = mean_gains(search, np.array([1, 12, 30]), C)
    assert gains == pytest.approx([mean_error(rest) - mean_error((*rest, site)) for site in (1, 12, 30)], rel=1e-9)


def test_weights_at_a_bound_cannot_be_wrong_and_the_others_are_known_as_if_alone():
    search = search_of(3)
    free = np.arange(K)[None] < 4
    at = search.sites.members(np.array([9, 3]))
    B = search.observation.response(at)[:, :4]
    C = covariances(search.observation, at, free)[0]
    alone = np.linalg.inv(B.T @ B / 0.5**2 + np.eye(4) / PRIOR_SD**2)
    assert C[:4, :4] == pytest.approx(alone)
    assert np.abs(C[4:]).max() == np.abs(C[:, 4:]).max() == 0
