"""Where a face was not understood beyond doubt, its places go without names rather than with wrong ones."""

from dataclasses import replace as change

import pytest
from msgspec.structs import replace

from capture_plan.anatomy.regions import REGIONS, UNNAMED, face_regions
from capture_plan.errors import InfeasibleError
from capture_plan.expressions.movement import movements
from capture_plan.expressions.sentences import sentence
from capture_plan.face.reading import face_reading
from capture_plan.layout.settings import LayoutSettings
from capture_plan.plan.make import make_plan
from capture_plan.plan.settings import Settings
from capture_plan.plan.summary import summary
from capture_plan.sample import sample_rig
from capture_plan.sheets.style import LOOKS, looks_of
from tests.once import QUICK

DOUBTED = ("eyes", "mouth", "axes")


@pytest.fixture
def unsure(monkeypatch):
    """Makes answers of every reading uncertain."""

    def make(*answers):
        def doubtful(rig):
            read = face_reading(rig)
            return replace(read, **{name: replace(getattr(read, name), sure=False) for name in answers})

        for module in ("capture_plan.anatomy.regions", "capture_plan.face.facts"):
            monkeypatch.setattr(f"{module}.face_reading", doubtful)

    return make


def rig():
    """The sample, and none that a test before has looked at."""
    return change(sample_rig(), name="sample")


@pytest.mark.parametrize("answer", DOUBTED)
def test_no_place_is_called_by_a_region_that_is_not_certain(unsure, answer):
    unsure(answer)
    regions = face_regions(rig())
    labels = {regions.label(vertex) for vertex in range(len(regions.of_vertex)) if regions.of_vertex[vertex] >= 0}
    assert labels == ({"marker"} if answer == "axes" else {"left side", "middle", "right side"})
    assert not any(region in label for label in labels for region in REGIONS)


def test_a_nose_or_ears_in_doubt_take_no_name_away(unsure):
    unsure("nose", "chin", "ears", "sides")
    assert face_regions(rig()).known


def test_a_plan_counts_its_markers_and_says_why(unsure):
    unsure("mouth")
    made = make_plan(rig(), QUICK)
    assert {m.region for m in made.layout.landmarks} == {UNNAMED}
    assert all(m.label.startswith(("left side", "right side", "middle")) for m in made.layout.landmarks)
    assert any("without the names of regions" in line for line in summary(made))


def test_a_movement_without_a_known_place_is_told_by_the_picture(unsure):
    """A name of no standard, so that only the region could tell."""
    unsure("eyes")
    nameless = change(rig(), names=tuple(f"shape{k}" for k in range(52)))
    assert movements(nameless, nameless.names) == ()
    assert sentence(nameless, ("shape0",)) == "Match the picture."


def test_a_cap_on_a_region_that_is_not_certain_is_refused(unsure):
    unsure("eyes")
    with pytest.raises(InfeasibleError, match="not certain"):
        make_plan(rig(), Settings(landmarks=LayoutSettings(method="cover", caps={"nose": 4})))


def test_what_has_no_region_has_a_look_of_its_own():
    assert looks_of(["nose", UNNAMED])[UNNAMED] not in [LOOKS["nose"]]
