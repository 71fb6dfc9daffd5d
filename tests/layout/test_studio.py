"""The default layout: as few landmarks as the goal asks for, and an end where no goal can be had."""

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest

from capture_plan.layout.assembly import EVEN, target_of
from capture_plan.layout.budget import spend_budget
from capture_plan.layout.design import design_layout
from capture_plan.layout.exchange import Search
from capture_plan.layout.face import SIXTY_EIGHT
from capture_plan.layout.observation import Observation
from capture_plan.layout.problem import search_of, task_of
from capture_plan.layout.record import Information
from capture_plan.layout.settings import LayoutSettings
from capture_plan.layout.sites import Sites
from capture_plan.layout.studio import HARDLY, LEAST_GAIN, Goal, ceiling, fewest

K = 5


def problem(seed, *, s=14, pairs=0, budget=14, noise_mm=0.3):
    rng = np.random.default_rng(seed)
    deltas = rng.normal(size=(K, 2 * s, 3)).astype(np.float32) * rng.uniform(0.2, 2, size=(1, 2 * s, 1))
    vertices = np.stack([np.arange(s), np.arange(s)], axis=1)
    vertices[:pairs, 1] += s
    sites = Sites(vertices, rng.uniform(size=(K, s)), np.ones(s))
    covers = sites.relative_displacement > 0.8
    return Search(
        Observation(deltas, np.ones(2 * s, dtype=bool), noise_mm), sites, covers[covers.any(axis=1)], None, budget
    )


def start_of(search):
    """A cover, one site after another."""
    chosen = ()
    for row in search.covers:
        if not row[list(chosen)].any() and row.any():
            chosen = (*chosen, int(row.argmax()))
    return chosen


def holds(search, chosen, target_mm):
    goal = Goal(search, target_mm)
    return (goal.error(chosen) <= target_mm and goal.rank(chosen) == search.observation.full_rank) and search.misses(
        chosen
    ) == 0


@pytest.mark.parametrize("seed", range(12))
def test_no_smaller_choice_of_a_small_face_reaches_the_goal_by_more_than_one_landmark(seed):
    search = problem(seed)
    target = 1.1 * Goal(search, 0.0).error(tuple(range(7)))
    found = fewest(search, start_of(search), target)
    assert holds(search, found, target)
    smaller = combinations(range(14), len(found) - 2)
    assert not any(holds(search, one, target) for one in smaller)


@pytest.mark.parametrize("seed", range(6))
def test_no_landmark_of_it_can_be_spared(seed):
    search = problem(seed, pairs=6, budget=20)
    target = 1.2 * Goal(search, 0.0).error(tuple(range(8)))
    found = fewest(search, start_of(search), target)
    assert holds(search, found, target)
    assert not any(holds(search, tuple(o for o in found if o != site), target) for site in found)


def test_what_cannot_be_had_ends_where_another_landmark_is_not_worth_its_while():
    search = problem(3, s=300, budget=300)
    found = fewest(search, start_of(search), target_mm=0.0)
    assert len(found) < 120
    goal = Goal(replace(search, budget=len(found) + 1), 0.0)
    assert goal.error(goal.of(len(found) + 1).fill(found)) > goal.error(found) * (1 - 1.5 * LEAST_GAIN)


@pytest.mark.parametrize("seed", range(4))
def test_where_the_target_cannot_be_had_every_landmark_is_worth_its_while(seed):
    search = problem(seed, s=80, budget=80)
    found = fewest(search, start_of(search), target_mm=0.0)
    goal = Goal(search, 0.0)
    spared = [tuple(other for other in found if other != site) for site in found]
    retained = [one for one in spared if search.misses(one) == 0 and goal.rank(one) == K]
    assert all(goal.error(one) > goal.error(found) * (1 + LEAST_GAIN) for one in retained)


@pytest.mark.parametrize("seed", range(6))
def test_no_exchange_of_one_landmark_lowers_its_error(seed):
    search = problem(seed, s=40, budget=40)
    target = 1.1 * Goal(search, 0.0).error(tuple(range(12)))
    found = fewest(search, start_of(search), target)
    exchanged = replace(search, budget=len(found)).swap_all(found)
    assert Goal(search, target).error(exchanged) == pytest.approx(Goal(search, target).error(found))


def with_a_shy_site(seed, like):
    """The fifth blendshape moves one site alone and little; that site else moves as site number `like` does."""
    search, shy = problem(seed, s=30, budget=30), 7
    deltas = search.observation.deltas.copy()
    deltas[4] = 0
    deltas[:, shy] = deltas[:, like] if like is not None else 0
    deltas[4, shy] = 0.05
    return replace(search, observation=replace(search.observation, deltas=deltas), covers=search.covers[:0]), shy


def test_a_mix_that_costs_the_others_nothing_is_told_apart_though_the_error_does_not_ask_for_it():
    plain, _ = with_a_shy_site(6, like=None)
    target = Goal(plain, 0.0).error((0, 1, 2, 3))
    message = next(site for site in fewest(plain, (0,), target))
    search, shy = with_a_shy_site(6, like=message)
    found = fewest(search, (0,), target)
    assert shy in found
    assert Goal(search, 0.0).rank(found) == K


