"""Takes: the same weights come out of every dialect, and what is lost or damaged is left out and counted."""

import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from capture_plan.curves.face_cap import USUAL
from capture_plan.errors import RigError
from capture_plan.sample import sample_rig
from capture_plan.sequence import read_sequence

NAMES = ("jawOpen", "eyeBlinkLeft", "eyeBlinkRight", "mouthSmileLeft", "mouthPucker", "browInnerUp")
T = 90  # frames, of 60 in a second


def weights(seed=0, frames=T):
    """Weights of a face that moves all of `NAMES`, in thousandths."""
    t = np.arange(frames)[:, None] / 60
    rng = np.random.default_rng(seed)
    return np.round(0.5 + 0.49 * np.sin(t * rng.uniform(3, 9, len(NAMES)) + rng.uniform(0, 6, len(NAMES))), 3)


def code(t, clock=60, start=36_000):
    """Timecode of frame t of a clock."""
    s = start + t // clock
    return f"{s // 3600:02d}:{s // 60 % 60:02d}:{s % 60:02d}:{t % clock:02d}"


def table(w, *, delimiter=",", decimal=".", lead="Timecode", first=code, names=NAMES, digits="{:.3f}"):
    rows = [
        delimiter.join([first(t), *(digits.format(x).replace(".", decimal) for x in row)]) for t, row in enumerate(w)
    ]
    return "\n".join([delimiter.join([lead, *names]), *rows]) + "\n"


def read(path, content, **options):
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return read_sequence(path, rig=sample_rig(), **options)


def driven(sequence, names=NAMES):
    """The weights of the rig's blendshapes by these names."""
    return sequence.frames.weights[:, [sample_rig().names.index(name) for name in names]]


TEXTS = {
    "comma": table(weights()),
    "tab": table(weights(), delimiter="\t"),
    "bar": table(weights(), delimiter="|"),
    "semicolons, decimal commas": table(weights(), delimiter=";", decimal=","),
    "sep=": "sep=;\n" + table(weights(), delimiter=";", decimal=","),
    "comments": "# take 3\n# Anna\n" + table(weights()),
    "title before the names": "Session,12\n" + table(weights()),
    "Windows": table(weights()).replace("\n", "\r\n"),
    "twice ended lines": table(weights()).replace("\n", "\r\r\n"),
    "mark": b"\xef\xbb\xbf" + table(weights()).encode(),
    "UTF-16": table(weights()).encode("utf-16"),
    "UTF-16 without mark": table(weights()).encode("utf-16-be"),
    "code page 1252": table(weights())
    .replace("Timecode", "Bemerkung für mich,Timecode")
    .replace("\n1", "\nä,1")
    .encode("cp1252"),
    "quoted": "\n".join(",".join(f'"{cell}"' for cell in line.split(",")) for line in table(weights()).splitlines()),
    "quoted decimal commas": "\n".join(
        ",".join(f'"{cell}"' for cell in line.split(";"))
        for line in table(weights(), delimiter=";", decimal=",").splitlines()
    ),
    "per cent signs": table(100 * weights(), digits="{:.1f}%"),
    "per cent": table(100 * weights(), digits="{:.1f}"),
    "spreadsheet's empty columns": table(weights()).replace("\n", ",,\n"),
}


@pytest.mark.parametrize("kind", TEXTS)
def test_every_way_to_write_a_table_gives_the_same_weights(tmp_path, kind):
    take = read(tmp_path / "take.csv", TEXTS[kind])
    assert driven(take) == pytest.approx(weights(), abs=1e-9)
    assert take.fps == 60


def named(w, spell=str):
    return [{spell(name): x for name, x in zip(NAMES, row, strict=True)} for row in w.tolist()]


def listed(w, label="categoryName"):
    return [[{"index": i, "score": x, label: name} for i, (name, x) in enumerate(row.items())] for row in named(w)]


