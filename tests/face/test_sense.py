"""A reading is asked whether it makes sense: of all ways to read a head, only the right one does."""

from dataclasses import replace as change

import numpy as np
import pytest
from msgspec.structs import replace

from capture_plan.anatomy.regions import SIDELESS, face_regions
from capture_plan.anatomy.symmetry import symmetry_report
from capture_plan.audit.audit import audit_rig
from capture_plan.audit.report import audit_text, verdict
from capture_plan.audit.sides import misnamed
from capture_plan.face.anchors import face_anchors, looks_elsewhere
from capture_plan.face.axes import axes_matrix
from capture_plan.face.facts import reading_facts
from capture_plan.face.of_rig import rig_channels
from capture_plan.face.reading import face_reading
from capture_plan.face.sense import contradicted, pose_senses, side_senses
from capture_plan.face.sense_size import likely_unit, size_sense
from capture_plan.face.unit import human_apart
from capture_plan.face.votes import names_agree
from capture_plan.face.words import answers
from capture_plan.rig.read_options import AXES
from capture_plan.rig.understood import Sign
from capture_plan.sample import sample_rig

NAMES = ("browInnerUp", "browDownLeft", "browDownRight", "eyeBlinkLeft", "eyeBlinkRight", "jawOpen", "mouthSmileLeft")
NAMES += ("mouthSmileRight", "mouthPucker", "noseSneerLeft", "noseSneerRight", "mouthLeft")
WAYS = [(up, facing) for up in AXES for facing in AXES if up[1] != facing[1]]
RIGHT = ("+y", "+z")


@pytest.fixture(scope="module")
def rig():
    """The sample with a few of its blendshapes."""
    whole = sample_rig()
    return change(whole, names=NAMES, deltas=whole.deltas[[whole.names.index(name) for name in NAMES]])


def read_as(rig, up, facing):
    """The rig as it is where somebody says that these axes of it are up and forward."""
    R = axes_matrix(up, facing)
    return change(rig, neutral=rig.neutral @ R.T, deltas=(rig.deltas @ R.T).astype(np.float32), up=up, facing=facing)


def failing(senses):
    return [sense.what for sense in senses if not sense.holds]


@pytest.mark.parametrize("way", WAYS, ids="/".join)
def test_of_all_ways_to_read_a_head_only_the_right_one_makes_sense(rig, way):
    read = read_as(rig, *way)
    wrong = failing(pose_senses(read))
    assert bool(wrong) == (way != RIGHT)
    assert (len(contradicted(read)) >= 2) == (way != RIGHT)


def test_what_is_wrong_is_told_in_words_with_the_axes_that_make_sense(rig):
    together, lying = [sense for sense in pose_senses(read_as(rig, "+z", "+y")) if not sense.holds][:2]
    assert "speak for +y up and +z forward" in together.found
    assert "before" in lying.found
    assert (together.about, lying.about) == ("axes", "axes")
    assert together.better == (("--up", "+y"), ("--facing", "+z"))
    upside_down = [sense.found for sense in pose_senses(read_as(rig, "-y", "+z")) if not sense.holds]
    assert any("below" in found for found in upside_down)
    assert any("jaw opens" in found and "up" in found for found in upside_down)


def test_a_head_without_names_is_asked_by_its_shape(rig):
    nameless = change(rig, names=tuple(f"shape{k}" for k in range(len(NAMES))))
    assert failing(pose_senses(nameless)) == []
    assert failing(pose_senses(read_as(nameless, "+z", "+y")))
    assert failing(pose_senses(read_as(nameless, "+y", "-z")))


def test_a_mirrored_rig_has_its_left_on_the_right(rig):
    flip = np.array([-1.0, 1.0, 1.0])
    mirrored = change(rig, neutral=rig.neutral * flip, deltas=(rig.deltas * flip).astype(np.float32))
    assert failing(side_senses(rig)) == []
    (sense,) = side_senses(mirrored)
    assert not sense.holds
    assert "eyeBlinkLeft" in sense.found or "browDownLeft" in sense.found
    assert sense.about == "sides"


def test_names_are_not_to_be_exchanged_before_it_is_settled_how_the_head_lies(rig):
    flip = np.array([-1.0, 1.0, 1.0])
    mirrored = change(rig, neutral=rig.neutral * flip, deltas=(rig.deltas * flip).astype(np.float32))
    for read, says, who in ((mirrored, "Exchange left", "rigger"), (read_as(rig, "+y", "-z"), "Settle first", "know")):
        found = misnamed(read, symmetry_report(read))
        assert "eyeBlinkLeft" in found[0].blendshapes
        assert "mouthLeft" in found[-1].blendshapes
        assert {(one.advice.startswith(says), one.urgency) for one in found} == {(True, who)}


def test_a_name_map_may_set_right_what_names_say_wrongly(rig):
    """Names of the other side, and a map that says so."""
    swapped = tuple(n.replace("Left", "L").replace("Right", "Left").replace("L", "Right") for n in ("Left", "Right"))
    other = {
        name: name.replace("Left", swapped[0]) if "Left" in name else name.replace("Right", "Left") for name in NAMES
    }
    lying = change(rig, names=tuple(other.values()))
    assert failing(side_senses(lying))
    message = change(lying, meanings=tuple((wrong, name) for name, wrong in other.items() if wrong != name))
    assert failing(side_senses(message)) == []


