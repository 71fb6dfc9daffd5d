"""Sites: relative displacement, symmetry, quality."""

import numpy as np
import pytest
from msgspec.structs import replace

from capture_plan.layout.costs import costs
from capture_plan.layout.quality import importance_weights, mean_quality, total_quality
from capture_plan.layout.settings import LayoutSettings
from capture_plan.layout.sites import mirrored_sites, moving, single_sites

NEUTRAL = np.array([[-5.0, 0, 0], [5, 0, 0], [0, 3, 0], [-1, 0, 0], [1, 0, 0]])
MIRROR = np.array([1, 0, 2, 4, 3])
EXTENT = np.array([[1.0, 0.2, 0.1, 0.0, 0.3], [0.2, 0.9, 1.0, 0.5, 0.0]])
SEEN = np.array([0.9, 0.7, 1.0, 0.5, 0.6])


def test_still_vertices_move_less_than_a_hundredth_of_the_largest():
    np.testing.assert_array_equal(moving(np.array([[100.0, 0.9, 1.1]])), [True, False, True])


def test_a_pair_takes_the_larger_displacement_and_the_smaller_visibility():
    sites = mirrored_sites(EXTENT, SEEN, np.ones(5, dtype=bool), neutral=NEUTRAL, mirror=MIRROR, spacing_mm=4.0)
    np.testing.assert_array_equal(sites.vertices, [[0, 1], [2, 2]])  # subject's right first; the near pair is left out
    np.testing.assert_array_equal(sites.size, [2, 1])
    np.testing.assert_array_equal(sites.relative_displacement, [[1.0, 0.1], [0.9, 1.0]])
    np.testing.assert_array_equal(sites.visibility, [0.7, 1.0])


def test_a_pair_with_a_forbidden_half_is_no_site():
    allowed = np.array([True, False, True, True, True])
    sites = mirrored_sites(EXTENT, SEEN, allowed, neutral=NEUTRAL, mirror=MIRROR, spacing_mm=0.0)
    np.testing.assert_array_equal(sites.vertices, [[2, 2], [3, 4]])


def test_members_are_named_once():
    sites = single_sites(EXTENT, SEEN, np.array([True, False, True, True, False]))
    np.testing.assert_array_equal(sites.members(np.array([2, 0])), [3, 0])


@pytest.mark.parametrize(("alpha", "expected"), [(0.0, 2 - 0.8), (1.0, 2 - 0.6), (0.5, 2 - 0.7)])
def test_alpha_weighs_visibility_against_displacement(alpha, expected):
    w = importance_weights(np.array([[0.8]]), np.array([0.6]), alpha)
    assert w[0, 0] == pytest.approx(expected)


def test_more_displacement_and_more_visibility_are_better():
    w = importance_weights(np.array([[0.5, 0.6, 0.6]]), np.array([0.5, 0.5, 0.7]), 0.5)[0]
    assert w[0] > w[1] > w[2]


@pytest.mark.parametrize("weights", ["paper", "lexicographic"])
def test_a_site_that_moves_by_exactly_epsilon_of_a_blendshape_is_its_candidate_and_pays_for_it(weights):
    sites = single_sites(EXTENT, SEEN, np.ones(5, dtype=bool))
    settings = LayoutSettings(epsilon=0.5, alpha=0.0, weights=weights)
    assert sites.covers(0.5)[:, 3].tolist() == [False, True]
    assert costs(sites, settings, np.arange(2), np.array([3])) == pytest.approx([2 - 0.5])
    above = costs(  # the mean over none is the worst, its sum is nothing
        sites, replace(settings, epsilon=0.51), np.arange(2), np.array([3])
    )
    assert above == pytest.approx([2.0 if weights == "lexicographic" else 0.0])


def test_sharing_a_landmark_costs_in_total_but_not_in_the_mean():
    covers, w = np.array([[True, True], [False, True]]), np.full((2, 2), 1.5)
    np.testing.assert_allclose(total_quality(covers, w), [1.5, 3.0])
    np.testing.assert_allclose(mean_quality(covers, w), [1.5, 1.5])
