"""Laws of what cameras make of a dot: views, pixels, the worst over expressions."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from capture_plan.camera import Camera, Optics, look_at
from capture_plan.visibility import FEWEST_PIXELS, MOST_DEGREES, Sight, camera_views, camera_visibility
from capture_plan.visibility.seen import SEEN, smaller_diameter
from tests.solids import patch, sphere, square, together


@pytest.fixture(autouse=True)
def own_cache(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))


def camera(position, target=(0.0, 0.0, 0.0), lens=(0.0, 0, 0, 0, 0), name="test"):
    position = np.array(position, dtype=float)
    intrinsics = np.array([[1000.0, 0, 319.5], [0, 1000, 239.5], [0, 0, 1]])
    return Camera(name, position, look_at(position, np.array(target)), intrinsics, (640, 480), np.array(lens))


def look(mesh, deltas, cameras, at=(0,), dot_mm=2.0):
    return camera_views(mesh[0], np.array(deltas, dtype=float), mesh[1], np.array(at), cameras, dot_mm=dot_mm)


def turned(degrees):
    """The patch, its normal turned from +z towards +x."""
    vertices, triangles = patch()
    return vertices @ Rotation.from_euler("xy", [90, degrees], degrees=True).as_matrix().T, triangles


def still(mesh):
    return np.zeros((1, *mesh[0].shape))


def test_pixels_before_the_camera_are_diameter_times_focal_length_over_distance():
    for distance in (100.0, 200.0, 400.0):
        mesh = turned(0)
        assert look(mesh, still(mesh), [camera((0, 0, distance))]).pixels[0, 0] == pytest.approx(2000 / distance)


@pytest.mark.parametrize("degrees", [0, 30, 60, 80])
def test_a_turned_dot_shrinks_by_the_cosine(degrees):
    mesh = turned(degrees)
    pixels = look(mesh, still(mesh), [camera((0, 0, 250.0))]).pixels[0, 0]
    assert pixels == pytest.approx(8 * np.cos(np.radians(degrees)), rel=1e-3)


def least_width(outline):
    """The least distance between two parallel lines that hold all points between them."""
    angle = np.radians(np.arange(0, 180, 0.25))
    along = outline @ np.stack([np.cos(angle), np.sin(angle)])
    return np.ptp(along, axis=0).min()


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_the_smaller_diameter_is_the_least_width_of_the_projected_circle(seed):
    rng = np.random.default_rng(seed)
    one = camera((20.0, 30, 250), lens=(rng.uniform(-0.3, 0.3), rng.uniform(-0.1, 0.1), 0.01, -0.01, 0.0))
    point = rng.uniform(-50, 50, size=3)
    way = one.position - point
    normal = rng.normal(size=3)
    normal *= np.sign(normal @ way)
    normal = normal / np.linalg.norm(normal)
    if normal @ way < 0.2 * np.linalg.norm(way):
        normal = way / np.linalg.norm(way)
    t = np.cross(normal, rng.normal(size=3))
    t /= np.linalg.norm(t)
    turn = np.linspace(0, 2 * np.pi, 721)[:, None]
    circle = point + 1.5 * (np.cos(turn) * t + np.sin(turn) * np.cross(normal, t))
    expected = least_width(one.project(circle))
    assert smaller_diameter(one, point[None], normal[None], 3.0)[0] == pytest.approx(expected, rel=2e-3)


def test_in_one_pose_views_are_the_cameras_that_see():
    mesh = sphere()
    cameras = [camera(np.array(p, dtype=float), name=str(i)) for i, p in enumerate([(0, 0, 300), (200, 0, 250)])]
    at = np.arange(len(mesh[0]))
    found = look(mesh, still(mesh), cameras, at)
    assert found.cameras == ("0", "1")
    assert np.array_equal(found.views, found.readable.sum(axis=0))
    seen = np.isin(found.how, SEEN).all(axis=0)
    assert np.array_equal(seen.mean(axis=0), camera_visibility(mesh[0], still(mesh), mesh[1], at, cameras))
    assert ((found.pixels > 0) == seen).all()
    assert (found.readable <= seen).all()


def test_views_are_the_fewest_at_once_and_not_the_cameras_that_always_see():
    """One expression hides the dot from the left camera, another from the right: one sees it at a time, none always."""
    mesh = together(turned(0), square((-500, 0, 20), (0, 9, 0), (0, 0, 9)), square((500, 0, 20), (0, 9, 0), (0, 0, 9)))
    cameras = [camera((-200.0, 0, 200)), camera((200.0, 0, 200))]
    move = np.zeros((2, len(mesh[0]), 3))
    move[0, 5:9, 0], move[1, 9:13, 0] = 480, -480
    found = look(mesh, move, cameras)
    assert found.at_once.tolist() == [[2], [1], [1]]
    assert found.views.tolist() == [1]
    assert found.readable.tolist() == [[False], [False]]
    assert found.share.tolist() == [[2 / 3], [2 / 3]]
    assert [found.first_unread(c, 0) for c in range(2)] == [(Sight.HIDDEN, 1), (Sight.HIDDEN, 2)]
    assert (found.pixels > 0).all()


def test_one_more_expression_never_gives_more():
    mesh = sphere(10, 16)
    at = np.arange(len(mesh[0]))
    deltas = 10 * np.random.default_rng(1).normal(size=(3, len(at), 3))
    cameras = [camera((0.0, 0, 300)), camera((100.0, 0, 300))]
    two, three = look(mesh, deltas[:2], cameras, at), look(mesh, deltas, cameras, at)
    assert (three.views <= two.views).all()
    assert (three.readable <= two.readable).all()
    assert (three.pixels <= two.pixels)[two.pixels > 0].all()


def test_a_dot_is_readable_where_it_is_always_seen_and_never_too_small():
    mesh = turned(0)
    forth = np.zeros((1, *mesh[0].shape))
    forth[0, :, 2] = -300
    limit = 1000 * 2.0 / FEWEST_PIXELS
    near, far = camera((0, 0, limit - 310)), camera((0, 0, limit - 290))
    assert look(mesh, forth, [near, far]).readable[:, 0].tolist() == [True, False]
    assert look(mesh, still(mesh), [near, far]).readable.all()


def test_the_answer_kept_on_disk_is_that_of_these_cameras_and_this_dot():
    mesh = turned(0)
    first = look(mesh, still(mesh), [camera((0, 0, 200.0))])
    assert np.array_equal(look(mesh, still(mesh), [camera((0, 0, 200.0))]).pixels, first.pixels)
    assert look(mesh, still(mesh), [camera((0, 0, 400.0))]).pixels[0, 0] == pytest.approx(first.pixels[0, 0] / 2)
    assert look(mesh, still(mesh), [camera((0, 0, 200.0))], dot_mm=4.0).pixels[0, 0] == pytest.approx(20)


@pytest.mark.parametrize(("degrees", "why"), [(74, Sight.READ), (76, Sight.EDGE_ON), (91, Sight.TURNED)])
def test_a_dot_that_is_turned_too_far_is_edge_on_and_then_turned_away(degrees, why):
    mesh = turned(degrees)
    found = look(mesh, still(mesh), [camera((0, 0, 250.0))], dot_mm=8.0)
    assert found.how[0, 0, 0] == why
    assert MOST_DEGREES == 75


def test_each_reason_is_told_by_its_name():
    mesh = turned(0)
    near = camera((0, 0, 250.0))
    hidden = together(mesh, square((0, 0, 20), (9, 0, 0), (0, 9, 0)))
    assert look(mesh, still(mesh), [near]).how[0, 0, 0] == Sight.READ
    assert look(hidden, still(hidden), [near]).how[0, 0, 0] == Sight.HIDDEN
    assert look(mesh, still(mesh), [near], dot_mm=0.5).how[0, 0, 0] == Sight.SMALL
    assert look(mesh, still(mesh), [camera((0, 0, 250.0), (400.0, 0, 0))]).how[0, 0, 0] == Sight.OUTSIDE
    assert look(mesh, still(mesh), [camera((0, 0, -250.0))]).how[0, 0, 0] == Sight.TURNED
    far = replace(near, optics=Optics(focus_mm=900.0, f_number=1.4, pixel_um=5.0))
    assert look(mesh, still(mesh), [far]).how[0, 0, 0] == Sight.BLURRED


@pytest.mark.parametrize("depth", [150.0, 250.0, 600.0])
def test_blur_is_where_the_cone_behind_the_lens_cuts_the_sensor(depth):
    """Similar triangles, with the distances of both images from Newton's lens formula x x' = f²."""
    optics = Optics(focus_mm=250.0, f_number=2.8, pixel_um=4.0)
    one = replace(camera((0, 0, 0.0), (0, 0, 1.0)), optics=optics)
    f = 1000 * 4e-3
    sensor, image = f + f**2 / (250 - f), f + f**2 / (depth - f)
    cone = f / 2.8 * abs(sensor - image) / image
    # the focal length in pixels is that of calibration, where the sensor stands: f in place of sensor, 2 % here
    assert one.blur_px(np.array([[0, 0, depth]]))[0] == pytest.approx(cone / 4e-3 * f / sensor, rel=0.02)
