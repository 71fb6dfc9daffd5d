"""Takes stored as markers: sizes as printed, corrections that fall with their rank, key points that end exact."""

import numpy as np
import pytest

from capture_plan.errors import InfeasibleError
from capture_plan.evaluation.le2013.skinning import (
    ShellSizes,
    coefficients,
    corrected_error,
    corrected_ratio,
    key_points,
    key_points_error,
    key_points_ratio,
    leading,
    markers_ratio,
    poses,
    skinning,
    varimax,
)
from capture_plan.shell.model import Shell
from capture_plan.shell.motion import motion_of
from tests.solids import sphere

# Le et al. 2013, Table 1 (simplified where there is a simplified mesh) and the ratios of Table 4 by number of markers
MODELS = (
    ShellSizes(23725, 46853, 384),
    ShellSizes(25342, 49999, 361),
    ShellSizes(25340, 49999, 77),
    ShellSizes(25301, 50000, 226),
    ShellSizes(25274, 49999, 321),
)
MARKERS = (40, 60, 80, 100)
PRINTED = (
    ((106.8, 16.3, 17.1), (98.1, 11.3, 11.7), (90.6, 8.7, 8.9), (84.2, 7.1, 7.2)),
    ((102.7, 15.4, 16.1), (95.1, 10.7, 11.1), (88.5, 8.2, 8.4), (82.8, 6.7, 6.8)),
    ((25.8, 3.5, 3.6), (25.3, 2.4, 2.5), (24.9, 1.8, 1.9), (24.4, 1.5, 1.5)),
    ((68.7, 9.8, 10.3), (65.2, 6.8, 7.0), (62.0, 5.2, 5.4), (59.2, 4.2, 4.3)),
    ((92.9, 13.7, 14.4), (86.6, 9.6, 9.9), (81.1, 7.3, 7.5), (76.3, 5.9, 6.1)),
)


@pytest.fixture(scope="module")
def take():
    """Twelve frames of a small sphere, most of their movement in a few vectors."""
    vertices, triangles = sphere(8, 12)
    rng = np.random.default_rng(0)
    shapes = rng.normal(0, 1, (12, 12)) * 2.0 ** -np.arange(12) @ rng.normal(0, 1, (12, 3 * len(vertices)))
    frames = shapes.reshape(12, -1, 3)
    return Shell(vertices, triangles, np.zeros(len(vertices), dtype=bool)), frames, np.array([3, 20, 41, 60, 77, 84])


@pytest.mark.parametrize("model", range(5))
@pytest.mark.parametrize("m", range(4))
def test_the_ratios_are_those_that_the_paper_prints(model, m):
    n, markers, (ours, corrected, points) = MODELS[model], MARKERS[m], PRINTED[model][m]
    assert f"{markers_ratio(n, markers):.1f}" == f"{ours:.1f}"
    assert f"{corrected_ratio(n, markers, markers // 2):.1f}" == f"{corrected:.1f}"
    assert f"{key_points_ratio(n, markers, markers // 2):.1f}" == f"{points:.1f}"


def test_a_correction_misses_what_the_other_singular_values_of_the_residual_hold(take):
    shell, frames, markers = take
    W = shell.weights(markers)
    R = (frames - np.einsum("vm,tmx->tvx", W, frames[:, markers])).reshape(len(frames), -1)
    sigma = np.linalg.svd(R, compute_uv=False)
    motion = motion_of(frames)
    for rank in range(7):
        tail = np.sqrt((sigma[rank:] ** 2).sum() / (len(shell.vertices) * len(frames)))
        assert corrected_error(shell, motion, markers, rank) == pytest.approx(tail, rel=1e-6)


def test_a_correction_of_more_vectors_misses_less(take):
    shell, frames, markers = take
    errors = [corrected_error(shell, motion_of(frames), markers, rank) for rank in range(13)]
    assert (np.diff(errors[:10]) < 0).all()
    assert errors[-1] < 1e-6 * errors[0]


def test_a_correction_of_no_vector_is_the_error_of_the_markers(take):
    shell, frames, markers = take
    found = skinning(shell, motion_of(frames), markers, ShellSizes(len(shell.vertices), len(shell.triangles), 12))
    assert corrected_error(shell, motion_of(frames), markers, 0) == pytest.approx(found.markers_mm)
    assert found.markers_mm == pytest.approx(motion_of(frames).rmse_mm(shell.weights(markers), markers))
    assert found.corrected_mm == pytest.approx(corrected_error(shell, motion_of(frames), markers, 3))
    assert "corrected_mm" in found.fitted
    assert "markers_mm" not in found.fitted


def test_key_points_are_exact_with_every_vector(take):
    _, frames, _ = take
    assert key_points_error(motion_of(frames), 24, 12) < 1e-7


def test_key_points_cannot_do_better_than_their_vectors(take):
    _, frames, _ = take
    P = poses(motion_of(frames).rows)
    for rank in (2, 4, 6):
        B = leading(P, rank)
        least = np.sqrt(((P - P @ B.T @ B) ** 2).sum() / frames.shape[1])
        assert key_points_error(motion_of(frames), 2 * rank, rank) >= least
        everywhere = coefficients(P, B, np.arange(frames.shape[1]))
        assert np.sqrt(((P - everywhere @ B) ** 2).sum() / frames.shape[1]) == pytest.approx(least)


def test_key_points_are_different_vertices(take):
    _, frames, _ = take
    P = poses(motion_of(frames).rows)
    assert len(set(key_points(P, leading(P, 5), 10).tolist())) == 10
    with pytest.raises(InfeasibleError, match="3 key points for 5 vectors"):
        key_points(P, leading(P, 5), 3)


def test_more_key_points_go_where_most_is_missed(take):
    _, frames, _ = take
    P = poses(motion_of(frames).rows)
    B = leading(P, 3)
    at = key_points(P, B, 6)
    for n in (3, 4, 5):
        missed = P - coefficients(P, B, at[:n]) @ B
        each = np.square(missed).sum(axis=0).reshape(-1, 3).sum(axis=1)
        each[at[:n]] = -1
        assert each[at[n]] == pytest.approx(each.max())


def test_turning_vectors_keeps_their_space_and_makes_them_sparser(take):
    _, frames, _ = take
    B = leading(poses(motion_of(frames).rows), 4)
    T = varimax(B)
    assert np.allclose(T @ T.T, np.eye(4))
    assert np.allclose(T.T @ T, B.T @ B)
    assert (T**4).sum() > (B**4).sum()


def test_shapes_hold_the_movement_of_the_frames(take):
    _, frames, _ = take
    flat = frames.reshape(len(frames), -1)
    P = poses(motion_of(frames).rows)
    assert np.allclose(P.T @ P, flat.T @ flat / len(frames))
