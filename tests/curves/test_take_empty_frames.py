"""JSON takes whose frames name no weight at all: at rest, as before, or lost, as the rest of the file tells."""

import json

import numpy as np
import pytest

from tests.curves.test_take_dialects import NAMES, T, driven, named, read, weights

AT = slice(40, 52)


def changes(w):
    """Frames that name only what changes."""
    rows, before = named(w), {}
    for row in rows:
        now = dict(row)
        for name in [name for name in row if before.get(name) == row[name]]:
            del row[name]
        before = now
    return rows


@pytest.mark.parametrize("write", [lambda row: {"blendShapes": row}, lambda row: {"blendShapes": row} if row else {}])
def test_nothing_said_is_nothing_changed_in_a_file_of_changes(tmp_path, write):
    w = np.round(weights(), 1)
    w[AT] = w[AT.start - 1]
    frames = [{"timestamp": t / 60, **write(row)} for t, row in enumerate(changes(w))]
    take = read(tmp_path / "a.json", json.dumps(frames))
    assert driven(take) == pytest.approx(w)
    assert any("without any weight keep the last ones too" in note for note in take.notes)


def test_null_is_a_lost_face_in_a_file_of_changes_too(tmp_path):
    w = np.round(weights(), 1)
    frames = [{"timestamp": t / 60, "blendShapes": row} for t, row in enumerate(changes(w))]
    for frame in frames[AT]:
        frame["blendShapes"] = None
    for name, x in zip(NAMES, w[AT.stop], strict=True):
        frames[AT.stop]["blendShapes"][name] = x
    take = read(tmp_path / "a.json", json.dumps(frames))
    assert driven(take) == pytest.approx(np.delete(w, AT, axis=0))


@pytest.mark.parametrize("count", [1, 2, len(NAMES)])
def test_nothing_said_is_rest_in_a_file_without_zeros(tmp_path, count):
    ease = np.clip(1.2 * np.sin(np.arange(T) / 6), 0, 1)[:, None]
    w = np.round(weights() * ease, 3)[:, :count]
    rows = [{name: x for name, x in zip(NAMES, row, strict=False) if x > 0} for row in w.tolist()]
    take = read(tmp_path / "a.json", json.dumps([{"time": t / 60, "blendShapes": row} for t, row in enumerate(rows)]))
    assert len(take) == T
    assert driven(take, NAMES[:count]) == pytest.approx(w)


@pytest.mark.parametrize("empty", [[], {}])
def test_nothing_said_amid_a_lively_face_is_a_lost_one(tmp_path, empty):
    rows = [{name: x for name, x in row.items() if x > 0.2} for row in named(weights())]
    w = np.where(weights() > 0.2, weights(), 0)
    rows[AT] = [empty] * (AT.stop - AT.start)
    take = read(tmp_path / "a.json", json.dumps([{"time": t / 60, "blendShapes": row} for t, row in enumerate(rows)]))
    assert driven(take) == pytest.approx(np.delete(w, AT, axis=0))
    assert any("12 of 90 frames" in note for note in take.notes)
