"""Laws of the cotangent Laplacian and of the areas that belong to it."""

import numpy as np
import pytest

from capture_plan.mesh import cotangent_laplacian, cotangents, mixed_areas, triangle_areas, with_area
from capture_plan.transfer.surface import Surface
from tests.shell.test_shell_state import bumpy
from tests.solids import sphere


def test_rows_sum_to_zero_and_the_matrix_is_symmetric():
    L = cotangent_laplacian(*bumpy())
    assert np.abs(L.sum(axis=1)).max() < 1e-9
    assert abs(L - L.T).max() < 1e-12


def test_it_is_minus_the_gradient_squared_over_the_areas():
    """L = -G' A G, the gradient G made triangle by triangle."""
    vertices, triangles = bumpy()
    surface = Surface(vertices, triangles, np.zeros(len(vertices), dtype=bool))
    G, A = surface.operator.toarray(), np.repeat(surface.areas, 2)
    assert cotangent_laplacian(vertices, triangles).toarray() == pytest.approx(-(G.T * A) @ G)


def test_the_angles_of_a_triangle_sum_to_half_a_turn():
    angles = np.arctan2(1, cotangents(*bumpy()))
    assert angles.sum(axis=1) == pytest.approx(np.pi)


def test_a_ball_is_curved_by_two_over_its_radius():
    """-L x = 2 H M x / r on a ball of radius r, H = 1 / r."""
    vertices, triangles = sphere(40, 80, 10.0)
    solid = with_area(vertices, triangles)
    pull = -(cotangent_laplacian(vertices, solid) @ vertices) / mixed_areas(vertices, solid)[:, None]
    inner = np.abs(vertices[:, 1]) < 9
    assert np.linalg.norm(pull[inner], axis=1) == pytest.approx(2 / 10, rel=0.02)


def test_a_triangle_without_an_area_is_left_out():
    corners = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 1, 0.0]])
    assert with_area(corners, np.array([[0, 1, 2], [0, 1, 3]])).tolist() == [[0, 1, 3]]


def test_mixed_areas_share_out_the_whole_surface():
    vertices, triangles = bumpy()
    assert mixed_areas(vertices, triangles).sum() == pytest.approx(triangle_areas(vertices, triangles).sum())
    assert (mixed_areas(vertices, triangles) > 0).all()


def test_a_corner_has_the_points_that_are_nearest_to_it():
    """The Voronoi part of each corner of a triangle without an obtuse angle, by throwing points into it."""
    corners = np.array([[0, 0, 0], [5, 0, 0], [1.5, 4, 0.0]])
    rng = np.random.default_rng(0)
    inside = rng.dirichlet(np.ones(3), 200_000) @ corners
    nearest = np.linalg.norm(inside[:, None] - corners, axis=2).argmin(axis=1)
    shares = mixed_areas(corners, np.array([[0, 1, 2]])) / 10
    assert shares == pytest.approx(np.bincount(nearest) / len(inside), abs=5e-3)
    assert np.ptp(shares) > 0.05


def test_stretching_is_the_energy_of_a_linear_map():
    """Dirichlet energy of f = n . x over a closed surface, triangle by triangle."""
    vertices, triangles = bumpy()
    f, L = vertices[:, 0], cotangent_laplacian(vertices, triangles)
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    in_plane = np.array([1.0, 0, 0]) - normal[:, :1] * normal
    energy = (triangle_areas(vertices, triangles) * np.square(in_plane).sum(axis=1)).sum()
    assert -f @ (L @ f) == pytest.approx(energy)


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_a_triangle_has_no_area_where_that_is_nothing_beside_its_longest_side(scale):
    def needle(height):
        return scale * np.array([[0, 0, 0], [100, 0, 0], [100, height, 0.0]])

    one = np.array([[0, 1, 2]])
    assert len(with_area(needle(1.9e-5), one)) == 0
    assert len(with_area(needle(2.1e-5), one)) == 1
