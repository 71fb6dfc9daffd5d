"""The table of kinds: what it names is there, and the command line and Python write the same from it."""

import json

import numpy as np
import pandas as pd
import pytest
from msgspec.structs import replace

from capture_plan.errors import PlanError
from capture_plan.exports import KINDS, WRITES, write_exports
from capture_plan.exports.tables import write_expressions, write_landmarks
from capture_plan.layout.record import View
from capture_plan.plan.files import write_plan
from capture_plan.plan.record import head_words, number_of, words_of
from capture_plan.progress import listen
from tests.command import run
from tests.exports.deliveries import sample

OF_THE_SAMPLE = tuple(name for name in KINDS if name not in ("wrap", "verify"))


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    folder = tmp_path_factory.mktemp("written")
    write_plan(sample().plan, folder / "plan.json")
    return folder, write_exports(sample().plan, sample().inputs, folder / "out", only=OF_THE_SAMPLE)


@pytest.mark.parametrize("kind", KINDS.values(), ids=KINDS)
def test_each_kind_has_its_writer_and_says_what_may_be_written(kind):
    assert callable(kind.write)
    assert kind.writes
    assert set(kind.writes) <= set(WRITES)
    assert "{" not in kind.next.format(folder="out", draft="")


def test_nothing_is_written_that_its_kind_does_not_name(written):
    folder, paths = written
    assert all(path.exists() for path in paths)
    found = {path.name for path in (folder / "out").iterdir() if not path.name.startswith(".")}
    may = {name for kind in OF_THE_SAMPLE for name in KINDS[kind].writes}
    assert found <= may
    assert all(found & set(KINDS[kind].writes) for kind in OF_THE_SAMPLE)


def test_the_command_line_writes_the_same_bytes_and_says_units_and_what_is_next(written):
    folder, paths = written
    asked = [word for kind in OF_THE_SAMPLE for word in ("--only", kind)]
    done = run("export", "plan.json", "-o", "typed", *asked, cwd=folder)
    assert done.returncode == 0, done.stderr
    for path in paths:
        assert (folder / "typed" / path.relative_to(folder / "out")).read_bytes() == path.read_bytes()
    steps = [line for line in done.stderr.splitlines() if line.startswith("Next: ")]
    for unit in ("millimetres, z up", "millimetres, y up", "centimetres, y up", "metres, z up", "metres, y up"):
        assert any(unit in step for step in steps)


def test_a_kind_that_cannot_be_written_takes_no_other_with_it(written):
    folder, _ = written
    done = run("export", "plan.json", "-o", "most", "--only", "trc", "--only", "wrap", "--only", "maya", cwd=folder)
    assert done.returncode == 2
    assert "all but wrap is written: no points for Wrap" in done.stderr.splitlines()[-1]
    found = [path.name for path in sorted(folder.glob("most/*")) if not path.name.startswith(".")]
    assert found == ["markers.ma", "markers.trc"]
    assert all(f"wrote most/{name}" in done.stderr.replace("\\", "/") for name in found)


def test_what_cannot_be_written_is_said_in_a_line_and_nothing_is_left(written):
    folder, _ = written
    done = run("export", "plan.json", "-o", "none", "--only", "wrap", cwd=folder)
    assert (done.returncode, len(done.stderr.splitlines())) == (2, 1)
    assert "no points for Wrap" in done.stderr
    assert not [path for path in folder.glob("none/*") if not path.name.startswith(".")]


def test_every_file_that_has_room_for_it_says_which_plan_and_whose_head_it_is_of(written):
    folder, plan = written[0] / "out", sample().plan
    number = number_of(plan)
    assert json.loads((written[0] / "plan.json").read_text())["seal"].startswith(number)
    for name in ("landmarks.csv", "expressions.csv", "slate.csv"):
        table = pd.read_csv(folder / name, dtype=str)
        assert set(table["plan"]) == {number}
        assert set(table["head"]) == {head_words(plan)} == {"MakeHuman head"}
    for name in ("markers.ma", "markers_blender.py", "expressions/neutral.obj"):
        assert words_of(plan) in (folder / name).read_text(), name
    for name in ("markers.usda", "expressions/examples.json"):
        assert number in (folder / name).read_text(), name
    for name in ("markers.c3d", "head.glb"):
        assert number.encode() in (folder / name).read_bytes(), name