def documents(w):
    """The same take in every dialect of JSON."""
    rows, cats, python = named(w), listed(w), listed(w, "category_name")
    return {
        "ARKit": [{"timestamp": t / 60, "blendShapes": row} for t, row in enumerate(rows)],
        "flat": [{"timestampMs": 1000 * t / 60, **row} for t, row in enumerate(rows)],
        "below frames": {"metadata": {"fps": 60}, "frames": [{"blendshapes": row} for row in rows]},
        "two levels down": {"fps": 60, "take": {"frames": [{"blendshapes": row} for row in rows]}},
        "MediaPipe task": [{"timestamp_ms": 1000 * t / 60, "blendshapes": row} for t, row in enumerate(python)],
        "MediaPipe bare": {"fps": 60, "frames": python},
        "MediaPipe faces": {"fps": 60, "frames": [{"face_blendshapes": [row]} for row in python]},
        "browser": [
            {"time": t / 60, "result": {"faceLandmarks": [], "faceBlendshapes": [{"categories": row, "headIndex": -1}]}}
            for t, row in enumerate(cats)
        ],
        "browser, bare": {"fps": 60, "results": [{"faceBlendshapes": [{"categories": row}]} for row in cats]},
        "Audio2Face": {"exportFps": 60, "facsNames": NAMES, "weightMat": w.tolist()},
        "numbered": {f"{t / 60:.5f}": row for t, row in enumerate(rows)},
        "numbered below frames": {"frames": {str(t): row for t, row in enumerate(rows)}, "fps": 60},
        "columns": {"fps": 60, **dict(zip(NAMES, w.T.tolist(), strict=True))},
        "Faceware": [{"time": t / 60, "animationValues": row} for t, row in enumerate(rows)],
        "times beside": {"timestamps": [t / 60 for t in range(len(w))], "frames": rows},
        "numbers in quotes": [
            {"timestamp": t / 60, "blendShapes": {name: str(x) for name, x in row.items()}}
            for t, row in enumerate(rows)
        ],
        "a data frame": {
            "fps": "60",
            **{n: {str(t): x for t, x in enumerate(row)} for n, row in zip(NAMES, w.T.tolist(), strict=True)},
        },
        "a data frame by times": {
            n: {f"{t / 60:.4f}": x for t, x in enumerate(row)} for n, row in zip(NAMES, w.T.tolist(), strict=True)
        },
        "a data frame below data": {
            "fps": 60,
            "data": {n: {str(t): x for t, x in enumerate(row)} for n, row in zip(NAMES, w.T.tolist(), strict=True)},
        },
        "text codes": [{"timecode": code(t), **row} for t, row in enumerate(rows)],
    }


@pytest.mark.parametrize("kind", documents(weights(frames=2)))
def test_every_dialect_of_json_gives_the_same_weights(tmp_path, kind):
    take = read(tmp_path / "take.json", json.dumps(documents(weights())[kind]))
    assert driven(take) == pytest.approx(weights(), abs=1e-9)
    assert take.fps == 60
    assert take.notes == ()


@pytest.mark.parametrize("suffix", ["json", "csv"])
def test_frames_whose_numbers_are_out_of_order_are_sorted_and_said(tmp_path, suffix):
    order = np.random.default_rng(0).permutation(T)
    frames = [{"frame": int(t), "blendShapes": row} for t, row in zip(order, named(weights()[order]), strict=True)]
    text = table(weights()[order], lead="frame", first=lambda t: str(order[t]))
    take = read(tmp_path / f"a.{suffix}", json.dumps({"fps": 60, "frames": frames}) if suffix == "json" else text)
    assert driven(take) == pytest.approx(weights())
    assert "frames do not stand in the order of 'frame': they are sorted by it" in take.notes


def test_json_lines_are_frames_and_a_cut_last_line_is_counted(tmp_path):
    text = "\n".join(json.dumps(frame) for frame in documents(weights())["ARKit"])
    assert driven(read(tmp_path / "take.jsonl", text)) == pytest.approx(weights())
    take = read(tmp_path / "take.json", text[:-20])
    assert driven(take) == pytest.approx(weights()[:-1])
    assert any(note.startswith("1 of 90 rows cannot be read and was left out") for note in take.notes)


@pytest.mark.parametrize("with_names", [True, False])
def test_face_caps_text_holds_the_same_take(tmp_path, with_names):
    names = [name.replace("Left", "_L").replace("Right", "_R") for name in NAMES] if with_names else USUAL
    at = [list(names).index(name.replace("Left", "_L").replace("Right", "_R")) for name in NAMES]
    w = np.zeros((T, len(names)))
    w[:, at] = weights()
    pose = "0.1,-2,30,4.5,9,12,1,2,3,4"
    lines = [f"k,{round(1000 * t / 60)},{pose},{','.join(map(str, row))}" for t, row in enumerate(w.tolist())]
    lead = ["info,Face Cap,1.9", *(["bs," + ",".join(names)] if with_names else [])]
    take = read(tmp_path / "take.txt", "\n".join([*lead, *lines]))
    assert driven(take) == pytest.approx(weights())
    assert take.fps == 60
    assert bool(take.notes) != with_names
    assert not any("no name" in why or "column" in name for name, why in take.mapping.left_out)


