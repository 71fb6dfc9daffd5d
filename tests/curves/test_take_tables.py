"""Takes as tables: on their side, with blank cells, sums below, a rate above, and numbers that stand for no face."""

import io
import json

import numpy as np
import pytest

from capture_plan.errors import RigError
from capture_plan.sample import sample_rig
from capture_plan.sequence import read_sequence
from tests.curves.test_take_dialects import NAMES, T, code, driven, named, read, table, weights


def on_its_side(w, top, *, names=NAMES, delimiter=",", corner="name"):
    head = [] if top is None else [delimiter.join([corner, *map(top, range(len(w)))])]
    return "\n".join([*head, *(delimiter.join([name, *map(str, x)]) for name, x in zip(names, w.T, strict=True))])


TOPS = {"codes": code, "numbers": str, "frames": "frame_{}".format, "letters": "f{}".format, "none": None}


@pytest.mark.parametrize("top", TOPS)
@pytest.mark.parametrize("frames", [2, 5, 6, 7, T])
def test_a_table_on_its_side_is_turned_and_said(tmp_path, top, frames):
    take = read(tmp_path / "a.csv", on_its_side(weights()[:frames], TOPS[top]))
    assert driven(take) == pytest.approx(weights()[:frames])
    assert any(f"it is turned ({len(NAMES)} names, {frames} frames)" in note for note in take.notes)


def test_a_square_table_of_all_names_is_read_by_where_they_stand(tmp_path):
    names = sample_rig().names
    w = np.round(np.random.default_rng(0).uniform(size=(len(names), len(names))), 3)
    assert driven(read(tmp_path / "a.csv", on_its_side(w, str, names=names)), names) == pytest.approx(w)
    assert driven(read(tmp_path / "a.csv", table(w, names=names)), names) == pytest.approx(w)


def test_times_across_the_top_tell_the_rate(tmp_path):
    ms = on_its_side(weights(), lambda t: f"{1000 * t / 60:.2f}", corner="timestamp_ms", delimiter=";")
    take = read(tmp_path / "a.csv", ms.replace(".", ","))
    assert driven(take) == pytest.approx(weights())
    assert take.fps == 60


def test_names_both_ways_are_no_table_on_its_side(tmp_path):
    take = read(tmp_path / "a.csv", "pose,jawOpen,mouthPucker\nmouth_pucker,0.1,1\njaw_open,0.9,0\n")
    assert driven(take, ("jawOpen", "mouthPucker")) == pytest.approx(np.array([[0.1, 1], [0.9, 0]]))


@pytest.mark.parametrize("square", [True, False])
def test_numbers_in_json_with_a_list_for_each_name_are_turned(tmp_path, square):
    w = weights()[: len(NAMES) if square else T]
    matrix = w if square else w.T
    take = read(tmp_path / "a.json", json.dumps({"fps": 60, "facsNames": NAMES, "weightMat": matrix.tolist()}))
    assert driven(take) == pytest.approx(w)
    assert any("it is turned" in note for note in take.notes) != square


def cells(w, blank, *, digits=str):
    rows = [["" if gone else digits(x) for x, gone in zip(row, gone_in, strict=True)]
            for row, gone_in in zip(w.tolist(), blank, strict=True)]  # fmt: skip
    return "\n".join(",".join(row) for row in [["Timecode", *NAMES], *([code(t), *row] for t, row in enumerate(rows))])


def unchanged(w):
    return np.vstack([np.zeros((1, w.shape[1]), dtype=bool), w[1:] == w[:-1]])


LONG = weights(frames=600)
HELD = {
    "coarse": np.round(LONG, 1),
    "finer": np.round(LONG, 2),
    "at rest at 0": np.clip(LONG - 0.3, 0, None).round(3),
    "at rest elsewhere": np.clip(LONG, 0.4, None),
    "some never move": np.where(np.arange(len(NAMES)) % 3 == 1, 0.3, np.round(LONG, 1)),
}


@pytest.mark.parametrize("kind", HELD)
def test_blank_cells_of_what_did_not_change_keep_the_last_value(tmp_path, kind):
    w = HELD[kind]
    take = read(tmp_path / "a.csv", cells(w, unchanged(w)))
    assert driven(take) == pytest.approx(w)
    assert any("columns are blank in some rows and keep their last value" in note for note in take.notes)


