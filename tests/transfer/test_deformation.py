"""Deformation transfer, and the Poisson problem under it."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from capture_plan.errors import RigError
from capture_plan.mesh import similarity_fit
from capture_plan.sample import sample_rig
from capture_plan.transfer.deformation import SourceFrames, deformation_transfer, frames
from capture_plan.transfer.surface import Surface
from tests.solids import BOX, BOX_SIDES, patch, sphere, together

RIG = sample_rig()
SOME = RIG.deltas[[RIG.names.index(name) for name in ("jawOpen", "eyeBlinkLeft", "eyeLookUpLeft")]].astype(float)
EXACT_MM = 1e-6


def transferred(target, deltas=SOME):
    return deformation_transfer(RIG.neutral, RIG.triangles, deltas, target)


def test_the_same_face_gets_the_same_blendshapes():
    assert np.abs(transferred(RIG.neutral) - SOME).max() < EXACT_MM


def test_turning_moving_and_scaling_the_target_does_the_same_to_its_blendshapes():
    sR = 0.7 * Rotation.from_euler("xyz", [20, -50, 130], degrees=True).as_matrix()
    assert np.abs(transferred(RIG.neutral @ sR.T + [10, -400, 30]) - SOME @ sR.T).max() < EXACT_MM


def test_no_movement_stays_none():
    assert not transferred(RIG.neutral * [1.2, 0.6, 1], np.zeros((1, *RIG.neutral.shape))).any()


def test_what_no_blendshape_moves_stays_in_place():
    blink = SOME[1:2]
    moved = transferred(RIG.neutral * [1.2, 0.6, 1], blink)
    assert not moved[:, np.linalg.norm(blink[0], axis=1) == 0].any()
    assert np.abs(moved).max() > 1


def test_a_triangle_that_is_a_line_tells_nothing_of_a_pose_and_the_others_nothing_of_rest():
    neutral, triangles = together(
        sphere(5, 6, 10.0), (np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0.0]]), np.array([[0, 1, 2]]))
    )
    source, line = SourceFrames.of(neutral, triangles), np.arange(len(triangles)) == len(triangles) - 1
    assert (source.solid == ~line).all()
    assert np.abs(source.gradients(neutral)).max() < 1e-12
    posed = source.gradients(neutral + np.random.default_rng(0).normal(size=neutral.shape))
    assert not posed[line].any()
    assert np.abs(posed[~line]).max(axis=(1, 2)).min() > 1e-3


def test_it_is_the_least_squares_solution_with_the_fourth_vertex():
    """Sumner & Popovic's own system, their fourth vertices among the unknowns, each triangle weighed by its area."""
    rng = np.random.default_rng(5)
    neutral, triangles = sphere(5, 6, 10.0)
    target = neutral * [1.3, 0.6, 1.0] + rng.normal(0, 0.3, neutral.shape)
    delta = rng.normal(0, 1, neutral.shape)
    delta[triangles[0]] = 0
    v, f = len(neutral), len(triangles)
    R, _ = similarity_fit(neutral, target)
    R /= np.cbrt(np.linalg.det(R))
    S = frames(neutral + delta, triangles) @ np.linalg.inv(frames(neutral, triangles))
    S = R @ S @ R.T
    inverse = np.linalg.inv(frames(target, triangles))
    area = 0.5 * np.linalg.norm(np.cross(*np.moveaxis(frames(target, triangles)[:, :, :2], 2, 0)), axis=1)
    rows, right = [], []
    for t, (a, b, c) in enumerate(triangles):
        for axis in range(3):  # column `axis` of [b - a, c - a, d - a] W^-1
            row = np.zeros(v + f)
            row[[b, c, v + t]] = inverse[t, :, axis]
            row[a] = -inverse[t, :, axis].sum()
            rows.append(np.sqrt(area[t]) * row)
            right.append(np.sqrt(area[t]) * S[t, :, axis])
    held = np.linalg.norm(delta, axis=1) == 0
    unknown = np.r_[~held, np.ones(f, dtype=bool)]
    rows, right = np.array(rows), np.array(right)
    x = np.linalg.lstsq(rows[:, unknown], right - rows[:, :v][:, held] @ target[held], rcond=None)[0]
    expected = np.zeros_like(target)
    expected[~held] = x[: (~held).sum()] - target[~held]
    assert np.abs(deformation_transfer(neutral, triangles, delta[None], target)[0] - expected).max() < EXACT_MM


def test_a_loose_piece_is_carried_by_its_mean():
    vertices, triangles = together(sphere(6, 8, 10.0), (5 * BOX + [30, 0, 0], BOX_SIDES))
    delta = np.zeros((1, *vertices.shape))
    delta[0, -len(BOX) :] = [0, 3, 0]
    moved = deformation_transfer(vertices, triangles, delta, vertices)
    assert np.abs(moved - delta).max() < EXACT_MM


def test_a_triangle_without_area_disturbs_nothing():
    vertices, triangles = sphere(6, 8, 10.0)
    vertices, triangles = (
        np.vstack([vertices, vertices[:1]]),
        np.vstack([triangles, [[0, 0, 1]], [[0, 1, len(vertices)]]]),
    )
    delta = np.random.default_rng(0).normal(size=(1, *vertices.shape))
    assert np.abs(deformation_transfer(vertices, triangles, delta, vertices) - delta).max() < EXACT_MM


def test_the_gradient_of_a_linear_map_is_that_map():
    vertices, triangles = patch(7.0)
    A = np.random.default_rng(1).normal(size=(3, 3))
    surface = Surface(vertices, triangles, np.zeros(len(vertices), dtype=bool))
    g = surface.gradient(vertices @ A.T).reshape(-1, 2, 3)
    assert np.allclose(g, np.einsum("xy,fya->fax", A, surface.tangents))


def test_integrating_a_gradient_gives_the_displacement_back():
    vertices, triangles = together(sphere(6, 8, 10.0), (5 * BOX, BOX_SIDES))
    x = np.random.default_rng(2).normal(size=vertices.shape)
    held = np.arange(len(vertices)) < 3
    surface = Surface(vertices, triangles, held)
    assert np.abs(surface.integrate(surface.gradient(x), x, surface.loose_means(x)) - x).max() < EXACT_MM


def test_the_normal_of_a_frame_grows_as_its_edges_do():
    vertices, triangles = sphere(5, 6, 10.0)
    assert np.allclose(frames(3 * vertices, triangles), 3 * frames(vertices, triangles))


def test_another_mesh_is_refused():
    with pytest.raises(RigError, match="the target neutral has 8 vertices, the rig has 4,939"):
        transferred(BOX)
