"""Notebooks run on the sample rig, turn only what depends on a knob, and say errors in one sentence."""

import ast
import html
import importlib.util
import subprocess
import sys
from dataclasses import replace

import marimo as mo
import msgspec
import pytest

from capture_plan import figures, notebook
from capture_plan import notebooks_support as parts
from capture_plan.audit.audit import audit_rig
from capture_plan.errors import RigError
from capture_plan.expressions import PackingSettings
from capture_plan.layout.settings import LayoutSettings
from capture_plan.notebook import notebooks_folder, open_notebook
from capture_plan.plan.files import plan_bytes
from capture_plan.plan.record import Plan
from capture_plan.progress import track
from capture_plan.report.words import millimetres
from capture_plan.sample import sample_rig
from capture_plan.sample.motion import sample_motion
from capture_plan.shell.takes import takes_of
from tests.once import plan_of, shortened

NOTEBOOKS = sorted(notebooks_folder().glob("*.py"))
NAMES = [
    "compact_landmarks",
    "compare_layouts",
    "expressions",
    "landmarks",
    "packing_error",
    "rig",
    "session",
    "sheets",
    "thin_shell",
    "visibility",
]


@pytest.fixture(scope="module")
def short_plan():
    """The sample's plan with two of its expressions: enough to draw."""
    return shortened(plan_of())


def run(name, **given):
    """Run a notebook as a script would, with some of its variables given; returns what it defined."""
    path = notebooks_folder() / f"{name}.py"
    spec = importlib.util.spec_from_file_location(f"notebook_{name}", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.app.run(defs=given)[1]


def needs(name):
    """For every variable of a notebook, the variables that its cell reads, as marimo keeps them in the file."""
    tree = ast.parse((notebooks_folder() / f"{name}.py").read_text())
    found = {}
    for cell in tree.body:
        if isinstance(cell, ast.FunctionDef):
            last = cell.body[-1]
            defined = (
                ast.unparse(last.value).strip("()").split(",") if isinstance(last, ast.Return) and last.value else []
            )
            found |= {variable.strip(): {a.arg for a in cell.args.args} for variable in defined if variable.strip()}
    return found


def everything_above(variable, reads):
    above = set(reads.get(variable, ()))
    return above.union(*(everything_above(other, reads) for other in above)) if above else above


def test_there_is_a_notebook_for_every_stage_and_one_for_the_session():
    assert [path.stem for path in NOTEBOOKS] == NAMES


def test_notebooks_are_clean_under_marimos_own_check():
    checked = subprocess.run(
        [sys.executable, "-m", "marimo", "check", "--strict", *NOTEBOOKS], capture_output=True, text=True, check=False
    )
    assert checked.returncode == 0, checked.stdout + checked.stderr
    assert all("__generated_with" in path.read_text() for path in NOTEBOOKS)


def test_what_packing_is_worth_is_shown_of_a_rig_that_it_is_given():
    whole = sample_rig()
    few = replace(whole, names=whole.names[:12], deltas=whole.deltas[:12])
    defined = run("packing_error", rig=few, sitter=figures.sit(few), used=audit_rig(few).used)
    assert {len(rows) for rows in defined["by_rules"].values()} == {11}
    assert {name for e in defined["packing"].expressions for name in e.blendshapes} == set(audit_rig(few).used)


def test_the_notebook_of_thin_shells_evaluates_the_take_that_it_is_given():
    defined = run("thin_shell", counts=(6,))
    assert defined["found"].counts == (6,)
    assert defined["found"].take == defined["sequence"].name


def test_the_sheets_notebook_draws_every_page(short_plan):
    pages = run("sheets", rig=sample_rig(), plan=short_plan)["pages"]
    assert all(page.startswith(b"\x89PNG") for page in pages.values())
    assert sum(title.startswith("shot ") and title != "shot list" for title in pages) >= 2


def test_the_session_makes_the_plan_that_the_command_line_makes():
    plan = run("session", pages={})["plan"]
    assert plan_bytes(plan) == plan_bytes(plan_of())


def test_knobs_start_at_the_defaults_of_the_settings():
    assert parts.landmark_settings(parts.landmark_knobs()) == LayoutSettings()
    assert parts.packing_settings(parts.expression_knobs()) == PackingSettings()


@pytest.mark.parametrize(
    ("knob", "retained"),
    [
        ("landmarks", {"report", "face", "packing"}),
        ("expressions", {"report", "face"}),  # no dots meet in them: the landmarks depend on the expressions
        ("cameras", {"report", "packing"}),
        ("paper", {"report", "face", "layout", "packing", "plan"}),
    ],
)
def test_a_knob_of_the_session_recomputes_only_what_depends_on_it(knob, retained):
    reads = needs("session")
    assert {
        variable
        for variable in ("report", "face", "layout", "packing", "plan")
        if knob in everything_above(variable, reads)
    } == {
        "report",
        "face",
        "layout",
        "packing",
        "plan",
    } - retained


def test_an_unusable_rig_is_one_sentence_without_a_traceback():
    with pytest.raises(mo.MarimoStopError) as stopped, parts.working():
        raise RigError("<b>smile</b>.obj has 3 vertices")
    shown = html.unescape(stopped.value.output.text)
    assert "&lt;b&gt;smile&lt;/b&gt;.obj has 3 vertices" in shown
    assert "Traceback" not in shown


def test_what_is_no_expected_error_is_not_swallowed():
    with pytest.raises(ZeroDivisionError), parts.working():
        raise ZeroDivisionError


def test_progress_inside_a_notebook_yields_every_item():
    with parts.working():
        assert list(track(range(3), "counting")) == [0, 1, 2]


@pytest.mark.parametrize("name", ["<script>", "*bold* $x$", "a_b_c", "[link](x)"])
def test_a_name_means_nothing_in_markdown(name):
    text = mo.md(parts.markdown_plain(name)).text
    assert not any(f"<{tag}" in text for tag in ("script", "em", "strong", "a ", "marimo-tex"))


def test_a_wrong_rig_is_refused_before_a_server_starts(tmp_path, monkeypatch):
    monkeypatch.setattr(notebook, "serve", lambda *_: pytest.fail("a server was started"))
    with pytest.raises(RigError, match="does not exist"):
        open_notebook(str(tmp_path / "nothing.glb"))


def test_a_wrong_take_is_refused_before_a_server_starts(tmp_path, monkeypatch):
    monkeypatch.setattr(notebook, "serve", lambda *_: pytest.fail("a server was started"))
    with pytest.raises(RigError, match=r"nothing\.npz"):
        open_notebook("sample", [str(tmp_path / "nothing.npz")])


def test_a_session_with_a_take_says_what_every_layout_loses_of_it_and_offers_its_own():
    rig = sample_rig()
    layout = run("session", takes=takes_of(rig, [sample_motion(frames=30)]), pages={})["layout"]
    page = parts.layout_view(layout).text
    assert f"{layout.motion.rmse_mm:.2f} mm" in page
    assert all(millimetres(mm) in page for mm in (layout.motion.rmse_mm, *layout.motion.references_mm.values()))
    assert "Motion: the take's best for so many" in parts.landmark_knobs(take=True).elements["method"].options
    assert "Motion: the take's best for so many" not in parts.landmark_knobs().elements["method"].options


def test_a_plan_of_a_notebook_reads_back(short_plan):
    assert msgspec.json.decode(plan_bytes(short_plan), type=Plan) == short_plan
