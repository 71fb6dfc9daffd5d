"""Two landmarks for every blendshape, with and without a spacing, and the swarm between them."""

import numpy as np
from msgspec.structs import replace

from capture_plan.evaluation.zell2022.particle_swarm import swarm, swarm_energy
from capture_plan.evaluation.zell2022.variants import layout_vertices
from capture_plan.layout.settings import LayoutSettings
from capture_plan.mesh import geodesic_distance

FREE = LayoutSettings(method="cover", symmetric=False, spacing_mm=7.0, rounds=2, keep_out={})


def counted(face, vertices):
    return (face.relative_displacement(FREE)[:, vertices] >= FREE.epsilon).sum(axis=1)


def energy(face, vertices, needed):
    covers = face.relative_displacement(FREE)[:, vertices] >= FREE.epsilon
    return swarm_energy(face.rig.neutral[vertices], covers, needed)


def test_two_landmarks_for_each_blendshape_stand_apart_where_they_are_asked_to(face):
    off, on = (layout_vertices(face, replace(FREE, method=method)) for method in ("trivial", "distance"))
    possible = np.minimum(face.sites(FREE).covers(FREE.epsilon).sum(axis=1), 2)
    assert (counted(face, off) >= possible).all()
    assert (counted(face, on) >= possible).all()
    assert len(on) >= len(off)
    apart = geodesic_distance(face.graph, on)[:, on][~np.eye(len(on), dtype=bool)]
    assert apart.min() >= FREE.spacing_mm


def test_a_swarm_spreads_landmarks_keeps_the_cover_and_answers_alike_to_the_same_seed(face):
    start = layout_vertices(face, replace(FREE, method="trivial"))
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