@settings(max_examples=15, deadline=None)
@given(st.permutations(range(len(NAMES))), st.integers(0, 99))
def test_the_order_of_columns_does_not_matter(tmp_path_factory, order, seed):
    folder, w = tmp_path_factory.mktemp("order"), weights(seed)
    take = read(folder / "take.csv", table(w[:, order], names=[NAMES[i] for i in order]))
    assert driven(take) == pytest.approx(w)


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 999), st.floats(0.2, 1.3))
def test_a_hundred_times_the_values_are_the_same_weights(tmp_path_factory, seed, top):
    folder, w = tmp_path_factory.mktemp("scale"), np.round(top * weights(seed), 4)
    plain = read(folder / "a.csv", table(w, digits="{:.4f}"))
    hundred = read(folder / "b.csv", table(100 * w, digits="{:.2f}"))
    assert driven(plain) == pytest.approx(w)
    assert driven(hundred) == pytest.approx(w)
    assert any("per cent" in note for note in hundred.notes)
    assert not any("per cent" in note for note in plain.notes)


@pytest.mark.parametrize(
    "beside",
    [
        {"frame_number": range(T)},
        {"timestampMs": [17 * t for t in range(T)]},
        {"HeadYaw": np.linspace(-40, 40, T)},
        {"somethingElse": np.linspace(0, 500, T), "another": np.full(T, 99.0)},
    ],
)
def test_columns_that_drive_nothing_never_make_weights_per_cent(tmp_path, beside):
    w = np.column_stack([weights(), *(list(values) for values in beside.values())])
    assert driven(read(tmp_path / "a.csv", table(w, names=(*NAMES, *beside)))) == pytest.approx(weights())
    rows = [dict(zip((*NAMES, *beside), row, strict=True)) for row in w.tolist()]
    assert driven(read(tmp_path / "a.json", json.dumps(rows))) == pytest.approx(weights())


def test_neither_one_value_nor_one_column_decides_about_per_cent(tmp_path):
    w = weights()
    w[7, 2] = 40.0
    take = read(tmp_path / "a.csv", table(w))
    assert driven(take) == pytest.approx(np.delete(w, 7, axis=0))
    assert any("eyeBlinkRight 40 in frame 7" in note for note in take.notes)
    w = 100 * weights()
    w[:, 1] /= 100
    assert driven(read(tmp_path / "b.csv", table(w, digits="{:.6f}")))[:, 0] == pytest.approx(weights()[:, 0])


def test_a_quiet_take_in_per_cent_is_told_and_never_four_times_a_face(tmp_path):
    take = read(tmp_path / "a.csv", table(np.round(4.2 * weights(), 2), digits="{:.2f}"))
    assert driven(take).max() < 0.05
    assert any("not certain" in note and "per cent" in note for note in take.notes)


def test_openfaces_intensities_keep_their_own_scale_beside_per_cent(tmp_path):
    w = np.column_stack([100 * weights()[:, :3], np.linspace(0, 5, T)])
    take = read(tmp_path / "a.csv", table(w, names=(*NAMES[:3], "AU12_r")))
    assert driven(take, ("mouthSmileLeft",)).max() == pytest.approx(1)


LOST = [3, 4, 40]


def with_lost(replacement):
    frames = documents(weights())["ARKit"]
    for t in LOST:
        frames[t] = replacement(frames[t])
    return json.dumps(frames)


@pytest.mark.parametrize(
    "replacement",
    [
        lambda frame: frame | {"blendShapes": None},
        lambda frame: frame | {"blendShapes": {}},
        lambda frame: frame | {"blendShapes": []},
        lambda frame: frame | {"blendShapes": dict.fromkeys(NAMES)},
        lambda frame: {"timestamp": frame["timestamp"]},
        lambda frame: frame | {"tracked": False},
        lambda frame: None,
    ],
)
def test_a_lost_face_in_json_is_left_out_and_counted(tmp_path, replacement):
    take = read(tmp_path / "take.json", with_lost(replacement).replace('}, {"timestamp', '},\n{"timestamp'))
    assert driven(take) == pytest.approx(np.delete(weights(), LOST, axis=0))
    assert "3 of 90 frames have no face and were left out" in take.notes
    assert take.fps == 60


