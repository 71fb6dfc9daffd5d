"""The page's section on cameras says what the pages and the plan say."""

import re

import pytest
from msgspec.structs import replace

from capture_plan.plan.settings import Settings
from capture_plan.report.cameras import camera_cards
from capture_plan.report.page import cameras_html, embedded_pixels, page_html
from capture_plan.sample import sample_rig
from tests.once import QUICK, plan_of, shortened


@pytest.fixture(scope="module")
def plan():
    return plan_of(Settings(cameras="head-mounted-pair", expressions=QUICK.expressions))


@pytest.fixture(scope="module")
def cards(plan):
    return camera_cards(plan, sample_rig(), embedded_pixels)


def test_a_card_for_each_camera_with_what_the_plan_says_is_unread(plan, cards):
    assert [card["name"] for card in cards] == [camera.name for camera in plan.cameras]
    for card in cards:
        lost = {
            ("neutral" if pose == "rest" else pose, card["name"], row["name"], word)
            for row in card["rows"]
            for pose, (letter, word) in zip(card["expressions"], row["cells"], strict=True)
            if letter != "●"
        }
        assert lost == {(u.pose, u.camera, u.dot, u.why) for u in plan.unread if u.camera == card["name"]}


def test_dots_are_drawn_where_the_picture_is_and_named_once(cards):
    for card in cards:
        for picture in card["pictures"]:
            names = [name for name, _, _ in picture["numbers"]]
            assert len(names) == len(set(names))
            for dot in picture["dots"]:
                points = [tuple(map(float, pair.split(","))) for pair in dot["points"].split()]
                assert all(-20 < x < picture["width"] + 20 and -20 < y < picture["height"] + 20 for x, y in points)


def test_page_and_frame_hold_the_section_only_where_cameras_are_known(plan, cards):
    plan, rig = shortened(plan), sample_rig()
    page = page_html(plan, rig)
    assert page.count('<article class="camera">') == len(cards)
    frame = cameras_html(rig, plan)
    assert frame.count('<article class="camera">') == len(cards)
    assert not re.search(r"(src|href)=\"(?!data:|#)", frame)
    bare = replace(plan, cameras=(), unread=())
    assert 'id="cameras"' not in page_html(bare, rig)