def test_a_mix_that_costs_the_others_more_than_hardly_anything_is_not_told_apart():
    search, shy = with_a_shy_site(6, like=None)
    found = fewest(search, (0,), Goal(search, 0.0).error((0, 1, 2, 3)))
    assert shy not in found
    assert Goal(search, 0.0).rank(found) == K - 1


@pytest.mark.parametrize("unit", [1e-3, 1.0, 1e3])
def test_which_sites_answer_to_a_mix_that_is_not_told_apart_does_not_depend_on_the_unit(unit):
    search, shy = with_a_shy_site(6, like=None)
    small = replace(search.observation, deltas=search.observation.deltas * np.float32(unit))
    goal = Goal(replace(search, observation=small), 0.0)
    assert np.flatnonzero(goal.answering((0, 1, 2, 3))).tolist() == [shy]


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("share", [1.1, 0.0], ids=["reached", "out of reach"])
def test_no_budget_of_as_many_landmarks_has_a_lower_error_by_more_than_hardly(seed, share):
    search = problem(seed, s=40, pairs=12, budget=30)
    start, target = start_of(search), share * Goal(search, 0.0).error(tuple(range(12)))
    found = fewest(search, start, target)
    goal, most = Goal(search, target), search.landmarks(found)
    budget = spend_budget(search.observation, search.sites, search.covers, np.array(start), budget=most, spacing=None)
    assert goal.error(found) <= goal.error(tuple(budget.tolist())) * (1 + HARDLY)


def test_it_never_goes_above_the_ceiling():
    search = problem(4, s=60, budget=9, noise_mm=3.0)
    assert len(fewest(search, start_of(search), target_mm=0.0)) <= 9


def test_a_rank_that_is_not_full_asks_for_more_landmarks_than_the_error():
    search = problem(5)
    easy = 10 * Goal(search, 0.0).error(())
    found = fewest(replace(search, covers=search.covers[:0]), (0,), easy)
    assert Goal(search, easy).rank(found) == K
    assert len(found) == 2  # six coordinates for five mixes


@pytest.mark.parametrize(
    ("cover", "rank", "most"), [(12, 51, 102), (80, 51, 120), (12, 251, 126)], ids=["usual", "cover", "coordinates"]
)
def test_the_ceiling_is_half_as_many_again_as_is_usual_or_needed(cover, rank, most):
    assert ceiling(cover, rank) == most


def information(error_mm):
    return Information(68, 50, 51, 100.0, 0.2, error_mm)


def test_points_that_tell_less_than_dots_anywhere_are_no_target():
    assert target_of({SIXTY_EIGHT: information(0.18), EVEN: information(0.25)}) == (SIXTY_EIGHT, 0.18)
    assert target_of({SIXTY_EIGHT: information(2.11), EVEN: information(0.25)}) == (EVEN, 0.25)
    assert target_of({EVEN: information(0.25), "single set cover": information(0.1)}) == (EVEN, 0.25)


def test_on_the_sample_no_budget_of_as_many_landmarks_is_better_by_more_than_hardly(face, studio):
    count = len(studio.landmarks)
    budget = design_layout(face, LayoutSettings(method="budget", budget=count))
    assert studio.information.error_mm <= budget.information.error_mm * (1 + HARDLY)


def test_a_budget_of_two_fewer_does_not_reach_the_target(face, studio):
    budget = design_layout(face, LayoutSettings(method="budget", budget=len(studio.landmarks) - 2))
    assert budget.information.error_mm > target_of(studio.references)[1]


def test_it_says_which_landmark_to_spare_first(studio):
    assert sorted(studio.order) == sorted(m.name for m in studio.landmarks)
    assert len(studio.curve_mm) == len(studio.landmarks)
    assert studio.curve_mm[-1] == pytest.approx(studio.information.error_mm, abs=1e-4)


def test_no_layout_of_as_many_landmarks_can_predict_less_than_its_bound(studio):
    assert 0.9 * studio.information.error_mm < studio.error_bound.error_mm <= studio.information.error_mm


def test_wider_zones_without_dots_end_in_a_number_that_people_glue(face):
    wide = LayoutSettings(keep_out={"lash line": 8.0, "wet lip": 12.0, "nostril rim": 8.0})
    layout = design_layout(face, wide)
    assert len(layout.landmarks) < 68
    assert layout.information.error_mm > target_of(layout.references)[1]


def test_planned_again_from_itself_it_stays_as_small(face, studio):
    again = design_layout(face, LayoutSettings(), former=studio)
    assert len(again.landmarks) <= len(studio.landmarks)


def test_planned_again_from_too_few_it_reaches_every_blendshape(face, studio):
    few = design_layout(face, LayoutSettings(method="budget", budget=4))
    again = design_layout(face, LayoutSettings(), former=few)
    assert set(few.uncovered) > set(studio.uncovered)
    assert again.uncovered == studio.uncovered


def test_a_budget_that_binds_is_spent_as_a_whole(face):
    layout = design_layout(face, LayoutSettings(budget=20))
    assert layout.method == "budget"
    assert len(layout.landmarks) == 20


def test_the_search_of_a_task_keeps_all_that_can_be_reached(face):
    task = task_of(face, LayoutSettings())
    assert len(search_of(task, 10).covers) == len(task.reachable)
    assert not len(search_of(task, 10, covered=False).covers)
