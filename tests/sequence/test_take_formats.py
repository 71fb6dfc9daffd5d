"""Takes as people's tools and offices save them: other axes, archives, other languages: read, or refused in a line."""

import io
import json
import zipfile

import numpy as np
import pytest

from capture_plan.curves.axes_of import as_frames
from capture_plan.errors import RigError
from capture_plan.sample import sample_rig
from capture_plan.sequence import read_sequence
from capture_plan.sequence.archive import read_archive
from capture_plan.sequence.meshes import MeshTake
from tests.curves.test_take_dialects import NAMES, driven, read, table, weights

X = np.random.default_rng(0).normal(size=(7, 120, 3)).astype(np.float32)  # 7 frames of 120 vertices
ORDERS = {
    "t v 3": X,
    "t 3v": X.reshape(7, -1),
    "3v t": X.reshape(7, -1).T,
    "t 3 v": X.transpose(0, 2, 1),
    "v t 3": X.transpose(1, 0, 2),
    "v 3 t": X.transpose(1, 2, 0),
    "1 t v 3": X[None],
}


@pytest.mark.parametrize("order", ORDERS)
def test_frames_are_found_in_any_order_of_axes_where_the_mesh_is_known(order):
    assert np.array_equal(as_frames(ORDERS[order], {120})[0], X)


def test_more_frames_than_vertices_are_told_apart_by_the_mesh():
    longer = np.concatenate([X] * 40)
    for order in (longer, longer.transpose(0, 2, 1), longer.transpose(1, 2, 0), longer.reshape(280, -1).T):
        assert np.array_equal(as_frames(order, {120})[0], longer)


def test_numbers_that_are_no_frames_stay_as_they_are():
    few = np.zeros((50, 52))
    assert as_frames(few) == (few, ())


def test_turned_frames_are_said(tmp_path):
    rig = sample_rig()
    shapes = (rig.neutral + rig.displacement[:4, :, None] * [0, 0, 1]).astype(np.float32)
    np.save(tmp_path / "take.npy", shapes.reshape(4, -1).T)
    take = read_sequence(tmp_path / "take.npy", rig=rig)
    assert len(take.frames) == 4
    assert any("is taken as 4 frames of" in note for note in take.notes)


def test_an_array_for_each_name_is_a_take(tmp_path):
    arrays = dict(zip(NAMES, weights().T, strict=True))
    np.savez(tmp_path / "take.npz", **arrays, time=np.arange(len(weights())) / 60)
    take = read_sequence(tmp_path / "take.npz", rig=sample_rig())
    assert driven(take) == pytest.approx(weights())
    assert take.fps == 60


def archive(**files: str) -> bytes:
    """A zip archive of these files."""
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w") as packed:
        for name, text in files.items():
            packed.writestr(name.replace("__", "."), text)
    return content.getvalue()


def test_a_take_among_the_files_of_an_app_is_found_and_named(tmp_path):
    rest = {"frame_log__csv": "a,b\n1,2\n", "take__json": '{"date": "today"}', "thumbnail__jpg": "x"}
    raw = table(weights() / 2)
    take = read(tmp_path / "take.zip", archive(**rest, Slate_1_cal__csv=table(weights()), Slate_1_raw__csv=raw))
    assert driven(take) == pytest.approx(weights())
    assert any("Slate_1_cal.csv is read; Slate_1_raw.csv beside it is left out" in note for note in take.notes)


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("take.zip", archive(a__csv=table(weights()), b__csv=table(weights())), "holds 2 tables of weights"),
        ("take.zip", archive(a__jpg="x"), "holds no table of weights"),
        ("take.csv", archive(a__xml="x"), "is a zip archive or a workbook"),
        ("take.xlsx", archive(a__xml="x"), "is a workbook: save its sheet as CSV"),
    ],
    ids=["two", "none", "a workbook called CSV", "a workbook"],
)
def test_archives_without_one_take_are_refused_in_one_line(tmp_path, name, content, message):
    with pytest.raises(RigError, match=message) as error:
        read(tmp_path / name, content)
    assert "\n" not in str(error.value)


