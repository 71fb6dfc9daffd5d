"""Nothing is made of a plan that does not hold, unless a person insists; then everything says DRAFT."""

import csv
import dataclasses
import json

import msgspec
import numpy as np
import pypdfium2
import pytest
from msgspec.structs import replace
from PIL import Image

from capture_plan.audit import audit_cache as audited
from capture_plan.audit.audit import audit_rig
from capture_plan.camera import cameras_for
from capture_plan.check import gate
from capture_plan.check.check import check_plan, claims_of
from capture_plan.check.gate import NAMED, as_draft, as_far_as_it_goes, lies
from capture_plan.errors import PlanError
from capture_plan.exports import WRITES
from capture_plan.plan.files import read_plan, write_plan
from capture_plan.plan.inputs import PlanInputs
from capture_plan.plan.record import sealed
from capture_plan.sheets.page import DRAFT, Booklet, paper
from tests.command import run
from tests.once import QUICK, plan_of
from tests.tampering import answers_kept, tampered

COMMANDS = (
    ("render", "-o", "out", "--dpi", "72"),
    ("export", "-o", "out", "--only", "csv"),
    ("export", "-o", "out", "--only", "json"),
    ("inspect", "--json"),
    ("edit", "-o", "out/edited.json", "--lock", "jawOpen=2"),
    ("edit", "--why", "jawOpen,browInnerUp"),
)


@pytest.fixture(scope="module")
def plan():
    return plan_of(QUICK)


@pytest.fixture
def folder(plan, tmp_path):
    write_plan(plan, tmp_path / "plan.json")
    return tmp_path


def with_lie(folder):
    """A plan whose first two markers have each other's places in words, written as a crooked hand would."""
    document = json.loads((folder / "plan.json").read_bytes())
    first, second = document["layout"]["landmarks"][:2]
    first["label"], second["label"] = second["label"], first["label"]
    document["packing"]["expressions"][0]["sentence"] = "Smile!"
    lie = msgspec.convert(document, type(read_plan(folder / "plan.json")))
    write_plan(lie, folder / "lie.json")
    return folder / "lie.json"


@pytest.mark.parametrize("command", COMMANDS, ids=lambda command: command[0])
def test_a_plan_that_lies_is_refused_with_its_lies_named_and_nothing_written(folder, command):
    lie = with_lie(folder)
    done = run(command[0], lie, *command[1:], cwd=folder)
    lines = done.stderr.splitlines()
    assert (done.returncode, done.stdout) == (1, "")
    assert "does not hold" in lines[0]
    assert 0 < sum(line.startswith("  FAILS") for line in lines) <= NAMED
    assert any(".label says" in line for line in lines)
    assert "check" in lines[-1]
    assert "--force" in lines[-1]
    assert not (folder / "out").exists()


@pytest.mark.parametrize("command", COMMANDS, ids=lambda command: command[0])
def test_a_plan_of_another_rig_is_refused_by_force_too(folder, plan, command):
    write_plan(replace(plan, rig=replace(plan.rig, fingerprint="0" * 16)), folder / "other.json")
    done = run(command[0], "other.json", *command[1:], "--force", cwd=folder)
    assert done.returncode == 2
    assert "the rig has changed since" in done.stderr
    assert not (folder / "out").exists()


def test_a_sound_plan_passes_and_nothing_says_draft(folder, plan, rig):
    assert lies(plan, rig) == ()
    assert as_draft(plan, ()) is plan
    done = run("export", "plan.json", "-o", "out", "--only", "csv", "--only", "json", "--force", cwd=folder)
    assert done.returncode == 0
    assert "DRAFT" not in done.stderr
    assert not [path for path in (folder / "out").iterdir() if "DRAFT" in path.name]
    assert (folder / "out" / "plan.json").read_bytes() == (folder / "plan.json").read_bytes()


def test_what_is_written_by_force_says_it_is_a_draft_and_stays_one(folder, rig):
    lie = with_lie(folder)
    kinds = [word for kind in ("csv", "json", "meshes", "verify") for word in ("--only", kind)]
    done = run("export", lie, "-o", "out", *kinds, "--force", cwd=folder)
    assert done.returncode == 0
    assert "DRAFT" in done.stderr
    names = sorted(path.name for path in (folder / "out").iterdir() if not path.name.startswith("."))
    tables = {f"{name}-DRAFT.csv" for name in ("expressions", "landmarks", "slate")}
    others = {"plan.json", "plan.schema.json", "rig.npz", "verify_plan.py", "expressions-DRAFT"}
    assert set(names) == tables | others
    assert set(names) <= set(WRITES)  # else a place that holds an input of such a name would be written over
    assert next(csv.reader((folder / "out" / "landmarks-DRAFT.csv").open()))[0] == "name"
    draft = read_plan(folder / "out" / "plan.json")
    assert any(".label says" in why for why in draft.draft)
    edited = run("edit", "out/plan.json", "-o", "edited.json", "--lock", "jawOpen=2", "--force", cwd=folder)
    assert edited.returncode == 0
    assert read_plan(folder / "edited.json").draft == draft.draft


