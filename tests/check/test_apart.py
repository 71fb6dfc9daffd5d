"""What is planned apart reaches everybody: the plan, its summary, its page, the shot list, and `check`."""

from dataclasses import replace

import numpy as np
import pypdfium2
import pytest
from msgspec.structs import replace as changed

from capture_plan.anatomy.kinds import apart_lines
from capture_plan.check.apart_claims import apart_claims
from capture_plan.check.check import check_plan
from capture_plan.plan.files import plan_bytes
from capture_plan.plan.make import make_plan
from capture_plan.plan.summary import summary
from capture_plan.report.contents import contents
from capture_plan.sample import sample_rig
from capture_plan.sheets.page import Booklet, paper
from capture_plan.sheets.shot_list import draw_shot_list, paged

NAMES = ("browInnerUp", "eyeBlinkLeft", "eyeBlinkRight", "jawOpen", "mouthSmileLeft", "mouthSmileRight")


@pytest.fixture(scope="module")
def rig():
    """Six expressions, a head that moves forward as one, a mix and a shape that moves nothing."""
    whole = sample_rig()
    deltas = whole.deltas[[whole.names.index(name) for name in NAMES]]
    forward = np.zeros_like(deltas[0]) + np.array([0, 0, 12], dtype=np.float32)
    more = np.stack([forward, deltas[0] + deltas[3], 0 * forward])
    return replace(
        whole,
        names=(*NAMES, "headForward", "Fcl_ALL_Surprise", "Fcl_ALL_Neutral"),
        deltas=np.concatenate([deltas, more]),
    )


@pytest.fixture(scope="module")
def plan(rig):
    return make_plan(rig)


def test_only_expressions_of_the_face_take_markers_importance_and_minutes(rig, plan):
    six = replace(rig, names=NAMES, deltas=rig.deltas[:6])
    alone = make_plan(six)
    assert plan.audit.used == NAMES
    assert plan.layout == alone.layout
    assert plan.packing == alone.packing
    assert plan.session.minutes == alone.session.minutes


def test_the_plan_lists_what_is_apart_with_kind_and_reason(plan):
    message = {one.name: one.kind for one in plan.audit.apart}
    assert message == {
        "headForward": "head movement",
        "Fcl_ALL_Surprise": "calls others",
        "Fcl_ALL_Neutral": "moves nothing",
    }
    assert b'"why": "moves the whole head as one, by up to 12 mm"' in plan_bytes(plan)


def test_summary_and_page_name_each(plan):
    lines = " ".join(summary(plan))
    assert "Head movements, planned apart: headForward." in lines
    said = contents(plan, plan.session)["apart"]
    assert [heading for heading, _, _ in said] == ["Head movements", "Mixes of others", "Move nothing"]


def test_the_last_page_of_the_shot_list_names_each(plan):
    book = Booklet(paper("a4"), "test")
    lists = paged(book, plan.session)
    book.add_page("shot-list")
    draw_shot_list(book, plan.session, lists[-1], apart_lines(plan.audit.apart))
    (page,) = pypdfium2.PdfDocument(book.bytes())
    text = " ".join(page.get_textpage().get_text_range().split())
    assert "Head movements (1): headForward. Mixes of others (1): Fcl_ALL_Surprise" in text


def test_check_agrees_and_catches_what_is_scanned_or_lost(rig, plan):
    assert all(claim.holds for claim in check_plan(plan, rig))
    silent = changed(plan.audit, findings=tuple(f for f in plan.audit.findings if "headForward" not in f.blendshapes))
    untold = changed(plan.audit, apart=plan.audit.apart[1:])
    for audit in (silent, untold):
        assert not all(claim.holds for claim in apart_claims(changed(plan, audit=audit), rig))
