"""Landmarks for a budget: closed forms, brute force, never worse than the cover or than greedy, coverage, spacing."""

from itertools import combinations

import numpy as np
import pytest
from msgspec.structs import replace
from scipy.sparse import csr_array

from capture_plan.check.check import claims_of
from capture_plan.errors import InfeasibleError
from capture_plan.layout.assembly import SINGLE_COVER
from capture_plan.layout.budget import keepable, replan, spend_budget
from capture_plan.layout.constraint_rows import Limit
from capture_plan.layout.design import design_layout
from capture_plan.layout.exchange import Search
from capture_plan.layout.face import SIXTY_EIGHT
from capture_plan.layout.observation import Observation, error_against_budget
from capture_plan.layout.settings import LayoutSettings
from capture_plan.layout.sites import Sites
from capture_plan.layout.spacing import Spacing
from capture_plan.plan.budget_words import unspent_words
from capture_plan.plan.make import make_plan
from capture_plan.plan.settings import Settings
from capture_plan.plan.summary import summary
from capture_plan.report.proofs import proofs
from capture_plan.sample import sample_rig
from tests.light import light_sample
from tests.once import QUICK, layout_of, plan_of

NO_CONSTRAINT = np.zeros((0, 9), dtype=bool)
NO_COVER = np.empty(0, dtype=int)
SLACK = 1 + 1e-9


def problem(seed, k=5, s=9, singles=3):
    """Random sites with decaying answers, `singles` of them of one landmark and the others of two."""
    rng = np.random.default_rng(seed)
    deltas = (rng.normal(size=(k, 2 * s, 3)) * rng.uniform(0.1, 2, size=(1, 2 * s, 1))).astype(np.float32)
    vertices = np.stack([np.arange(s), np.arange(s, 2 * s)], axis=1)
    vertices[:singles, 1] = vertices[:singles, 0]
    sites = Sites(vertices, rng.uniform(size=(k, s)), np.ones(s))
    return Observation(deltas, np.ones(2 * s, dtype=bool), noise_mm=0.5), sites


def error(observation, sites, chosen):
    return observation.error(observation.covariance(sites.members(np.array(chosen, dtype=int))))


def unlimited(observation, sites, budget, limits=()):
    return Search(observation, sites, np.zeros((0, len(sites.size)), bool), None, budget, limits)


@pytest.mark.parametrize("singles", [3, 9])
def test_a_swap_lowers_the_error_by_what_its_closed_form_says(singles):
    observation, sites = problem(0, singles=singles)
    search, chosen = unlimited(observation, sites, 9), (1, 4, 7)
    gains = search.gains(chosen)
    for left in chosen:
        rest = [site for site in chosen if site != left]
        subset = np.array([site for site in range(9) if site not in rest])
        before = error(observation, sites, rest) ** 2
        after = np.array([error(observation, sites, [*rest, site]) ** 2 for site in subset])
        rows = search.rows((left,))
        assert gains.without(rows, subset, beat=0.0) == pytest.approx(before - after, rel=1e-6)
        assert gains.loss(rows) == pytest.approx(before - error(observation, sites, chosen) ** 2, rel=1e-6)
        some = gains.without(rows, subset, beat=gains.loss(rows))
        assert (some[before - after > gains.loss(rows)] > 0).all()


@pytest.mark.parametrize("singles", [3, 9])
def test_what_a_swap_can_gain_at_most_is_never_less_than_what_it_gains(singles):
    observation, sites = problem(5, singles=singles)
    search, chosen = unlimited(observation, sites, 9), (1, 4, 7)
    gains = search.gains(chosen)
    most = gains.most(search.all_rows[list(chosen)])
    for n, left in enumerate(chosen):
        gain = gains.without(search.rows((left,)), np.arange(9), beat=-1.0)
        assert (most[n] >= gain / SLACK).all()
        traces = np.trace(gains.step(search.rows((left,)), 1).H, axis1=1, axis2=2)
        assert most[n] == pytest.approx(traces / observation.noise_mm**2)