def test_a_folder_that_now_holds_two_plans_is_told(tmp_path):
    of, told = sample(), []
    fewer = replace(of.plan, layout=replace(of.plan.layout, landmarks=of.plan.layout.landmarks[:-1]))
    with listen(told.extend):
        write_exports(of.plan, of.inputs, tmp_path, only=["trc", "maya"])
        write_exports(of.plan, of.inputs, tmp_path, only=["trc"])
        assert told == []
        write_exports(fewer, of.inputs, tmp_path, only=["trc"])
    (line,) = told
    assert "holds two plans: markers.ma not of plan " + number_of(fewer) in line


def test_a_folder_in_the_folder_is_told_too_and_what_is_of_no_plan_is_not(tmp_path):
    of, told = sample(), []
    fewer = replace(of.plan, layout=replace(of.plan.layout, landmarks=of.plan.layout.landmarks[:-1]))
    with listen(told.extend):
        write_exports(of.plan, of.inputs, tmp_path, only=["meshes", "json"])
        write_exports(fewer, of.inputs, tmp_path, only=["trc"])
    (line,) = [each for each in told if "two plans" in each]
    assert "holds two plans: expressions/ and plan.json not of plan " + number_of(fewer) in line


def test_a_kind_that_is_none_is_refused_with_the_kinds_there_are(tmp_path):
    with pytest.raises(PlanError, match="'fbx' is no kind of export: choose among csv, json"):
        write_exports(sample().plan, sample().inputs, tmp_path, only=["fbx"])


def test_the_tables_say_which_vertex_is_of_which_file(written):
    rows = (written[0] / "out" / "landmarks.csv").read_text().splitlines()
    first = dict(zip(rows[0].split(","), rows[1].split(","), strict=True))
    marker = sample().plan.layout.markers[0]
    assert first["file"] == "MakeHuman's base.obj"
    assert (int(first["vertex_in_file"]), int(first["vertex_in_plan"])) == (marker.source_vertex, marker.vertex)


def test_the_table_says_how_each_camera_sees_a_dot(tmp_path):
    views = (
        View("top", True, 5.25),
        View("left", False, 3.0, 0.5, "hidden", "jawOpen"),
        View("far", False, 0.0, 0.0, "edge-on", "neutral"),
    )
    layout = sample().plan.layout
    deep, flat = (0.04, 0.05, 0.2), (0.04, 0.05)
    measured = [deep] + [flat] * (len(layout.landmarks) - 1)
    marks = (replace(m, views=views, measured_mm=mm) for m, mm in zip(layout.landmarks, measured, strict=True))
    seen = replace(layout, landmarks=tuple(marks), head=())
    table = pd.read_csv(write_landmarks(seen, tmp_path / "landmarks.csv", file="hero.obj"))
    assert table.iloc[0][["top reads it", "left reads it", "far reads it"]].tolist() == ["always", "sometimes", "never"]
    assert table.iloc[0][["top least px", "left least px", "far least px"]].tolist() == [5.2, 3.0, 0.0]
    assert table.iloc[:2]["measured_to_mm"].tolist() == [0.04, 0.04]
    assert table["measured_worst_mm"][0] == 0.2
    assert np.isnan(table["measured_worst_mm"][1])
    assert table.iloc[0]["left why not"] == "hidden: jawOpen"
    assert len(table) == len(layout.landmarks)


def test_every_file_that_can_say_so_says_its_unit(written):
    folder = written[0] / "out"
    said = {
        "markers.ma": "one unit is a centimetre, +y up",
        "markers_blender.py": "One unit is a metre, +z up",
        "markers.usda": "One unit is a millimetre, +y up",
        "markers.trc": "\tmm\t",
        "expressions/neutral.obj": "unit: millimetre; +y up",
    }
    for name, words in said.items():
        assert words in (folder / name).read_text(), name
    assert json.loads((folder / "expressions" / "examples.json").read_text())["unit"] == "millimetre"


def test_poses_and_rows_of_expressions_stand_in_the_order_of_shooting(tmp_path):
    of = sample()
    shot = [item for item in of.plan.session.items if item.kind == "expression"]
    assert list(of.poses)[1:] == [item.name for item in shot] != [e.name for e in of.plan.packing.expressions]
    rows = pd.read_csv(write_expressions(of.plan, tmp_path / "e.csv"))
    assert list(rows["name"]) == [item.name for item in shot]
    assert list(rows["shot"]) == [int(item.slate) for item in shot]
    assert list(rows["covered_percent"]) == pytest.approx([100 * item.covered for item in shot], abs=0.01)
