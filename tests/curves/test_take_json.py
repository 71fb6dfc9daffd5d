"""Takes as JSON: sides and groups within each other, faces distinguished, lost faces, names that frames leave out."""

import json

import numpy as np
import pytest

from capture_plan.curves.json_twice import names_twice
from capture_plan.curves.json_weights import spelled
from capture_plan.errors import RigError
from tests.curves.test_take_dialects import NAMES, T, driven, named, read, weights


def split_sides(row):
    """The same weights with sides as objects."""
    tree = {}
    for name, x in row.items():
        side = next((side for side in ("Left", "Right") if name.endswith(side)), None)
        if side:
            tree.setdefault(name.removesuffix(side), {})[side] = x
        else:
            tree[name] = x
    return tree


def sides_first(row):
    """The same weights with an object for each side."""
    tree = {name: x for name, x in row.items() if not name.endswith(("Left", "Right"))}
    for side in ("Left", "Right"):
        tree[side.lower()] = {name.removesuffix(side): x for name, x in row.items() if name.endswith(side)}
    return tree


SHAPES = {
    "sides below": split_sides,
    "sides above": sides_first,
    "groups": lambda row: {
        "eyes": {name: x for name, x in row.items() if name.startswith("eye")},
        "rest": {name: x for name, x in row.items() if not name.startswith("eye")},
    },
    "words on the way": lambda row: {
        "jaw": {"open": row["jawOpen"]},
        "eye": {"blink": {"left": row["eyeBlinkLeft"], "right": row["eyeBlinkRight"]}},
        "mouth": {"smile": {"L": row["mouthSmileLeft"]}, "pucker": row["mouthPucker"]},
        "brow": {"innerUp": row["browInnerUp"]},
    },
    "objects": lambda row: {name: {"value": x, "confidence": 1} for name, x in row.items()},
    "one-key objects": lambda row: [{name: x} for name, x in row.items()],
    "pairs": lambda row: [[name, x] for name, x in row.items()],
    "keys and values": lambda row: [{"key": name, "value": x} for name, x in row.items()],
    "commas": lambda row: {name: str(x).replace(".", ",") for name, x in row.items()},
    "per cent": lambda row: {name: f"{100 * x:.1f} %" for name, x in row.items()},
}


@pytest.mark.parametrize("below", ["blendShapes", None])
@pytest.mark.parametrize("shape", SHAPES)
def test_no_nesting_of_names_loses_a_weight(tmp_path, shape, below):
    rows = [SHAPES[shape](row) for row in named(weights())]
    if below is None and isinstance(rows[0], list):
        pytest.skip("a list stands below a name")
    frames = [{"timestamp": t / 60, **({below: row} if below else row)} for t, row in enumerate(rows)]
    take = read(tmp_path / "a.json", json.dumps(frames))
    assert driven(take) == pytest.approx(weights(), abs=1e-9)
    assert take.fps == 60


def test_the_words_on_the_way_make_the_name_that_says_most():
    assert spelled(("mouth", "smile", "left")) == "mouthSmileLeft"
    assert spelled(("R", "eyeBlink")) == "eyeBlinkRight"
    assert spelled(("group", "jawOpen")) == "jawOpen"


def test_what_is_no_number_among_weights_is_named(tmp_path):
    frames = [{"blendShapes": {**row, "mouthShape": [1, 2], "mood": "calm"}} for row in named(weights())]
    take = read(tmp_path / "a.json", json.dumps({"fps": 60, "frames": frames}))
    assert any("'mouthShape', 'mood'" in note for note in take.notes)


LOST = np.arange(T) % 10 == 3
ASIDE = {
    "isTracked": lambda lost: {"isTracked": "NO" if lost else "YES"},
    "trackingState": lambda lost: {"trackingState": "notTracking" if lost else "normal"},
    "limited": lambda lost: {"trackingState": "limited" if lost else "normal"},
    "lost": lambda lost: {"lost": lost},
    "0": lambda lost: {"success": 0.0 if lost else 1.0},
    "below": lambda lost: {"face": {"tracked": not lost}},
    "null": lambda lost: {"tracked": None if lost else True},
    "confidence": lambda lost: {"confidence": 0 if lost else 0.9},
}


@pytest.mark.parametrize("said", ASIDE)
def test_every_way_to_say_that_the_face_is_lost_leaves_the_frame_out(tmp_path, said):
    rows = enumerate(named(weights()))
    frames = [{"timestamp": t / 60, "blendShapes": row, **ASIDE[said](bool(LOST[t]))} for t, row in rows]
    take = read(tmp_path / "a.json", json.dumps(frames))
    assert driven(take) == pytest.approx(weights()[~LOST])
    assert "9 of 90 frames have no face and were left out" in take.notes


def test_a_frame_with_the_heads_turn_alone_has_no_face(tmp_path):
    frames = [{"timestamp": t / 60, "yaw": 3.0, **({} if LOST[t] else row)} for t, row in enumerate(named(weights()))]
    take = read(tmp_path / "a.json", json.dumps(frames))
    assert driven(take) == pytest.approx(weights()[~LOST])
    assert "9 of 90 frames have no face and were left out" in take.notes