@pytest.mark.parametrize("singles", [3, 9])
def test_steps_in_and_out_arrive_where_large_products_do(singles):
    observation, sites = problem(3, singles=singles)
    search = unlimited(observation, sites, 9)
    stepped = search.gains((1, 4, 7)).step(search.rows((8,)), -1).step(search.rows((4, 1)), 1)
    direct = search.gains((7, 8))
    for name in ("C", "P", "T", "H"):
        assert getattr(stepped, name) == pytest.approx(getattr(direct, name), abs=1e-9)


@pytest.mark.parametrize("seed", range(12))
@pytest.mark.parametrize("budget", [4, 5])
def test_no_choice_at_all_is_better_by_more_than_a_tenth(seed, budget):
    observation, sites = problem(seed)
    chosen = spend_budget(observation, sites, NO_CONSTRAINT, NO_COVER, budget=budget, spacing=None)
    within = [
        subset
        for n in range(1, budget + 1)
        for subset in combinations(range(9), n)
        if sites.size[list(subset)].sum() <= budget
    ]
    best = min(error(observation, sites, subset) for subset in within)
    assert best / SLACK <= error(observation, sites, chosen) <= 1.1 * best


@pytest.mark.parametrize("seed", range(8))
def test_no_swap_of_the_answer_is_better(seed):
    observation, sites = problem(seed, s=20, singles=6)
    chosen = spend_budget(observation, sites, np.zeros((0, 20), bool), NO_COVER, budget=9, spacing=None)
    reached = error(observation, sites, chosen)
    for n in range(len(chosen)):
        rest = np.delete(chosen, n)
        for new in np.flatnonzero(sites.size == sites.size[chosen[n]]):
            assert error(observation, sites, [*rest, new]) >= reached / SLACK


@pytest.mark.parametrize("seed", range(8))
def test_every_exchange_lowers_the_error_and_greedy_is_never_better(seed):
    observation, sites = problem(seed, s=20, singles=6)
    search = unlimited(observation, sites, 9)
    greedy = search.fill(())
    swapped = search.swap_all(greedy)
    traded = search.trade(swapped)
    assert search.score(traded) <= search.score(swapped)
    assert search.score(swapped)[2] <= search.score(greedy)[2] * SLACK
    chosen = spend_budget(observation, sites, search.covers, NO_COVER, budget=9, spacing=None)
    assert error(observation, sites, chosen) <= error(observation, sites, greedy) * SLACK


@pytest.mark.parametrize("seed", range(8))
def test_a_budget_is_left_short_only_where_no_site_is_open(seed):
    observation, sites = problem(seed, s=20, singles=6)
    near = np.triu(np.random.default_rng(seed).uniform(size=(40, 40)) < 0.15, 1)
    spacing = Spacing(csr_array((near | near.T).astype(float)), sites, 2.0)
    chosen = spend_budget(observation, sites, np.zeros((0, 20), bool), NO_COVER, budget=20, spacing=spacing)
    search = Search(observation, sites, np.zeros((0, 20), bool), spacing, 20)
    assert not len(search.next(tuple(chosen.tolist())))
    assert not len(search.next(search.descend(search.fill(()))))  # exchanges have made room on two of these faces


@pytest.mark.parametrize("seed", range(8))
def test_every_blendshape_keeps_a_landmark_where_the_budget_pays_for_a_cover(seed):
    observation, sites = problem(seed, k=8, s=20, singles=6)
    covers = sites.relative_displacement >= 0.8
    covers[:, 19] = True  # one pair reaches all
    cover = np.array([19])
    for budget in (2, 3, 6):
        chosen = spend_budget(observation, sites, covers, cover, budget=budget, spacing=None)
        filled = Search(observation, sites, covers, None, budget).fill((19,))
        assert covers[:, chosen].any(axis=1).all()
        assert error(observation, sites, chosen) <= error(observation, sites, filled) * SLACK
        assert error(observation, sites, chosen) <= error(observation, sites, cover) * SLACK


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("budget", [1, 2, 5, 8, 9])
def test_a_budget_is_spent_to_the_last_landmark(seed, budget):
    observation, sites = problem(seed)
    chosen = spend_budget(observation, sites, NO_CONSTRAINT, NO_COVER, budget=budget, spacing=None)
    assert sites.size[chosen].sum() == budget
    assert len(set(chosen.tolist())) == len(chosen)


