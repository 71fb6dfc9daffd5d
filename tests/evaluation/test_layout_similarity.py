"""Laws of likeness: a layout is itself, both ways are one, a part lies on the whole but not back."""

from dataclasses import replace

import numpy as np
import pytest

from capture_plan.anatomy.regions import face_regions
from capture_plan.evaluation.layout_similarity import similarities, similarity
from capture_plan.registration.empirical_layouts import empirical_layout
from capture_plan.registration.known import EMPIRICAL
from capture_plan.sample import sample_rig

RIG = sample_rig()
MPEG4, IBUG = empirical_layout("mpeg4").vertices, empirical_layout("ibug68").vertices


def brute_force(ours, theirs):
    apart = np.linalg.norm(RIG.neutral[ours][:, None] - RIG.neutral[theirs][None], axis=2)
    return apart.min(axis=1).mean(), apart.min(axis=0).mean()


def test_a_layout_is_like_itself():
    same = similarity(RIG, IBUG, "itself", IBUG[::-1])
    assert same.mean_nearest_mm == same.ours_to_theirs_mm == same.theirs_to_ours_mm == 0
    assert same.region_overlap == pytest.approx(1)


def test_ours_and_theirs_may_change_places():
    one, other = similarity(RIG, IBUG, "MPEG-4", MPEG4), similarity(RIG, MPEG4, "iBUG", IBUG)
    assert one.mean_nearest_mm == pytest.approx(other.mean_nearest_mm)
    assert one.region_overlap == pytest.approx(other.region_overlap)
    assert (one.ours_to_theirs_mm, one.theirs_to_ours_mm) == (other.theirs_to_ours_mm, other.ours_to_theirs_mm)
    assert 0 < one.region_overlap < 1


def test_distances_are_those_of_all_pairs():
    found = similarity(RIG, IBUG, "MPEG-4", MPEG4)
    assert (found.ours_to_theirs_mm, found.theirs_to_ours_mm) == pytest.approx(brute_force(IBUG, MPEG4))
    assert found.mean_nearest_mm == pytest.approx(sum(brute_force(IBUG, MPEG4)) / 2)


def test_a_part_lies_on_the_whole_and_the_whole_not_on_the_part():
    part = similarity(RIG, IBUG[17:], "the 68", IBUG)
    assert part.ours_to_theirs_mm == 0 < part.theirs_to_ours_mm


def test_a_head_twice_as_large_has_twice_the_distances_and_the_same_regions():
    large = replace(RIG, neutral=2 * RIG.neutral, deltas=2 * RIG.deltas)
    one, two = similarity(RIG, IBUG, "MPEG-4", MPEG4), similarity(large, IBUG, "MPEG-4", MPEG4)
    assert two.mean_nearest_mm == pytest.approx(2 * one.mean_nearest_mm)
    assert two.region_overlap == pytest.approx(one.region_overlap)


def test_layouts_of_different_regions_do_not_overlap():
    of_vertex, names = face_regions(RIG).of_vertex, face_regions(RIG).names
    brow, jaw = (np.flatnonzero(of_vertex == names.index(name))[:5] for name in ("brow", "jaw"))
    assert similarity(RIG, brow, "jaw", jaw).region_overlap == 0


def test_beside_the_empirical_ones_its_own_is_first():
    found = similarities(RIG, IBUG)
    assert found[0].name == "68 points (iBUG)"
    assert len(found) == len(EMPIRICAL)
    assert found[0].mean_nearest_mm == 0
    assert [one.mean_nearest_mm for one in found] == sorted(one.mean_nearest_mm for one in found)
