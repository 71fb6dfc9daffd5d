"""Which page shows which marker: each once, where it is seen best, and no page that nothing needs."""

import numpy as np
import pytest

from capture_plan.sheets.view import CHIN_UP, FRONT, LEFT
from capture_plan.sheets.which_page import NOWHERE, VIEWS, page_of_each


def facing(*degrees):
    """Normals that look so far aside (azimuth) and up (elevation)."""
    a, e = np.radians(np.array(degrees, dtype=float)).T
    return np.stack([np.sin(a) * np.cos(e), np.sin(e), np.cos(a) * np.cos(e)], axis=1)


AHEAD = [(0, 0), (5, 5), (-5, 5), (0, 10), (10, 0), (-10, 0)]


def page(normals, seen=None):
    there = np.stack([view.project(normals)[:, 2] > 0.12 for view in VIEWS]) if seen is None else seen
    return [VIEWS[w].name if w != NOWHERE else None for w in page_of_each(normals, there)]


def test_what_faces_forward_is_on_the_front_page_alone():
    assert page(facing((0, 0), (20, 5), (-20, 5), (35, 0), (-35, 0))) == [FRONT.name] * 5


def test_what_faces_aside_is_on_its_own_sides_page():
    found = page(facing(*AHEAD, (60, 0), (-60, 0)))
    assert found == [FRONT.name] * len(AHEAD) + ["Left three-quarter", "Right three-quarter"]


def test_one_marker_that_the_front_shows_well_enough_opens_no_page():
    assert page(facing(*AHEAD, (47, 0), (-30, 0))) == [FRONT.name] * (len(AHEAD) + 2)


def test_only_what_is_seen_steeply_elsewhere_opens_the_profile_and_the_raised_chin():
    found = page(facing(*AHEAD, (100, 0), (-100, 0), (0, -75)))
    assert found[-4:] == [FRONT.name, "Left profile", "Right profile", CHIN_UP.name]
    assert page(facing(*AHEAD, (50, -10), (-50, -10)))[-2:] == ["Left three-quarter", "Right three-quarter"]


def test_what_no_view_shows_is_on_no_page():
    normals = facing((0, 0), (180, 0))
    assert page(normals) == [FRONT.name, None]


@pytest.mark.parametrize("view", VIEWS, ids=lambda view: view.name)
def test_every_view_is_a_rotation_that_looks_where_it_says(view):
    np.testing.assert_allclose(view.rotation @ view.rotation.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(view.rotation) == pytest.approx(1)
    towards = facing((view.azimuth, view.elevation))
    assert view.project(towards)[0] == pytest.approx([0, 0, 1], abs=1e-12)


def test_the_left_three_quarter_shows_the_subjects_left():
    assert LEFT.project(facing((60, 0)))[0, 2] > LEFT.project(facing((-60, 0)))[0, 2]
