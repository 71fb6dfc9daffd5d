"""The reading as an audit tells it: in both coordinates, in sentences, every doubt with what to give."""

import re
from dataclasses import replace as change

import msgspec
import numpy as np
import pytest
from msgspec.structs import replace

from capture_plan.audit.audit import Audit, audit_rig
from capture_plan.audit.mesh import sizes
from capture_plan.audit.report import audit_text, can_be_planned, verdict
from capture_plan.face.facts import SIGNS, PairFacts, ReadingFacts, SpotFacts, reading_facts
from capture_plan.face.words import answers, doubts, signs_words
from capture_plan.rig.understood import Sign


@pytest.fixture(scope="module")
def found(rig):
    return audit_rig(rig)


@pytest.fixture(scope="module")
def read(found):
    return found.reading


def without_face(read):
    nothing, nowhere = PairFacts(None, None, False), SpotFacts(None, None, False)
    return replace(read, eyes=nothing, mouth=nowhere, nose=nowhere, chin=nowhere, ears=nothing)


def test_points_of_the_file_are_those_of_the_rig_in_its_unit_and_axes(rig):
    """up +z, facing -y: the file's x is the subject's left, y is backwards, z is up."""
    turned = change(rig, unit_mm=10.0, turn=(1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, -1.0, 0.0))
    read = reading_facts(turned)
    x, y, z = read.mouth.mm
    np.testing.assert_allclose(read.mouth.file, (x / 10, -z / 10, y / 10), rtol=1e-5)
    assert read.eyes.left.mm[0] > read.eyes.right.mm[0]
    assert read.eyes.left.file[0] == pytest.approx(read.eyes.left.mm[0] / 10, rel=1e-5)


def test_json_has_every_answer_with_its_doubt(found):
    message = msgspec.json.decode(msgspec.json.encode(found))["reading"]
    assert set(message) == {
        *("axes", "unit", "eyes", "mouth", "nose", "chin", "ears", "sides"),
        *("left_out", "set_aside", "against", "turn"),
    }
    for name in ("axes", "unit", "eyes", "mouth", "nose", "chin", "ears", "sides"):
        assert {"sure", "signs"} <= set(message[name]), name
    assert (
        len(message["eyes"]["left"]["mm"]) == len(message["eyes"]["left"]["file"]) == len(message["mouth"]["mm"]) == 3
    )
    carried = message["unit"]["mm"] * np.array(message["turn"]) @ message["mouth"]["file"]
    assert carried == pytest.approx(message["mouth"]["mm"], abs=0.01)


def test_an_audit_without_a_reading_is_still_read(found):
    """Plans of older versions carry none."""
    old = msgspec.json.decode(msgspec.json.encode(found))
    del old["reading"]
    audit_of_old = msgspec.convert(old, Audit)
    assert audit_of_old.reading is None
    assert "WHAT WAS UNDERSTOOD" not in audit_text(audit_of_old)


def test_a_plan_carries_the_strongest_signs_alone(rig, monkeypatch):
    signs = tuple(Sign(f"sign {i}", "", weight=(-1) ** i * i / 3) for i in range(20))

    def with_signs(rig):
        return msgspec.structs.replace(read, axes=replace(read.axes, signs=signs))

    from capture_plan.face.reading import face_reading

    read = face_reading(rig)
    monkeypatch.setattr("capture_plan.face.facts.face_reading", with_signs)
    retained = reading_facts(rig).axes.signs
    assert {sign.name for sign in retained} == {f"sign {i}" for i in range(20 - SIGNS, 20)}


def test_signs_are_told_for_and_against():
    message = signs_words(
        (Sign("weak", "", 1.0), Sign("the format", "+y", 5.0), Sign("the blink", "it goes down", -2.0))
    )
    assert message == "rests on: the format, weak; against it: the blink (it goes down)"


def test_a_unit_that_a_sign_would_fit_is_told_as_a_unit_and_not_as_a_distance(read):
    signs = (Sign("the format", "1000 mm", 4.5), Sign("the distance between the pupils", "304.8 mm", -2.0))
    message = next(
        one for one in answers(replace(read, unit=replace(read.unit, mm=304.8, signs=signs))) if one.label == "Unit"
    )
    assert signs_words(message.signs) == (
        "rests on: the format; against it: the distance between the pupils would fit 1 unit = 304.8 mm"
    )


