"""The command line: exit codes, one line for what is wrong, output in the named place only."""

import json
import re
import subprocess
import sys

import numpy as np
import pytest

from capture_plan.cli import RIG_FORMATS, options_again
from capture_plan.reader.read import FOLDER_READERS, FORMATS, READERS
from capture_plan.rig.read_options import ReadOptions
from capture_plan.sample import sample_rig
from tests.command import run
from tests.light import light_sample


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("session")
    quick = ("--method", "cover", "--expressions", "greedy")
    planned = run("plan", "sample", *quick, "-o", "plan.json", cwd=folder)
    assert planned.returncode == 0, planned.stderr
    assert "landmarks" in planned.stdout
    assert "wrote plan.json" in planned.stderr
    return folder


def test_a_plan_is_checked_and_data_go_to_standard_output(folder):
    checked = run("check", "plan.json", "--json", cwd=folder)
    assert checked.returncode == 0
    assert all(claim["holds"] for claim in json.loads(checked.stdout))


def test_a_plan_that_lies_exits_with_one(folder):
    plan = json.loads((folder / "plan.json").read_text())
    plan["layout"]["information"]["rank"] = 12
    (folder / "lie.json").write_text(json.dumps(plan))
    checked = run("check", "lie.json", cwd=folder)
    assert checked.returncode == 1
    assert "FAILS  12 of " in checked.stdout
    assert "plan again" in checked.stdout


def test_a_check_says_in_one_line_what_holds_and_in_a_line_each_where_asked(folder):
    claims = json.loads(run("check", "plan.json", "--json", cwd=folder).stdout)
    short, long = (run("check", "plan.json", *asked, cwd=folder).stdout.splitlines() for asked in ((), ("--all",)))
    assert short[0] == f"All {len(claims)} claims hold; --all lists each."
    assert long[: len(claims)] == [f"holds  {claim['what']}: {claim['found']}" for claim in claims]
    assert long[len(claims)] == f"All {len(claims)} claims hold."
    assert short[1:] == long[len(claims) + 1 :]
    assert all(line.startswith("Not checked: ") for line in short[1:])


def test_an_audit_is_a_page_or_json(folder):
    assert json.loads(run("audit", "sample", "--json", cwd=folder).stdout)["blendshapes"] == 52
    page = run("audit", "sample", cwd=folder)
    assert "tongueOut" in page.stdout
    assert run("audit", "sample", "-o", "audit.txt", cwd=folder).returncode == 0
    assert (folder / "audit.txt").read_text() == page.stdout


def test_after_an_audit_a_plan_is_the_next_step_only_where_one_can_be_made(folder):
    sample = sample_rig()
    still = sample.source_index[~sample.deltas.any(axis=(0, 2))]
    (folder / "still.txt").write_text(" ".join(map(str, still)))
    arrays = {"vertices": sample.neutral, "faces": sample.triangles, "deltas": sample.deltas, "names": sample.names}
    np.savez(folder / "head.npz", **arrays, source_index=sample.source_index, units="mm")
    nothing_moves = ("audit", "head.npz", "--skin", "still.txt")
    assert "Next: capture-plan audit sample -o audit.png shows how it was understood; then capture-plan plan" in (
        run("audit", "sample", cwd=folder).stderr
    )
    assert "Next: capture-plan plan sample." in run("audit", "sample", "-o", "a.txt", cwd=folder).stderr
    done = run(*nothing_moves, cwd=folder)
    assert "Shoot with it?      No: " in done.stdout
    assert "capture-plan plan" not in done.stderr
    assert "Next: " not in run(*nothing_moves, "-o", "b.txt", cwd=folder).stderr


def test_the_next_command_says_again_how_the_rig_was_to_be_read(folder):
    given = {"unit_mm": 216.5, "up": None, "facing": "-y", "skin": "M Face", "names": None}
    assert options_again(ReadOptions(**given)) == " --unit-mm 216.5 --facing -y --skin 'M Face'"
    assert options_again(ReadOptions()) == ""
    (folder / "n.toml").write_text('[names]\njawOpen = "jawOpen"\n')
    sample = sample_rig()
    arrays = {"vertices": sample.neutral, "faces": sample.triangles, "deltas": sample.deltas, "names": sample.names}
    np.savez(folder / "said.npz", **arrays, source_index=sample.source_index, units="mm")
    said = run("audit", "said.npz", "--names", "n.toml", "--up", "+y", cwd=folder).stderr
    assert "then capture-plan plan said.npz --up +y --names n.toml." in said


def test_an_audit_is_a_picture_where_its_file_is_called_one(folder):
    for name, begins in (("audit.png", b"\x89PNG"), ("audit.pdf", b"%PDF"), ("audit.html", b"<!doctype html>")):
        assert run("audit", "sample", "-o", name, cwd=folder).returncode == 0
        assert (folder / name).read_bytes().startswith(begins)
    assert run("audit", "sample", "--json", "-o", "audit.json", cwd=folder).returncode == 0
    assert json.loads((folder / "audit.json").read_text())["reading"]["axes"]["up"] == "+y"