def test_pairs_alone_leave_an_odd_budget_short_by_one_and_buy_nothing_for_one():
    observation, sites = problem(1, singles=0)
    chosen = spend_budget(observation, sites, NO_CONSTRAINT, NO_COVER, budget=5, spacing=None)
    assert sites.size[chosen].sum() == 4
    with pytest.raises(InfeasibleError, match="budget of 1 landmark"):
        spend_budget(observation, sites, NO_CONSTRAINT, NO_COVER, budget=1, spacing=None)


def limited(rng, sites):
    """A pin, a keep-out, a cap and an exact number that site 0, the pin and fillers can keep."""
    s = len(sites.size)
    pin, away = rng.choice(s, 2, replace=False)
    zone = rng.permutation(s)[:4]
    return (
        Limit("pin", (np.arange(s) == pin).astype(int), least=1),
        Limit("keep-out", (np.arange(s) == away).astype(int), most=0),
        Limit("cap", np.isin(np.arange(s), zone) * sites.size, most=2),
        Limit("number", sites.size, least=5, most=5),
    )


def choices_within(sites, limits, budget):
    return [
        subset
        for n in range(1, budget + 1)
        for subset in combinations(range(len(sites.size)), n)
        if sites.size[list(subset)].sum() <= budget and all(limit.shortfall(np.array(subset)) == 0 for limit in limits)
    ]


@pytest.mark.parametrize("seed", range(16))
def test_limits_are_kept_and_no_choice_within_them_is_better_by_more_than_a_tenth(seed):
    observation, sites = problem(seed, singles=4)
    limits = limited(np.random.default_rng(seed), sites)
    within = choices_within(sites, limits, 5)
    cover = np.array(within[seed % len(within)])
    chosen = spend_budget(observation, sites, NO_CONSTRAINT, cover, budget=5, spacing=None, limits=limits)
    assert [limit.name for limit in limits if limit.shortfall(chosen)] == []
    best = min(error(observation, sites, subset) for subset in within)
    assert best / SLACK <= error(observation, sites, chosen) <= 1.1 * best


@pytest.mark.parametrize("seed", range(12))
def test_every_move_keeps_the_limits(seed):
    observation, sites = problem(seed, s=20, singles=6)
    zone = np.arange(20) < 8
    limits = (
        Limit("pins", (np.arange(20) == 2).astype(int), least=1),
        Limit("some", zone * sites.size, least=2, most=3),
        Limit("none", (np.arange(20) > 16).astype(int), most=0),
    )
    search = unlimited(observation, sites, 9, limits)
    filled = search.fill(())
    for move in (search.swap_all(filled), search.trade(filled), search.descend(filled)):
        assert search.shortfall(move) == 0
        assert search.score(move) <= (0, 0, search.score(filled)[2] * SLACK)
        assert search.landmarks(move) <= 9


@pytest.mark.parametrize("seed", range(8))
def test_limits_come_before_blendshapes_and_blendshapes_before_the_error(seed):
    observation, sites = problem(seed, k=8, s=20, singles=6)
    covers = np.zeros((8, 20), dtype=bool)
    covers[:, 19] = covers[:4, 18] = True
    never = Limit("not there", (np.arange(20) == 19).astype(int), most=0)
    free = Search(observation, sites, covers, None, 6)
    assert 19 in free.descend(free.fill(()))
    held = Search(observation, sites, covers, None, 6, (never,))
    end = held.descend(held.fill(()))
    assert 19 not in end
    assert 18 in end


@pytest.mark.parametrize("seed", range(8))
def test_what_a_site_would_leave_missing_is_what_is_missing_with_it(seed):
    observation, sites = problem(seed, singles=4)
    limits = limited(np.random.default_rng(seed), sites)
    search = Search(observation, sites, sites.relative_displacement > 0.7, None, 5, limits)
    rest, subset = (1, 6), np.array([0, 2, 3, 4, 5, 7, 8])
    assert search.misses_with(rest, subset).tolist() == [search.misses((*rest, site)) for site in subset.tolist()]


def one(vertex, **ends):
    return Limit(f"vertex {vertex}", (np.arange(20) == vertex).astype(int), **ends)


