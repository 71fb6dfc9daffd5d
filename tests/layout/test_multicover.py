"""Adaptive multi-cover and spacing on the sample head."""

import numpy as np
import pytest
from msgspec.structs import replace

from capture_plan.layout.costs import crowded
from capture_plan.layout.face import Face
from capture_plan.layout.multicover import adaptive_cover, best_cover
from capture_plan.layout.settings import LayoutSettings
from capture_plan.layout.sites import Sites
from capture_plan.layout.spacing import Spacing
from capture_plan.mesh import geodesic_distance, near_table, surface_graph
from capture_plan.sample import sample_rig

SETTINGS = LayoutSettings(spacing_mm=10.0)


@pytest.fixture(scope="module")
def face():
    rig = sample_rig()
    used = tuple(name for name, d in zip(rig.names, rig.displacement[:, rig.skin], strict=True) if d.max() > 1)
    return Face(rig, used, rig.skin.astype(float))


@pytest.fixture(scope="module")
def graph(face):
    return surface_graph(face.rig.neutral, face.rig.triangles)


def spacing_over(face, sites, spacing_mm=10.0):
    return Spacing(
        near_table(surface_graph(face.rig.neutral, face.rig.triangles), face.rig.neutral, spacing_mm), sites, spacing_mm
    )


def landmarks_of(sites, rounds):
    return sites.members(np.concatenate([cover.chosen for cover in rounds]))


@pytest.mark.parametrize("symmetric", [True, False])
@pytest.mark.parametrize("spacing_mm", [6.0, 14.0])
def test_all_landmarks_of_all_rounds_keep_the_spacing(face, graph, symmetric, spacing_mm):
    wanted = replace(SETTINGS, symmetric=symmetric, spacing_mm=spacing_mm)
    sites = face.sites(wanted)
    vertices = landmarks_of(sites, adaptive_cover(sites, wanted, spacing_over(face, sites, spacing_mm)))
    distance = geodesic_distance(graph, vertices)[:, vertices]
    assert distance[~np.eye(len(vertices), dtype=bool)].min() >= spacing_mm


def test_every_ball_is_a_clique_and_every_close_pair_is_known(face, graph):
    sites = face.sites(SETTINGS)
    spacing = spacing_over(face, sites)
    close = spacing.table.toarray()
    for row in spacing.balls[::37].toarray():
        clique = np.flatnonzero(row)
        assert close[np.ix_(clique, clique)].all()
    some = np.arange(0, len(sites.vertices), 41)
    along = geodesic_distance(graph, sites.vertices[some].ravel()).reshape(len(some), 2, -1).min(axis=1)
    nearest = along[:, sites.vertices].min(axis=2)
    np.testing.assert_array_equal(close[some], nearest < 10.0)


def test_a_site_is_close_when_either_of_its_landmarks_is(face):
    sites = face.sites(SETTINGS)
    spacing = spacing_over(face, sites)
    lopsided = Sites(sites.vertices.copy(), sites.relative_displacement, sites.visibility)
    pair = int(np.flatnonzero(sites.size == 2)[0])
    partner = lopsided.vertices[pair, 1]
    far = np.flatnonzero(~spacing.close(np.array([pair]))[0] & (sites.size == 2))[-1]
    lopsided.vertices[far, 1] = partner  # its other half stands where the pair's does
    assert spacing_over(face, lopsided).close(np.array([pair]))[0, far]
    assert spacing_over(face, lopsided).close(np.array([far]))[0, pair]


def test_more_rounds_never_take_landmarks_away(face):
    sites = face.sites(SETTINGS)
    spacing = spacing_over(face, sites)
    one = landmarks_of(sites, adaptive_cover(sites, replace(SETTINGS, rounds=1), spacing))
    three = landmarks_of(sites, adaptive_cover(sites, SETTINGS, spacing))
    assert set(one) <= set(three)
    assert len(three) > len(one)


def test_the_first_round_reaches_every_blendshape(face):
    sites = face.sites(SETTINGS)
    first = adaptive_cover(sites, SETTINGS, spacing_over(face, sites))[0]
    assert sites.covers(SETTINGS.epsilon)[:, first.chosen].any(axis=1).all()


@pytest.mark.parametrize("demand", [2, 3])
def test_each_blendshape_has_as_many_sites_as_it_asks_for_also_where_the_best_is_not_proved(demand, monkeypatch):
    for name, most in (("FIRST_SITES", 40), ("MOST_SITES", 40), ("FIRST_SHARE", 0)):
        monkeypatch.setattr(f"capture_plan.layout.cover.{name}", most)
    rng = np.random.default_rng(demand)
    sites = Sites(np.stack([np.arange(200)] * 2, axis=1), rng.uniform(size=(30, 200)), np.ones(200))
    wanted = replace(SETTINGS, weights="count", epsilon=0.9)
    found = best_cover(sites, wanted, np.arange(30), np.arange(200), None, demand=demand)
    assert not found.proven_optimal
    assert sites.covers(0.9)[:, found.chosen].sum(axis=1).min() >= demand


def test_lexicographic_needs_as_few_as_counting_and_suits_better(face):
    everything = np.arange(len(face.used))
    sites = face.sites(SETTINGS)
    everywhere = np.arange(len(sites.visibility))
    few = best_cover(sites, replace(SETTINGS, weights="count"), everything, everywhere, None)
    good = best_cover(sites, SETTINGS, everything, everywhere, None)
    assert sites.size[good.chosen].sum() == sites.size[few.chosen].sum() == few.objective


@pytest.mark.parametrize("pair", [False, True])
def test_a_landmark_may_own_exactly_a_tenth_of_the_blendshapes_and_each_of_a_pair_as_many(pair):
    """20 blendshapes, two landmarks or pairs; the first owns as many as it may, then one more."""
    most = 4 if pair else 2
    for owned, found in ((most, []), (most + 1, list(range(most + 1)))):
        relative = np.zeros((20, 2))
        relative[:owned, 0] = 1.0
        relative[owned:, 1] = 0.1  # too little to be a candidate
        sites = Sites(np.array([[0, 5 * pair], [1, 1]]), relative, np.ones(2))
        assert crowded(sites, np.array([0, 1]), 0.5).tolist() == found


def test_a_landmark_that_owns_too_many_blendshapes_is_crowded(face):
    sites = face.sites(SETTINGS)
    busiest = np.array([sites.covers(SETTINGS.epsilon).sum(axis=0).argmax()])
    owned = sites.covers(SETTINGS.epsilon)[:, busiest[0]]
    np.testing.assert_array_equal(crowded(sites, busiest, SETTINGS.epsilon), np.flatnonzero(owned))
