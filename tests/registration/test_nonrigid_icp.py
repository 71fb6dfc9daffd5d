"""Laws of the registration: planes cost nothing, a sheet comes to lie on a sheet, every point gets its own."""

import numpy as np
import pytest

from capture_plan.mesh import vertex_normals
from capture_plan.registration.nonrigid_icp import fit, graph_stiffness, own_nearest, spline_start


def test_stiffness_leaves_planes_alone_and_is_symmetric():
    """A shape of constant slope inside a regular grid costs nothing; a lone bump does."""
    x, y = np.meshgrid(np.arange(7.0), np.arange(7.0))
    first = (np.arange(6)[:, None] * 7 + np.arange(6)).ravel()
    triangles = np.concatenate([np.stack([first, first + 1, first + 8], 1), np.stack([first, first + 8, first + 7], 1)])
    K = graph_stiffness(triangles, 49).toarray()
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
    p = fit(start, triangles, skin, vertex_normals(skin, triangles), np.ones(len(skin), dtype=bool))
    assert np.abs(p - start)[:, 2].mean() > 0.08
    assert np.sqrt(np.mean((p - skin) ** 2)) < 0.01


def test_each_point_gets_a_vertex_of_its_own_facing_the_same_way():
    p = np.array([[0.0, 0, 0], [0.01, 0, 0]])
    up = np.array([[0.0, 0, 1]] * 2)
    q = np.array([[0.0, 0, 0], [0.0, 0, 0], [0.05, 0, 0]])
    m = np.array([[0.0, 0, -1], [0.0, 0, 1], [0.0, 0, 1]])
    assert own_nearest(p, up, q, m).tolist() == [1, 2]


def test_what_does_not_attract_leaves_the_sheet_where_it_was():
    count = np.linspace(-1, 1, 5)
    x, y = (grid.ravel() for grid in np.meshgrid(count, count))
    first = (np.arange(4)[:, None] * 5 + np.arange(4)).ravel()
    triangles = np.concatenate([np.stack([first, first + 1, first + 6], 1), np.stack([first, first + 6, first + 5], 1)])
    start = np.stack([x, y, np.zeros_like(x)], axis=1)
    skin = start + np.array([0, 0, 0.1])
    p = fit(start, triangles, skin, vertex_normals(skin, triangles), np.zeros(len(skin), dtype=bool))
    assert np.allclose(p, start, atol=1e-9)


def test_a_spline_through_affine_controls_is_affine():
    """Smoothing and unit do not matter where a straight map explains all control points."""
    random = np.random.default_rng(0)
    here, points = random.normal(size=(8, 3)), random.normal(size=(5, 3))
    A, b = random.normal(size=(3, 3)), random.normal(size=3)
    bent = spline_start(points, (here, here @ A + b), 2.0, 3.0, smoothing=0.5)
    assert np.allclose(bent, points @ A + b)
