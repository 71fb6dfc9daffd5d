"""How far an eye is open is no wide eye: 1 at rest, it is the blink turned round, or left out beside one."""

import numpy as np
import pytest

from capture_plan.curves.frames import PosedFrames
from capture_plan.sample import sample_rig
from capture_plan.sequence import read_sequence

RIG = sample_rig()
T = 120
JAW, BLINK = (0.5 - 0.5 * np.cos(np.arange(T) / 20)).round(4), (np.arange(T) % 30 < 4) * 0.9


def driven(tmp_path, columns):
    lines = [f"{t / 60:.4f}," + ",".join(f"{x[t]:.4f}" for x in columns.values()) for t in range(T)]
    (tmp_path / "a.csv").write_text("\n".join(["time," + ",".join(columns), *lines]))
    take = read_sequence(tmp_path / "a.csv", rig=RIG)
    assert isinstance(take.frames, PosedFrames)
    assert take.mapping is not None
    return dict(zip(RIG.names, take.frames.weights.T, strict=True)), take.notes, dict(take.mapping.left_out)


@pytest.mark.parametrize("full", [1, 100])
@pytest.mark.parametrize("name", ["EyeOpenLeft", "leftEyeOpen", "eye_open_L", "Eye_Openness_Left", "left_eye_openness"])
def test_an_open_eye_is_the_blink_turned_round(tmp_path, name, full):
    weights, notes, _ = driven(tmp_path, {"jawOpen": full * JAW, name: full * (1 - BLINK)})
    assert weights["eyeWideLeft"] == pytest.approx(0)
    assert weights["eyeBlinkLeft"] == pytest.approx(BLINK, abs=1e-4)
    assert weights["eyeBlinkRight"] == pytest.approx(0)
    assert any(name in note and "1 less the value" in note for note in notes)


def test_a_column_of_both_eyes_blinks_with_both(tmp_path):
    weights, *_ = driven(tmp_path, {"jawOpen": JAW, "eyes_open": 1 - BLINK})
    for side in ("Left", "Right"):
        assert weights[f"eyeBlink{side}"] == pytest.approx(BLINK, abs=1e-4)


def test_beside_a_blink_it_is_left_out_and_said(tmp_path):
    weights, notes, left_out = driven(tmp_path, {"jawOpen": JAW, "eyeBlinkLeft": BLINK, "leftEyeOpen": 1 - BLINK / 2})
    assert weights["eyeWideLeft"] == pytest.approx(0)
    assert weights["eyeBlinkLeft"] == pytest.approx(BLINK, abs=1e-4)
    assert any("leftEyeOpen" in note and "left out" in note for note in notes)
    assert "leftEyeOpen" in left_out


def test_a_wide_eye_rests_near_0_and_stays_one(tmp_path):
    for name in ("EyeOpenLeft", "eyeWideLeft"):
        weights, *_ = driven(tmp_path, {"jawOpen": JAW, name: BLINK})
        assert weights["eyeWideLeft"] == pytest.approx(BLINK, abs=1e-4)
        assert weights["eyeBlinkLeft"] == pytest.approx(0)


def test_eyes_that_are_shut_for_half_of_a_take_are_open_where_the_face_rests(tmp_path):
    weights, *_ = driven(tmp_path, {"jawOpen": JAW, "EyeOpenLeft": 1 - JAW})
    assert weights["eyeBlinkLeft"] == pytest.approx(JAW, abs=1e-4)
    weights, *_ = driven(tmp_path, {"jawOpen": JAW, "EyeOpenLeft": JAW})
    assert weights["eyeWideLeft"] == pytest.approx(JAW, abs=1e-4)