CLOCKS = ["Zeit", "Zeit (s)", "Temps", "Tiempo", "時間", "時刻", "时间"]


@pytest.mark.parametrize("clock", CLOCKS)
def test_clocks_are_known_in_other_languages(tmp_path, clock):
    rows = table(weights()).splitlines()
    rest = [",".join([f"{t / 60:.5f}", row.partition(",")[2]]) for t, row in enumerate(rows[1:])]
    head = ",".join([clock, rows[0].partition(",")[2]])
    assert read(tmp_path / "take.csv", "\n".join([head, *rest])).fps == 60


def test_japanese_text_of_a_spreadsheet_is_read_and_said(tmp_path):
    rows = table(weights()).splitlines()
    rest = [f"{t},{t / 60:.5f},{row.partition(',')[2]}" for t, row in enumerate(rows[1:])]
    text = "\n".join([f"フレーム,時刻,{rows[0].partition(',')[2]}", *rest])
    take = read(tmp_path / "take.csv", text.encode("cp932"))
    assert take.fps == 60
    assert any("code page 932, Japanese" in note for note in take.notes)


def test_accents_are_not_taken_for_japanese(tmp_path):
    rows = table(weights()).splitlines()
    text = "\n".join([f"{rows[0]},Lächeln,Öffnung,größer", *(f"{row},0,0,0" for row in rows[1:])])
    assert any("code page 1252" in note for note in read(tmp_path / "take.csv", text.encode("cp1252")).notes)


def test_powers_of_ten_with_decimal_commas_are_no_names(tmp_path):
    rows = table(weights(), delimiter=";").splitlines()
    powers = [
        ";".join([row.partition(";")[0], *(f"{x:.4E}".replace(".", ",") for x in w)])
        for row, w in zip(rows[1:], weights().tolist(), strict=True)
    ]
    assert driven(read(tmp_path / "take.csv", "\n".join([rows[0], *powers]))) == pytest.approx(weights(), abs=1e-4)


W = weights()


def keys_of(**keys):
    """Keys of each name: the time of frame t, and its weight."""
    time, value = keys
    return {n: [{time: keys[time](t), value: float(x)} for t, x in enumerate(w)] for n, w in BY_NAME.items()}


BY_NAME = dict(zip(NAMES, W.T, strict=True))
SECONDS = [t / 60 for t in range(len(W))]
CURVES = {
    "by name": {"FrameRate": 60, "Curves": keys_of(Time=lambda t: t / 60, Value=None)},
    "a list": {
        "fps": 60,
        "animation": {
            "curves": [{"name": n, "keys": k} for n, k in keys_of(time=lambda t: t / 60, value=None).items()]
        },
    },
    "pairs of frame and value": {
        "fps": 60,
        "fcurves": [
            {
                "data_path": f'key_blocks["{n}"].value',
                "keyframe_points": [{"co": [t + 1, float(x)]} for t, x in enumerate(w)],
            }
            for n, w in BY_NAME.items()
        ],
    },
    "lists of times and values": {
        "tracks": {n: {"times": SECONDS, "values": w.tolist()} for n, w in BY_NAME.items()},
    },
}


@pytest.mark.parametrize("clock", ["timestamp_ms", "time_s", "frame"])
def test_curves_play_in_the_unit_that_their_clock_is_named_for(tmp_path, clock):
    unit = {"timestamp_ms": 1000 / 60, "time_s": 1 / 60, "frame": 1}[clock]
    keys = {n: [{clock: round(t * unit, 6), "value": float(x)} for t, x in enumerate(w)] for n, w in BY_NAME.items()}
    take = read(tmp_path / "take.json", json.dumps({"fps": 60, "curves": keys}))
    assert driven(take) == pytest.approx(W, abs=1e-3)
    assert take.fps == 60


@pytest.mark.parametrize("kind", CURVES)
def test_curves_of_animation_programs_are_takes(tmp_path, kind):
    take = read(tmp_path / "take.json", json.dumps(CURVES[kind]))
    assert driven(take) == pytest.approx(W, abs=1e-6)
    assert take.fps == 60


