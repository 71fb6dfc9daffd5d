"""Active sets and the importance of blendshapes."""

from dataclasses import replace as dataclass_replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from msgspec.structs import replace

from capture_plan.expressions.active_sets import STILL_MM, active_sets, skin_displacement, vertex_kinds
from capture_plan.expressions.importance import (
    cosine_similarity,
    displacement_strength,
    triangle_distortion,
    triangle_stretch,
    uniqueness,
)
from capture_plan.expressions.listing import blendshape_importance
from capture_plan.expressions.settings import DistortionForm, PackingSettings
from capture_plan.sample import sample_rig

OURS = DistortionForm()
TRIANGLES = np.array([[0, 1, 2], [1, 3, 2]])
SQUARE = np.array([[0.0, 0, 0], [3, 0, 0], [0, 4, 0], [3, 4, 0]])


def random_square(seed):
    return SQUARE + np.random.default_rng(seed).uniform(-0.8, 0.8, SQUARE.shape)


@settings(max_examples=25, deadline=None)
@given(st.floats(0.05, 0.9), st.floats(0.05, 0.9))
def test_a_higher_threshold_never_adds_an_active_vertex(one, other):
    rig = sample_rig()
    low, high = (active_sets(rig, rig.names[:6], mu) for mu in sorted((one, other)))
    assert (low | ~high).all()


def test_only_skin_is_active_and_the_most_moved_skin_always_is():
    rig = sample_rig()
    active = active_sets(rig, rig.names, 1.0)
    assert not active[:, ~rig.skin].any()
    furthest = (rig.displacement * rig.skin).argmax(axis=1)
    moving = (rig.displacement * rig.skin).max(axis=1) > 1e-3
    assert active[np.arange(len(rig.names)), furthest][moving].all()
    assert not active[~moving].any()


def test_active_is_at_least_mu_of_the_largest_movement():
    rig = sample_rig()
    k = rig.names.index("jawOpen")
    moved = np.where(rig.skin, rig.displacement[k], 0)
    assert (active_sets(rig, ("jawOpen",), 0.3)[0] == (moved >= 0.3 * moved.max())).all()


def test_kinds_are_static_smoothing_active():
    rig = sample_rig()
    kinds = vertex_kinds(rig, ("eyeBlinkLeft",), 0.3)[0]
    moved = np.where(rig.skin, rig.displacement[rig.names.index("eyeBlinkLeft")], 0)
    assert set(kinds.tolist()) == {0, 1, 2}
    assert moved[kinds == 0].max() <= 1e-3 < moved[kinds == 1].min()
    assert moved[kinds == 1].max() < moved[kinds == 2].min()


def test_strength_is_the_mean_over_active_vertices_against_the_strongest():
    displacement = np.array([[4.0, 2.0, 1.0], [1.0, 1.0, 0.0]])
    active = np.array([[True, True, False], [True, True, False]])
    assert displacement_strength(displacement, active) == pytest.approx([1, 1 / 3])


@settings(max_examples=25, deadline=None)
@given(st.floats(0.01, 100))
def test_strength_knows_no_unit(scale):
    displacement, active = np.array([[4.0, 2.0], [1.0, 3.0]]), np.ones((2, 2), dtype=bool)
    assert displacement_strength(scale * displacement, active) == pytest.approx(
        displacement_strength(displacement, active)
    )


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 1000), st.floats(0.1, 10))
def test_a_larger_copy_of_the_face_is_no_distortion(seed, scale):
    face = random_square(seed)
    assert triangle_stretch(face, scale * face, TRIANGLES, OURS).tolist() == [0, 0]
    assert triangle_distortion(face, [scale * face], TRIANGLES, np.ones((1, 4), dtype=bool), OURS).tolist() == [0]


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 1000), st.integers(0, 1000))
def test_stretch_is_the_same_from_the_target_to_the_rig(seed, other):
    a, b = random_square(seed), random_square(other)
    assert triangle_stretch(a, b, TRIANGLES, OURS) == pytest.approx(triangle_stretch(b, a, TRIANGLES, OURS))


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 1000), st.integers(0, 1000))
def test_stretch_does_not_depend_on_the_order_of_corners(seed, other):
    a, b = random_square(seed), random_square(other)
    assert triangle_stretch(a, b, TRIANGLES, OURS) == pytest.approx(
        triangle_stretch(a, b, np.roll(TRIANGLES, 1, axis=1), OURS)
    )


def test_stretch_of_one_triangle_by_hand():
    one = np.array([[0, 1, 2]])
    target = SQUARE * [1, 2, 1]  # edges 3, 4, 5 become 3, 8, sqrt(73)
    scale = np.sqrt((9 + 16 + 25) / (9 + 64 + 73))
    ratio = np.array([3 * scale / 3, 8 * scale / 4, np.sqrt(73) * scale / 5])
    assert triangle_stretch(SQUARE, target, one, OURS)[0] == pytest.approx(np.maximum(ratio, 1 / ratio).sum() - 3)


def test_a_triangle_without_area_is_left_aside():
    flat = SQUARE.copy()
    flat[3] = flat[1]
    assert triangle_stretch(flat, SQUARE, TRIANGLES, OURS)[1] == 0


