"""Takes: several of them, or of several faces, are never joined or mixed in silence, however the file holds them."""

import json

import numpy as np
import pytest

from capture_plan.curves.wide import other_columns
from capture_plan.errors import RigError
from capture_plan.sample import sample_rig
from tests.curves.test_take_dialects import NAMES, T, code, driven, listed, named, read, table, weights
from tests.curves.test_take_json import split_sides

ROWS, OTHER = named(weights()), named(1 - weights())
COLUMNS = dict(zip(NAMES, weights().T.tolist(), strict=True))
SHAPES = [{"blendShapes": row} for row in ROWS]
SEVERAL = {
    "list of takes": {"takes": [{"name": "a", "frames": SHAPES}, {"name": "b", "frames": OTHER}]},
    "a list for each": {"fps": 60, "a": SHAPES, "b": OTHER},
    "an object for each": {"a": {"frames": ROWS}, "b": {"frames": SHAPES}},
    "at the top": [{"name": "a", "frames": ROWS}, {"name": "b", "frames": OTHER}],
    "below sessions": {"sessions": [{"takes": [{"take": "a", "data": ROWS}, {"take": "b", "data": OTHER}]}]},
    "columns": {"a": COLUMNS, "b": COLUMNS},
    "categories": {"takes": {"a": {"frames": listed(weights())}, "b": {"frames": listed(weights())}}},
    "bare numbers": {x: {"facsNames": NAMES, "weightMat": weights().tolist()} for x in "ab"},
    "with a neutral": {"neutral": ROWS[0], "a": [None, *ROWS], "b": OTHER},
    "a name in every frame": [{"take": x, **row} for x, rows in (("a", ROWS), ("b", OTHER)) for row in rows],
}


@pytest.mark.parametrize("kind", SEVERAL)
def test_several_takes_in_one_file_are_refused_by_their_names(tmp_path, kind):
    with pytest.raises(RigError, match=r"holds 2 takes.*'a'.*'b'.*save each as a file of its own"):
        read(tmp_path / "a.json", json.dumps(SEVERAL[kind]))


def test_takes_without_names_are_numbered_and_json_lines_can_be_takes(tmp_path):
    with pytest.raises(RigError, match="'take 1' with 90 frames, 'take 2' with 90 frames"):
        read(tmp_path / "a.json", json.dumps([ROWS, OTHER]))
    lines = [json.dumps({"name": name, "frames": rows}) for name, rows in (("a", ROWS), ("b", OTHER))]
    with pytest.raises(RigError, match="'a' with 90 frames, 'b' with 90 frames"):
        read(tmp_path / "a.jsonl", "\n".join(lines))


ONE = {
    "in a list": {"fps": 60, "takes": [{"name": "Anna", "frames": SHAPES}]},
    "by its name": {"Anna": {"fps": 60, "frames": ROWS}},
    "a list by its name": {"fps": 60, "Anna": ROWS},
    "deep": {"fps": 60, "session": {"recording": {"frames": ROWS}}},
}


@pytest.mark.parametrize("kind", ONE)
def test_the_only_take_of_a_file_is_read_from_where_it_stands(tmp_path, kind):
    take = read(tmp_path / "a.json", json.dumps(ONE[kind]))
    assert driven(take) == pytest.approx(weights())
    assert take.fps == 60


def test_faces_and_sides_of_one_frame_are_no_takes(tmp_path):
    both = [list(pair) for pair in zip(SHAPES, OTHER, strict=True)]
    for content in (both, {"frames": both}, [{"faces": pair} for pair in both], [split_sides(row) for row in ROWS]):
        assert driven(read(tmp_path / "a.json", json.dumps(content))) == pytest.approx(weights())


@pytest.mark.parametrize("name", ["take", "Take Name", "clip", "slate", "shot_id"])
def test_takes_in_the_rows_of_a_table_are_refused_by_their_names(tmp_path, name):
    lines = table(weights()).splitlines()
    marked = [f"{name},{lines[0]}", *(f"{'A' if t < 40 else 'B'},{line}" for t, line in enumerate(lines[1:]))]
    with pytest.raises(RigError, match=r"holds 2 takes by .*'B' 50, 'A' 40"):
        read(tmp_path / "a.csv", "\n".join(marked))
    one = [f"{name},{lines[0]}", *(f"A,{line}" for line in lines[1:])]
    assert driven(read(tmp_path / "a.csv", "\n".join(one))) == pytest.approx(weights())


def test_one_table_below_the_other_is_refused_where_the_clock_goes_back(tmp_path):
    for first in (code, str, lambda t: f"{t / 60:.4f}"):
        lead = {code: "Timecode", str: "frame"}.get(first, "time")
        with pytest.raises(RigError, match="one below the other"):
            read(tmp_path / "a.csv", 2 * table(weights(), lead=lead, first=first))


@pytest.mark.parametrize("lead", ["time", "frame", "Timecode", "jawOpen"])
def test_a_table_of_other_names_below_the_first_is_refused(tmp_path, lead):
    """Its numbers would drive what the first line names."""
    w, at = weights(), None if lead == "jawOpen" else lambda t: str(t)
    first, second = (
        "\n".join([",".join([lead, *names]), *(f"{t if at else row[0]},{','.join(map(str, row[1:]))}"
                                               for t, row in enumerate(np.column_stack([w[:, :1], some])))]) + "\n"
        for names, some in ((NAMES[1:4], w[:, 1:4]), (NAMES[3:6], w[:, 3:6]))
    )  # fmt: skip
    with pytest.raises(RigError, match="several tables, one below the other"):
        read(tmp_path / "a.csv", first + second)


