"""Figures that a technician measures with a tape."""

from dataclasses import replace

import numpy as np
import pytest

from capture_plan.camera import Camera, Optics, between, look_at, mounting

PHILTRUM = np.array([0.0, 700, 140])


def camera(position, target=PHILTRUM, optics=None):
    position = np.array(position, dtype=float)
    K = np.array([[2000.0, 0, 767.5], [0, 2000, 1023.5], [0, 0, 1]])
    return Camera("a", position, look_at(position, target), K, (1536, 2048), np.zeros(5), optics=optics)


def test_a_camera_straight_ahead():
    m = mounting(camera((0, 700, 390)), PHILTRUM)
    assert (m.away_mm, m.ahead_mm) == pytest.approx((250, 250))
    assert (m.left_mm, m.above_mm, m.down_degrees, m.leftward_degrees, m.roll_degrees) == pytest.approx(
        (0,) * 5, abs=1e-6
    )
    assert m.field_degrees == pytest.approx(
        (2 * np.degrees(np.arctan(768 / 2000)), 2 * np.degrees(np.arctan(1024 / 2000)))
    )
    assert m.covers_mm == pytest.approx((250 * 1536 / 2000, 250 * 2048 / 2000))
    assert m.pixel_mm == pytest.approx(0.125)
    assert m.sharp_mm is None


def test_signs_are_the_actors_own():
    m = mounting(camera((100, 800, 390)), PHILTRUM)
    assert (m.left_mm, m.above_mm, m.ahead_mm) == pytest.approx((100, 100, 250))
    assert m.down_degrees == pytest.approx(np.degrees(np.arctan2(100, np.hypot(100, 250))))
    assert m.leftward_degrees == pytest.approx(-np.degrees(np.arctan2(100, 250)))  # from the left it looks to the right


def test_what_is_called_sharp_is_sharp_and_nothing_beyond():
    optics = Optics(focus_mm=250.0, f_number=5.6, pixel_um=3.45)
    one = camera((0, 700, 390), optics=optics)
    near, far = mounting(one, PHILTRUM).sharp_mm
    ends = one.position + np.outer([near, far], one.rotation[2])
    np.testing.assert_allclose(one.blur_px(ends), 2.0)
    assert near < 250 < far
    assert mounting(replace(one, optics=replace(optics, f_number=500.0)), PHILTRUM).sharp_mm[1] == np.inf


def test_two_cameras_as_the_face_sees_them():
    assert between(camera((0, 700, 390)), camera((250, 700, 140)), PHILTRUM) == pytest.approx((250 * np.sqrt(2), 90))
