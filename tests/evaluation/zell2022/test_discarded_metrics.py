"""Curvature of surfaces whose curvature is known, and the other metrics that the paper discarded."""

import numpy as np
import pytest
import trimesh

from capture_plan.evaluation.zell2022.discarded_metrics import (
    conditioning,
    discarded_metrics,
    gaussian_curvature,
    mean_curvature,
    saliency,
)
from capture_plan.layout.face import see_face
from capture_plan.mesh import boundary_vertices, vertex_areas
from capture_plan.sample import sample_rig
from tests.solids import sphere


def grid(n, shape):
    """An n x n sheet of squares cut in two, and which vertices lie well inside."""
    i, j = (index.ravel() for index in np.meshgrid(np.arange(n), np.arange(n), indexing="ij"))
    a = np.flatnonzero((i < n - 1) & (j < n - 1))
    triangles = np.concatenate([np.stack([a, a + n, a + n + 1], 1), np.stack([a, a + n + 1, a + 1], 1)])
    inside = (np.minimum(i, j) > 0) & (np.maximum(i, j) < n - 1)
    return shape(i.astype(float), j.astype(float)), triangles, inside


@pytest.mark.parametrize("radius", [10.0, 80.0])
def test_a_sphere_bulges_by_one_over_r_and_its_gaussian_curvature_is_the_square(radius):
    ball = trimesh.creation.icosphere(subdivisions=4, radius=radius)
    regular = np.bincount(ball.faces.ravel()) == 6  # a third of the triangles is too little at the twelve corners of 5
    H = mean_curvature(np.array(ball.vertices), np.array(ball.faces))[regular]
    K = gaussian_curvature(np.array(ball.vertices), np.array(ball.faces))[regular]
    assert np.abs(H * radius - 1).max() < 0.06
    assert np.abs(K * radius**2 - 1).max() < 0.06


def test_the_curvature_of_any_closed_surface_sums_to_four_pi():
    vertices, triangles = sphere()
    squashed = vertices * [1.0, 0.4, 2.0]
    assert gaussian_curvature(squashed, triangles) @ vertex_areas(squashed, triangles) == pytest.approx(4 * np.pi)


def test_a_cylinder_has_half_the_mean_curvature_of_its_circle_and_no_gaussian_curvature():
    r, step = 20.0, 0.05
    vertices, triangles, inside = grid(
        30, lambda i, j: np.stack([r * np.sin(step * i), j, r * np.cos(step * i)], axis=1)
    )
    assert mean_curvature(vertices, triangles)[inside] == pytest.approx(1 / (2 * r), rel=1e-3)
    assert gaussian_curvature(vertices, triangles)[inside] == pytest.approx(0, abs=1e-9)


def test_a_plane_is_flat_and_a_border_has_no_curvature():
    vertices, triangles, _ = grid(12, lambda i, j: np.stack([i, j, 0 * i], axis=1))
    assert mean_curvature(vertices, triangles) == pytest.approx(0, abs=1e-12)
    K = gaussian_curvature(vertices, triangles)
    assert pytest.approx(0, abs=1e-12) == K
    assert (K[boundary_vertices(triangles)] == 0).all()


def test_a_dent_turns_the_sign():
    ball = trimesh.creation.icosphere(subdivisions=3, radius=10.0)
    inside_out = np.array(ball.faces)[:, ::-1]
    assert (mean_curvature(np.array(ball.vertices), inside_out) < 0).all()


def test_what_is_curved_alike_everywhere_is_not_salient_and_a_bump_is():
    vertices, triangles, inside = grid(40, lambda i, j: np.stack([i, j, 0 * i], axis=1))
    assert saliency(vertices, np.full(len(vertices), 0.3), diagonal_mm=200.0) == pytest.approx(0, abs=1e-12)
    bump = np.exp(-((vertices[:, 0] - 20) ** 2 + (vertices[:, 1] - 20) ** 2) / 4)
    S = saliency(vertices, mean_curvature(vertices + bump[:, None] * [0, 0, 1], triangles), diagonal_mm=200.0)
    assert np.linalg.norm(vertices[S.argmax(), :2] - 20) < 3
    assert inside[S.argmax()]


def test_conditioning_tells_a_line_from_a_ball():
    alike = np.eye(3)[:, None, :]
    assert conditioning(alike) == pytest.approx(1)
    along = np.array([[[1.0, 0, 0]], [[2.0, 0, 0]], [[-1.0, 0, 0]]])
    assert conditioning(along) == pytest.approx(0, abs=1e-7)
    assert conditioning(np.array([[[4.0, 0, 0]], [[0, 2.0, 0]], [[0, 0, 1.0]]])) == pytest.approx(0.25)


def test_metrics_of_a_head_are_shares_on_the_skin_that_may_be_marked():
    rig = sample_rig()
    face = see_face(rig, rig.names[:8])
    for values in discarded_metrics(face).values():
        assert np.array_equal(np.isfinite(values), face.markable)
        assert np.nanmin(values) >= 0
        assert np.nanmax(values) == 1
