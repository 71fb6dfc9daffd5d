"""`check` asks whether the reading makes sense, also where the plan was made from the same wrong one."""

from dataclasses import replace as dataclass_replace

import numpy as np
import pytest
from msgspec.structs import replace

from capture_plan.check.again_claims import audit_claim
from capture_plan.check.reading_claims import reading_claims, strongest_kinds
from capture_plan.check.report import check_lines
from capture_plan.mesh.decimate import decimate
from capture_plan.plan.files import read_plan, rig_of
from capture_plan.plan.make import make_plan
from capture_plan.reader.read import read_rig
from tests.command import run
from tests.once import QUICK, plan_of


@pytest.fixture(scope="module")
def plan():
    return plan_of(QUICK)


@pytest.fixture(scope="module")
def file(rig, tmp_path_factory):
    """A coarser sample in centimetres, as a file that says nothing of its axes; and its mirror image."""
    folder = tmp_path_factory.mktemp("rigs")
    retained, triangles = decimate(rig.neutral, rig.triangles, len(rig.triangles) // 2)
    x, deltas = rig.neutral[retained] / 10, rig.deltas[:, retained] / 10
    for name, flip in (("head.npz", [1, 1, 1]), ("mirrored.npz", [-1, 1, 1])):
        arrays = {"faces": triangles[:, :: flip[0]], "names": np.array(rig.names), "units": "cm"}
        np.savez(folder / name, vertices=x * flip, deltas=deltas * flip, **arrays)
    (folder / "quick.toml").write_text(
        '[landmarks]\nmethod = "cover"\n[expressions]\nmethod = "greedy"\nposeable = false\n'
    )
    return folder / "head.npz"


def broken(plan, rig):
    return {claim.what: claim.explanation for claim in reading_claims(plan, rig) if not claim.holds}


def test_a_plan_that_was_read_right_makes_sense(plan, rig):
    assert broken(plan, rig) == {}


def test_a_mirrored_rig_fails(file):
    mirrored = read_rig(file.with_name("mirrored.npz"))
    found = broken(make_plan(mirrored, QUICK), mirrored)
    assert "exchange left and right" in found["what is called left moves the subject's left"]


EYES_ABOVE = "what moves the eyes lies above what moves the mouth"
FROM_THE_FRONT = "most of the markers are seen from the front"
PUPILS = "the pupils are 50 to 80 mm apart, or there is a reason why not"


@pytest.mark.parametrize(
    ("given", "what", "message", "says"),
    [
        ("--up +y --facing -z", FROM_THE_FRONT, "0% of the markers look forward", "without it, or with --facing +z."),
        ("--up +z --facing +y", EYES_ABOVE, "--up +y --facing +z", "without them, or with --up +y --facing +z."),
        ("--up -y --facing +z", "the jaw opens downwards", "the jaw opens 67% up", "without it, or with --up +y."),
        ("--unit-mm 20", PUPILS, "with --unit-mm 10", "without it, or with --unit-mm 10."),
    ],
)
def test_a_wrong_reading_fails_though_the_plan_was_made_with_it_and_what_to_correct_is_said_once(
    file, given, what, message, says
):
    run("plan", file.name, *given.split(), "--settings", "quick.toml", "-o", "plan.json", cwd=file.parent)
    plan = read_plan(file.with_name("plan.json"))
    claims = reading_claims(plan, rig_of(plan, file.with_name("plan.json")))
    assert message in next(claim.explanation for claim in claims if claim.what == what and not claim.holds)
    (to_correct,) = (line for line in check_lines(claims, ()) if line.startswith("To correct: "))
    assert says in to_correct


def named(plan, region):
    """The plan with every marker called by one region."""
    markers = tuple(replace(m, region=region, label=region) for m in plan.layout.landmarks)
    return replace(plan, layout=replace(plan.layout, landmarks=markers))


@pytest.mark.parametrize("region", ["forehead", "chin", "cheek", "upper lip"])
def test_regions_that_move_otherwise_are_caught(plan, rig, region):
    found = broken(named(plan, region), rig)
    assert "moves most with" in found["markers are called by regions that move as they do"]


def test_a_marker_that_the_jaw_moves_most_is_no_forehead(plan, rig):
    kinds = strongest_kinds(plan, rig, list(plan.layout.landmarks))
    by_the_jaw = [m for m, (name, _) in zip(plan.layout.landmarks, kinds, strict=True) if name == "jawOpen"]
    assert by_the_jaw
    assert {m.region for m in by_the_jaw} <= {"chin", "lower lip", "jaw", "neck", "cheek", "mouth corner"}


def test_markers_called_left_lie_on_the_left(plan, rig):
    exchanged = {"left": "right", "right": "left", "middle": "middle"}
    markers = tuple(replace(m, side=exchanged[m.side]) for m in plan.layout.landmarks)
    found = broken(replace(plan, layout=replace(plan.layout, landmarks=markers)), rig)
    assert "markers called left lie on the subject's left" in found


def test_a_reading_that_is_not_that_of_the_rig_is_caught(plan, rig):
    read = plan.audit.reading
    lie = replace(plan, audit=replace(plan.audit, reading=replace(read, mouth=replace(read.mouth, mm=(0.0, 0.0, 0.0)))))
    assert "audit.reading.mouth.mm" in audit_claim(lie, plan.audit).found
    assert not audit_claim(lie, plan.audit).holds


def test_markers_that_stand_still_opposite_a_moving_half_have_no_wrong_region(plan, rig):
    deltas = rig.deltas.copy()
    deltas[:, rig.neutral[:, 0] < -1] = 0
    half = dataclass_replace(rig, deltas=deltas)
    still = [m for m in plan.layout.landmarks if rig.neutral[m.vertex, 0] < -1]
    assert still
    assert {kind for _, kind in strongest_kinds(plan, half, still)} == {None}
    assert not any("regions that move" in what for what in broken(plan, half))
