"""Takes in two scales, joined: a seam is said wherever it lies; quiet stretches and pauses of one scale are none."""

import numpy as np
import pytest

from capture_plan.curves.joined_scales import mixed_frames

FRAMES = 600


def face(seed=0, columns=20):
    """Weights of a face in a long take: it blinks at times, rests a little above 0 and moves most in its middle."""
    rng, t = np.random.default_rng(seed), np.arange(FRAMES)
    rest = 0.03 + 0.02 * np.sin(t[:, None] / rng.uniform(5, 40, columns) + rng.uniform(0, 6, columns))
    lively = np.exp(-(((t - FRAMES / 2) / 120) ** 2))[:, None] * rng.uniform(0, 0.6, columns)
    w = rest + lively * (1 + np.sin(t[:, None] / rng.uniform(8, 20, columns))) / 2
    w[:, 0] += 0.7 * np.exp(-(((t % 150 - 70) / 4.0) ** 2))
    return w


@pytest.mark.parametrize("full", [100, 255])
@pytest.mark.parametrize("cut", [40, 180, 300, 470])
@pytest.mark.parametrize("columns", [3, 20])
def test_a_seam_of_two_scales_is_said_on_either_side(full, cut, columns):
    for seed in range(5):
        for part in (np.s_[:cut], np.s_[cut:]):
            w = full * face(seed, columns)
            w[part] /= full
            assert "not certain that all frames" in "".join(mixed_frames(w, full))


def test_a_part_between_two_seams_is_said():
    w = 100 * face()
    w[200:380] /= 100
    assert "from 33% of the take on" in mixed_frames(w, 100)[0]


QUIET = {
    "as it is": lambda w: w,
    "gated": lambda w: np.where(w > 6, w, 0),
    "whole": np.round,
    "pauses": lambda w: w * (np.sin(np.arange(FRAMES) / 15) > 0)[:, None],
    "calms down": lambda w: w * np.clip(np.abs(np.arange(FRAMES) - 300) / 60 - 0.5, 0.01, 1)[:, None],
    "starts at rest": lambda w: np.where(np.arange(FRAMES)[:, None] < 200, 0, w),
    "noise": lambda w: np.where(np.arange(FRAMES)[:, None] < 200, np.random.default_rng(0).uniform(0, 0.7, w.shape), w),
}


@pytest.mark.parametrize("kind", QUIET)
@pytest.mark.parametrize("columns", [1, 3, 20])
def test_quiet_stretches_of_one_scale_are_no_seam(kind, columns):
    for seed in range(5):
        assert mixed_frames(QUIET[kind](100 * face(seed, columns)), 100) == []
