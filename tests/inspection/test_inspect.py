"""The inspection of a plan: the whole page of the sample, and what it must agree with."""

import msgspec
import numpy as np
import pytest

from capture_plan.cli import inspect
from capture_plan.evaluation.identifiability import Separator
from capture_plan.inspection.inspect import Inspection, inspect_plan
from capture_plan.inspection.inspect_report import inspection_text, separator_words, short_text
from capture_plan.layout.face import see_face
from capture_plan.layout.settings import LayoutSettings
from capture_plan.plan.files import write_plan
from capture_plan.plan.settings import Settings
from capture_plan.sample import sample_rig
from tests.once import once, plan_of

FEW = Settings(landmarks=LayoutSettings(method="cover"))  # markers: what is said of each is found for each


@pytest.fixture(scope="module")
def plan():
    return plan_of(FEW)


@pytest.fixture(scope="module")
def found(plan):
    return once(FEW, Inspection, lambda: inspect_plan(plan, sample_rig()))


def test_the_inspection_agrees_with_the_plan(plan, found):
    assert found.information == plan.layout.information
    assert found.blind == plan.layout.uncovered
    assert [marker.name for marker in found.markers] == [landmark.name for landmark in plan.layout.landmarks]
    assert found.trials[0].error_mm == pytest.approx(plan.layout.predictions[0].error_mm, rel=0.1)


def test_what_only_one_landmark_sees_is_lost_with_it(found):
    for marker in found.markers:
        assert marker.reason.only_one == marker.lost.uncovered
        assert not (marker.lost.uncovered and marker.lost.carry_on)


def test_points_that_the_68_do_not_see_are_named(plan, found):
    assert found.blind_of_68 is not None
    assert {"cheekSquintLeft", "cheekSquintRight"} <= set(found.blind_of_68)


def test_a_substitute_keeps_the_spacing_to_all_others(plan, found):
    places = sample_rig().neutral[[landmark.vertex for landmark in plan.layout.landmarks]]
    for m, marker in enumerate(found.markers):
        if marker.substitute:
            here = sample_rig().neutral[marker.substitute.vertex]
            away = np.linalg.norm(np.delete(places, m, axis=0) - here, axis=1)
            assert away.min() > 0.6 * plan.settings.landmarks.spacing_mm  # straight, where the spacing is on the skin
    face = see_face(sample_rig(), plan.audit.used)
    assert all(face.allowed(plan.settings.landmarks)[m.substitute.vertex] for m in found.markers if m.substitute)


def test_the_page_names_every_marker_and_the_json_holds_the_same(plan, found):
    page = inspection_text(found)
    for landmark in plan.layout.landmarks:
        assert page.count(f"{landmark.name} {landmark.label}:") == 3
    assert f"rank {found.information.rank} of {found.information.full_rank}" in page
    assert "nan" not in page.replace("nanny", "")
    assert msgspec.json.decode(msgspec.json.encode(found), type=Inspection) == found


def test_the_command_prints_a_page_for_people_and_json_for_programs(plan, found, tmp_path, capsys, monkeypatch):
    path = write_plan(plan, tmp_path / "plan.json")
    inspect(path, json=True)
    assert msgspec.json.decode(capsys.readouterr().out, type=Inspection) == found
    monkeypatch.setattr("capture_plan.inspection.inspect.inspect_plan", lambda *_: found)  # as it was found just now
    inspect(path, output=tmp_path / "all.txt")
    said = capsys.readouterr()
    assert (tmp_path / "all.txt").read_text() == inspection_text(found) + "\n"
    assert said.out == short_text(found) + "\n"
    assert said.err.startswith("wrote ")
    assert len(said.out.splitlines()) + len(said.err.splitlines()) <= 15


def test_one_more_dot_is_said_with_its_region_and_from_where_its_place_is_measured(found):
    more = Separator(("a", "b"), 5.0, 0, (-45.0, 737.0, 126.0), 0, 9.0, 21.0)
    words = separator_words(more, "right cheek", found)
    assert f"on the right cheek, 9 mm from {found.markers[0].name}" in words
    assert "(-45, 737, 126) mm from the rig's origin, x to the subject's left, y up, z to the front" in words


def test_an_inspection_of_a_draft_begins_with_what_does_not_hold(found):
    assert "DRAFT" not in inspection_text(found)
    lines = inspection_text(msgspec.structs.replace(found, draft=("a label was wrong",))).splitlines()
    assert lines[:2] == ["DRAFT: this plan does not hold", "  a label was wrong"]
