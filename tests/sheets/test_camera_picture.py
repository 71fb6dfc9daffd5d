"""What a camera's picture shows agrees with what rays say that it sees."""

import numpy as np
import pytest
from scipy.ndimage import maximum_filter, minimum_filter

from capture_plan.camera import Camera, cameras_for, look_at
from capture_plan.mesh import vertex_normals
from capture_plan.sample import sample_rig
from capture_plan.sheets.camera_picture import Crop, dot_outlines, through_lens
from capture_plan.sheets.head import SKIN, Posed, Shown, make_head, pose
from capture_plan.visibility.occluder import Occluder
from capture_plan.visibility.seen import FEWEST_PIXELS, Sight, sights, smaller_diameter
from tests.solids import BOX, BOX_SIDES, sphere, square, together

POINTS, SURE_MM = 1000, 0.3


@pytest.fixture(scope="module")
def head():
    return pose(make_head(sample_rig()), sample_rig().neutral)


def bent(camera):
    """The camera with a lens that bends, and one aside."""
    return Camera(
        "bent", camera.position, camera.rotation, camera.intrinsics, camera.size_px, np.array([-0.2, 0.05, 1e-3, 0, 0])
    )


def cameras():
    rig = sample_rig()
    pair = cameras_for("head-mounted-pair", rig.neutral, rig.skin)
    aside = np.array([350.0, 760.0, 500.0])
    turned = look_at(aside, np.array([0.0, 690, 100]))
    return [*pair, bent(pair[0]), Camera("aside", aside, turned, pair[0].intrinsics, pair[0].size_px, np.zeros(5))]


def bare(vertices, triangles):
    """A head of these triangles and no others, as they are."""
    n, ones = len(vertices), np.ones(len(vertices))
    normals = vertex_normals(vertices, triangles)
    piece = Shown(SKIN, vertices, normals, triangles, np.tile(SKIN.colour, (n, 1)), ones, ones)
    return Posed(vertices, normals, (piece,))


def told_apart(vertices, triangles, camera, at):
    """Which of these vertices rays hide, and which the picture's depth surely hides and surely shows."""
    how, _ = sights(camera, Occluder(vertices, triangles), vertices, at, dot_mm=30.0)
    shown = through_lens(bare(vertices, triangles), camera, Crop.whole(camera), camera.size_px[0])
    column, row = np.clip(
        np.nan_to_num(camera.project(vertices[at])).round().astype(int), 0, np.array(camera.size_px) - 1
    ).T
    depth = (vertices[at] - camera.position) @ camera.rotation[2]
    near, far = minimum_filter(shown.depth, 3)[row, column], maximum_filter(shown.depth, 3)[row, column]
    asked = np.isin(how, [Sight.READ, Sight.EDGE_ON, Sight.HIDDEN])
    return how == Sight.HIDDEN, asked & (far < depth - SURE_MM), asked & (near > depth - SURE_MM)


@pytest.mark.parametrize("number", range(4))
def test_rays_hide_what_the_picture_hides(number):
    """1,000 places of the skin, also behind the nose of a pair that looks past it: what lies behind all around its
    pixel is hidden, what lies before is not; at outlines a pixel holds both and says nothing."""
    rig, camera = sample_rig(), cameras()[number]
    at = np.random.default_rng(number).choice(np.flatnonzero(rig.skin), POINTS, replace=False)
    hidden, behind, before = told_apart(rig.neutral, rig.triangles, camera, at)
    assert behind.sum() > 20
    assert before.sum() > 200
    assert (behind & ~hidden).sum() <= 1
    assert (before & hidden).sum() <= 0.01 * before.sum()


@pytest.mark.parametrize("scene", ["sphere", "cube", "two sheets"])
def test_simple_bodies_hide_exactly_what_they_hide(scene):
    meshes = {
        "sphere": together(sphere(radius=60.0), square((0, 0, 120), (30, 0, 0), (0, 30, 0))),
        "cube": together(
            (40 * BOX, BOX_SIDES),
            square((0, 0, -120), (90, 0, 0), (0, 90, 0)),
            square((0, 0, -99), (9, 0, 0), (0, 9, 0)),
        ),
        "two sheets": together(
            *(square((x, y, 0), (9, 0, 0), (0, 9, 0)) for x in range(-90, 91, 20) for y in range(-90, 91, 20)),
            square((0, 0, 40), (45, 0, 0), (0, 45, 0)),
        ),
    }
    vertices, triangles = meshes[scene]
    K = np.array([[1500.0, 0, 511.5], [0, 1500, 511.5], [0, 0, 1]])
    place = np.array([60.0, 40, 500])
    camera = Camera("a", place, look_at(place, np.zeros(3)), K, (1024, 1024), np.zeros(5))
    hidden, behind, before = told_apart(vertices, triangles, camera, np.arange(len(vertices)))
    assert behind.any() or scene == "sphere"
    assert before.any()
    assert not (behind & ~hidden).any()
    assert not (before & hidden).any()


def test_every_seen_vertex_lies_on_the_head_in_the_picture(head):
    rig, camera = sample_rig(), cameras()[2]
    shown = through_lens(head, camera, Crop.whole(camera), camera.size_px[0] // 2)
    at = np.flatnonzero(rig.skin)
    how, _ = sights(camera, Occluder(rig.neutral, rig.triangles), rig.neutral, at, dot_mm=30.0)
    column, row = ((camera.project(rig.neutral[at[how == Sight.READ]]) + 0.5) / 2).astype(int).T
    depth = (rig.neutral[at[how == Sight.READ]] - camera.position) @ camera.rotation[2]
    off = np.abs(shown.depth[row, column] - depth)
    assert np.quantile(off, 0.95) < 1.5


def test_a_crop_is_a_part_of_the_whole(head):
    camera = cameras()[0]
    whole = through_lens(head, camera, Crop.whole(camera), camera.size_px[0]).depth
    part = through_lens(head, camera, Crop(399.5, 499.5, 600, 800), 600).depth
    both = np.isfinite(part) & np.isfinite(whole[500:1300, 400:1000])
    assert both.mean() > 0.5
    np.testing.assert_allclose(part[both], whole[500:1300, 400:1000][both], atol=0.2)


def test_the_rim_of_a_dot_is_as_narrow_as_it_is_said_to_be(head):
    camera, at = cameras()[2], np.arange(0, 3000, 50)
    points, normals = head.vertices[at], head.normals[at]
    facing = np.einsum("ni,ni->n", camera.position - points, normals) > 100
    rims = dot_outlines(camera, points, normals, 3.0)[facing]
    widths = smaller_diameter(camera, points, normals, 3.0)[facing]
    angle = np.radians(np.arange(0, 180, 2))
    along = rims @ np.stack([np.cos(angle), np.sin(angle)])
    narrow = np.ptp(along, axis=1).min(axis=1)
    big = np.isfinite(narrow) & (widths > FEWEST_PIXELS)
    np.testing.assert_allclose(narrow[big], widths[big], rtol=0.02)