@pytest.mark.parametrize("apart_mm", [90.5, 90.54, 45.45, 1205.6])
def test_one_distance_is_rounded_alike_wherever_it_is_said(rig, found, apart_mm):
    message = sizes(rig, apart_mm, found.used, 60.0)[0].message
    left, right = (
        replace(place, mm=(sign * apart_mm / 2, 700.0, 100.0))
        for place, sign in ((found.reading.eyes.left, 1), (found.reading.eyes.right, -1))
    )
    for sure in (True, False):
        eyes, unit = (replace(part, sure=sure) for part in (found.reading.eyes, found.reading.unit))
        read = replace(found.reading, unit=unit, eyes=replace(eyes, left=left, right=right))
        text = message + audit_text(replace(found, reading=read, interpupillary_mm=apart_mm))
        assert set(re.findall(r"([\d,.]+) mm\s+apart", text)) == {f"{apart_mm:,.1f}"}


def test_a_plan_can_be_made_where_a_face_was_found_whose_skin_moves(found, read):
    assert can_be_planned(found)
    assert can_be_planned(replace(found, reading=None))
    assert not can_be_planned(replace(found, used=()))
    assert not can_be_planned(replace(found, reading=without_face(read)))


def test_the_text_says_what_was_understood(found):
    text = audit_text(found)
    assert text.index("Shoot with it?") < text.index("WHAT WAS UNDERSTOOD") < text.index("LEFT OUT")
    assert "+y of the file is up, the face looks along +z" in text
    assert "In doubt" not in text
    assert max(map(len, text.splitlines())) <= 100


def test_a_thing_without_a_face_is_not_shot_with(found, read):
    nothing = without_face(read)
    assert verdict(replace(found, reading=nothing)).startswith("No: no face was found")
    (message,) = doubts(nothing)
    for option in ("--up", "--facing", "--unit-mm", "--skin"):
        assert option in message


def test_a_mouth_alone_is_a_face_in_doubt(found, read):
    mouth_alone = replace(without_face(read), mouth=read.mouth)
    assert verdict(replace(found, reading=mouth_alone)).startswith("Look at how it was understood first")


@pytest.mark.parametrize(
    ("doubt", "says"),
    [
        (lambda r: replace(r, axes=replace(r.axes, sure=False)), "--up and --facing"),
        (lambda r: replace(r, unit=replace(r.unit, sure=False)), "--unit-mm"),
        (lambda r: replace(r, eyes=replace(r.eyes, sure=False)), "--skin"),
        (lambda r: replace(r, mouth=SpotFacts(None, None, False)), "--skin"),
        (lambda r: replace(r, sides=replace(r.sides, disagree=("jawLeft",))), "jawLeft"),
        (lambda r: replace(r, sides=replace(r.sides, sure=False)), "--facing"),
        (lambda r: replace(r, eyes=replace(r.eyes, left=replace(r.eyes.left, mm=(300.0, 0, 0)))), "--unit-mm"),
    ],
)
def test_every_doubt_is_a_sentence_with_what_to_give(found, read, doubt, says):
    assert doubts(read) == []
    message = doubts(doubt(read))
    assert any(says in sentence for sentence in message)
    assert all(sentence[0].isupper() and sentence.endswith(".") for sentence in message)
    assert says in " ".join(audit_text(replace(found, reading=doubt(read))).split())


def test_a_doubt_is_marked_beside_its_answer(read):
    unsure = replace(read, mouth=SpotFacts(None, None, False))
    (doubted,) = [one for one in answers(unsure) if not one.sure]
    assert (doubted.label, doubted.text) == ("Mouth", "not found")
    against = replace(read, against=("the eyes lie 60 mm below the mouth",))
    assert [one.label for one in answers(against) if not one.sure] == ["Axes"]


def test_region_names_need_eyes_and_mouth(read):
    assert read.regions_known
    assert not replace(read, eyes=replace(read.eyes, sure=False)).regions_known
    assert not replace(read, mouth=replace(read.mouth, sure=False)).regions_known


def test_readings_survive_json(read):
    assert msgspec.json.decode(msgspec.json.encode(read), type=ReadingFacts) == read