def test_a_second_line_of_names_in_another_spelling_is_no_table(tmp_path):
    lines = table(weights()).splitlines()
    again = ",".join(["Timecode", *(name.replace("Left", "_L").replace("Right", "_R") for name in NAMES)])
    assert driven(read(tmp_path / "a.csv", "\n".join([lines[0], again, *lines[1:]]))) == pytest.approx(weights())


def test_a_counter_that_begins_again_is_said(tmp_path):
    again = table(weights(), lead="frame", first=str) + table(weights(), lead="frame", first=str).partition("\n")[2]
    assert any("'frame' begins again in row 90" in note for note in read(tmp_path / "a.csv", again).notes)


AFFIXES = [
    *[("face0_{}", "face1_{}"), ("A.{}", "B.{}"), ("Anna:{}", "Ben:{}"), ("{}_0", "{}_1"), ("{}", "B_{}")],
    *[("{}", "{}.1"), ("{} (Anna)", "{} (Ben)"), ("face0{}", "face1{}"), ("{}", "raw_{}"), ("{}_mean", "{}_std")],
]


@pytest.mark.parametrize(("first", "second"), AFFIXES)
def test_a_second_face_beside_the_first_is_never_mixed_in(tmp_path, first, second):
    """The second has a shape that only it has."""
    names = [first.format(name) for name in NAMES] + [second.format(name) for name in (*NAMES, "tongueOut")]
    w = np.column_stack([weights(), 1 - weights(), weights()[:, 0]])
    take = read(tmp_path / "a.csv", table(w, names=names))
    assert driven(take, (*NAMES, "tongueOut")) == pytest.approx(np.column_stack([weights(), np.zeros(T)]))
    assert any("are of 2 faces, or versions of one" in note and "7 of the others" in note for note in take.notes)
    rows = [dict(zip(names, row, strict=True)) for row in w.tolist()]
    assert driven(read(tmp_path / "a.json", json.dumps(rows)), ("tongueOut",)).max() == 0


def test_a_face_that_is_lost_beside_another_is_left_out(tmp_path):
    lost = np.arange(T) % 10 == 3
    rows = [[str(x) for x in row] for row in np.column_stack([weights(), 1 - weights()]).tolist()]
    rows = [[*[""] * len(NAMES), *row[len(NAMES) :]] if gone else row for row, gone in zip(rows, lost, strict=True)]
    names = [f"{face}.{name}" for face in "BA" for name in NAMES]
    take = read(tmp_path / "a.csv", "\n".join(",".join(row) for row in [names, *rows]))
    assert driven(take) == pytest.approx(1 - weights())


def test_meshes_of_one_face_that_hold_the_same_are_no_faces():
    columns = [f"{mesh}.{name}" for mesh in ("Head", "Teeth") for name in NAMES]
    assert other_columns(columns, np.hstack([weights(), weights()])) == ([], "")


def spellings():
    names = sample_rig().names
    yield names
    yield [name.replace("Left", "_L").replace("Right", "_R") for name in names]
    yield [name[-4:] * name.endswith("Left") + name.removesuffix("Left") for name in names]
    yield ["chinRaise_u", "chinRaise_d", "brow_raise_d", "brow_raise_l", "lip_raise_u", "lip_raise_d"]
    yield [f"{side}_{what}_{axis}" for side in ("left", "right") for what in ("pupil", "brow") for axis in "xy"]
    yield [f"AU{i:02d}_{end}" for i in range(1, 30) for end in "rc"]
    yield [f"Expressions_{name}_{end}" for name in names for end in ("min", "max")]
    yield [*dict.fromkeys(x for name in names for x in (name, name.removesuffix("Left").removesuffix("Right")))]


@pytest.mark.parametrize("names", list(spellings()))
def test_the_names_of_one_face_are_of_one_face(names):
    assert other_columns(names, np.random.default_rng(0).uniform(size=(5, len(names)))) == ([], "")


@pytest.mark.parametrize("below", [True, False])
def test_faces_by_any_names_within_a_frame_are_told_apart(tmp_path, below):
    def face(row):
        return {"blendShapes": row} if below else row

    frames = [
        {"timestamp": t / 60, "Anna": face(row), "Ben": face(other | {"tongueOut": 0.5})}
        for t, (row, other) in enumerate(zip(ROWS, OTHER, strict=True))
    ]
    take = read(tmp_path / "a.json", json.dumps(frames))
    assert driven(take, (*NAMES, "tongueOut")) == pytest.approx(np.column_stack([weights(), np.zeros(T)]))
    assert any("holds 2 faces" in note for note in take.notes)


def test_frames_that_hold_the_other_face_alone_are_left_out(tmp_path):
    lost = np.arange(T) % 10 == 3
    frames = [{"faces": {"Bert" if lost[t] else "Anna": row}} for t, row in enumerate(ROWS)]
    frames[0]["faces"]["Bert"] = frames[0]["faces"]["Anna"]
    take = read(tmp_path / "a.json", json.dumps({"fps": 60, "frames": frames}))
    assert driven(take) == pytest.approx(weights()[~lost])
