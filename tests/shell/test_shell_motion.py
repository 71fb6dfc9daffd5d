"""Laws of dense motion as rows, and of where it ends."""

import numpy as np
import pytest

from capture_plan.errors import RigError
from capture_plan.shell import Motion, motion_from_rig, motion_of, stack_sessions, with_mirror_image
from capture_plan.shell.boundary import end_of_mesh, find_boundary, neighbours_of
from tests.shell.test_shell_model import some_markers
from tests.shell.test_shell_optimise import symmetric_shell
from tests.shell.test_shell_state import bumpy, shell_of


def recorded(t=20, k=4, seed=0):
    rng = np.random.default_rng(seed)
    v = len(bumpy()[0])
    deltas, weights = rng.normal(0, 3, (k, v, 3)), rng.uniform(0, 1, (t, k))
    return weights, deltas, np.einsum("tk,kvx->tvx", weights, deltas)


def direct(X, W, H, s):
    """RMSE over vertices and frames, from its definition."""
    missed = X - np.einsum("vm,tmx->tvx", W, X[:, H])
    return np.sqrt((np.square(missed).sum(axis=2) @ s).mean() / s.sum())


def test_the_error_is_the_root_of_the_mean_square_over_vertices_and_frames():
    shell, (_, _, X), H = shell_of(True), recorded(), np.array([10, 60, 127, 240])
    W, s = shell.weights(H), np.random.default_rng(1).uniform(0, 2, len(shell.vertices))
    assert motion_of(X).rmse_mm(W, H) == pytest.approx(direct(X, W, H, np.ones(len(s))))
    assert motion_of(X).weighted(s).rmse_mm(W, H) == pytest.approx(direct(X, W, H, s))


def test_a_rig_and_its_weights_give_the_products_of_its_frames():
    weights, deltas, X = recorded()
    a, b = motion_from_rig(weights, deltas).rows, motion_of(X).rows
    assert a.shape[1] == 3 * len(deltas)
    assert np.allclose(a @ a.T, b @ b.T)


def test_one_idle_blendshape_does_no_harm():
    weights, deltas, X = recorded()
    weights[:, 1] = 0
    rows = motion_from_rig(weights, deltas).rows
    X = motion_of(np.einsum("tk,kvx->tvx", weights, deltas)).rows
    assert np.allclose(rows @ rows.T, X @ X.T)


@pytest.mark.parametrize("tail", [0.0, 0.5, 2.0])
def test_compression_leaves_out_no_more_than_said(tail):
    motion = motion_of(recorded()[2]).weighted(np.random.default_rng(2).uniform(0, 3, len(bumpy()[0])))
    small = motion.compressed(tail)
    power = np.square(motion.rows).sum(axis=1) @ motion.weights, np.square(small.rows).sum(axis=1) @ motion.weights
    assert power[0] - power[1] <= tail**2 * motion.weights.sum() * (1 + 1e-9) + 1e-9 * power[0]
    assert small.rows.shape[1] <= 12  # four blendshapes have no more


@pytest.mark.parametrize("tail", [0.3, 1.0, 2.0])
def test_compression_keeps_the_fewest_rows_that_do(tail):
    """One strongest direction less, by the singular values of the weighted rows, would leave out too much."""
    s = np.random.default_rng(2).uniform(0, 3, len(bumpy()[0]))
    motion = motion_of(recorded(k=7)[2]).weighted(s)
    power = np.linalg.svd(np.sqrt(s)[:, None] * motion.rows, compute_uv=False) ** 2
    r = motion.compressed(tail).rows.shape[1]
    assert power[r:].sum() <= tail**2 * s.sum() * (1 + 1e-9) < power[r - 1 :].sum()


def test_compression_to_nothing_left_out_changes_no_error():
    shell, motion, H = shell_of(True), motion_of(recorded()[2]), np.array([10, 60, 127, 240])
    W = shell.weights(H)
    assert motion.compressed(0.0).rmse_mm(W, H) == pytest.approx(motion.rmse_mm(W, H), rel=1e-9)


def test_sessions_count_alike_however_long():
    shell, H = shell_of(True), np.array([10, 60, 127, 240])
    W, a, b = shell.weights(H), recorded(20)[2], recorded(5, seed=3)[2]
    both = stack_sessions([motion_of(a), motion_of(b)]).rmse_mm(W, H)
    assert both**2 == pytest.approx((motion_of(a).rmse_mm(W, H) ** 2 + motion_of(b).rmse_mm(W, H) ** 2) / 2)
    assert stack_sessions([motion_of(a)] * 3).rmse_mm(W, H) == pytest.approx(motion_of(a).rmse_mm(W, H))