@pytest.mark.parametrize("times", [0.1, 0.39, 2.54, 10.0])
def test_a_wrong_unit_is_no_size_of_a_face(rig, times):
    other = change(rig, neutral=rig.neutral * times, deltas=rig.deltas * times, unit_mm=times, unit_found="given")
    sense = size_sense(other)
    assert not sense.holds
    assert sense.better == (("--unit-mm", "1"),)
    assert size_sense(rig).holds


def test_a_unit_that_the_file_states_is_a_reason(rig):
    giant = change(rig, neutral=rig.neutral * 2, deltas=rig.deltas * 2, unit_mm=10.0, unit_found="format")
    assert size_sense(giant).holds
    assert "the file itself states its unit" in size_sense(giant).found


def test_a_unit_that_the_file_states_stops_no_shoot_that_its_check_lets_pass(rig):
    giant = change(rig, neutral=rig.neutral * 1.4, deltas=rig.deltas * 1.4, unit_mm=10.0, unit_found="format")
    assert size_sense(giant).holds
    (size,) = [finding for finding in audit_rig(giant).findings if finding.kind == "size"]
    assert size.urgency == "know"
    (asked,) = [one for one in audit_rig(change(giant, unit_found="detected")).findings if one.kind == "size"]
    assert asked.urgency == "stop"


def test_pupils_are_judged_as_they_are_told():
    assert human_apart(80.04)
    assert not human_apart(80.06)
    assert human_apart(49.96)


def test_a_unit_is_hinted_only_where_a_person_would_have_the_size(rig):
    read = reading_facts(rig)
    for says, message in (("10 mm", "another unit"), ("1.2 mm", "1 unit = 1.2 mm")):
        doubted = replace(read, unit=replace(read.unit, mm=1.0, signs=(Sign("the size of the mesh", says, -1.0),)))
        (unit,) = [one for one in answers(doubted) if one.label == "Unit"]
        assert [sign.name for sign in unit.signs] == [f"the size of the mesh would fit {message}"]


def test_a_unit_that_failed_is_not_the_better_one():
    assert likely_unit(10.0, 45.0) == pytest.approx(14, abs=0.1)
    assert likely_unit(1000.0, 157.0) == pytest.approx(401, abs=1)  # feet would make the pupils 48 mm


def test_the_likely_unit_is_a_usual_one_where_one_fits():
    assert likely_unit(1.0, 6.2) == 10.0
    assert likely_unit(10.0, 620.0) == 1.0
    assert likely_unit(1.0, 20.0) == pytest.approx(3.15)


def test_a_reading_that_the_face_contradicts_is_doubted_on_the_page_and_takes_the_names_away(rig):
    behind = read_as(rig, "+y", "-z")
    found = audit_rig(behind)
    assert found.reading is not None
    assert found.reading.against
    assert not found.reading.regions_known
    assert verdict(found).startswith("Look at how it was understood first")
    assert "Against this reading" in audit_text(found)
    regions = face_regions(behind)
    assert regions.label(int(np.flatnonzero(behind.skin)[0])) == SIDELESS
    assert reading_facts(rig).against == ()


def test_one_answer_alone_contradicts_nothing(rig, monkeypatch):
    """A jaw that opens forward is odd, not a head that was read from behind."""
    deltas = rig.deltas.copy()
    deltas[NAMES.index("jawOpen"), :, 2] *= -1
    odd = change(rig, deltas=deltas)
    assert failing(pose_senses(odd)) == ["the jaw opens downwards"]
    assert contradicted(odd) == ()


def test_no_eyes_no_question_about_them(rig, monkeypatch):
    nothing = replace(face_reading(rig), eyes=replace(face_reading(rig).eyes, left=None, right=None))
    monkeypatch.setattr("capture_plan.face.sense.face_reading", lambda rig: nothing)
    assert "the eyes lie above the mouth" not in [sense.what for sense in pose_senses(rig)]


def test_the_jaw_is_asked_where_brows_are_called_by_the_other_side(rig):
    """Names that contradict each other about sides say nothing against the jaw: what is called so moves most, too."""
    exchanged = {"browDownLeft": "browDownRight", "browDownRight": "browDownLeft"}
    crossed = change(rig, names=tuple(exchanged.get(name, name) for name in rig.names))
    assert not names_agree(rig_channels(crossed))
    what = "the jaw opens downwards"
    assert [sense.holds for sense in pose_senses(crossed) if sense.what == what] == [True]
    unnamed = change(crossed, names=tuple("t" if name == "jawOpen" else name for name in crossed.names))
    assert what not in [sense.what for sense in pose_senses(unnamed)]
    mapped = change(unnamed, meanings=(("t", "jawOpen"),))
    assert [sense.holds for sense in pose_senses(mapped) if sense.what == what] == [True]


@pytest.mark.parametrize(("off", "against"), [(0.0, 0), (0.05, 0), (0.2, 1)])
def test_eyes_that_lie_beside_what_looks_turn_are_doubted(off, against):
    head = sample_rig()
    anchors = face_anchors(head)
    eyes = np.stack([anchors.eye_left, anchors.eye_right]) + np.array([0, off * anchors.pupils, 0])
    assert len(looks_elsewhere(head, eyes, anchors.midline)) == against
    blind = change(head, deltas=head.deltas * head.skin[:, None])
    assert looks_elsewhere(blind, eyes, anchors.midline) == ()
