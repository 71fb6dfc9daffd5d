"""Numbers that say how sure a tracker is, or in which state: far less than usual is lost, what nobody tells is said."""

import json

import numpy as np
import pytest

from capture_plan.sample import sample_rig
from capture_plan.sequence import read_sequence
from tests.curves.test_take_dialects import NAMES, T, driven, named, read, weights
from tests.curves.test_take_presence import LOST, table


def objects(lead, cells):
    """Frames with a number beside their weights."""
    rows = zip(cells, named(weights()), strict=True)
    frames = [{"time": t / 60, lead: float(cell), "blendShapes": row} for t, (cell, row) in enumerate(rows)]
    return json.dumps(frames)


WRITE = [("csv", lambda lead, cells: table(cells, lead=lead)), ("json", objects)]


@pytest.mark.parametrize(("suffix", "write"), WRITE)
@pytest.mark.parametrize("lead", ["confidence", "trackingQuality", "face_score", "Detection Confidence"])
@pytest.mark.parametrize("full", [1, 100])
def test_rows_of_far_less_confidence_have_lost_the_face(tmp_path, suffix, write, lead, full):
    sure = full * np.where(LOST, 0.06, 0.9 + 0.08 * np.sin(np.arange(T)))
    take = read(tmp_path / f"a.{suffix}", write(lead, [f"{x:.3f}" for x in sure]))
    assert driven(take) == pytest.approx(weights()[~LOST])
    assert "9 of 90 frames have no face and were left out" in take.notes


def test_an_archive_says_so_too(tmp_path):
    np.savez(tmp_path / "a.npz", weights=weights(), names=NAMES, fps=60, confidence=np.where(LOST, 0.05, 0.97))
    take = read_sequence(tmp_path / "a.npz", rig=sample_rig())
    assert driven(take) == pytest.approx(weights()[~LOST])


@pytest.mark.parametrize(("suffix", "write"), WRITE)
def test_rows_of_some_less_confidence_stay_and_are_said(tmp_path, suffix, write):
    take = read(tmp_path / f"a.{suffix}", write("confidence", np.where(LOST, "0.4", "0.95").tolist()))
    assert driven(take) == pytest.approx(weights())
    assert any("not certain" in note and "9 rows" in note for note in take.notes)


@pytest.mark.parametrize(("suffix", "write"), WRITE)
@pytest.mark.parametrize("sure", [(0.9, 0.7), (0.2, 0.03), (3.0, 1.0)])
def test_numbers_that_are_all_alike_or_no_shares_lose_nothing(tmp_path, suffix, write, sure):
    cells = [str(sure[int(lost)]) for lost in LOST]
    take = read(tmp_path / f"a.{suffix}", write("confidence", cells))
    assert len(take) == T


@pytest.mark.parametrize(("suffix", "write"), WRITE)
@pytest.mark.parametrize("lead", ["trackingState", "status"])
@pytest.mark.parametrize("other", ["1", "2"])
def test_the_good_majority_is_not_lost_for_a_code_of_0(tmp_path, suffix, write, lead, other):
    take = read(tmp_path / f"a.{suffix}", write(lead, np.where(LOST, other, "0").tolist()))
    assert driven(take) == pytest.approx(weights())
    assert any(f"not certain what the numbers of '{lead}' mean" in note for note in take.notes)


@pytest.mark.parametrize(("suffix", "write"), WRITE)
def test_a_minority_of_0_is_lost_and_states_between_are_said(tmp_path, suffix, write):
    cells = np.where(LOST, "0", np.where(np.arange(T) % 7 == 0, "1", "2")).tolist()
    take = read(tmp_path / f"a.{suffix}", write("trackingState", cells))
    assert driven(take) == pytest.approx(weights()[~LOST])
    assert any("rows above 0 stay" in note for note in take.notes)


@pytest.mark.parametrize("key", ["meta", "info", "header", "tracking", "frameInfo"])
def test_what_an_object_beside_the_weights_says_counts(tmp_path, key):
    rows = enumerate(named(weights()))
    frames = [{key: {"timestamp": t / 60, "tracked": not LOST[t]}, "blendShapes": row} for t, row in rows]
    take = read(tmp_path / "a.json", json.dumps(json.loads(json.dumps(frames, default=bool))))
    assert driven(take) == pytest.approx(weights()[~LOST])
    assert take.fps == 60
