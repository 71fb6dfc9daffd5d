"""Where a marker is measured from: points that are there, on its own side, and the error that a tape makes."""

import numpy as np
import pytest

from capture_plan.anatomy.regions import face_regions
from capture_plan.mesh import vertex_normals
from capture_plan.sample import sample_rig
from capture_plan.sheets.tape import measured_from, tape_points
from tests.once import plan_of


@pytest.fixture(scope="module")
def points():
    rig = sample_rig()
    return tape_points(rig, face_regions(rig))


@pytest.fixture(scope="module")
def normals():
    rig = sample_rig()
    return vertex_normals(rig.neutral, rig.triangles)


def test_the_sample_has_every_point_and_its_sides_mirror_each_other(points):
    assert sorted(p.letter + p.side[0] for p in points) == ["al", "ar", "bl", "br", "cl", "cr", "dl", "dr", "em", "fm"]
    at = {(p.letter, p.side): np.array(p.position) for p in points}
    for letter in "abcd":
        assert at[letter, "left"] * [-1, 1, 1] == pytest.approx(at[letter, "right"], abs=0.5)
        assert at[letter, "left"][0] > 0
    assert at["a", "left"][0] > at["b", "left"][0] + 15  # the outer corner lies further out
    assert at["c", "left"][1] < at["a", "left"][1]  # wings below eyes
    assert at["d", "left"][1] < at["c", "left"][1]  # the mouth below the wings


def test_a_marker_is_measured_from_its_own_side_with_the_distances_that_are_there(points, normals):
    for landmark in plan_of().layout.landmarks:
        measure = measured_from(landmark, normals[landmark.vertex], points)
        assert measure is not None
        if landmark.side != "middle":
            assert {p.side for p in measure.points} <= {landmark.side, "middle"}
        for point, mm in zip(measure.points, measure.mm, strict=True):
            assert mm == pytest.approx(np.linalg.norm(np.subtract(landmark.position, point.position)))
        assert measure.error_mm >= np.sqrt(2) - 1e-9


def test_the_error_is_that_of_the_place_where_both_distances_are_off_by_a_millimetre(points, normals):
    """Move the marker over the skin's plane until both distances have changed by a random millimetre."""
    landmark = next(m for m in plan_of().layout.landmarks if m.region == "cheek")
    n = normals[landmark.vertex]
    measure = measured_from(landmark, n, points)
    assert measure is not None
    x, q = np.array(landmark.position), np.array([p.position for p in measure.points])
    e1 = np.cross(n, [0, 1, 0])
    e1 /= np.linalg.norm(e1)
    axes, step = np.stack([e1, np.cross(n, e1)]), 1e-4
    change = [(np.linalg.norm(x + step * axis - q, axis=1) - np.linalg.norm(x - q, axis=1)) / step for axis in axes]
    moves = np.linalg.solve(np.array(change).T, np.random.default_rng(0).normal(size=(2, 20_000)))
    assert np.sqrt((moves**2).sum(axis=0).mean()) == pytest.approx(measure.error_mm, rel=0.02)


def test_without_eyes_and_mouth_nothing_is_measured(normals):
    landmark = plan_of().layout.landmarks[0]
    assert measured_from(landmark, normals[landmark.vertex], ()) is None
