"""Frames of zeros: a lost face where they break in, a pause of a mouth alone, rest where they are reached slowly."""

import numpy as np
import pytest

from capture_plan.curves.silence import zeroed
from tests.curves.test_take_dialects import NAMES, T, driven, read, table, weights

LOST = slice(40, 55)
MOUTH = ("jawOpen", "mouthPucker", "mouthFunnel", "mouthSmileLeft", "mouthSmileRight")
ARKIT = 52


def half_still(frames=T, seed=0):
    """Weights of which more than half are 0 in any frame, others in other frames, as a camera tracks a face."""
    t, k = np.arange(frames)[:, None] / 60, np.arange(ARKIT)
    return np.maximum(0, np.sin((1 + k % 5) * t + k) - 0.7) + np.where(k % 4 == 0, 0.02 + 0.01 * np.cos(40 * t + k), 0)


def test_zeros_of_a_face_whose_weights_are_mostly_zero_are_a_lost_face():
    w = half_still()
    assert np.median((w != 0).mean(axis=1)) < 0.5
    w[LOST] = 0
    lost, may = zeroed(w)
    assert (np.flatnonzero(lost).tolist(), may.any()) == ([*range(T)][LOST], False)


def test_zeros_that_are_reached_slowly_are_rest_and_half_of_it_is_a_doubt():
    t = np.arange(T)
    slow = np.clip((35 - t) / 30, 0, 1)
    both = np.maximum(slow, np.clip((t - 55) / 30, 0, 1))[:, None]
    assert not zeroed(half_still() * both)[0].any()
    assert not zeroed(half_still() * both)[1].any()
    lost, may = zeroed(half_still() * np.where(t < 55, slow, 1)[:, None])
    assert (lost.any(), may.sum()) == (False, 20)


def test_poses_that_are_held_between_neutrals_are_no_lost_face():
    rng = np.random.default_rng(0)
    poses = np.where(np.arange(6)[:, None] % 2 == 0, rng.uniform(size=(6, ARKIT)), 0)
    lost, may = zeroed(np.repeat(poses, 15, axis=0))
    assert not lost.any()
    assert not may.any()


@pytest.mark.parametrize("count", [1, 2, 3, 5])
def test_a_mouth_pauses_and_is_never_lost_for_it(tmp_path, count):
    w = np.where(np.arange(T)[:, None] // 15 % 2, weights()[:, :count], 0)
    take = read(tmp_path / "a.csv", table(w, names=MOUTH[:count]))
    assert driven(take, MOUTH[:count]) == pytest.approx(w)
    assert any("not certain whether the face rests or was lost" in note for note in take.notes) == (count > 3)


@pytest.mark.parametrize("head", [0, 1])
def test_zeros_of_a_whole_face_are_left_out_and_counted_whatever_its_head_does(tmp_path, head):
    w = weights()
    w[LOST] = 0
    w = np.hstack([w, np.linspace(1, 9, T)[:, None]])[:, : len(NAMES) + head]
    take = read(tmp_path / "a.csv", table(w, names=(*NAMES, "headYaw")[: len(NAMES) + head]))
    assert driven(take, NAMES) == pytest.approx(np.delete(weights(), LOST, axis=0))