@pytest.mark.parametrize("seed", range(8))
def test_planned_again_after_one_change_it_keeps_the_change_and_is_as_good_as_any_start(seed):
    observation, sites = problem(seed, s=20, singles=20)
    nothing = np.zeros((0, 20), bool)
    former = spend_budget(observation, sites, nothing, NO_COVER, budget=6, spacing=None)
    new = next(site for site in range(20) if site not in former)
    changes = {
        "pinned": (one(new, least=1),),
        "forbidden": (one(former[0], most=0),),
        "moved": (one(new, least=1), one(former[-1], most=0)),
    }
    for limits in changes.values():
        search = unlimited(observation, sites, 6, limits)
        again = replan(search, tuple(former.tolist()))
        assert search.shortfall(tuple(again.tolist())) == 0
        assert len(again) == 6
        scratch = spend_budget(observation, sites, nothing, NO_COVER, budget=6, spacing=None, limits=limits)
        assert error(observation, sites, again) <= 1.05 * error(observation, sites, scratch)


def test_planned_again_without_a_change_it_stays():
    observation, sites = problem(2, s=20, singles=6)
    former = spend_budget(observation, sites, np.zeros((0, 20), bool), NO_COVER, budget=7, spacing=None)
    assert np.array_equal(replan(unlimited(observation, sites, 7), tuple(former.tolist())), former)


def test_what_must_go_is_what_is_missed_least():
    observation, sites = problem(4, s=20, singles=20)
    former = spend_budget(observation, sites, np.zeros((0, 20), bool), NO_COVER, budget=6, spacing=None)
    fewer = unlimited(observation, sites, 5)
    assert keepable(fewer, tuple(former.tolist())) == tuple(former[:5].tolist())
    pinned = next(site for site in range(20) if site not in former)
    held = unlimited(observation, sites, 6, (one(pinned, least=1),))
    assert set(keepable(held, tuple(former.tolist()))) == {pinned, *former[:5]}


@pytest.mark.parametrize("seed", range(6))
def test_with_more_of_a_nested_order_the_error_never_grows(seed):
    observation, sites = problem(seed)
    chosen = np.array([0, 3, 1, 8, 5])
    order = np.array(unlimited(observation, sites, 9).in_order(tuple(chosen.tolist())))
    assert sorted(order) == sorted(chosen)
    curve = error_against_budget(observation, sites.members(order))
    assert len(curve) == sites.size[chosen].sum()
    assert (np.diff(curve) <= 0).all()
    assert curve[-1] == pytest.approx(error(observation, sites, chosen))


@pytest.mark.parametrize("seed", range(6))
def test_the_last_of_a_nested_order_is_missed_least(seed):
    observation, sites = problem(seed)
    order = np.array(unlimited(observation, sites, 9).in_order((0, 3, 1, 8, 5)))
    for n in range(2, 6):
        retained = order[:n]
        lost = [error(observation, sites, retained[retained != site]) ** 2 for site in retained]
        lost = (np.array(lost) - error(observation, sites, retained) ** 2) / sites.size[retained]
        assert lost.argmin() == n - 1


@pytest.fixture(scope="module")
def half():
    return layout_of(LayoutSettings(method="budget", budget=34))


def test_half_of_68_landmarks_predict_less_error_on_the_sample(half):
    assert half.information.landmarks == 34
    assert half.information.error_mm < half.references[SIXTY_EIGHT].error_mm
    assert half.uncovered == ()


def test_on_the_sample_the_budget_beats_the_cover_at_its_number_and_equals_the_studio_layout_at_its_own(face, half):
    studio = layout_of()
    cover = half.references[SINGLE_COVER]
    for information in (studio.information, cover):
        layout = design_layout(face, LayoutSettings(method="budget", budget=information.landmarks))
        assert layout.information.landmarks <= information.landmarks
        assert layout.information.error_mm <= information.error_mm
        assert layout.uncovered == studio.uncovered
    assert half.information.error_mm < cover.error_mm


def test_a_budget_below_the_minimum_says_which_blendshapes_go_without(face):
    layout = design_layout(face, LayoutSettings(method="budget", budget=5))
    assert layout.information.landmarks == 5
    assert layout.programs == ()
    assert set(layout.uncovered) == set(face.used) - {name for m in layout.landmarks for name in m.blendshapes}


