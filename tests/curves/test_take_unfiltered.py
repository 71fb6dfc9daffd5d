"""Of a raw and a filtered column of one name the filtered drives, in any order, and the raw is named."""

import numpy as np
import pytest

from capture_plan.curves.frames import PosedFrames
from capture_plan.curves.unfiltered import best_version, raw_columns
from capture_plan.sample import sample_rig
from capture_plan.sequence import read_sequence

RIG = sample_rig()
JAW = (0.5 - 0.5 * np.cos(np.arange(90) / 20)).round(4)


@pytest.mark.parametrize(
    ("raw", "filtered"),
    [
        ("JawOpen_raw", "JawOpen_filtered"),
        ("rawJawOpen", "jawOpen"),
        ("jaw_open_unfiltered", "jaw_open"),
        ("Raw Jaw Open", "Smoothed Jaw Open"),
    ],
)
def test_the_filtered_column_drives_and_the_raw_one_is_named(tmp_path, raw, filtered):
    for names in ((raw, filtered), (filtered, raw)):
        rows = "\n".join(f"{t / 60:.4f},{a:.4f},{b:.4f}" for t, (a, b) in enumerate(values(names, filtered)))
        (tmp_path / "a.csv").write_text(f"time,{','.join(names)}\n{rows}")
        take = read_sequence(tmp_path / "a.csv", rig=RIG)
        assert isinstance(take.frames, PosedFrames)
        assert take.mapping is not None
        assert take.frames.weights[:, RIG.names.index("jawOpen")] == pytest.approx(JAW, abs=1e-4)
        assert any(raw in note and filtered in note for note in take.notes)
        assert raw in dict(take.mapping.left_out)


def values(names, filtered):
    return zip(*[JAW if name == filtered else JAW * 0.8 + 0.1 for name in names], strict=True)


def test_a_raw_column_alone_stays():
    assert raw_columns(["JawOpen_raw", "eyeBlink_L_filtered", "drawing", "raw"]) == {}


@pytest.mark.parametrize(
    ("names", "best"),
    [
        (("raw", "smoothed"), "smoothed"),
        (("face", "faceFiltered"), "faceFiltered"),
        (("faceRaw", "face"), "face"),
        (("raw", "previous"), None),
        (("anna", "bo"), None),
    ],
)
def test_of_versions_of_one_face_the_filtered_one_is_best(names, best):
    assert best_version(names) == best == best_version(names[::-1])
