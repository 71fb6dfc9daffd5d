"""The error to expect of weights solved between 0 and 1: its laws, and SciPy's solver as the judge."""

import msgspec
import numpy as np
import pytest
from scipy.optimize import lsq_linear

from capture_plan.audit.audit import audit_rig
from capture_plan.curves.frames import StoredFrames
from capture_plan.curves.random_mixes import moment_of_mixes, random_mixes
from capture_plan.layout.face import see_face
from capture_plan.layout.observation import PRIOR_SD, Observation
from capture_plan.layout.predict import (
    FRAMES,
    MIXES,
    TALKING,
    Performance,
    moment_of_talking,
    of_recording,
    of_weights,
    performances,
    predict,
    predictions,
    talking,
)
from capture_plan.layout.record import Prediction
from capture_plan.sample.motion import made_up_take
from capture_plan.sequence import Sequence
from capture_plan.shell.take_basis import record
from capture_plan.shell.takes import takes_of

RNG = np.random.default_rng(8)
K, V, MANY = 14, 60, 600
DELTAS = (RNG.normal(size=(K, V, 3)) * RNG.uniform(0.3, 3, (K, 1, 1))).astype(np.float32)
FEW, SOME, ALL = np.arange(0, V, 14), np.arange(0, V, 5), np.arange(V)


def observed(noise_mm=0.2):
    return Observation(DELTAS, np.ones(V, dtype=bool), noise_mm)


@pytest.fixture
def observation():
    return observed()


@pytest.fixture(scope="module")
def face_observation(rig):
    return see_face(rig, audit_rig(rig).used).observation(0.2)