def test_tables_and_schema_are_written_where_asked(folder):
    done = run("export", "plan.json", "-o", "out", "--only", "CSV,json", "--only", "csv", cwd=folder)
    assert done.returncode == 0, done.stderr
    said = done.stderr.splitlines() + done.stdout.splitlines()
    assert len(said) == len(set(said))
    names = sorted(path.name for path in (folder / "out").iterdir() if path.name != ".capture-plan.json")
    assert names == ["expressions.csv", "landmarks.csv", "plan.json", "plan.schema.json", "slate.csv"]
    assert (folder / "out" / "plan.json").read_bytes() == (folder / "plan.json").read_bytes()


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["plan", "nowhere", "-o", "x.json"], "nowhere"),
        (["plan", "sample", "--epsilon", "0", "-o", "x.json"], "epsilon"),
        (["plan", "sample", "--epsilon", "much", "-o", "x.json"], "epsilon"),
        (["plan", "sample", "--cameras", "nothing.toml", "-o", "x.json"], "nothing.toml"),
        (["plan", "sample", "--method", "magic", "-o", "x.json"], "magic"),
        (["plan", "sample", "--method", "budget", "-o", "x.json"], "needs a budget"),
        (["plan", "sample", "--budget", "0", "-o", "x.json"], "budget"),
        (["plan", "sample", "--skin", "nose", "-o", "x.json"], "--skin"),
        (["check", "nothing.json"], "nothing.json"),
        (["export", "plan.json", "--only", "fax"], "fax"),
        (["export", "plan.json", "--only", "c3d,"], "is no kind of export"),
        (["dance"], "dance"),
    ],
)
def test_what_is_wrong_is_said_in_one_line(folder, arguments, says):
    before = sorted(folder.rglob("*"))
    done = run(*arguments, cwd=folder)
    assert done.returncode == 2
    assert len(done.stderr.strip().splitlines()) == 1
    assert says in done.stderr
    assert "Traceback" not in done.stderr
    assert sorted(folder.rglob("*")) == before


def test_output_that_cannot_be_written_is_refused_and_nothing_left(folder):
    done = run("plan", "sample", "-o", "plan.json/inside.json", cwd=folder)
    assert done.returncode == 2
    assert "would lie in plan.json, which is a file" in done.stderr.splitlines()[-1]


@pytest.mark.parametrize("only", ["meshes", "json"])
def test_an_export_does_not_write_over_or_take_away_what_its_plan_was_made_of(folder, tmp_path, only):
    rig = tmp_path / "out" / "expressions"
    rig.mkdir(parents=True)
    (rig / "neutral.obj").write_text("v 0 0 0")
    plan = json.loads((folder / "plan.json").read_text())
    plan["rig"]["path"] = "out/expressions"
    (tmp_path / "hero.json").write_text(json.dumps(plan))
    done = run("export", "hero.json", "-o", "out", "--only", only, cwd=tmp_path)
    assert (done.returncode, len(done.stderr.splitlines())) == (2, 1)
    assert "is what is read" in done.stderr
    assert [path.name for path in (tmp_path / "out").rglob("*")] == ["expressions", "neutral.obj"]


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["audit", "sample", "-o", "plan.json"], "holds a plan"),
        (["inspect", "plan.json", "-o", "other.json"], "holds a plan"),
        (["settings", "-o", "other.json"], ".toml"),
        (["export", "other.json", "-o", ".", "--only", "json"], "holds a plan"),
        (["demo", "-o", "."], "holds a plan"),
        (["audit", "sample", "-o", "a.gif"], ".png .pdf .html"),
        (["inspect", "plan.json", "-o", "a.gif"], ".txt .json"),
        (["edit", "plan.json"], "nothing to edit"),
        (["edit", "plan.json", "-o", "new.json"], "nothing to edit"),
        (["edit", "plan.json", "--another", "--drop", "jawOpen"], "stand alone"),
        (["edit", "plan.json", "--why", "jawOpen,mouthPucker", "--drop", "jawOpen"], "stand alone"),
    ],
)
def test_what_would_replace_a_plan_or_write_what_a_name_does_not_say_is_refused(folder, tmp_path, arguments, says):
    for name in ("plan.json", "other.json"):
        (tmp_path / name).write_bytes((folder / "plan.json").read_bytes())
    done = run(*arguments, cwd=tmp_path)
    assert (done.returncode, len(done.stderr.splitlines())) == (2, 1)
    assert says in done.stderr
    assert {path.name: path.read_bytes() == (folder / "plan.json").read_bytes() for path in tmp_path.iterdir()} == {
        "plan.json": True,
        "other.json": True,
    }


