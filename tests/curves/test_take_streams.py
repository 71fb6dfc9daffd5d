"""Two faces or devices in turn are never one; a face that is found again, or stands raw and smoothed, is never two."""

import json

import numpy as np
import pytest

from capture_plan.curves.streams import alternate, in_turn, together
from capture_plan.curves.unfiltered import best_version
from tests.curves.test_take_dialects import NAMES, T, driven, named, read, weights

TIMES = [f"{t // 2 / 60:.4f}" for t in range(2 * T)]
BOTH = np.stack([weights(), 1 - weights()], axis=1).reshape(-1, len(NAMES))


def text(lead, cells, w, times=TIMES):
    """A table with a time and one more column before the weights."""
    rows = [["time", lead, *NAMES]]
    rows += [[time, cell, *map(str, row)] for time, cell, row in zip(times, cells, w.tolist(), strict=True)]
    return "\n".join(map(",".join, rows))


def objects(lead, cells, w, times=TIMES):
    """The table as a list of JSON objects."""
    rows = zip(times, cells, named(w), strict=True)
    return json.dumps([{"time": float(time), lead: cell, "blendShapes": row} for time, cell, row in rows])


@pytest.mark.parametrize(("write", "suffix"), [(text, "csv"), (objects, "json")])
@pytest.mark.parametrize("lead", ["device", "cameraName", "source", "client_ip", "anything at all"])
def test_two_devices_in_turn_are_told_apart_by_the_column_that_says_so(tmp_path, write, suffix, lead):
    take = read(tmp_path / f"a.{suffix}", write(lead, ["phone A", "phone B"] * T, BOTH))
    assert driven(take) == pytest.approx(weights())
    assert take.fps == 60
    assert any(f"2 devices by '{lead}'" in note and "only 'phone A'" in note for note in take.notes)


@pytest.mark.parametrize(("write", "suffix"), [(text, "csv"), (objects, "json")])
def test_two_devices_in_turn_without_a_name_are_said(tmp_path, write, suffix):
    take = read(tmp_path / f"a.{suffix}", write("mood", ["calm"] * (2 * T), BOTH))
    assert any("not certain that its frames are of one face" in note for note in take.notes)


@pytest.mark.parametrize(("write", "suffix"), [(text, "csv"), (objects, "json")])
@pytest.mark.parametrize("lead", ["faceId", "trackId", "device"])
def test_a_number_that_changes_when_the_face_is_found_again_is_one_face(tmp_path, write, suffix, lead):
    cells = np.repeat(["face 3", "face 4", "face 3"], T // 3).tolist()
    take = read(tmp_path / f"a.{suffix}", write(lead, cells, weights(), [f"{t / 60:.4f}" for t in range(T)]))
    assert driven(take) == pytest.approx(weights())
    assert any(f"'{lead}' changes" in note and "one face, found again" in note for note in take.notes)


def test_what_comes_in_turn_and_what_does_not():
    assert together(["1", "2"] * 9)
    assert together(["1", "2", "2", "1"] * 9)
    assert together(["1"] * 9 + ["2"] * 9, [str(t % 9) for t in range(18)])
    assert together((["1"] * 5 + ["2"] * 5) * 3, [f"{t // 10 * 5 + t % 5 + 0.5 * (t // 5 % 2)}" for t in range(30)])
    assert not together(["1"] * 9 + [""] * 3 + ["2"] * 9 + ["1"] * 9)
    assert in_turn(["a", "b"] * 9, [str(t // 2) for t in range(18)])
    assert not in_turn(["a", "b"] * 9, [str(t) for t in range(18)])
    assert not in_turn(["a"] * 18, [str(t // 2) for t in range(18)])


@pytest.mark.parametrize("repeat", [1, 2, 3])
def test_frames_of_one_face_do_not_alternate(repeat):
    noise = np.random.default_rng(0).normal(0, 0.02, (repeat * T, len(NAMES)))
    assert alternate(np.repeat(weights(), repeat, axis=0)) == ""
    assert alternate(np.repeat(weights(), repeat, axis=0) + noise) == ""


@pytest.mark.parametrize("order", ["AB", "ABC", "AAB", "ABCD"])
def test_frames_of_several_faces_in_turn_are_seen(order):
    faces = {name: weights(seed) for seed, name in enumerate("ABCD")}
    assert f"{len(order)} frames before" in alternate(
        np.array([faces[order[t % len(order)]][t // 3] for t in range(T)])
    )


VERSIONS = [
    ("raw", "smoothed"),
    ("blendShapesRaw", "blendShapesFiltered"),
    ("original", "face"),
    ("target", "current"),
    ("raw", "blendShapes"),
]


@pytest.mark.parametrize(("raw", "good"), VERSIONS)
@pytest.mark.parametrize("turned", [False, True])
def test_raw_and_smoothed_are_versions_of_one_face(tmp_path, raw, good, turned):
    frames = []
    for t, (row, other) in enumerate(zip(named(weights()), named(1 - weights()), strict=True)):
        both = {raw: other, good: row}
        frames.append({"timestamp": t / 60, **(dict(reversed(both.items())) if turned else both)})
    take = read(tmp_path / "a.json", json.dumps(frames))
    assert driven(take) == pytest.approx(weights())
    assert any("versions of one face" in note and f"'{good}' is read" in note for note in take.notes)


def test_names_of_people_are_no_versions():
    assert best_version(["anna", "bo"]) is None
    assert best_version(["face0", "face1"]) is None
    assert best_version(["anna_raw", "bo_raw"]) is None