@pytest.fixture(scope="module")
def spread(rig, face_observation):
    """Some vertices all over the moving skin, about as many as a plan has."""
    return np.flatnonzero(face_observation.skin)[:: int(face_observation.skin.sum()) // 36]


def of_these(observation, name, w):
    """Frames that are all there is."""
    return of_weights(observation, name, w, w.T @ w / len(w))


def judged(observation, vertices, shown, noise_mm, seed):
    """Mean square distance of every frame from what SciPy solves, of noise of its own."""
    B, y = observation.response(vertices), shown.weights @ shown.rows(vertices).T
    measured = y + noise_mm * np.random.default_rng(seed).standard_normal(y.shape)
    A = np.vstack([B, noise_mm / PRIOR_SD * np.eye(B.shape[1])])
    padded = np.pad(measured, ((0, 0), (0, B.shape[1])))
    x = np.stack([lsq_linear(A, row, (0, 1), method="bvls", tol=1e-13).x for row in padded])
    return shown.distances(observation.gram, x)


def within_standard_errors(predicted, squares, times=4.0):
    """Whether the root of a mean agrees with a prediction, as far as both are known."""
    measured = np.sqrt(squares.mean())
    sure = squares.std() / np.sqrt(len(squares)) / (2 * measured)
    return abs(predicted.error_mm - measured) < times * np.hypot(sure, predicted.standard_error_mm) + 1e-4


@pytest.mark.parametrize("noise_mm", [0.2, 0.5])
@pytest.mark.parametrize(("number", "drawn"), [(0, random_mixes), (1, talking)])
def test_the_error_of_the_sample_is_what_scipy_measures_on_other_frames(
    face_observation, spread, number, drawn, noise_mm
):
    mine = performances(face_observation, None)[number]
    others = of_these(face_observation, "others", drawn(len(face_observation.deltas), frames=300, seed=1))
    found = predict(face_observation, spread, mine, noise_mm=noise_mm)
    squares = judged(face_observation, spread, others, noise_mm, seed=2)
    assert within_standard_errors(found, squares)
    assert found.error_mm == pytest.approx(np.sqrt(squares.mean()), rel=0.1)
    low, high = np.sqrt(np.quantile(squares, [0.05, 0.95]))
    assert (found.low_mm, found.high_mm) == pytest.approx((low, high), rel=0.15)


@pytest.mark.parametrize("vertices", [FEW[:2], FEW, SOME, ALL], ids=["two", "few", "some", "all"])
@pytest.mark.parametrize("noise_mm", [0.05, 0.2, 1.0])
def test_every_layout_and_noise_comes_true_by_scipy(observation, vertices, noise_mm):
    """Two landmarks leave weights in doubt: what other frames would lose is part of the standard error."""
    others = of_these(observation, MIXES, random_mixes(K, frames=MANY, seed=3))
    found = predict(observation, vertices, performances(observation, None)[0], noise_mm=noise_mm)
    assert within_standard_errors(found, judged(observation, vertices, others, noise_mm, seed=4))


@pytest.mark.parametrize("count", [1, 2, 5, 30])
def test_the_moments_are_those_of_many_frames(count):
    for moment, drawn in ((moment_of_mixes, random_mixes), (moment_of_talking, talking)):
        w = drawn(count, frames=20_000, seed=9)
        np.testing.assert_allclose(moment(count), w.T @ w / len(w), atol=0.01)


def test_without_noise_nothing_is_lost(observation):
    for shown in performances(observation, None):
        errors = [predict(observation, SOME, shown, noise_mm=noise).error_mm for noise in (0.5, 0.05, 0.005, 0.0)]
        assert sorted(errors, reverse=True) == errors
        assert errors[-1] < 1e-3


def test_weights_that_rest_at_no_bound_give_the_upper_estimate_back():
    """Deep inside the bounds both solves agree, and C of the upper estimate is what weights of its own spread give."""
    observation = observed(0.02)
    w = 0.5 + 0.02 * np.random.default_rng(5).standard_normal((400, K))
    found = predict(observation, ALL, of_these(observation, "inside", w), noise_mm=0.02)
    assert found.error_mm == pytest.approx(observation.error(observation.covariance(ALL)), rel=0.02)


def test_sparse_performances_come_back_better_than_the_upper_estimate(face_observation, spread):
    upper = face_observation.error(face_observation.covariance(spread))
    for shown in performances(face_observation, None):
        found = predict(face_observation, spread, shown, noise_mm=0.2)
        assert found.low_mm < found.error_mm < found.high_mm
        assert found.error_mm + 4 * found.standard_error_mm < upper


def test_the_simulation_of_the_free_solve_is_taken_away_exactly():
    """Where the bounds never act, q is u: what is left is E u, without chance."""
    observation = observed(0.01)
    w = np.full((FRAMES, K), 0.5)
    found = predict(observation, ALL, of_these(observation, "held", w), noise_mm=0.01)
    B = observation.response(ALL)
    A = np.linalg.solve(B.T @ B + (0.01 / PRIOR_SD) ** 2 * np.eye(K), B.T)
    shrunk = (A @ B - np.eye(K)) @ w[0]
    squares = shrunk @ observation.gram @ shrunk + 0.01**2 * np.trace(observation.gram @ A @ A.T)
    assert found.error_mm == pytest.approx(np.sqrt(squares), abs=1e-4)
    assert found.standard_error_mm == 0


def test_more_landmarks_measure_better(observation):
    shown = performances(observation, None)[0]
    errors = [predict(observation, at, shown, noise_mm=0.2).error_mm for at in (FEW, SOME, ALL)]
    assert sorted(errors, reverse=True) == errors


def test_the_usual_noise_stands_beside_that_of_the_settings():
    given = performances(observed(), None)
    assert [(p.noise_mm, p.performance) for p in predictions(observed(0.5), SOME, given)] == [
        (noise, name) for noise in (0.2, 0.5) for name in (MIXES, TALKING)
    ]
    assert len(predictions(observed(0.2), SOME, given)) == 2


def test_the_same_layout_gives_the_same_words_again(observation):
    first, again = (predictions(observation, SOME, performances(observation, None)) for _ in range(2))
    assert first == again
    assert msgspec.json.decode(msgspec.json.encode(first), type=tuple[Prediction, ...]) == first


def test_who_talks_moves_a_third_of_the_blendshapes_a_little():
    w = talking(50, frames=4000, seed=1)
    assert (w > 0).mean() == pytest.approx(0.3, rel=0.03)
    assert w[w > 0].mean() == pytest.approx(0.25, rel=0.05)
    assert w.max() <= 1


@pytest.mark.parametrize("noise_mm", [0.2, 0.5])
def test_a_take_of_the_rig_comes_true_on_its_other_frames(rig, face_observation, spread, noise_mm):
    one = record(rig, made_up_take(rig, 3))
    found = predict(face_observation, spread, of_recording(face_observation, one), noise_mm=noise_mm)
    every = of_recording(face_observation, one, frames=len(one))
    assert within_standard_errors(found, judged(face_observation, spread, every, noise_mm, seed=6))
    assert found.beyond_mm == pytest.approx(0, abs=1e-3)  # all that moves is planned for


def scanned(rig, seed, strength):
    """A take as meshes, bent by something that no blendshape of the rig does."""
    posed = made_up_take(rig, seed, frames=60)
    frames = posed.frames.block(0, 60)
    wave = np.sin(rig.neutral[:, [1]] / 9) * np.array([0.0, 0.0, 1.0]) * rig.skin[:, None]
    bent = frames + strength * np.linspace(0, 1, 60)[:, None, None] * wave
    return Sequence("scans", rig.neutral, rig.triangles, StoredFrames(bent), 30.0, rig)


def test_what_the_rig_cannot_show_is_named_and_left_over(rig, face_observation, spread):
    takes = takes_of(rig, [scanned(rig, 4, 1.5)])
    *_, shown = performances(face_observation, takes)
    found = predict(face_observation, spread, shown, noise_mm=0.2)
    assert 0.1 < found.beyond_mm < 1.5 * np.sqrt(1 / 3)
    assert found.error_mm > found.beyond_mm
    every = of_recording(face_observation, takes.first.recordings[0], frames=60)
    squares = judged(face_observation, spread, every, 0.2, seed=7)
    assert found.error_mm == pytest.approx(np.sqrt(squares.mean()), rel=0.05)


def test_what_the_rig_cannot_show_is_what_scipy_leaves_of_the_whole_skin(rig, face_observation):
    sequence = scanned(rig, 5, 1.0)
    skin, some = face_observation.skin, np.arange(0, 60, 12)
    few = Sequence("few", rig.neutral, rig.triangles, StoredFrames(sequence.frames.block(0, 60)[some]), 30.0, rig)
    found = of_recording(face_observation, record(rig, few)).beyond_mm
    D = face_observation.deltas[:, skin].reshape(len(face_observation.deltas), -1).T.astype(float)
    X = (few.frames.block(0, len(some)) - rig.neutral)[:, skin].reshape(len(some), -1)
    left = [2 * lsq_linear(D, row, (0, 1), method="bvls", tol=1e-13).cost / skin.sum() for row in X]
    assert found == pytest.approx(np.sqrt(np.mean(left)), abs=3e-3)  # leading shapes leave out 0.002 mm


def test_a_take_shorter_than_the_simulation_is_measured_again_and_again(rig, face_observation, spread):
    takes = takes_of(rig, [made_up_take(rig, 1, frames=16)])
    *_, shown = performances(face_observation, takes)
    assert len(shown.weights) == FRAMES
    assert isinstance(shown, Performance)
    assert predict(face_observation, spread, shown, noise_mm=0.2).standard_error_mm > 0