def test_distortion_counts_triangles_with_an_active_corner():
    stretch = triangle_stretch(
        SQUARE, SQUARE * [1, 2, 1] + [[0, 0, 0], [0, 0, 0], [0, 0, 0], [5, 0, 0]], TRIANGLES, OURS
    )
    target = SQUARE * [1, 2, 1] + [[0, 0, 0], [0, 0, 0], [0, 0, 0], [5, 0, 0]]
    active = np.array([[True, False, False, False], [False, True, False, False], [False, False, False, True]])
    expected = np.array([stretch[0], stretch.sum(), stretch[1]])
    assert triangle_distortion(SQUARE, [target], TRIANGLES, active, OURS) == pytest.approx(expected / expected.max())


def test_what_moves_by_no_more_than_nothing_is_static_however_low_the_threshold():
    rig = sample_rig()
    a, b, c = np.flatnonzero(rig.skin)[:3]
    deltas = np.zeros_like(rig.deltas)
    deltas[0, [a, b, c], 1] = 1.0, 1.01 * STILL_MM, STILL_MM
    assert vertex_kinds(dataclass_replace(rig, deltas=deltas), rig.names[:1], 0.0)[0, [a, b, c]].tolist() == [2, 2, 0]


def test_without_a_target_the_importance_of_the_paper_is_how_strongly_skin_moves():
    rig = sample_rig()
    used, paper = rig.names[:8], PackingSettings(importance="paper")
    active = active_sets(rig, used, paper.mu)
    found = blendshape_importance(rig, used, paper, None)
    assert found == pytest.approx(displacement_strength(skin_displacement(rig, used), active))
    assert np.ptp(found) > 0.1
    alike = blendshape_importance(rig, used, replace(paper, distortion=0.0), rig.neutral)
    assert alike == pytest.approx(found)


def test_uniqueness_is_least_for_a_copy_and_full_for_the_opposite():
    d = np.random.default_rng(0).normal(size=(1, 5, 3)).astype(np.float32)
    deltas = np.concatenate([d, d, -d, 0.5 * d])
    packed = np.array([True, False, False, False])
    assert uniqueness(cosine_similarity(deltas), packed) == pytest.approx([0, 0, 1, 0], abs=1e-6)


def test_uniqueness_is_nothing_before_the_first_expression_and_full_where_nothing_is_alike():
    cosine = np.eye(3)
    assert uniqueness(cosine, np.zeros(3, dtype=bool)).tolist() == [0, 0, 0]
    assert uniqueness(cosine, np.array([True, False, False]))[1:].tolist() == [1, 1]


PRINTED = DistortionForm(edges="two", scaled=False)


def test_as_printed_two_edges_are_counted_and_nothing_is_subtracted():
    one, target = np.array([[0, 1, 2]]), SQUARE * [1, 2, 1]  # the edges from corner 1 are 3, 5: they become 3, sqrt(73)
    assert triangle_stretch(SQUARE, target, one, PRINTED)[0] == pytest.approx(1 + np.sqrt(73) / 5)
    assert triangle_stretch(SQUARE, SQUARE, TRIANGLES, PRINTED).tolist() == [2, 2]


def test_as_printed_equal_faces_weigh_blendshapes_by_their_number_of_triangles():
    active = np.array([[True, False, False, False], [False, True, False, False]])
    assert triangle_distortion(SQUARE, [SQUARE], TRIANGLES, active, PRINTED).tolist() == [0.5, 1]
    assert triangle_distortion(SQUARE, [SQUARE], TRIANGLES, active, OURS).tolist() == [0, 0]


def test_as_printed_a_larger_face_is_distorted_all_over():
    assert triangle_stretch(SQUARE, 3 * SQUARE, TRIANGLES, PRINTED) == pytest.approx([6, 6])
    assert triangle_stretch(SQUARE, 3 * SQUARE, TRIANGLES, DistortionForm(edges="two")) == pytest.approx([2, 2])


def test_the_mean_does_not_favour_many_triangles():
    active = np.array([[True, False, False, False], [False, True, False, False]])
    target = SQUARE * [1, 2, 1]  # both triangles are stretched alike
    assert triangle_distortion(SQUARE, [target], TRIANGLES, active, DistortionForm(reduce="mean")) == pytest.approx(
        [1, 1]
    )
    assert triangle_distortion(SQUARE, [target], TRIANGLES, active, OURS) == pytest.approx([0.5, 1])


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 1000), st.integers(0, 1000))
def test_of_several_targets_the_largest_or_the_mean_counts(seed, other):
    active = np.array([[True, False, False, False], [False, True, False, False], [False, False, False, True]])
    targets = [random_square(seed), random_square(other)]
    each = [triangle_distortion(SQUARE, [target], TRIANGLES, active, OURS) for target in targets]
    both = triangle_distortion(SQUARE, targets, TRIANGLES, active, OURS)
    mean = triangle_distortion(SQUARE, targets, TRIANGLES, active, DistortionForm(targets="mean"))
    assert both.tolist() == np.maximum(*each).tolist()
    assert mean == pytest.approx((each[0] + each[1]) / 2)
