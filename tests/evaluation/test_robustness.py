"""What a layout forgives: lost landmarks, dots beside their place, mishaps. Closed forms against recomputation."""

from itertools import combinations

import numpy as np
import pytest

from capture_plan.curves.random_mixes import random_mixes
from capture_plan.evaluation.monte_carlo import misplaced_responses, neighbours, solved, swapped, trials
from capture_plan.evaluation.robustness import (
    DOT_MM,
    EXTENT_MM,
    GROWTH,
    losses,
    measured_error,
    substitutes,
    tolerances,
    unnoticed_error,
)
from capture_plan.evaluation.tangent_chart import flatten, in_words, tangent_axes
from capture_plan.layout.observation import PRIOR_SD, Observation
from capture_plan.layout.predict import performances, predict
from capture_plan.layout.weight_recovery import recover_weights
from capture_plan.mesh import surface_graph

K, SIDE = 5, 21
V = SIDE * SIDE
NAMES = tuple("abcde")
VERTICES = np.array([110, 115, 220, 325, 330])
COVERS = np.ones((K, 5), dtype=bool)


@pytest.fixture(scope="module")
def plane():
    """A flat square of 40 x 40 mm, 2 mm a step, moved by smooth bumps."""
    x, y = np.meshgrid(2.0 * np.arange(SIDE), 2.0 * np.arange(SIDE))
    neutral = np.stack([x.ravel(), y.ravel(), np.zeros(V)], axis=1)
    corner = (np.arange(SIDE - 1)[:, None] * SIDE + np.arange(SIDE - 1)).ravel()
    below = np.stack([corner, corner + 1, corner + SIDE], axis=1)
    above = np.stack([corner + 1, corner + SIDE + 1, corner + SIDE], axis=1)
    return neutral, np.concatenate([below, above])


@pytest.fixture(scope="module")
def observation(plane):
    neutral = plane[0]
    rng = np.random.default_rng(3)
    centres, directions = rng.uniform(0, 40, size=(K, 2)), rng.normal(size=(K, 3))
    bump = np.exp(-(np.linalg.norm(neutral[None, :, :2] - centres[:, None], axis=2) ** 2) / 300)
    return Observation((5 * bump[:, :, None] * directions[:, None]).astype(np.float32), np.ones(V, bool), 0.2)


@pytest.fixture(scope="module")
def charts(plane):
    neutral, triangles = plane
    normals = np.tile([0.0, 0.0, 1.0], (V, 1))
    return flatten(neutral, normals, surface_graph(neutral, triangles), VERTICES, extent_mm=EXTENT_MM)


@pytest.mark.parametrize("at_once", [1, 2])
def test_losing_landmarks_costs_what_recomputing_without_them_finds(observation, at_once):
    found = losses(observation, VERTICES, COVERS, NAMES, at_once=at_once)
    lost = list(combinations(range(5), at_once))
    assert [loss.landmarks for loss in found] == lost
    for loss, gone in zip(found, lost, strict=True):
        again = observation.error(observation.covariance(np.delete(VERTICES, gone)))
        assert loss.error_mm == pytest.approx(again, rel=1e-9)


def test_a_lost_landmark_uncovers_what_it_alone_saw(observation):
    covers = COVERS.copy()
    covers[2] = [False, True, False, False, False]
    covers[4] = False  # nobody ever saw it: no loss
    found = losses(observation, VERTICES, covers, NAMES, at_once=1)
    assert [loss.uncovered for loss in found] == [(), ("c",), (), (), ()]
    assert not found[1].carry_on


def test_carry_on_means_at_most_a_tenth_more_error(observation):
    before = observation.error(observation.covariance(VERTICES))
    for loss in losses(observation, VERTICES, COVERS, NAMES, at_once=2):
        assert loss.carry_on == (loss.error_mm <= GROWTH * before)


def test_a_dot_that_sits_elsewhere_unnoticed_costs_what_the_whole_formula_says(observation):
    B, C = observation.response(VERTICES), observation.covariance(VERTICES)
    A = np.random.default_rng(4).normal(size=(6, 3, K))
    found = unnoticed_error(observation, C, B[6:9], A)
    answer = C @ B.T / observation.noise_mm**2
    for rows, error in zip(A, found, strict=True):
        there = B.copy()
        there[6:9] = rows
        E = answer @ there - np.eye(K)
        spread = PRIOR_SD**2 * E @ E.T + observation.noise_mm**2 * answer @ answer.T
        assert error == pytest.approx(observation.error(spread), rel=1e-9)


def test_a_dot_at_its_place_costs_nothing(observation):
    B, C = observation.response(VERTICES), observation.covariance(VERTICES)
    for error in (unnoticed_error, measured_error):
        assert error(observation, C, B[:3], B[None, :3])[0] == pytest.approx(observation.error(C), rel=1e-9)


def test_a_measured_place_costs_what_recomputing_with_it_finds(observation):
    C = observation.covariance(VERTICES)
    A_m = observation.response(VERTICES[2:3])
    for vertex in (0, 100, 222):
        moved = VERTICES.copy()
        moved[2] = vertex
        found = measured_error(observation, C, A_m, observation.response(np.array([vertex]))[None])[0]
        assert found == pytest.approx(observation.error(observation.covariance(moved)), rel=1e-9)


def test_a_chart_of_a_plane_is_the_plane(plane, charts):
    neutral, _ = plane
    for chart, vertex in zip(charts, VERTICES, strict=True):
        rebuilt = neutral[vertex] + chart.flat @ chart.axes
        away = np.linalg.norm(neutral[chart.at] - neutral[vertex], axis=1)
        off = np.linalg.norm(rebuilt - neutral[chart.at], axis=1)
        assert (off <= 0.1 * away + 1e-9).all()  # distances along the mesh are a few per cent too long


