"""Predicting an error against the same measurements solved one by one by SciPy.

pytest tests/benchmarks --benchmark-enable
"""

import time

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from capture_plan.layout.observation import PRIOR_SD, Observation
from capture_plan.layout.predict import FRAMES, SEED, performances, predict
from capture_plan.layout.weight_recovery import measurement_noise

K, V, LANDMARKS, NOISE_MM = 52, 3000, 34, 0.2
MOST_S = 0.1  # so that a notebook can predict while a knob is turned
SHARE = 0.5  # of SciPy's time


def generated_face(seed=0):
    """Deltas that are smooth bumps of many sizes, in all directions."""
    rng = np.random.default_rng(seed)
    place, centre = rng.uniform(-60, 60, (V, 2)), rng.uniform(-50, 50, (K, 2))
    distance2 = ((place[None] - centre[:, None]) ** 2).sum(axis=2)
    bump = np.exp(-distance2 / (2 * rng.uniform(8, 30, (K, 1)) ** 2))
    deltas = bump[:, :, None] * rng.normal(scale=4, size=(K, 1, 3))
    return Observation(deltas.astype(np.float32), np.ones(V, dtype=bool), NOISE_MM)


def seconds_of_scipy(observation, vertices, w):
    """CPU seconds for both measurements of every frame."""
    B, n = observation.response(vertices), measurement_noise(vertices, frames=len(w), seed=SEED)
    A = np.vstack([B, NOISE_MM / PRIOR_SD * np.eye(K)])
    y = np.pad(np.concatenate([w @ B.T + NOISE_MM * n, w @ B.T - NOISE_MM * n]), ((0, 0), (0, K)))
    start = time.process_time()
    for row in y:
        lsq_linear(A, row, (0, 1), method="bvls")
    return time.process_time() - start


@pytest.mark.parametrize("number", [0, 1], ids=["mixes", "talking"])
def test_a_prediction_costs_less_than_solving_frame_by_frame(benchmark, number):
    observation = generated_face()
    vertices = np.arange(0, V, V // LANDMARKS)[:LANDMARKS]
    shown = performances(observation, None)[number]
    found = benchmark(predict, observation, vertices, shown, noise_mm=NOISE_MM)
    assert found.error_mm > 0
    assert len(shown.weights) == FRAMES
    if benchmark.enabled:
        share = benchmark.stats.stats.min / seconds_of_scipy(observation, vertices, shown.weights)
        benchmark.extra_info["share_of_scipy"] = share
        assert share < SHARE
        assert benchmark.stats.stats.min < MOST_S
