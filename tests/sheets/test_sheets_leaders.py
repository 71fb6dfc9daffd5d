"""Leader lines: none crosses another, whatever the landmarks, and each label has its own place."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from capture_plan.errors import PlanError
from capture_plan.sheets.leaders import assign_anchors, crossings


def columns(rows: int) -> np.ndarray:
    y = np.linspace(0, 200, rows)
    return np.concatenate([np.stack([np.full(rows, x), y], axis=1) for x in (0.0, 190.0)])


def cross(a: np.ndarray, b: np.ndarray, c: np.ndarray, d: np.ndarray) -> bool:
    """Solve a + s (b - a) = c + t (d - c), a second way to ask."""
    matrix = np.stack([b - a, c - d], axis=1)
    if abs(np.linalg.det(matrix)) < 1e-9:
        return False
    s, t = np.linalg.solve(matrix, c - a)
    return bool(1e-9 < s < 1 - 1e-9 and 1e-9 < t < 1 - 1e-9)


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), n=st.integers(0, 45))
def test_no_two_leaders_cross(seed, n):
    rng = np.random.default_rng(seed)
    points, anchors = rng.uniform([30, 0], [160, 200], (n, 2)), columns(30)
    ends = anchors[assign_anchors(points, anchors)]
    assert not any(cross(points[i], ends[i], points[j], ends[j]) for i in range(n) for j in range(i))


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_every_label_has_a_place_of_its_own(seed):
    points = np.random.default_rng(seed).uniform([30, 0], [160, 200], (40, 2))
    assert len(set(assign_anchors(points, columns(25)).tolist())) == 40


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_crossings_are_found_as_by_solving_for_the_common_point(seed):
    a, b = np.random.default_rng(seed).uniform(0, 10, (2, 12, 2))
    found = {tuple(pair) for pair in crossings(a, b).tolist()}
    assert found == {(i, j) for j in range(12) for i in range(j) if cross(a[i], b[i], a[j], b[j])}


def test_a_lone_point_takes_the_nearest_anchor():
    assert columns(21)[assign_anchors(np.array([[40.0, 101.0]]), columns(21))[0]].tolist() == [0.0, 100.0]


def test_a_leader_does_not_run_over_another_marker():
    points = np.array([[90.0, 100.0], [40.0, 100.0]])
    ends = columns(21)[assign_anchors(points, columns(21))]
    assert ends[0].tolist() != [0.0, 100.0]


def test_more_labels_than_places_are_refused():
    with pytest.raises(PlanError, match="3 labels but room for 2"):
        assign_anchors(np.zeros((3, 2)), columns(1))
