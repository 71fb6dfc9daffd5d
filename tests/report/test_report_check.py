"""The page's own check of a plan: true ones pass, forged ones get a cross at the lie."""

import copy
import json

import pytest
from msgspec.structs import replace

from capture_plan.layout.settings import LayoutSettings
from capture_plan.plan.files import plan_bytes
from capture_plan.plan.settings import Settings
from capture_plan.report.evidence import evidence
from capture_plan.report.page import ASSETS
from capture_plan.sample import sample_rig
from tests.exports import test_verify_plan as forged
from tests.once import plan_of


@pytest.fixture(scope="module")
def plan():
    return plan_of(Settings(landmarks=LayoutSettings(method="adaptive", head_markers=3)))


@pytest.fixture(scope="module")
def rig_figures(plan, tmp_path_factory):
    return json.loads(json.dumps(evidence(plan, sample_rig())))


@pytest.fixture(scope="module")
def checked(browser, rig_figures):
    """What the script says of a plan."""
    page = browser.new_page()
    for name in ("head.js", "check.js"):
        page.add_script_tag(content=ASSETS.joinpath(name).read_text())
    yield lambda document: page.evaluate("([plan, rig]) => CapturePlan.check(plan, rig)", [document, rig_figures])
    page.close()


@pytest.fixture
def document(plan):
    return copy.deepcopy(json.loads(plan_bytes(plan)))


def crosses(lines):
    return [f"{line['what']}: {line['found']}" for line in lines if not line["holds"]]


def test_a_true_plan_has_no_cross(checked, document):
    lines = checked(document)
    assert crosses(lines) == []
    assert len(lines) >= 12


@pytest.mark.parametrize(
    ("forge", "named"),
    [
        (forged.one_more_expression, "No list has fewer than 19 expressions"),
        (forged.higher_minimum, "No fewer than 30 landmarks"),
        (forged.inflated_prices, "too high at"),
        (forged.other_side_in_labels, "Left markers"),
        (forged.other_sides, "Left markers"),
        (forged.moved_marker, "Markers lie where the rig has their vertex: M01"),
        (forged.empty_clique, "a clique of 0"),
        (forged.longer_clique, "fit together"),
        (forged.wider_spacing, "Markers stand 11 mm apart, straight and so along the skin: M"),
        (forged.two_exchanged, "share skin or exclude each other: E"),
        (forged.all_in_one, "share skin or exclude each other: E1"),
        (forged.blendshape_on_no_landmark, "Each marker moves with what it stands for: M01"),
    ],
    ids=lambda value: value.__name__ if callable(value) else "",
)
def test_a_lie_gets_a_cross(checked, document, forge, named):
    forge(document)
    message = crosses(checked(document))
    assert any(named in line for line in message), message


def test_what_cannot_be_computed_is_said(plan):
    lost = replace(plan, settings=replace(plan.settings, cameras="gone.toml"))
    assert "gone.toml" in evidence(lost, sample_rig())["missing"]
