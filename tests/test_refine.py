"""Two landmarks for every blendshape, with and without a spacing, and the swarm between them."""

from itertools import combinations

import numpy as np
import pytest

from capture_plan.layout.design import spacing_on
from capture_plan.layout.face import see_face
from capture_plan.layout.refine import enough_of_each, spaced_multicover, swarm, swarm_energy, trivial_multicover
from capture_plan.layout.settings import LayoutSettings
from capture_plan.layout.sites import Sites
from capture_plan.mesh import geodesic_distance
from capture_plan.rig import sample_rig
from capture_plan.rig.audit import audit

FREE = LayoutSettings(method="cover", symmetric=False, spacing_mm=7.0)


@pytest.fixture(scope="module")
def face():
    rig = sample_rig()
    return see_face(rig, audit(rig).used)


def counted(face, vertices):
    return (face.reach(FREE)[:, vertices] >= FREE.epsilon).sum(axis=1)


def energy(face, vertices, needed):
    covers = face.reach(FREE)[:, vertices] >= FREE.epsilon
    return swarm_energy(face.rig.neutral[vertices], covers, needed)


@pytest.mark.parametrize("seed", range(6))
def test_no_fewer_sites_give_every_blendshape_two(seed):
    rng = np.random.default_rng(seed)
    reach = np.where(rng.uniform(size=(6, 9)) < 0.45, rng.uniform(0.5, 1, size=(6, 9)), 0.1)
    sites = Sites(np.repeat(np.arange(9)[:, None], 2, axis=1), reach, rng.uniform(size=9))
    covers = sites.covers(0.5)
    wanted = np.minimum(covers.sum(axis=1), 2)

    def enough(some):
        return (covers[:, list(some)].sum(axis=1) >= wanted).all()

    fewest = next(n for n in range(1, 10) if any(enough(some) for some in combinations(range(9), n)))
    found = trivial_multicover(sites, FREE)
    assert enough(found)
    assert len(found) == fewest


def test_every_kind_of_site_keeps_its_cheapest():
    covers = np.array([[1, 1, 1, 0, 1], [0, 0, 0, 1, 0]], dtype=bool)
    kept = enough_of_each(covers, np.array([3.0, 1.0, 2.0, 9.0, 2.5]), np.ones(5, dtype=int), 2)
    assert kept.tolist() == [1, 2, 3]


def test_two_landmarks_for_each_blendshape_stand_apart_where_they_are_asked_to(face):
    sites = face.sites(FREE)
    spacing = spacing_on(face.rig, sites, FREE)
    off, on = trivial_multicover(sites, FREE), spaced_multicover(sites, FREE, spacing)
    possible = np.minimum(sites.covers(FREE.epsilon).sum(axis=1), 2)
    assert (counted(face, off) >= possible).all()
    assert (counted(face, on) >= possible).all()
    assert len(on) >= len(off)
    apart = geodesic_distance(spacing.graph, on)[:, on][~np.eye(len(on), dtype=bool)]
    assert apart.min() >= FREE.spacing_mm


def test_a_swarm_spreads_landmarks_keeps_the_cover_and_answers_alike_to_the_same_seed(face):
    start = trivial_multicover(face.sites(FREE), FREE)
    needed = np.minimum(counted(face, start), 2)
    spread = swarm(face, FREE, start, seed=3)
    assert energy(face, spread, needed) < energy(face, start, needed)
    assert (counted(face, spread) >= needed).all()
    assert face.allowed(FREE)[spread].all()
    assert np.array_equal(spread, swarm(face, FREE, start, seed=3))
    assert not np.array_equal(spread, swarm(face, FREE, start, seed=4))


def test_energy_falls_with_distance_and_rises_with_what_is_missing():
    near, far = np.array([[0.0, 0, 0], [1, 0, 0]]), np.array([[0.0, 0, 0], [5, 0, 0]])
    covers = np.array([[True, False]])
    assert swarm_energy(near, covers, np.array([1])) == -2
    assert swarm_energy(far, covers, np.array([1])) == -10
    assert swarm_energy(far, covers, np.array([2])) > swarm_energy(near, covers, np.array([1]))
