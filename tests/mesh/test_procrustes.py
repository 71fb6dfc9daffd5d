"""Laws of Procrustes fits."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from capture_plan.mesh import rigid_fit, similarity_fit

X = np.random.default_rng(4).normal(size=(20, 3)) * [3, 2, 1]
Q, MOVE = Rotation.random(random_state=1).as_matrix(), np.array([1.0, -2, 3])


def left(x, y, R, u, w=1.0):
    return float((w * np.square(x @ R.T + u - y).sum(axis=1)).sum())


def test_a_rigid_motion_is_found_and_a_scaled_one_with_its_scale():
    R, u = rigid_fit(X, X @ Q.T + MOVE)
    assert (R, u) == (pytest.approx(Q), pytest.approx(MOVE))
    sR, u = similarity_fit(X, 2.5 * X @ Q.T + MOVE)
    assert (sR, u) == (pytest.approx(2.5 * Q), pytest.approx(MOVE))


@pytest.mark.parametrize("fit", [rigid_fit, similarity_fit])
def test_a_mirror_image_is_turned_and_not_mirrored(fit):
    sR, _ = fit(X, X * [1, 1, -1])
    assert np.linalg.det(sR) > 0
    assert sR @ sR.T == pytest.approx(np.trace(sR @ sR.T) / 3 * np.eye(3))


@pytest.mark.parametrize("seed", range(10))
def test_no_motion_near_the_fit_leaves_less(seed):
    rng = np.random.default_rng(seed)
    y, w = rng.normal(size=X.shape), rng.uniform(0, 1, len(X))
    turn, shift = Rotation.from_rotvec(rng.normal(0, 0.05, 3)).as_matrix(), rng.normal(0, 0.05, 3)
    R, u = rigid_fit(X, y, w)
    assert left(X, y, R, u, w) <= left(X, y, turn @ R, u + shift, w)
    sR, u = similarity_fit(X, y, w)
    assert left(X, y, sR, u, w) <= left(X, y, rng.uniform(0.9, 1.1) * turn @ sR, u + shift, w)
    assert left(X, y, sR, u, w) <= left(X, y, R, rigid_fit(X, y, w)[1], w)


def test_what_weighs_nothing_is_not_heeded():
    w = np.r_[np.zeros(5), np.ones(15)]
    y = X @ Q.T + MOVE
    y[:5] += 7
    assert rigid_fit(X, y, w)[0] == pytest.approx(Q)
    assert similarity_fit(X, y, w)[0] == pytest.approx(Q)


def test_a_single_point_is_moved_and_not_turned_inside_out():
    R, u = rigid_fit(X[:1], X[:1] + MOVE)
    assert X[:1] @ R.T + u == pytest.approx(X[:1] + MOVE)
    assert np.linalg.det(R) == pytest.approx(1)
