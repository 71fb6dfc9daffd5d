"""Takes: a frame without a face is never a neutral, whatever words say so; of several faces one is read, and named."""

import numpy as np
import pytest

from capture_plan.curves.presence import answer, other_faces, without_face
from tests.curves.test_take_dialects import NAMES, T, code, driven, read, weights

LOST = np.arange(T) % 10 == 3
PAIRS = {
    **{no: "1" for no in ("0", "0.00", "-1", "0,0")},
    **{no: yes for no, yes in (("n", "y"), ("f", "t"), ("False", "True"), ("NO", "YES"), ("none", "face"))},
    **{"lost": "tracked", "notTracking": "normal", "limited": "normal", "not tracked": "tracked", "": "ok"},
}


def table(cells, *, lead="success", quote="", w=None, times=None):
    """A table with one more column before the weights."""
    w, times = weights() if w is None else w, [code(t) for t in range(T)] if times is None else times
    rows = [["Timecode", lead, *NAMES]]
    rows += [[time, cell, *map(str, row)] for time, cell, row in zip(times, cells, w.tolist(), strict=True)]
    return "\n".join(",".join(f"{quote}{cell}{quote}" for cell in row) for row in rows)


@pytest.mark.parametrize("quote", ["", '"'])
@pytest.mark.parametrize(("no", "yes"), PAIRS.items())
def test_every_word_for_a_lost_face_leaves_its_row_out(tmp_path, no, yes, quote):
    if "," in no and not quote:
        pytest.skip("a decimal comma between commas needs quotes")
    take = read(tmp_path / "a.csv", table(np.where(LOST, no, yes).tolist(), quote=quote))
    assert driven(take) == pytest.approx(weights()[~LOST])
    assert "9 of 90 frames have no face and were left out" in take.notes


def test_a_column_that_tells_of_loss_means_the_opposite(tmp_path):
    take = read(tmp_path / "a.csv", table(np.where(LOST, "1", "0").tolist(), lead="isLost"))
    assert driven(take) == pytest.approx(weights()[~LOST])
    assert answer("lost", opposite=True) is False


def test_words_that_are_not_known_and_columns_that_find_no_face_are_said(tmp_path):
    lost, message = without_face("state", ["tracked", "warped", "lost"])
    assert lost.tolist() == [False, False, True]
    assert "'warped'" in message
    take = read(tmp_path / "a.csv", table(["0"] * T))
    assert len(take) == T
    assert any("every row" in note for note in take.notes)


def test_a_take_that_is_mostly_lost_is_read_and_the_share_said(tmp_path):
    take = read(tmp_path / "a.csv", table(["1" if t % 4 == 0 else "0" for t in range(T)]))
    assert len(take) == 23
    assert any("67 of 90 frames" in note and "74%" in note and "little" in note for note in take.notes)


def test_zeros_all_at_once_are_a_lost_face(tmp_path):
    w = weights()
    w[20:30] = w[60] = 0
    take = read(tmp_path / "a.csv", table(["1"] * T, w=w))
    assert driven(take) == pytest.approx(np.delete(weights(), [*range(20, 30), 60], axis=0))
    assert any("in 11 of 90 frames every weight is exactly 0" in note for note in take.notes)


def test_a_face_that_goes_to_rest_is_no_lost_face(tmp_path):
    w = np.round(weights() * np.clip(np.abs(np.arange(T) - 45) / 40, 0, 1)[:, None], 3)
    w[43:48] = 0
    assert len(read(tmp_path / "a.csv", table(["1"] * T, w=w))) == T


def test_frames_that_stand_still_are_said_and_stay(tmp_path):
    w = weights()
    w[31:50] = w[30]
    take = read(tmp_path / "a.csv", table(["1"] * T, w=w))
    assert len(take) == T
    assert any("frames 31 to 49 repeat the one before exactly" in note for note in take.notes)


def twice(w):
    """Every frame of two faces, of which the second does the opposite."""
    return np.stack([w, 1 - w], axis=1).reshape(-1, w.shape[1])


@pytest.mark.parametrize("lead", ["face", "face_id", "subject", "personId", "Actor", "trackingId"])
@pytest.mark.parametrize("ids", ["01", "AB", ("Anna", "Bo")])
def test_two_faces_are_never_mixed_in_a_table(tmp_path, lead, ids):
    times = [code(t // 2) for t in range(2 * T)]
    take = read(tmp_path / "a.csv", table(list(ids) * T, lead=lead, w=twice(weights()), times=times))
    assert driven(take) == pytest.approx(weights())
    assert take.fps == 60
    assert any(f"only '{ids[0]}'" in note for note in take.notes)


def test_the_face_with_most_rows_is_the_take():
    other, message = other_faces("id", ["B", "A", "A", "", "A", "B"])
    assert other.tolist() == [True, False, False, False, False, True]
    assert "'A' 3, 'B' 2" in message
    assert other_faces("id", ["7"] * 5)[1] == ""


@pytest.mark.parametrize("majority", [0, 1])
def test_a_flag_called_face_is_no_face_of_its_own(tmp_path, majority):
    flags = np.where(np.arange(T) % 5 == 0, 1 - majority, majority)
    take = read(tmp_path / "a.csv", table([str(flag) for flag in flags], lead="face"))
    assert driven(take) == pytest.approx(weights()[flags == 1])


def test_two_faces_are_told_apart_by_a_column_called_id_and_a_row_number_is_no_face(tmp_path):
    w = np.repeat(weights(), 2, axis=0)
    w[1::2] = 1 - w[1::2]
    retained = [t for t in range(2 * T) if t % 2 == 0 or t % 3]
    ids = ["A" if t % 2 == 0 else "B" for t in retained]
    times = [code(t // 2) for t in retained]
    take = read(tmp_path / "a.csv", table(ids, lead="id", w=w[retained], times=times))
    assert driven(take) == pytest.approx(weights())
    assert any("holds 2 faces by 'id'" in note for note in take.notes)
    assert driven(read(tmp_path / "b.csv", table([str(t) for t in range(T)], lead="id"))) == pytest.approx(weights())


def test_the_one_face_that_is_kept_is_not_said_to_be_lost(tmp_path):
    w = np.repeat(weights(), 2, axis=0)
    retained = [t for t in range(2 * T) if t % 2 == 0 or t % 3]
    faces = [str(t % 2) for t in retained]
    take = read(tmp_path / "a.csv", table(faces, lead="face", w=w[retained], times=[code(t // 2) for t in retained]))
    assert len(take) == T
    assert not any("not believed" in note for note in take.notes)