def test_curves_with_few_keys_run_straight_between_them_and_say_so(tmp_path):
    keys = {n: [{"frame": 1, "value": 0.0}, {"frame": 11, "value": 1.0}] for n in NAMES}
    take = read(tmp_path / "take.json", json.dumps({"fps": 24, "curves": keys}))
    assert driven(take)[:, 0] == pytest.approx(np.arange(11) / 10)
    assert take.fps == 24
    assert any("straight between its keys" in note for note in take.notes)


def doubled(other):
    """A table whose last column has the name of the first weight, and other numbers where asked."""
    rows = [row.split(",") for row in table(W).splitlines()]
    extra = [f"{1 - float(row[1]):.3f}" if other else row[1] for row in rows[1:]]
    return "\n".join(",".join([*row, cell]) for row, cell in zip(rows, [NAMES[0], *extra], strict=True))


def test_a_column_that_stands_twice_is_read_once_and_said(tmp_path):
    take = read(tmp_path / "take.csv", doubled(other=False))
    assert driven(take) == pytest.approx(W)
    assert any(f"'{NAMES[0]}' stands twice" in note for note in take.notes)


def test_two_columns_of_one_name_with_other_numbers_are_refused(tmp_path):
    with pytest.raises(RigError, match="two columns 'jawOpen' with other numbers"):
        read(tmp_path / "take.csv", doubled(other=True))


def test_a_row_of_sums_without_a_time_is_no_frame(tmp_path):
    sums = ",".join(["", *(f"{x:.3f}" for x in W.sum(axis=0))])
    take = read(tmp_path / "take.csv", f"{table(W)}{sums}\n")
    assert driven(take) == pytest.approx(W)
    assert any("1 row has nothing in place of 'Timecode'" in note for note in take.notes)


def test_names_in_paths_of_data_are_those_of_the_blendshapes(tmp_path):
    paths = [f'key_blocks["{name}"].value' for name in NAMES]
    assert driven(read(tmp_path / "take.csv", table(W, names=paths))) == pytest.approx(W)


def test_a_line_of_groups_above_the_names_is_left_out(tmp_path):
    groups = ",".join(["Clock", *["Face"] * len(NAMES)])
    assert driven(read(tmp_path / "take.csv", f"{groups}\n{table(W)}")) == pytest.approx(W)


def test_long_tables_between_tabs_keep_their_empty_first_title(tmp_path):
    rows = [f"{i}\t{t / 60:.4f}\t{n}\t{x}" for i, (t, n, x) in enumerate(
        (t, n, x) for t, w in enumerate(W.tolist()) for n, x in zip(NAMES, w, strict=True))]  # fmt: skip
    take = read(tmp_path / "take.tsv", "\n".join(["\ttime\tshape\tvalue", *rows]))
    assert driven(take) == pytest.approx(W)
    assert take.fps == 60


def test_names_and_values_as_two_lists_of_each_frame_are_read(tmp_path):
    frames = [{"time": t / 60, "shapeNames": list(NAMES), "shapeValues": w} for t, w in enumerate(W.tolist())]
    take = read(tmp_path / "take.json", json.dumps({"frames": frames}))
    assert driven(take) == pytest.approx(W)
    assert take.fps == 60


def test_meshes_stay_meshes_beside_arrays_that_bear_names_of_a_face(tmp_path):
    frames = np.zeros((4, 30, 3), np.float32) + np.arange(30)[:, None]
    np.savez(tmp_path / "take.npz", frames=frames, jawOpen=np.arange(4.0), mouthClose=np.arange(4.0))
    assert isinstance(read_archive(tmp_path / "take.npz"), MeshTake)


def test_the_one_table_of_an_archive_says_what_is_wrong_with_it(tmp_path):
    with pytest.raises(RigError, match=r"take\.csv, which .*two columns 'jawOpen' with other numbers"):
        read(tmp_path / "take.zip", archive(take__csv=doubled(other=True)))