@pytest.mark.parametrize("row", ["{code}", "{code},0", "{code}" + "," * 7, "{code},0" + "," * 6, "{code}" + ",nan" * 7])
def test_a_lost_face_in_a_table_is_left_out_and_counted(tmp_path, row):
    lines = table(np.column_stack([np.full(T, 6), weights()]), names=("BlendshapeCount", *NAMES)).splitlines()
    for t in LOST:
        lines[t + 1] = row.format(code=code(t))
    take = read(tmp_path / "take.csv", "\n".join(lines))
    assert driven(take) == pytest.approx(np.delete(weights(), LOST, axis=0))
    assert "3 of 90 frames have no face and were left out" in take.notes


@pytest.mark.parametrize(
    "row", ["{code},0.1,0.2", "{code},0.1,0.2,x,0.4,0.5,0.6", "{code},0.1,,0.3,0.4,0.5,0.6", "{code}" + ",1" * 9]
)
def test_damaged_rows_are_counted_and_refused_above_a_fifth(tmp_path, row):
    lines = table(weights()).splitlines()
    for t in LOST:
        lines[t + 1] = row.format(code=code(t))
    take = read(tmp_path / "take.csv", "\n".join(lines))
    assert driven(take) == pytest.approx(np.delete(weights(), LOST, axis=0))
    assert any(note.startswith("3 of 90 rows cannot be read and were left out") for note in take.notes)
    for t in range(20):
        lines[t + 1] = row.format(code=code(t))
    with pytest.raises(RigError, match="of 90 rows that cannot be read") as refused:
        read(tmp_path / "take.csv", "\n".join(lines))
    assert "\n" not in str(refused.value)


def test_names_that_frames_leave_out_are_0_and_told(tmp_path):
    w = np.where(weights() > 0.4, weights(), 0)
    frames = [{name: x for name, x in row.items() if x} for row in named(w)]
    take = read(tmp_path / "take.json", json.dumps({"fps": 60, "frames": frames}))
    retained = np.array([bool(frame) for frame in frames])
    assert driven(take) == pytest.approx(w[retained])
    assert any("missing in some frames and count as 0" in note for note in take.notes)


def test_python_writes_no_number_as_nan_and_it_is_read(tmp_path):
    frames = documents(weights())["ARKit"]
    frames[5]["blendShapes"]["jawOpen"] = float("nan")
    take = read(tmp_path / "take.json", json.dumps(frames))
    assert driven(take) == pytest.approx(np.delete(weights(), 5, axis=0))


def test_a_column_with_few_numbers_is_left_out_and_named(tmp_path):
    lines = table(weights()).splitlines()
    lines = [line if t < 20 else line.rpartition(",")[0] + "," for t, line in enumerate(lines)]
    take = read(tmp_path / "take.csv", "\n".join(lines))
    assert len(take) == T
    assert ("browInnerUp", "it has a number in 19 of 90 rows") in take.mapping.left_out


def test_arrays_of_meshes_are_frames_whatever_they_are_called(tmp_path):
    rig = sample_rig()
    jaw = rig.deltas[rig.names.index("jawOpen")]
    frames = np.stack([rig.neutral + a * jaw for a in np.linspace(0, 1, 6)]).astype(np.float32)
    np.save(tmp_path / "a.npy", frames)
    np.save(tmp_path / "flat.npy", frames.reshape(6, -1))
    for name in ("frames", "vertices", "verts", "whatever"):
        np.savez(tmp_path / f"{name}.npz", **{name: frames})
    want = np.asarray(frames, dtype=float)
    for path in tmp_path.iterdir():
        take = read_sequence(path, rig=rig, fps=30.0)
        assert take.frames.block(0, 6) == pytest.approx(want, abs=0.1), path.name
    lost = frames.copy()
    lost[2], lost[4] = np.nan, 0
    np.save(tmp_path / "a.npy", lost)
    take = read_sequence(tmp_path / "a.npy", rig=rig, fps=30.0)
    assert take.frames.block(0, 4) == pytest.approx(want[[0, 1, 3, 5]], abs=0.1)
    assert take.notes[0] == "2 of 6 frames have no face and were left out"
    np.save(tmp_path / "few.npy", np.zeros((4, 52)))
    with pytest.raises(RigError, match=r"expected frames \(t, v, 3\)"):
        read_sequence(tmp_path / "few.npy", rig=rig)


def test_numbers_without_names_are_refused_as_such(tmp_path):
    with pytest.raises(RigError, match="has no line of names above its numbers"):
        read(tmp_path / "take.csv", table(weights()).partition("\n")[2])
    with pytest.raises(RigError, match="decimal commas between commas"):
        read(tmp_path / "take.csv", table(weights(), decimal=","))
