"""How exactly cameras measure a point, against triangulation of noisy pixels."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import least_squares

from capture_plan.camera import Camera, deviations, look_at, root, told

POINTS, FRAMES = 40, 1500


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
    """1,500 noisy frames of 40 points, each triangulated by least squares from linearised pixels and, for some of them,
    by SciPy from the pixels themselves."""
    cameras, points, rng = SETS[name], places(), np.random.default_rng(2)
    L = told(cameras, points, np.ones((len(cameras), POINTS)))
    noises = [one.noise_px * rng.standard_normal((FRAMES, POINTS, 2)) for one in cameras]
    J = np.concatenate([one.jacobian(points) / one.noise_px for one in cameras], axis=1)
    e = np.concatenate([noise / one.noise_px for one, noise in zip(cameras, noises, strict=True)], axis=2)
    off = np.einsum("pij,tpj->tpi", np.linalg.pinv(J), e)
    measured = np.einsum("tpi,tpj->pij", off, off) / FRAMES
    expected = np.linalg.inv(L)
    share = np.trace(measured, axis1=1, axis2=2) / np.trace(expected, axis1=1, axis2=2)
    assert abs(share.mean() - 1) < 0.02
    pixels = [one.project(points) for one in cameras]

    def residual(x, t, p):
        each = zip(cameras, pixels, noises, strict=True)
        return np.concatenate([(one.project(x[None])[0] - at[p] - n[t, p]) / one.noise_px for one, at, n in each])

    for p in range(2):
        found = [least_squares(residual, points[p], args=(t, p)).x - points[p] for t in range(30)]
        np.testing.assert_allclose(found, off[:30, p], rtol=0.05, atol=0.03)


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
