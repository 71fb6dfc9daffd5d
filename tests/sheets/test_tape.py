"""Where a marker is measured from: points that are there, on its own side, and the error that a tape makes."""

import numpy as np
import pytest
from msgspec import structs

from capture_plan.anatomy.regions import face_regions, mirrored_label
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


def test_a_marker_and_its_mirror_image_are_measured_from_the_same_points_on_a_lopsided_face(points, normals):
    """A head that is wider on its left, as scans are: each by itself, some would be measured from other points."""
    marks = {m.label: m for m in plan_of().layout.landmarks}
    lopsided = np.random.default_rng(3)

    def moved(xyz, by):
        return tuple(np.add(xyz, by).tolist())

    points = tuple(p._replace(position=moved(p.position, lopsided.normal(0, 4, 3))) for p in points)
    marks = {k: structs.replace(m, position=moved(m.position, lopsided.normal(0, 4, 3))) for k, m in marks.items()}
    alone, together = [], []
    for label, left in marks.items():
        if label.startswith("left"):
            right = marks[mirrored_label(label)]
            each = [(m, normals[m.vertex]) for m in (left, right)]
            alone.append([letters(measured_from(*one, points)) for one in each])
            together.append([letters(measured_from(*each[i], points, each[1 - i])) for i in (0, 1)])
    assert any(left != right for left, right in alone)
    assert all(left == right for left, right in together)


def letters(measure):
    return [point.letter for point in measure.points]


def test_without_eyes_and_mouth_nothing_is_measured(normals):
    landmark = plan_of().layout.landmarks[0]
    assert measured_from(landmark, normals[landmark.vertex], ()) is None