def test_the_same_budget_gives_the_same_layout(face, half):
    assert design_layout(face, LayoutSettings(method="budget", budget=34)) == half


@pytest.fixture(scope="module")
def plan():
    return plan_of(Settings(landmarks=LayoutSettings(method="budget", budget=15), expressions=QUICK.expressions))


def with_budget(plan, **changes):
    landmarks = replace(plan.settings.landmarks, **changes)
    return replace(plan, settings=replace(plan.settings, landmarks=landmarks))


def test_a_budget_that_is_not_spent_says_why(plan):
    assert unspent_words(plan) == []
    (left,) = unspent_words(with_budget(plan, budget=20))
    assert left == (
        "15 of the 20 are used: beside these no further dot, with its mirror image, keeps 8 mm from the others and all "
        "constraints."
    )
    (one,) = unspent_words(with_budget(plan, budget=16))
    assert "15 of the 16 are used: the one that is left buys no pair" in one
    default = replace(plan, layout=replace(plan.layout, method="studio"))
    (stops,) = unspent_words(with_budget(default, budget=20, method="studio"))
    assert "15 of at most 20 are used: the default stops" in stops
    assert unspent_words(with_budget(default, budget=None, method="studio")) == []


def test_a_plan_within_a_budget_holds_and_its_summary_sets_it_beside_68_points(plan):
    assert [claim for claim in claims_of(plan, sample_rig(), quick=True) if not claim.holds] == []
    text = "\n".join(summary(plan))
    assert "15 landmarks" in text
    assert "for a budget of 15" in text
    assert "68 points (iBUG): 68 landmarks" in text
    assert "Beside 68 points (iBUG), these 15 landmarks have a predicted error" in text
    assert (
        f"no layout of fewer than {plan.layout.target_landmarks} landmarks has the upper estimate of 68 points" in text
    )
    assert plan.layout.target_landmarks == plan_of().layout.target_landmarks  # of the face, whatever the budget
    assert f"{plan.layout.curve_mm[6]:.2f} mm with the first 7" in text
    assert not any("chose markers" in line for line in proofs(plan))


def test_a_plan_over_its_budget_or_with_fewer_landmarks_than_its_bound_is_caught(plan):
    bound = replace(plan.layout.programs[0], bound=16.0)
    boasting = replace(plan, layout=replace(plan.layout, programs=(bound,)))
    for lie in (with_budget(plan, budget=14), boasting):
        broken = [claim.what for claim in claims_of(lie, sample_rig(), quick=True) if not claim.holds]
        assert any("keeps its budget" in what for what in broken)


def test_a_plan_with_another_order_than_its_curve_is_caught(plan):
    lie = replace(plan, layout=replace(plan.layout, order=plan.layout.order[::-1]))
    broken = [claim.found for claim in claims_of(lie, sample_rig(), quick=True) if not claim.holds]
    assert any("layout.order[1] says" in found for found in broken)


def test_a_plan_whose_budget_pays_for_a_cover_may_leave_nothing_uncovered(plan):
    lone = plan.layout.landmarks[0].blendshapes[0]
    without = tuple(m for m in plan.layout.landmarks if lone not in m.blendshapes)
    seen = {name for m in without for name in m.blendshapes}
    uncovered = tuple(name for name in plan.audit.used if name not in seen)
    order = tuple(name for name in plan.layout.order if name in {m.name for m in without})
    lie = replace(plan, layout=replace(plan.layout, landmarks=without, uncovered=uncovered, order=order))
    assert any(
        "keeps its budget" in claim.what for claim in claims_of(lie, sample_rig(), quick=True) if not claim.holds
    )


def test_a_summary_says_what_a_budget_does_not_pay_for():
    few = LayoutSettings(method="budget", budget=5)
    plan = make_plan(light_sample(), Settings(landmarks=few, expressions=QUICK.expressions))
    assert all(claim.holds for claim in claims_of(plan, light_sample(), quick=True))
    assert "The budget does not pay for a landmark on every blendshape" in summary(plan)[1]


def test_a_method_without_its_budget_is_refused():
    with pytest.raises(ValueError, match="needs a budget"):
        replace(LayoutSettings(), method="budget")