def test_a_plan_stands_beside_its_rig_by_name_and_is_edited_in_its_place(folder, tmp_path):
    (tmp_path / "sample.plan.json").write_bytes((folder / "plan.json").read_bytes())
    edited = run("edit", "sample.plan.json", "--drop", "jawForward", cwd=tmp_path)
    assert edited.returncode == 0, edited.stderr
    assert sorted(path.name for path in tmp_path.iterdir()) == ["sample.plan.json", "sample.plan.json~"]
    assert (tmp_path / "sample.plan.json~").read_bytes() == (folder / "plan.json").read_bytes()
    again = run("edit", "sample.plan.json", "--drop", "jawForward", cwd=tmp_path)
    assert (again.returncode, len(again.stderr.splitlines())) == (2, 1)
    assert "follows these edits already" in again.stderr
    mine = (tmp_path / "sample.plan.json").read_bytes()
    refused = run("plan", "sample", cwd=tmp_path)
    assert refused.returncode == 2
    assert "edited by hand" in refused.stderr
    assert "--replace" in refused.stderr
    assert (tmp_path / "sample.plan.json").read_bytes() == mine
    quick = ("--method", "cover", "--expressions", "greedy")
    assert run("plan", "sample", *quick, "--replace", cwd=tmp_path).returncode == 0
    assert (tmp_path / "sample.plan.json~").read_bytes() == mine


@pytest.mark.parametrize(("name", "reason"), [("other.json", "another rig"), ("notes.json", "no plan"), ("l", "link")])
def test_a_plan_is_not_put_where_something_else_would_be_lost(folder, tmp_path, name, reason):
    plan = json.loads((folder / "plan.json").read_text())
    plan["rig"] |= {"fingerprint": "0" * len(plan["rig"]["fingerprint"]), "path": "hero.glb"}
    (tmp_path / "other.json").write_text(json.dumps(plan))
    (tmp_path / "notes.json").write_text("my notes")
    (tmp_path / "l").symlink_to("notes.json")
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    done = run("plan", "sample", "-o", name, cwd=tmp_path)
    assert done.returncode == 2
    assert reason in done.stderr
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before


def test_an_export_does_not_write_over_the_plan_that_it_is_made_of(folder):
    done = run("export", "plan.json", "-o", ".", "--only", "csv", cwd=folder)
    assert done.returncode == 2
    assert "plan.json is what is read" in done.stderr


CLOSED = ["1>&-", "2>&-", "1>&- 2>&-", "2>/dev/full", "1>/dev/full"]


@pytest.mark.parametrize(("closed", "asked"), [*((closed, "--json") for closed in CLOSED), ("1>/dev/full", "")])
def test_work_goes_on_where_nobody_reads_and_no_traceback_is_seen(tmp_path, closed, asked):
    command = f"'{sys.executable}' -c 'from capture_plan.cli import main; main()' audit sample {asked}"
    done = subprocess.run(["sh", "-c", f"{command} {closed}"], capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == (2 if closed == "1>/dev/full" else 0)
    assert "Traceback" not in done.stderr


def test_help_names_every_command(tmp_path):
    page = run("--help", cwd=tmp_path)
    assert page.returncode == 0
    for command in ("demo", "audit", "plan", "check", "render", "export", "notebook"):
        assert command in page.stdout


def test_the_help_of_a_rig_names_every_format_that_is_read():
    """Where a format is added, both texts name it."""
    for suffix in (*READERS, *FOLDER_READERS):
        kind = suffix[1:].upper() if suffix in FOLDER_READERS else suffix
        assert kind in RIG_FORMATS
        assert kind in FORMATS or (kind.startswith(".usd") and "USD" in FORMATS)


@pytest.mark.parametrize(("arguments", "code"), [(["--help"], 0), (["dance"], 2)])
def test_a_new_process_ends_and_says_as_in_this_one(tmp_path, arguments, code):
    command = [sys.executable, "-c", "from capture_plan.cli import main; main()", *arguments]
    done, here = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path), run(*arguments, cwd=tmp_path)
    assert done.returncode == here.returncode == code
    assert (done.stdout, done.stderr) == (here.stdout, here.stderr)


def test_a_plan_that_no_pages_are_made_of_is_told_so_when_it_is_made_and_with_what_to_correct(tmp_path):
    """Names of the upper face exchanged between left and right: `render` refuses such a plan."""
    rig = light_sample()
    sides = {"Left": "Right", "Right": "Left"}
    upper = re.compile(r"(brow|cheek|nose|eye).*(Left|Right)$")
    names = [re.sub("Left$|Right$", lambda of: sides[of[0]], n) if upper.match(n) else n for n in rig.names]
    np.savez(tmp_path / "b.npz", vertices=rig.neutral, faces=rig.triangles, deltas=rig.deltas, names=names, units="mm")
    few = ("--method", "cover", "--expressions", "sequential")
    made = run("plan", "b.npz", *few, "-o", "p.json", cwd=tmp_path)
    assert made.returncode == 0
    told = made.stderr[made.stderr.index("Before `render`") :]
    refused = run("render", "p.json", "-o", "out", cwd=tmp_path)
    assert refused.returncode == 1
    fails = [line for line in refused.stderr.splitlines() if line.startswith(("  FAILS", "  To correct"))]
    assert len(fails) > 1
    assert all(line in told for line in fails)
    assert "plan again, or capture-plan render p.json --force" in told
