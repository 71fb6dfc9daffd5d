"""The picture of a placement: as large as its page, each seen dot in its region's colour, nothing lost in silence."""

import numpy as np
import pytest

from capture_plan.anatomy.regions import face_regions
from capture_plan.errors import PlanError
from capture_plan.registration.empirical_layouts import empirical_layout
from capture_plan.sample import sample_rig
from capture_plan.sheets import placement_picture
from capture_plan.sheets.placement import FOOTER_MM, HEAD_MM, HEADER_MM, VIEWS, named_in
from capture_plan.sheets.style import LOOKS, rgb
from capture_plan.sheets.view import pixels

DPI = 60


def draw(names, vertices):
    return placement_picture(sample_rig(), "Some points", names, vertices, subtitle="residual 0.1 mm", dpi=DPI)


@pytest.fixture(scope="module")
def drawn():
    layout = empirical_layout("motionbuilder17")
    return layout, draw(tuple(point.name for point in layout.points), layout.vertices)


def test_the_picture_is_as_large_as_three_heads_with_their_names(drawn):
    _, image = drawn
    assert image.height == pytest.approx(pixels(1, HEADER_MM + HEAD_MM[1] + FOOTER_MM, DPI)[1], abs=1)
    assert image.width > pixels(len(VIEWS) * HEAD_MM[0], 1, DPI)[0]


def test_dots_have_the_colours_of_their_regions(drawn):
    layout, image = drawn
    regions = face_regions(sample_rig())
    seen = np.asarray(image.convert("RGB")).reshape(-1, 3).astype(int)
    for region in {regions.names[regions.of_vertex[vertex]] for vertex in layout.vertices}:
        assert (np.abs(seen - np.array(rgb(LOOKS[region].colour))).max(axis=1) < 12).any(), region


def test_a_dot_more_changes_the_picture_on_its_own_side_only():
    """The left cheek is seen from the front and from the left; the view from the right stays as it was."""
    cheek = {point.name: point.vertex for point in empirical_layout("mpeg4").points}
    without, with_it = (
        np.asarray(draw(names, np.array([cheek[n] for n in names]))) for names in (("5.4",), ("5.4", "5.3"))
    )
    above_the_legend = slice(0, pixels(1, HEADER_MM + HEAD_MM[1], DPI)[1])
    heads = (without != with_it)[above_the_legend].any(axis=(0, 2))
    third = len(heads) // 3
    assert not heads[: third - 10].any()
    assert heads[third:].any()
    assert heads[2 * third :].any()


def test_points_are_named_from_the_front_or_from_their_own_side():
    """A corner of the right eye that faces the nose is not named in the view from the left, where it is seen too."""
    x = np.array([-20.0, -20.0, 20.0, 0.0])
    normals = np.array([[0.6, 0, 0.8], [-0.8, 0, 0.6], [0.8, 0, 0.6], [0, 0, 1.0]])
    everywhere = np.ones((len(VIEWS), 4), dtype=bool)
    names = [VIEWS[i].name for i in named_in(everywhere, normals, x)]
    assert names == ["Front", "Right three-quarter", "Left three-quarter", "Front"]
    from_the_left_only = np.array([[view.azimuth > 0] * 4 for view in VIEWS])
    assert {VIEWS[i].name for i in named_in(from_the_left_only, normals, x)} == {"Left three-quarter"}


def test_names_must_match_points():
    with pytest.raises(PlanError, match="Some points: 1 names for 2 points"):
        draw(("one",), np.array([1400, 455]))