def test_a_draft_does_not_pass_even_where_all_else_holds(plan, rig):
    draft = sealed(replace(plan, draft=("a label was wrong",)))
    assert [one.found for one in lies(draft, rig)] == ["a label was wrong"]
    assert [one.found for one in check_plan(draft, rig) if not one.holds] == ["a label was wrong"]


def test_a_broken_seal_alone_is_a_lie_and_the_slow_claims_are_asked_for_it(plan, rig):
    colliding = replace(plan, packing=replace(plan.packing, colliding=()))
    assert [one.what for one in lies(replace(plan, seal="0"), rig)] == ["the plan is as it was written"]
    assert "expressions, their sentences and figures are those of the rig" in {one.what for one in lies(colliding, rig)}


def test_what_was_found_of_a_plan_is_not_asked_again_unless_a_word_of_it_changes(plan, rig, monkeypatch):
    asked = []

    def counted(*arguments, **named):
        asked.append(arguments)
        return claims_of(*arguments, **named)

    monkeypatch.setattr(gate, "claims_of", counted)
    lie = sealed(replace(plan, layout=replace(plan.layout, uncovered=("jawOpen",))))
    assert (lies(plan, rig), lies(plan, rig)) == ((), ())
    assert lies(lie, rig) == lies(lie, rig) != ()
    assert len(asked) <= 2


def test_what_was_found_of_a_plan_is_asked_again_where_the_inputs_beside_its_rig_change(plan, rig, monkeypatch):
    """Cameras are part of what an answer is kept for; what a person measured or painted is asked each time."""
    asked = []
    monkeypatch.setattr(gate, "claims_of", lambda *arguments, **named: asked.append(arguments) or ())
    near, far = (cameras_for("frontal", rig.neutral * scale, rig.skin) for scale in (1.0, 1.1))
    seen = sealed(replace(plan, settings=replace(plan.settings, cameras="frontal")))
    for cameras in (near, near, far, far):
        lies(seen, PlanInputs(rig, cameras=cameras))
    assert len(asked) == 2
    for _ in range(2):
        lies(plan, PlanInputs(rig, target=rig.neutral))
    assert len(asked) == 4


def test_an_audit_is_found_once_for_equal_rigs_and_anew_for_others(rig, monkeypatch):
    asked = []
    monkeypatch.setattr(audited, "audit_rig", lambda one: asked.append(one) or audit_rig(one))
    other = dataclasses.replace(rig, note="read with care")
    assert audited.audit_once(rig) == audited.audit_once(dataclasses.replace(rig)) == audit_rig(rig)
    assert audited.audit_once(other) == audit_rig(other) != audit_rig(rig)
    assert len([one for one in asked if one is other]) <= 1 <= 2 - len([one for one in asked if one is not other])


def pages_of(book, dpi=40):
    document = pypdfium2.PdfDocument(book.bytes())
    return [
        (page.get_textpage().get_text_range(), np.asarray(page.render(scale=dpi / 72).to_pil().convert("RGB")))
        for page in document
    ]


def test_draft_and_why_lie_across_every_page_over_pictures_too():
    book = Booklet(paper("a4"), "pages", draft="a label was wrong")
    for number in range(3):
        book.add_page(str(number))
        book.image(np.asarray(Image.new("RGB", (20, 30), "#404040")), 0, 0, 210, 297)
    for text, pixels in pages_of(book):
        assert text.count(DRAFT) == 2
        assert "a label was wrong" in text
        red = pixels[..., 0].astype(int) - pixels[..., 1] > 15
        rows, columns = np.nonzero(red)
        assert np.ptp(rows) > 0.6 * len(red)
        assert np.ptp(columns) > 0.6 * red.shape[1]


def test_pages_that_are_no_draft_carry_no_word_of_it():
    book = Booklet(paper("a4"), "pages")
    book.add_page("one")
    [(text, pixels)] = pages_of(book)
    assert text == ""
    assert (pixels == 255).all()


def test_a_draft_that_is_broken_too_far_ends_in_one_line(plan):
    with pytest.raises(PlanError, match="KeyError"), as_far_as_it_goes(replace(plan, draft=("a label was wrong",))):
        {}["E07"]
    with pytest.raises(KeyError), as_far_as_it_goes(plan):
        {}["E07"]


@pytest.mark.parametrize("seed", range(3))
def test_whatever_was_changed_a_forced_export_ends_without_a_traceback(folder, seed):
    document = json.loads((folder / "plan.json").read_bytes())
    with answers_kept():
        for number in range(12):
            kind, changed = tampered(document, number * 7, seed)
            (folder / "changed.json").write_text(json.dumps(changed))
            done = run("export", "changed.json", "-o", "out", "--only", "csv", "--only", "json", "--force", cwd=folder)
            assert done.returncode in (0, 2), kind
