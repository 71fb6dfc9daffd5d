"""The number beside each marker: nearest to its own, on no other, and left out rather than misread."""

import numpy as np
import pytest

from capture_plan.sheets.number_places import APART_MM, FREE_MM, OWN, TICK_MM, place_numbers

PAGE = (0.0, 0.0, 120.0, 160.0)
NOTHING = np.zeros((0, 4))
RADIUS = 1.5


def crowd(n, seed, least=7.0):
    """Places at least so far apart."""
    rng, points = np.random.default_rng(seed), []
    while len(points) < n:
        p = rng.uniform([12, 12], [108, 148])
        if all(np.linalg.norm(p - q) >= least for q in points):
            points.append(p)
    return np.array(points)


def to_box(point, middle, half):
    return float(np.linalg.norm(np.maximum(np.abs(point - middle) - half, 0)))


def to_segment(point, start, end):
    along = end - start
    t = np.clip((point - start) @ along / max(along @ along, 1e-12), 0, 1)
    return float(np.linalg.norm(point - start - t * along))


@pytest.mark.parametrize("n", [1, 10, 34, 60])
@pytest.mark.parametrize("seed", [0, 1])
def test_every_number_is_nearest_to_its_own_marker_and_lies_on_nothing(n, seed):
    points = crowd(n, seed)
    sizes, radii = np.tile([8.5, 3.5], (n, 1)), np.full(n, RADIUS)
    found = place_numbers(points, sizes, radii, NOTHING, PAGE)
    assert found is not None
    half = sizes[0] / 2
    for i in range(n):
        own = to_box(points[i], found.middle[i], half)
        start, end = found.ticks[i]
        for j in range(n):
            if i == j:
                continue
            assert to_box(points[j], found.middle[i], half) >= max(RADIUS + FREE_MM, OWN * own) - 1e-6
            assert (np.abs(found.middle[i] - found.middle[j]) >= sizes[0] + APART_MM - 1e-9).any()
            if (start != end).any():
                assert to_segment(points[j], start, end) >= TICK_MM - 1e-6


def test_a_lone_number_stands_at_its_side_without_a_tick():
    found = place_numbers(np.array([[60.0, 80.0]]), np.array([[8.0, 3.0]]), np.array([RADIUS]), NOTHING, PAGE)
    assert found is not None
    assert found.middle[0, 1] == pytest.approx(80)
    assert (found.ticks[0, 0] == found.ticks[0, 1]).all()


def test_numbers_keep_off_what_stays_free_and_inside_the_page():
    point, size = np.array([[4.0, 80.0]]), np.array([[8.0, 3.0]])
    wall = np.array([[12.0, 80.0, 5.0, 3.0]])
    found = place_numbers(point, size, np.array([RADIUS]), wall, PAGE)
    assert found is not None
    assert found.middle[0, 0] >= 4
    assert (np.abs(found.middle[0] - wall[0, :2]) >= size[0] / 2 + wall[0, 2:]).any()


def test_where_there_is_no_room_nothing_is_placed_badly():
    points = np.array([(x, y) for x in range(10, 30, 3) for y in range(10, 30, 3)], dtype=float)
    sizes = np.tile([8.5, 3.5], (len(points), 1))
    assert place_numbers(points, sizes, np.full(len(points), RADIUS), NOTHING, PAGE) is None


def test_the_same_markers_get_the_same_places():
    points, sizes = crowd(30, 3), np.tile([8.5, 3.5], (30, 1))
    one, other = (place_numbers(points, sizes, np.full(30, RADIUS), NOTHING, PAGE) for _ in range(2))
    assert one is not None
    assert other is not None
    assert (one.middle == other.middle).all()