def faces(w):
    """Frames of two faces in every way to tell them apart; the second does the opposite, the first is lost at times."""
    one, two = named(w), named(1 - w)
    pairs = [[] if LOST[t] else [(0, a)] for t, a in enumerate(one)]
    pairs = [[(1, b), *some][:: 1 if t % 2 else -1] for t, (some, b) in enumerate(zip(pairs, two, strict=True))]
    shown = [(t / 60, {i: {"blendShapes": row} for i, row in some}) for t, some in enumerate(pairs)]
    return {
        "rows": [{"timestamp": s, "faceId": i, **face} for s, some in shown for i, face in some.items()],
        "list": [{"timestamp": s, "faces": [{"id": i, **face} for i, face in some.items()]} for s, some in shown],
        "object": [{"timestamp": s, "faces": {f"{i}": face for i, face in some.items()}} for s, some in shown],
        "names": [{"timestamp": s, **{f"face{i}": face for i, face in some.items()}} for s, some in shown],
    }


@pytest.mark.parametrize("kind", ["rows", "list", "object", "names"])
def test_two_faces_are_never_mixed_in_json(tmp_path, kind):
    take = read(tmp_path / "a.json", json.dumps(faces(weights())[kind]))
    assert driven(take) == pytest.approx(1 - weights())
    assert take.fps == 60
    assert any("holds 2 faces" in note and "90" in note and "81" in note for note in take.notes)


def test_faces_without_names_are_said(tmp_path):
    frames = [{"faces": [{"blendShapes": row}, {"blendShapes": row}]} for row in named(weights())]
    take = read(tmp_path / "a.json", json.dumps({"fps": 60, "frames": frames}))
    assert any("several faces without names" in note for note in take.notes)


def test_names_left_out_because_nothing_changed_keep_their_value(tmp_path):
    w = np.round(weights(), 1)
    rows, before = named(w), {}
    for row in rows:
        now = dict(row)
        for name in [name for name in row if before.get(name) == row[name]]:
            del row[name]
        before = now
    rows = [row or {"jawOpen": w[t, 0]} for t, row in enumerate(rows)]
    take = read(tmp_path / "a.json", json.dumps({"fps": 60, "frames": rows}))
    assert driven(take) == pytest.approx(w)
    assert any("keep their last value" in note for note in take.notes)


def test_columns_of_json_say_what_is_beside_them(tmp_path):
    lists = dict(zip(NAMES, weights().T.tolist(), strict=True))
    take = read(tmp_path / "a.json", json.dumps({"fps": 60, **lists, "tracked": (~LOST).tolist()}))
    assert driven(take) == pytest.approx(weights()[~LOST])
    with pytest.raises(RigError, match="has 3 numbers for 'jawOpen', 90 for other names"):
        read(tmp_path / "b.json", json.dumps({"fps": 60, **lists, "jawOpen": [1, 2, 3]}))


@pytest.mark.parametrize(
    ("name", "no", "yes"), [("isTracked", "NO", "YES"), ("success", 0, 1), ("faceLost", True, False)]
)
def test_a_word_for_a_lost_face_among_the_weights_is_heeded(tmp_path, name, no, yes):
    lost = np.arange(T) % 10 == 3
    frames = [
        {"timestamp": t / 60, "blendShapes": row | {name: no if lost[t] else yes}}
        for t, row in enumerate(named(weights()))
    ]
    take = read(tmp_path / "take.json", json.dumps(frames))
    assert driven(take) == pytest.approx(weights()[~lost])
    assert "9 of 90 frames have no face and were left out" in take.notes


def test_weights_that_stand_beside_the_object_of_weights_are_read(tmp_path):
    beside = {NAMES[0], NAMES[1]}
    frames = [
        {
            "timestamp": t / 60,
            "blendShapes": {name: x for name, x in row.items() if name not in beside},
            NAMES[0]: row[NAMES[0]],
            "more": {NAMES[1]: row[NAMES[1]]},
            "headYaw": 33.0,
        }
        for t, row in enumerate(named(weights()))
    ]
    take = read(tmp_path / "take.json", json.dumps(frames))
    assert driven(take) == pytest.approx(weights())


def test_a_name_that_stands_twice_in_a_frame_is_said(tmp_path):
    once = [dict(zip(NAMES, row, strict=True)) for row in weights()]
    twice = [json.dumps(row)[:-1] + f', "{NAMES[0]}": 0.5}}' for row in once]
    take = read(tmp_path / "a.json", '{"frames": [' + ", ".join(twice) + "]}")
    assert [f"'{NAMES[0]}' stands twice" in note for note in take.notes].count(True) == 1
    assert not any("stands twice" in note for note in read(tmp_path / "b.json", json.dumps({"frames": once})).notes)


def test_names_are_twice_in_one_object_alone():
    assert names_twice('{"a": {"b": 1, "c": "a"}, "d": [{"b": 2}, {"b": 3}], "e": "x\\": {"}') == {}
    assert names_twice('{"a": 1, "b": {"a": 2, "a": 3}, "a": [{"c": 1, "c": 2, "c": 3}]}') == {"a": 2, "c": 2}
