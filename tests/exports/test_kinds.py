"""The table of kinds: what it names is there, and the command line and Python write the same from it."""

import json

import pandas as pd
import pytest
from msgspec.structs import replace

from capture_plan.errors import PlanError
from capture_plan.exports import KINDS, WRITES, write_exports
from capture_plan.exports.tables import write_expressions, write_landmarks
from capture_plan.layout.record import View
from capture_plan.plan.files import write_plan
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


def test_what_cannot_be_written_is_said_in_a_line_and_nothing_else_is_left(written):
    folder, _ = written
    done = run("export", "plan.json", "-o", "none", "--only", "trc", "--only", "wrap", cwd=folder)
    assert (done.returncode, len(done.stderr.splitlines())) == (2, 1)
    assert "no points for Wrap" in done.stderr
    assert not [path for path in folder.glob("none/*") if not path.name.startswith(".")]


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
    views = (View("top", True, 5.25), View("left", False, 3.0), View("far", False, 0.0))
    layout = sample().plan.layout
    seen = replace(layout, landmarks=tuple(replace(m, views=views) for m in layout.landmarks), head=())
    table = pd.read_csv(write_landmarks(seen, tmp_path / "landmarks.csv", file="hero.obj"))
    assert table.iloc[0][["top sees it", "left sees it", "far sees it"]].tolist() == ["always", "sometimes", "never"]
    assert table.iloc[0][["top least px", "left least px", "far least px"]].tolist() == [5.2, 3.0, 0.0]
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
    assert list(rows["slate"]) == [item.name for item in shot]
    assert list(rows["covered_percent"]) == pytest.approx([100 * item.covered for item in shot], abs=0.01)