def test_mirrored_motion_judges_a_layout_as_its_mirror_image():
    shell, mirror = symmetric_shell()
    X = np.random.default_rng(0).normal(0, 3, (6, len(mirror), 3))
    both = with_mirror_image(motion_of(X), mirror)
    turned = X[:, mirror] * [-1, 1, 1]
    H = some_markers(shell, 6)
    here, there = (direct(X, shell.weights(at), at, np.ones(len(mirror))) for at in (H, mirror[H]))
    assert motion_of(turned).rmse_mm(shell.weights(H), H) == pytest.approx(there)
    assert np.allclose(np.split(both.rows, 2, axis=1)[1], motion_of(turned).rows / np.sqrt(2))
    assert both.rmse_mm(shell.weights(H), H) == pytest.approx(np.sqrt((here**2 + there**2) / 2))
    with pytest.raises(RigError, match="mirror first"):
        with_mirror_image(both.compressed(), mirror)


def test_what_is_no_motion_is_refused():
    with pytest.raises(RigError, match="not finite"):
        Motion(np.full((3, 2), np.nan), np.ones(3))
    with pytest.raises(RigError, match="2 weights for 3"):
        Motion(np.ones((3, 2)), np.ones(2))
    with pytest.raises(RigError, match="without frames"):
        motion_of(np.zeros((0, 4, 3)))
    with pytest.raises(RigError, match="one mesh"):
        stack_sessions([Motion(np.ones((3, 2)), np.ones(3)), Motion(np.ones((4, 2)), np.ones(4))])


def test_the_boundary_runs_beside_what_moves_in_steps():
    vertices, triangles = bumpy(0, 36, 48)
    extent = np.maximum(vertices[:, 2], 0)
    found = find_boundary(vertices, triangles, extent, apart_mm=10.0)
    assert np.array_equal(found.moving, extent >= 0.5)
    assert not (found.fixed & found.moving).any()
    assert neighbours_of(triangles, found.moving)[found.fixed].all()
    at = np.flatnonzero(found.fixed)
    apart = np.linalg.norm(vertices[at, None] - vertices[at], axis=2) + 1e9 * np.eye(len(at))
    line = np.flatnonzero(~found.moving & neighbours_of(triangles, found.moving))
    to_fixed = np.linalg.norm(vertices[line, None] - vertices[at], axis=2).min(axis=1)
    assert apart.min() >= 10 - 1e-6
    assert to_fixed.max() < 10


def test_vertices_beside_some_share_a_triangle_with_one_of_them():
    vertices, triangles = bumpy()
    some = np.random.default_rng(0).uniform(size=len(vertices)) < 0.05
    near = {int(v) for triangle in triangles for v in triangle for u in triangle if u != v and some[u]}
    assert set(np.flatnonzero(neighbours_of(triangles, some)).tolist()) == near


def test_a_border_that_moves_is_not_fixed():
    vertices, triangles = bumpy()
    front = triangles[(vertices[triangles, 2] > 0).all(axis=1)]
    assert not find_boundary(vertices, front, np.full(len(vertices), 3.0)).fixed.any()
    still = find_boundary(vertices, front, np.zeros(len(vertices)))
    assert still.fixed.any()
    assert not still.moving.any()


def test_the_end_of_a_mesh_carries_no_marker_but_the_rim_of_a_hole_does():
    x, y = np.meshgrid(np.arange(9.0), np.arange(9.0), indexing="ij")
    vertices = np.stack([x.ravel(), y.ravel(), 0 * x.ravel()], axis=1)
    corner = (np.arange(8)[:, None] * 9 + np.arange(8)).ravel()
    retained = corner[corner != 4 * 9 + 4]
    triangles = np.vstack([retained[:, None] + [0, 9, 10], retained[:, None] + [0, 10, 1]])
    outer = (np.abs(vertices[:, :2] - 4).max(axis=1) == 4).astype(bool)
    assert np.array_equal(end_of_mesh(vertices, triangles), outer)
    assert np.array_equal(find_boundary(vertices, triangles, np.full(81, 3.0)).moving, ~outer)