def test_deltas_of_a_chart_are_those_of_its_vertices(observation, charts):
    found = charts[2].deltas(observation.deltas, charts[2].flat)
    np.testing.assert_allclose(found, np.moveaxis(observation.deltas[:, charts[2].at], 0, 2), atol=1e-5)


def test_the_skin_ends_where_the_mesh_does(charts):
    corner = charts[0]  # 10 mm from the lower edge
    down = -np.array([0.0, 1.0])
    assert corner.on_skin(np.array([9.0 * down])).all()
    assert not corner.on_skin(np.array([14.0 * down])).any()


def test_directions_are_the_subject_s_own():
    e1, e2 = tangent_axes(np.array([0.0, 0.0, 1.0]))
    assert (in_words(e1), in_words(e2), in_words(-e1)) == ("left", "up", "right")
    assert in_words(np.array([0.7, -0.7, 0.1])) == "down and left"


def test_a_landmark_may_not_leave_what_it_alone_sees(observation, charts):
    largest = np.linalg.norm(observation.deltas, axis=2).max(axis=1)
    free = tolerances(observation, VERTICES, charts, COVERS, largest, 0.5)
    alone = COVERS.copy()
    alone[0] = np.arange(5) == 2
    here = float(np.linalg.norm(observation.deltas[0, VERTICES[2]]) / largest[0])
    bound = tolerances(observation, VERTICES, charts, alone, largest, 0.98 * here)
    for (tight, tight_known), (loose, loose_known) in zip(bound, free, strict=True):
        assert tight.worst_mm <= loose.worst_mm <= loose.best_mm
        assert tight_known.worst_mm <= loose_known.worst_mm
    assert bound[2][1].worst_mm < 2


def test_the_tolerance_grows_with_the_noise(observation, charts):
    largest = np.ones(K)
    noisy = Observation(observation.deltas, observation.skin, 1.0)
    quiet = tolerances(observation, VERTICES, charts, COVERS, largest, 0.5)
    loud = tolerances(noisy, VERTICES, charts, COVERS, largest, 0.5)
    assert all(one[0].worst_mm <= other[0].worst_mm for one, other in zip(quiet, loud, strict=True))
    assert sum(one[0].worst_mm for one in quiet) < sum(other[0].worst_mm for other in loud)


def test_a_substitute_is_the_nearest_free_place_that_serves(observation, charts):
    free = np.ones((5, V), dtype=bool)
    found = substitutes(observation, VERTICES, charts, COVERS, np.ones(K), 0.5, free)
    allowed = GROWTH * observation.error(observation.covariance(VERTICES))
    for m, other in enumerate(found):
        assert other is not None
        assert other.distance_mm >= DOT_MM
        moved = VERTICES.copy()
        moved[m] = other.vertex
        error = observation.error(observation.covariance(moved))
        assert other.error_mm == pytest.approx(error, rel=1e-6)
        assert error <= allowed
    assert substitutes(observation, VERTICES, charts, COVERS, np.ones(K), 0.5, ~free) == (None,) * 5


def test_hidden_landmarks_are_as_good_as_none(observation):
    """Draws with different landmarks in sight are solved as if only those existed, all draws together."""
    B, rng = observation.response(VERTICES), np.random.default_rng(0)
    w = random_mixes(K, frames=12, seed=0)
    y = w @ B.T + 0.2 * rng.standard_normal((12, 15))
    in_sight = np.ones((12, 5), bool)
    in_sight[3:7, [1, 4]] = False
    found = solved(B, y, in_sight, noise_mm=0.2)
    some = observation.response(VERTICES[[0, 2, 3]])
    np.testing.assert_allclose(found[3:7], recover_weights(some, y[3:7][:, np.repeat(in_sight[3], 3)], noise_mm=0.2))
    np.testing.assert_allclose(found[[0, 11]], recover_weights(B, y[[0, 11]], noise_mm=0.2))


def test_swapped_markers_bring_their_places_with_them(plane, observation):
    neutral, B = plane[0], observation.response(VERTICES)
    mishap = swapped(observation, VERTICES, neutral[VERTICES], 0, 1)
    np.testing.assert_array_equal(mishap.response[:3], B[3:6])
    np.testing.assert_allclose(mishap.offset[:3], neutral[115] - neutral[110])
    np.testing.assert_allclose(mishap.offset[:3] + mishap.offset[3:6], 0)
    assert neighbours(neutral[VERTICES])[:2].tolist() == [1, 0]


def test_dots_scatter_by_the_root_mean_square_that_is_said(plane, charts):
    """Deltas that are the places themselves give the places back."""
    neutral = plane[0]
    rows = misplaced_responses(
        Observation(neutral[None], np.ones(V, bool), 0.2), charts[2:3], 2.0, np.random.default_rng(0)
    )
    off = np.linalg.norm(rows[:, :, 0] - neutral[VERTICES[2]], axis=1)
    assert np.sqrt(np.mean(off**2)) == pytest.approx(2.0, rel=0.1)


def test_mishaps_are_seeded_and_grow(plane, observation, charts):
    found = trials(observation, VERTICES, plane[0], charts)
    assert found == trials(observation, VERTICES, plane[0], charts)
    placed = [trial.error_mm for trial in found if "off its place" in trial.what]
    assert placed == sorted(placed)
    assert placed[-1] > found[0].error_mm
    assert all(trial.worst_mm > trial.error_mm for trial in found)


def test_a_trial_without_mishap_is_what_is_predicted_of_mixes(plane, observation, charts):
    expected = predict(observation, VERTICES, performances(observation, None)[0], noise_mm=observation.noise_mm)
    assert trials(observation, VERTICES, plane[0], charts)[0].error_mm == pytest.approx(expected.error_mm, rel=0.1)
