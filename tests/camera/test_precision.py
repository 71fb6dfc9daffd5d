"""How exactly cameras measure a point, against triangulation of noisy pixels."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import least_squares

from capture_plan.camera import Camera, deviations, look_at, root, told

POINTS, FRAMES = 40, 100


def camera(position, lens=(0.0,) * 5, noise_px=0.5, fisheye=False):
    position = np.array(position, dtype=float)
    K = np.array([[2000.0, 0, 767.5], [0, 2000, 1023.5], [0, 0, 1]])
    turn = look_at(position, np.array([0.0, 0, 0]))
    return Camera(str(position), position, turn, K, (1536, 2048), np.array(lens), fisheye, noise_px=noise_px)


SETS = {
    "pair on a boom": [camera((0, 60, 250)), camera((0, -40, 250))],
    "three with lenses": [
        camera((-200, 0, 500), (-0.2, 0.05, 0.002, -0.001, 0.01)),
        camera((200, 30, 500), (0.1, 0, 0, 0, 0), noise_px=0.2),
        camera((0, 150, 600), (0.01, 0.002, 0, 0), fisheye=True),
    ],
    "ring of six": [
        camera((700 * np.sin(a), 40 * i, 700 * np.cos(a))) for i, a in enumerate(np.linspace(-1.2, 1.2, 6))
    ],
}


def places(count=POINTS):
    return np.random.default_rng(5).uniform(-60, 60, size=(count, 3))


@pytest.mark.parametrize("name", SETS)
def test_pixels_move_with_a_point_as_the_jacobian_says(name):
    points, step = places(), np.random.default_rng(1).normal(size=(POINTS, 3))
    for one in SETS[name]:
        J = one.jacobian(points)
        moved = (one.project(points + 1e-3 * step) - one.project(points - 1e-3 * step)) / 2e-3
        np.testing.assert_allclose(np.einsum("pij,pj->pi", J, step), moved, rtol=1e-5, atol=1e-5)


@pytest.mark.parametrize("name", SETS)
def test_the_covariance_is_that_of_triangulated_noisy_pixels(name):
    """1,000 points in 100 noisy frames, each triangulated by least squares on the pixels through the lenses (four steps
    of Gauss-Newton): whitened by what is told of them, their errors have a variance of 1 along each axis."""
    cameras, points, rng = SETS[name], places(1000), np.random.default_rng(2)
    R = root(told(cameras, points, np.ones((len(cameras), len(points)))))
    truth = np.tile(points, (FRAMES, 1))
    noisy = [one.project(truth) + one.noise_px * rng.standard_normal((len(truth), 2)) for one in cameras]
    found = truth.copy()
    for _ in range(4):
        J = np.concatenate([one.jacobian(found) / one.noise_px for one in cameras], axis=1)
        r = np.concatenate(
            [(at - one.project(found)) / one.noise_px for one, at in zip(cameras, noisy, strict=True)], axis=1
        )
        step = np.linalg.solve(np.swapaxes(J, 1, 2) @ J, np.einsum("pij,pi->pj", J, r)[:, :, None])[:, :, 0]
        found += step
    assert np.abs(step).max() < 1e-4
    white = np.einsum("pij,tpj->tpi", R, (found - truth).reshape(FRAMES, len(points), 3)).reshape(-1, 3)
    assert np.abs(white.T @ white / len(white) - np.eye(3)).max() < 0.05


def test_a_triangulated_point_is_where_another_solver_puts_it():
    cameras, points, rng = SETS["three with lenses"], places(5), np.random.default_rng(3)
    J = np.concatenate([one.jacobian(points) / one.noise_px for one in cameras], axis=1)
    noise = [one.noise_px * rng.standard_normal((5, 2)) for one in cameras]
    e = np.concatenate([n / one.noise_px for one, n in zip(cameras, noise, strict=True)], axis=1)
    off = np.einsum("pij,pj->pi", np.linalg.pinv(J), e)

    def residual(x, p):
        each = zip(cameras, noise, strict=True)
        return np.concatenate(
            [(one.project(x[None]) - one.project(points[[p]]) - n[p])[0] / one.noise_px for one, n in each]
        )

    found = [least_squares(residual, points[p], args=(p,)).x - points[p] for p in range(5)]
    np.testing.assert_allclose(found, off, rtol=0.05, atol=0.03)


def test_one_camera_tells_no_depth_and_two_do():
    one, other = SETS["pair on a boom"]
    flat = deviations(told([one], places(), np.ones((1, POINTS))))
    assert np.isinf(flat[:, 2]).all()
    assert np.isfinite(flat[:, :2]).all()
    assert np.isfinite(deviations(told([one, other], places(), np.ones((2, POINTS))))).all()


def test_what_is_read_in_half_of_the_expressions_tells_half():
    cameras, points = SETS["pair on a boom"], places()
    whole, half = (told(cameras, points, np.full((2, POINTS), share)) for share in (1.0, 0.5))
    np.testing.assert_allclose(half, whole / 2)
    assert not told(cameras, points, np.zeros((2, POINTS))).any()
    twice = [replace(one, noise_px=2 * one.noise_px) for one in cameras]
    np.testing.assert_allclose(told(twice, points, np.ones((2, POINTS))), whole / 4)
    np.testing.assert_allclose(told(cameras, points, np.ones((2, POINTS)), np.full((2, POINTS), 1.0)), whole / 2)


def test_a_root_gives_its_matrix_back():
    L = told(SETS["three with lenses"], places(), np.ones((3, POINTS)))
    R = root(L)
    np.testing.assert_allclose(R.transpose(0, 2, 1) @ R, L, rtol=1e-9)
