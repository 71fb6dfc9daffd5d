"""A dot's name is its name and never the number of a vertex; what is neither is refused."""

import json

import pytest
from msgspec.structs import replace

from capture_plan import notebooks_support as parts
from capture_plan.audit.audit import audit_rig
from capture_plan.errors import PlanError
from capture_plan.evaluation.user_layouts import read_layouts
from capture_plan.layout.design import design_layout
from capture_plan.layout.dot_numbers import vertices_of, words_in
from capture_plan.layout.face import see_face
from capture_plan.plan.files import read_plan, write_plan
from capture_plan.plan.settings import LayoutSettings, Settings
from tests.command import run
from tests.once import QUICK, plan_of

COVER = LayoutSettings(method="cover", head_markers=3)
NEITHER = (
    "M99",
    "m01",
    "M 1",
    "-12",
    "12.0",
    "12.5",
    "1,225",
    "1e3",
    "0x1F",
    "",
    "twelve",
    "\u0661\u0662",
    "M01M02",
    "M",
)


@pytest.fixture(scope="module")
def plan():
    return plan_of(Settings(landmarks=COVER, expressions=QUICK.expressions))


@pytest.fixture
def folder(plan, tmp_path):
    write_plan(plan, tmp_path / "plan.json")
    return tmp_path


def at(plan, name):
    return next(m.source_vertex for m in plan.layout.markers if m.name == name)


@pytest.mark.parametrize("word", NEITHER)
def test_what_is_neither_a_dot_nor_a_whole_number_is_refused_with_both_named(word):
    with pytest.raises(PlanError, match=r"neither a dot of plan.json \(M01 to H02\) nor the whole number"):
        vertices_of([word], {"M01": 7, "M12": 90, "H02": 4}, what="pin", whose="plan.json")
    with pytest.raises(PlanError, match="no plan here"):
        vertices_of([word], {}, what="pin")


def test_a_name_is_the_dot_and_a_number_the_vertex():
    assert vertices_of(["M12", "12", "H02"], {"M12": 90, "H02": 4}, what="pin", whose="a plan") == (90, 12, 4)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("M12, 1225", ["M12", "1225"]),
        ("1225,2081; 7", ["1225", "2081", "7"]),
        ("1,225", ["1,225"]),
        ("1.225", ["1.225"]),
        ("1, 225", ["1", "225"]),
        (" ", []),
    ],
)
def test_a_list_of_dots_comes_apart_and_a_number_with_its_thousands_parted_does_not(text, words):
    assert words_in(text) == words


def test_pins_and_forbidden_dots_on_the_command_line_mean_those_of_the_plan_that_is_replaced(folder, plan):
    name, quick = plan.layout.landmarks[0].name, ("--method", "cover", "--expressions", "greedy")
    done = run("plan", "sample", *quick, "--pin", "H01", "--forbid", name, "-o", "plan.json", cwd=folder)
    assert done.returncode == 0, done.stderr
    made = read_plan(folder / "plan.json")
    assert made.settings.landmarks.pins == (at(plan, "H01"),)
    assert made.settings.landmarks.forbidden == (at(plan, name),)
    vertices = {m.source_vertex for m in made.layout.landmarks}
    assert at(plan, "H01") in vertices
    assert at(plan, name) not in vertices


def test_dots_in_a_settings_file_mean_those_of_the_plan_that_is_named(folder, plan):
    constraints = f'[landmarks]\nmethod = "cover"\npins = ["M03", {at(plan, "H01")}]\nforbidden = []\n'
    constraints += '[expressions]\nmethod = "greedy"\n'
    (folder / "constraints.toml").write_text(constraints)
    done = run("plan", "sample", "--settings", "constraints.toml", "--dots-of", "plan.json", "-o", "x.json", cwd=folder)
    assert done.returncode == 0, done.stderr
    assert read_plan(folder / "x.json").settings.landmarks.pins == (at(plan, "M03"), at(plan, "H01"))


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["--pin", "M99", "--dots-of", "plan.json"], "neither a dot of plan.json"),
        (["--pin", "M01"], "no plan here"),
        (["--forbid", "12.5"], "--forbid: '12.5'"),
        (["--pin", "M01", "--dots-of", "nothing.json"], "nothing.json"),
        (["--pin", "M01", "--dots-of", "other.json"], "another rig"),
        (["--cap", "nose=2.7"], "whole number"),
        (["--cap", "nose=inf"], "whole number"),
        (["--settings", "bad.toml"], "landmarks.pins: 'M99'"),
    ],
)
def test_what_cannot_be_meant_is_said_in_one_line(folder, plan, arguments, says):
    (folder / "bad.toml").write_text('[landmarks]\npins = ["M99"]\n')
    other = replace(plan, rig=replace(plan.rig, fingerprint="0" * 16))
    write_plan(other, folder / "other.json")
    done = run("plan", "sample", *arguments, "-o", "new.json", cwd=folder)
    assert done.returncode == 2
    assert len(done.stderr.strip().splitlines()) == 1
    assert says in done.stderr
    assert not (folder / "new.json").exists()


def test_a_layout_to_compare_names_vertices_and_no_dots(rig, tmp_path):
    (tmp_path / "mine.json").write_text(json.dumps({"mine": [1225, "M12"]}))
    with pytest.raises(PlanError, match="'mine': 'M12' is not the whole number"):
        read_layouts(tmp_path / "mine.json", rig)


class Knobs:
    def __init__(self, pins):
        self.value = parts.landmark_knobs().value | {"method": "cover", "pins": pins}


def test_a_dot_that_is_pinned_in_a_notebook_is_the_one_of_the_layout_without_pins(rig):
    face = see_face(rig, audit_rig(rig).used)
    free = parts.landmark_settings(Knobs(""), face)
    dots = {m.name: m.source_vertex for m in design_layout(face, free).markers}
    assert parts.landmark_settings(Knobs("M12, 12"), face).pins == (dots["M12"], 12)
    assert dots["M12"] != 12
    with pytest.raises(PlanError, match="'M99' is neither a dot of the layout without pins"):
        parts.landmark_settings(Knobs("M99"), face)
    with pytest.raises(PlanError, match="1,225"):
        parts.landmark_settings(Knobs("1,225"))
