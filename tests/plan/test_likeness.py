"""Pages without the actor's likeness: shapes are the bundled head's, places and movements the rig's."""

import json
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from msgspec import structs

from capture_plan.face.anchors import face_anchors
from capture_plan.mesh.nearest import nearest_on_surface
from capture_plan.plan.carry import as_worn, worn_words
from capture_plan.plan.inputs import PlanInputs
from capture_plan.plan.likeness import on_generic_head
from capture_plan.plan.record import ActorDot, ActorHead, head_words, number_of
from capture_plan.report.page import page_html
from capture_plan.rig import Rig
from capture_plan.sample import sample_rig
from tests.once import QUICK, plan_of, shortened


@cache
def stranger() -> Rig:
    """The sample with a long face, a broad nose and a heavy jaw, on the same mesh."""
    rig, anchors = sample_rig(), face_anchors(sample_rig())
    x = rig.neutral - anchors.nose_tip
    near = np.exp(-np.square(x / 18).sum(axis=1))
    low = 1 / (1 + np.exp((x[:, 1] + 35) / 8))
    moved = np.column_stack([x[:, 0] * (0.25 * near + 0.12 * low), 0.08 * x[:, 1], 6 * near + 3 * low])
    return replace(rig, name="stranger", neutral=(rig.neutral + moved).astype(rig.neutral.dtype), understood=None)


@pytest.fixture(scope="module")
def given():
    return on_generic_head(PlanInputs(stranger()))


@pytest.fixture(scope="module")
def own():
    return on_generic_head(PlanInputs(sample_rig()))


def test_the_shape_is_the_bundled_heads_and_not_the_rigs(given):
    sample, rig = sample_rig(), stranger()
    skin = np.flatnonzero(rig.skin & (np.linalg.norm(rig.neutral - face_anchors(rig).nose_tip, axis=1) < 60))

    def off(x):
        foot = nearest_on_surface(x[skin], sample.neutral, sample.triangles)
        return np.percentile(np.linalg.norm(x[skin] - foot, axis=1), 80)

    assert off(given.worn) < 0.5
    assert off(rig.neutral) > 2


def test_places_are_those_of_the_plan_and_pages_say_that_distances_are_nobodys(given, own):
    plan = plan_of(QUICK)
    shown, worn = as_worn(plan, own)
    assert [m.name for m in shown.layout.markers] == [m.name for m in plan.layout.markers]
    was, now = (np.array([m.position for m in one.layout.markers]) for one in (plan, shown))
    assert np.linalg.norm(was - now, axis=1).max() < 3
    assert worn.names == sample_rig().names
    assert "no distance on it is the actor's" in worn_words(plan, given)
    assert head_words(plan, generic=True) == "MakeHuman head on a generic head"
    assert worn_words(plan, PlanInputs(sample_rig())) == ""


def test_the_html_page_shows_the_generic_head_and_keeps_the_plans_number(own):
    plan = shortened(plan_of(QUICK))
    page = page_html(plan, own)
    assert "drawn on a generic head" in page
    assert number_of(plan) in page
    assert "drawn on a generic head" not in page_html(plan, sample_rig())


def test_no_place_on_the_rig_or_on_the_actor_stands_in_the_page():
    rig = stranger()
    made = plan_of(QUICK)
    plan = structs.replace(shortened(made), rig=structs.replace(made.rig, fingerprint=rig.fingerprint))
    at = {m.name: rig.neutral[m.vertex].astype(float).round(4).tolist() for m in plan.layout.landmarks}
    dots = tuple(ActorDot(name, (1.234567, *place[1:]), (7.654321, 0.0, 0.0), 0.1) for name, place in at.items())
    actor = ActorHead(
        "anna", "anna.ply", "f" * 16, 1.0, (), (0.0, 0.0, 0.0), "", "", 1.0, 2.0, "estimated", 0, 1.0, dots
    )
    page = page_html(structs.replace(plan, actor=actor), on_generic_head(PlanInputs(rig)))
    held = json.loads(page.split('id="plan-data"')[1].split(">", 1)[1].split("</script>")[0])
    assert "actor" not in held or held["actor"] is None
    assert "anna.ply" not in page
    assert "1.234567" not in page
    assert "7.654321" not in page
    for marker in held["layout"]["landmarks"]:
        assert np.abs(np.array(marker["position"]) - at[marker["name"]]).max() > 0.01