@pytest.mark.parametrize("digits", [1, 2, 3])
def test_blank_cells_that_stand_for_0_are_0(tmp_path, digits):
    w = np.clip(LONG - 0.3, 0, None).round(digits)
    take = read(tmp_path / "a.csv", cells(w, w == 0))
    assert driven(take) == pytest.approx(w[(w != 0).any(axis=1)])
    assert any("columns are blank in some rows and count as 0" in note for note in take.notes)


@pytest.mark.parametrize("share", [0.1, 0.3, 0.6])
def test_numbers_that_are_missing_at_random_are_damage(tmp_path, share):
    missing = np.random.default_rng(0).random(LONG.shape) < share
    with pytest.raises(RigError, match=r"cannot be read|in half of its rows"):
        read(tmp_path / "a.csv", cells(LONG, missing))


@pytest.mark.parametrize("every", [2, 3, 6])
def test_numbers_in_one_row_of_several_are_no_lost_faces(tmp_path, every):
    rows = np.arange(len(LONG)) % every > 0
    take = read(tmp_path / "a.csv", cells(LONG, np.repeat(rows[:, None], len(NAMES), axis=1)))
    assert driven(take) == pytest.approx(LONG[np.arange(len(LONG)) // every * every])
    assert any(f"1 of every {every} rows" in note for note in take.notes)


def test_a_column_of_events_fills_no_blank_cell_of_a_weight(tmp_path):
    lines = cells(weights(), np.zeros((T, len(NAMES)), dtype=bool)).splitlines()
    lines = [lines[0] + ",event", *(line + ("," if t % 9 else ",1") for t, line in enumerate(lines[1:]))]
    lines[6] = ",".join([code(5), "", *lines[6].split(",")[2:]])
    assert driven(read(tmp_path / "a.csv", "\n".join(lines))) == pytest.approx(np.delete(weights(), 5, axis=0))


@pytest.mark.parametrize("number", [-1, -999])
@pytest.mark.parametrize("suffix", ["csv", "json"])
def test_one_number_below_0_in_every_column_stands_for_no_face(tmp_path, number, suffix):
    w = weights()
    w[10:20] = number
    text = table(w) if suffix == "csv" else json.dumps({"fps": 60, "frames": named(w)})
    take = read(tmp_path / f"a.{suffix}", text)
    assert driven(take) == pytest.approx(np.delete(weights(), range(10, 20), axis=0))
    assert any(f"every weight is {number}, which stands for no face" in note for note in take.notes)


@pytest.mark.parametrize("share", [-1, -100, 2])
def test_weights_below_0_in_many_columns_are_said(tmp_path, share):
    w = share * weights() - (share > 0)
    assert any("go below 0" in note and "not certain" in note for note in read(tmp_path / "a.csv", table(w)).notes)


@pytest.mark.parametrize("lead", ["fps,60\n", "# frame rate: 60\n", "Take,3\nFrame rate,60.0\nActor,Anna\n\n"])
def test_a_rate_above_the_names_is_heeded(tmp_path, lead):
    take = read(tmp_path / "a.csv", lead + table(weights(), lead="frame", first=str))
    assert take.fps == 60
    assert driven(take) == pytest.approx(weights())
    take = read(tmp_path / "a.csv", lead.replace("60", "25") + table(weights()))
    assert take.fps == 60
    assert any("it says 25 frames in a second, but its times make it 60" in note for note in take.notes)


@pytest.mark.parametrize("lead", ["Timecode", "frame"])
def test_sums_below_the_frames_are_no_frames(tmp_path, lead):
    sums = "".join(f"{word}{',0.5' * len(NAMES)}\n" for word in ("mean", "max"))
    take = read(tmp_path / "a.csv", table(weights(), lead=lead, first=code if lead == "Timecode" else str) + sums)
    assert driven(take) == pytest.approx(weights())
    assert any("2 rows have words in place of" in note for note in take.notes)


def test_per_cent_of_some_columns_are_hundredths(tmp_path):
    rows = [[f"{100 * x:.1f}%" if c < 3 else str(x) for c, x in enumerate(row)] for row in weights().tolist()]
    lines = [",".join(["Timecode", *NAMES]), *(",".join([code(t), *row]) for t, row in enumerate(rows))]
    frames = [dict(zip(NAMES, [row[0], *map(float, x[1:])], strict=True))
              for row, x in zip(rows, weights().tolist(), strict=True)]  # fmt: skip
    for name, text in (("a.csv", "\n".join(lines)), ("a.json", json.dumps({"fps": 60, "frames": frames}))):
        take = read(tmp_path / name, text)
        assert driven(take) == pytest.approx(weights())
        assert any("taken as hundredths" in note for note in take.notes)


def test_decimal_commas_in_times_hide_no_line_of_names(tmp_path):
    text = table(weights(), delimiter=";", decimal=",", lead="time", first=lambda t: f"00:00:{t / 60:06.3f}")
    assert driven(read(tmp_path / "a.csv", text.replace(".", ","))) == pytest.approx(weights())


def test_times_in_an_archive_tell_its_rate(tmp_path):
    file = io.BytesIO()
    np.savez(file, weights=weights(), names=np.array(NAMES), timestamps=np.arange(T) / 60)
    assert read(tmp_path / "a.npz", file.getvalue()).fps == 60


def archive(path, **arrays):
    np.savez(path, **{"weights": weights(), "names": np.array(NAMES), **arrays})
    return read_sequence(path, rig=sample_rig())


@pytest.mark.parametrize(
    "rate",
    [{"frameRate": 60}, {"Frame_Rate": [60.0]}, {"fps": "60"}, {"timestamps_ms": np.arange(T) / 0.06}],
    ids=["one word", "two words", "text", "times"],
)
def test_an_archive_tells_its_rate_in_every_spelling(tmp_path, rate):
    take = archive(tmp_path / "a.npz", **rate)
    assert take.fps == 60
    assert take.notes == ()


def test_times_in_an_archive_that_speak_against_its_rate_are_followed_and_said(tmp_path):
    take = archive(tmp_path / "a.npz", fps=30, time=np.arange(T) / 60)
    assert take.fps == 60
    assert any("the times are followed" in note for note in take.notes)


def test_frames_of_an_archive_are_sorted_by_their_times_as_is_said(tmp_path):
    order = np.random.default_rng(0).permutation(T)
    take = archive(tmp_path / "a.npz", weights=weights()[order], time=order / 60)
    assert driven(take) == pytest.approx(weights())
    assert any("they are sorted by these" in note for note in take.notes)


@pytest.mark.parametrize(
    "said",
    [lambda there: {"success": there}, lambda there: {"confidence": 0.9 * there}, lambda there: {"face_lost": ~there}],
    ids=["tracked", "confidence", "lost"],
)
def test_a_face_that_an_archive_says_was_lost_is_left_out_and_counted(tmp_path, said):
    there = np.arange(T) >= 20
    take = archive(tmp_path / "a.npz", weights=np.where(there[:, None], weights(), 0.77), fps=60, **said(there))
    assert driven(take) == pytest.approx(weights()[20:])
    assert any(note.startswith("20 of 90 frames have no face") for note in take.notes)


def test_the_minus_sign_of_print_is_one(tmp_path):
    w = weights() - 0.2
    minus = table(w).replace("-", "\N{MINUS SIGN}")
    assert driven(read(tmp_path / "a.csv", minus)) == pytest.approx(w)


def test_frames_without_any_number_are_refused_as_such(tmp_path):
    with pytest.raises(RigError, match="holds no number under any name"):
        read(tmp_path / "a.json", json.dumps([dict.fromkeys(NAMES, True)] * 5))


OTHER_ROWS = {"every second": lambda t: t % 2 == 1, "the others": lambda t: t % 2 == 0, "all": lambda _: True}


@pytest.mark.parametrize("rows", OTHER_ROWS)
@pytest.mark.parametrize("decimal", [".", ","])
@pytest.mark.parametrize(("mine", "other"), [(",", ";"), (";", ","), (",", "\t"), ("\t", ";")])
def test_rows_that_another_sign_cuts_are_read_and_counted(tmp_path, rows, decimal, mine, other):
    if decimal == "," in (mine, other) and (other == "," or rows != "all"):
        pytest.skip("decimal commas between commas")
    lines = table(weights(), delimiter=mine, decimal="." if mine == "," else decimal).splitlines()
    others = table(weights(), delimiter=other, decimal=decimal).splitlines()
    text = [lines[0], *(others[t + 1] if OTHER_ROWS[rows](t) else lines[t + 1] for t in range(T))]
    take = read(tmp_path / "a.csv", "\n".join(text))
    assert driven(take) == pytest.approx(weights())
    count = sum(map(OTHER_ROWS[rows], range(T)))
    assert any(f"{count} of {T} rows are cut by" in note for note in take.notes)


def broken(word, rows, suffix):
    """A take in which one column holds a word in some rows."""
    if suffix == "json":
        frames = named(weights())
        for t in rows:
            frames[t]["jawOpen"] = word
        return json.dumps({"fps": 60, "frames": [{"blendShapes": row} for row in frames]})
    lines = [line.split(",") for line in table(weights()).splitlines()]
    for t in rows:
        lines[t + 1][1] = word
    return "\n".join(map(",".join, lines))


@pytest.mark.parametrize("suffix", ["csv", "json"])
@pytest.mark.parametrize("word", ["err", "inf", "-inf", "1.#QNAN", "#REF!"])
def test_a_word_in_place_of_a_weight_is_never_0(tmp_path, word, suffix):
    rows = list(range(0, T, 9))
    take = read(tmp_path / f"a.{suffix}", broken(word, rows, suffix))
    assert driven(take) == pytest.approx(np.delete(weights(), rows, axis=0))
    assert any(f"'{word}' for 'jawOpen'" in note for note in take.notes)
    assert len(take.notes) == 1
    with pytest.raises(RigError, match="for 'jawOpen'"):
        read(tmp_path / f"a.{suffix}", broken(word, range(0, T, 3), suffix))


@pytest.mark.parametrize("suffix", ["csv", "json"])
def test_one_column_with_gaps_among_many_is_missing_there(tmp_path, suffix):
    names, rows = sample_rig().names, np.arange(300) % 3 == 0
    t, rng = np.arange(300)[:, None] / 60, np.random.default_rng(1)
    w = np.round(0.5 + 0.45 * np.sin(t * rng.uniform(3, 9, len(names)) + rng.uniform(0, 6, len(names))), 3)
    lines = [line.split(",") for line in table(w, names=names).splitlines()]
    frames = [dict(zip(names, row, strict=True)) for row in w.tolist()]
    for one in np.flatnonzero(rows).tolist():
        lines[one + 1][4] = ""
        del frames[one][names[3]]
    if suffix == "csv":
        with pytest.raises(RigError, match=f"no number for '{names[3]}'"):
            read(tmp_path / "a.csv", "\n".join(map(",".join, lines)))
    else:
        take = read(tmp_path / "a.json", json.dumps({"fps": 60, "frames": frames}))
        assert driven(take, names)[~rows] == pytest.approx(w[~rows])
        assert driven(take, names)[1:, 3].min() > 0.04
        assert any(f"keep their last value there ({names[3]})" in note for note in take.notes)


def test_a_word_under_a_name_of_its_own_is_said_once(tmp_path):
    frames = [{"blendShapes": {**row, "mood": "glad"}} for row in named(weights())]
    take = read(tmp_path / "a.json", json.dumps({"fps": 60, "frames": frames}))
    assert driven(take) == pytest.approx(weights())
    assert any("'mood' holds no number and is not read" in note for note in take.notes)


@pytest.mark.parametrize("word", ["", "NaN", "n/a"])
def test_a_word_for_nothing_is_a_name_left_out_and_said_once(tmp_path, word):
    take = read(tmp_path / "a.json", broken(word, range(0, T, 3), "json"))
    rest = np.arange(T) % 3 > 0
    assert driven(take)[rest] == pytest.approx(weights()[rest])
    assert len(take.notes) == 1
    assert "keep their last value there (jawOpen)" in take.notes[0]
