"""Seams: what a format split becomes one surface again, and what only touches stays apart."""

import numpy as np
import pytest

from capture_plan.formats.raw import RawRig
from capture_plan.formats.weld import TOLERANCE, weld_seams
from capture_plan.sample import sample_rig

SAMPLE = sample_rig()


def raw(neutral, triangles, deltas):
    """A rig of one part."""
    v = len(neutral)
    return RawRig(
        name="r",
        neutral=np.asarray(neutral, dtype=np.float64),
        triangles=np.asarray(triangles, dtype=np.int32),
        deltas=np.asarray(deltas, dtype=np.float32),
        names=tuple(f"s{k}" for k in range(len(deltas))),
        parts=np.zeros(v, dtype=np.int32),
        part_names=("mesh",),
        source_index=np.arange(v, dtype=np.int32),
    )


def welded(rig):
    return weld_seams(rig, rig.parts)


def head():
    """The sample's largest part, as one mesh without borders of its own at a seam."""
    inside = np.flatnonzero(SAMPLE.parts == np.bincount(SAMPLE.parts).argmax())
    triangles = SAMPLE.triangles[np.isin(SAMPLE.triangles, inside).all(axis=1)]
    return raw(SAMPLE.neutral[inside], np.searchsorted(inside, triangles), SAMPLE.deltas[::4, inside])


def split(rig, side):
    """The rig with vertices doubled where triangles of both sides meet; how many were doubled."""
    both = np.intersect1d(rig.triangles[side], rig.triangles[~side])
    copy = np.arange(len(rig.neutral))
    copy[both] = len(rig.neutral) + np.arange(len(both))
    triangles = np.where(side[:, None], copy[rig.triangles], rig.triangles)
    doubled = np.concatenate([np.arange(len(rig.neutral)), both])
    return raw(rig.neutral[doubled], triangles, rig.deltas[:, doubled]), len(both)


@pytest.mark.parametrize("soup", [False, True])
def test_a_split_surface_becomes_the_one_it_was(soup):
    rig = head()
    if soup:
        corners = rig.triangles.ravel()
        other = raw(rig.neutral[corners], np.arange(len(corners)).reshape(-1, 3), rig.deltas[:, corners])
    else:
        other, _ = split(rig, np.floor(rig.neutral[rig.triangles].mean(axis=1)[:, 1] / 14) % 2 == 0)
    again = welded(other)
    assert len(again.neutral) == len(rig.neutral)
    np.testing.assert_array_equal(again.neutral[again.triangles], rig.neutral[rig.triangles])


@pytest.mark.parametrize("unit", [0.001, 1.0, 25.4])
def test_rounding_opens_no_seam_in_any_unit(unit):
    rig = head()
    other, doubled = split(rig, rig.neutral[rig.triangles].mean(axis=1)[:, 0] > 0)
    noise = np.zeros_like(other.neutral)
    noise[-doubled:] = np.random.default_rng(0).uniform(-0.002, 0.002, (doubled, 3))
    other = raw(unit * (other.neutral + noise), other.triangles, unit * (other.deltas + noise[None]))
    assert len(welded(other).neutral) == len(rig.neutral)


def test_lips_that_touch_stay_two():
    """Two squares share an edge in place; only the lower one moves."""
    places = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, -1, 0], [1, -1, 0], [1, 0, 0], [0, 0, 0]]
    triangles = [[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]]
    delta = np.zeros((1, 8, 3))
    delta[0, 4:, 1] = -1
    assert len(welded(raw(places, triangles, delta)).neutral) == 8
    delta[0, 4:, 1] = -TOLERANCE
    delta[0, 0, 0] = 1  # a corner of the seam moves alone
    assert len(welded(raw(places, triangles, delta)).neutral) == 7
    delta[0, 7] = delta[0, 0]
    again = welded(raw(places, triangles, delta))
    np.testing.assert_array_equal(again.source_index, np.arange(6))
    np.testing.assert_array_equal(again.triangles, [[0, 1, 2], [0, 2, 3], [4, 5, 1], [4, 1, 0]])


def test_both_sides_of_a_sheet_stay_two():
    places = [[0, 0, 0], [1, 0, 0], [0, 1, 0]] * 2
    assert len(welded(raw(places, [[0, 1, 2], [3, 5, 4]], np.ones((1, 6, 3)))).neutral) == 6


def test_strips_over_one_another_stay_apart():
    """Three triangles on one edge are no surface."""
    places = [[0, 0, 0], [1, 0, 0], [0, 1, 0.5], [0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 0, 0], [0, 0, 0], [0, -1, 0]]
    triangles = [[0, 1, 2], [3, 4, 5], [6, 7, 8]]
    assert len(welded(raw(places, triangles, np.ones((1, 9, 3)))).neutral) == 9
    assert len(welded(raw(places[3:], [[0, 1, 2], [3, 4, 5]], np.ones((1, 6, 3)))).neutral) == 4


def test_other_groups_stay_apart():
    places = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 0, 0], [0, 0, 0], [0, -1, 0]]
    rig = raw(places, [[0, 1, 2], [3, 4, 5]], np.ones((1, 6, 3)))
    assert len(weld_seams(rig, np.array([0, 0, 0, 1, 1, 1])).neutral) == 6
    assert len(weld_seams(rig, np.zeros(6, int)).neutral) == 4


def test_thousands_of_vertices_on_one_spot_are_read_in_little_memory():
    places = np.zeros((30_000, 3))
    places[0], places[1] = 1, [0, 1, 0]
    triangles = np.arange(30_000).reshape(-1, 3)
    rig = raw(places, triangles, np.ones((1, 30_000, 3)))
    assert len(welded(rig).neutral) <= 30_000
