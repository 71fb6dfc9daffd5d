"""Laws of the 68 points: the sample's own come back, sides mirror, and a bent, scaled, coarser head gets them too."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from solids import square

from capture_plan.errors import RigError
from capture_plan.layout.empirical import (
    fit,
    fit_ibug68,
    ibug68_of_sample,
    own_nearest,
    place_ibug68,
    stiffness,
)
from capture_plan.mesh import vertex_normals
from capture_plan.rig import Rig, sample_rig

# subject's right and left of the 68 points, iBUG's order
MIRROR = [*range(16, -1, -1), *range(26, 16, -1), 27, 28, 29, 30, 35, 34, 33, 32, 31, 45, 44, 43, 42, 47, 46, 39, 38]
MIRROR += [37, 36, 41, 40, 54, 53, 52, 51, 50, 49, 48, 59, 58, 57, 56, 55, 64, 63, 62, 61, 60, 67, 66, 65]


@cache
def on_the_sample():
    return fit_ibug68(sample_rig())


def error_mm(rig, vertices):
    return np.linalg.norm(rig.neutral[vertices] - rig.neutral[ibug68_of_sample()], axis=1)


def test_the_samples_points_lie_on_its_skin_apart_and_mirrored():
    rig, points = sample_rig(), ibug68_of_sample()
    place = rig.neutral[points]
    assert len(set(points.tolist())) == 68
    assert rig.skin[points].all()
    assert np.abs(place[MIRROR] - place * [-1, 1, 1]).max() < 0.1
    assert (place[:8, 0] < 0).all()  # counted from the subject's right, which is -x


def test_features_follow_each_other_down_the_sample():
    y = sample_rig().neutral[ibug68_of_sample(), 1]
    assert (np.diff(y[27:31]) < 0).all()  # bridge of the nose
    brow, eye, tip, upper, lower, chin = y[19], y[36], y[30], y[51], y[57], y[8]
    assert brow > eye > tip > upper > lower > chin


def test_the_sample_gets_its_own_points_back():
    rig = sample_rig()
    placement = on_the_sample()
    assert np.mean(error_mm(rig, placement.vertices)) < 1.5
    assert placement.residual_mm < 0.5


def test_size_and_place_do_not_matter():
    rig = sample_rig()
    moved = replace(rig, neutral=1.3 * rig.neutral + [0, -500, 200], deltas=1.3 * rig.deltas)
    assert (place_ibug68(moved) == on_the_sample().vertices).mean() > 0.95  # rounding may decide between equals


def test_a_bent_head_gets_the_points_of_the_head_it_was_bent_from():
    """12 % wider jaw, longer chin, deeper profile: the points move with the skin."""
    rig = sample_rig()
    x, y, z = rig.neutral.T
    low = np.clip((735 - y) / 100, 0, 1)
    bent = np.stack([x * (1 + 0.12 * low), y - 8 * low**2, z * 1.06 + 3 * low], axis=1)
    head = replace(rig, neutral=bent)
    vertices = place_ibug68(head)
    assert len(set(vertices.tolist())) == 68
    assert rig.skin[vertices].all()
    assert np.mean(error_mm(head, vertices)) < 3
    assert np.max(error_mm(head, vertices)) < 12


def test_a_poor_fit_shows_in_the_residual():
    rig = sample_rig()
    rough = rig.neutral + 4 * np.random.default_rng(0).normal(size=rig.neutral.shape) * (rig.neutral[:, [2]] > 50)
    assert fit_ibug68(replace(rig, neutral=rough)).residual_mm > 3 * on_the_sample().residual_mm


def test_same_rig_same_points():
    assert np.array_equal(place_ibug68(sample_rig()), on_the_sample().vertices)


def test_stiffness_leaves_planes_alone_and_is_symmetric():
    """A shape of constant slope inside a regular grid costs nothing; a lone bump does."""
    x, y = np.meshgrid(np.arange(7.0), np.arange(7.0))
    first = (np.arange(6)[:, None] * 7 + np.arange(6)).ravel()
    triangles = np.concatenate([np.stack([first, first + 1, first + 8], 1), np.stack([first, first + 8, first + 7], 1)])
    K = stiffness(triangles, 49).toarray()
    assert np.allclose(K, K.T)
    assert np.allclose(K @ np.ones(49), 0)
    assert np.linalg.eigvalsh(K).min() > -1e-12
    inner = (2 * x + 3 * y).ravel()
    assert (K @ inner).reshape(7, 7)[3, 3] == pytest.approx(0, abs=1e-9)
    assert np.eye(49)[24] @ K @ np.eye(49)[24] > 1


def test_fit_lays_a_sheet_onto_a_sheet_beside_it():
    count = np.linspace(-1, 1, 13)
    x, y = (grid.ravel() for grid in np.meshgrid(count, count))
    first = (np.arange(12)[:, None] * 13 + np.arange(12)).ravel()
    triangles = np.concatenate(
        [np.stack([first, first + 1, first + 14], 1), np.stack([first, first + 14, first + 13], 1)]
    )
    start = np.stack([x, y, np.zeros_like(x)], axis=1)
    skin = np.stack([x, y, 0.1 + 0.05 * x**2], axis=1)
    p = fit(start, triangles, skin, vertex_normals(skin, triangles))
    assert np.abs(p - start)[:, 2].mean() > 0.08
    assert np.sqrt(np.mean((p - skin) ** 2)) < 0.01


def test_each_point_gets_a_vertex_of_its_own_facing_the_same_way():
    p = np.array([[0.0, 0, 0], [0.01, 0, 0]])
    up = np.array([[0.0, 0, 1]] * 2)
    q = np.array([[0.0, 0, 0], [0.0, 0, 0], [0.05, 0, 0]])
    m = np.array([[0.0, 0, -1], [0.0, 0, 1], [0.0, 0, 1]])
    assert own_nearest(p, up, q, m).tolist() == [1, 2]


def test_a_mesh_too_coarse_for_68_points_is_refused_in_one_line():
    vertices, triangles = square((0, 0, 0), (50, 0, 0), (0, 50, 0))
    deltas = np.zeros((1, 4, 3), dtype=np.float32)
    deltas[0, 0, 2] = 5
    rig = Rig(
        name="plate",
        neutral=vertices,
        triangles=triangles,
        deltas=deltas,
        names=("up",),
        skin=np.ones(4, dtype=bool),
        parts=np.zeros(4, dtype=np.int32),
        part_names=("plate",),
        source_index=np.arange(4),
    )
    with pytest.raises(RigError, match="plate: 4 skin vertices for 68 points"):
        place_ibug68(rig)
