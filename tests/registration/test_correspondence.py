"""Laws of the surface correspondence: the same comes back, size and stretch do not matter, a bent head keeps its own.

The 68 points of iBUG stand for any layout.
"""

from dataclasses import replace

import numpy as np
import pytest

from capture_plan.errors import RigError
from capture_plan.registration.correspondence import correspond, transfer
from capture_plan.registration.empirical_layouts import empirical_layout, place_layout
from capture_plan.registration.known import EMPIRICAL
from capture_plan.rig import Rig
from capture_plan.sample import sample_rig
from tests.solids import square

SIXTY_EIGHT = empirical_layout("ibug68").vertices


def changed(neutral):
    return replace(sample_rig(), neutral=neutral)


def error_mm(rig, vertices):
    return np.linalg.norm(rig.neutral[vertices] - rig.neutral[SIXTY_EIGHT], axis=1)


@pytest.mark.parametrize("key", EMPIRICAL)
def test_to_the_same_rig_every_point_is_itself(key):
    layout = empirical_layout(key)
    carried = transfer(sample_rig(), layout.vertices, sample_rig())
    assert np.array_equal(carried.vertices, layout.vertices)
    assert carried.gaps_mm.max() < 1
    assert not carried.absent.any()


@pytest.mark.parametrize("key", EMPIRICAL)
def test_size_place_and_stretch_do_not_matter(key):
    layout = empirical_layout(key)
    stretched = changed(sample_rig().neutral * [1.3, 1.1, 1.2] + [0, -500, 200])
    carried = transfer(sample_rig(), layout.vertices, stretched)
    assert np.array_equal(carried.vertices, layout.vertices)


def test_there_and_back_is_where_it_was():
    """From a stretched head to the sample, the points of the sample."""
    stretched = changed(sample_rig().neutral * [1.2, 0.9, 1.1])
    assert np.array_equal(transfer(stretched, SIXTY_EIGHT, sample_rig()).vertices, SIXTY_EIGHT)


def test_a_bent_head_gets_the_points_of_the_head_it_was_bent_from():
    """12 % wider jaw, longer chin, deeper profile: the points move with the skin."""
    rig = sample_rig()
    x, y, z = rig.neutral.T
    low = np.clip((735 - y) / 100, 0, 1)
    head = changed(np.stack([x * (1 + 0.12 * low), y - 8 * low**2, z * 1.06 + 3 * low], axis=1))
    vertices = transfer(rig, SIXTY_EIGHT, head).vertices
    assert len(set(vertices.tolist())) == 68
    assert rig.skin[vertices].all()
    assert np.mean(error_mm(head, vertices)) < 3
    assert np.max(error_mm(head, vertices)) < 12


def test_numbers_of_vertices_do_not_matter():
    """A mesh with its vertices in another order gets the same places."""
    rig = sample_rig()
    order = np.random.default_rng(0).permutation(len(rig.neutral))
    new = np.argsort(order)
    shuffled = replace(
        rig,
        neutral=rig.neutral[order] * 1.1,
        deltas=rig.deltas[:, order],
        triangles=new[rig.triangles].astype(np.int32),
        skin=rig.skin[order],
        parts=rig.parts[order],
        source_index=rig.source_index[order],
    )
    assert np.array_equal(order[transfer(rig, SIXTY_EIGHT, shuffled).vertices], SIXTY_EIGHT)


def test_one_fit_serves_all_layouts():
    assert correspond(sample_rig(), sample_rig()) is correspond(sample_rig(), sample_rig())


def test_the_face_lies_as_it_lies_whatever_else_is_asked_for():
    """Ears and skull follow the face, and do not move it."""
    rig = sample_rig()
    rough = rig.neutral + np.random.default_rng(1).normal(size=rig.neutral.shape)
    laid = correspond(rig, changed(rough))
    at, places = laid.head
    assert set(laid.face.tolist()) < set(at.tolist())
    assert np.array_equal(places[np.isin(at, laid.face)], laid.places)


def test_a_poor_fit_shows_in_the_gaps():
    rig = sample_rig()
    rough = rig.neutral + 4 * np.random.default_rng(0).normal(size=rig.neutral.shape) * (rig.neutral[:, [2]] > 50)
    assert transfer(rig, SIXTY_EIGHT, changed(rough)).gaps_mm.mean() > 1


def test_where_no_landmark_is_allowed_points_are_absent_and_the_others_stay():
    """The skin narrowed to what lies above the mouth: eyes and nose are where they were, lips and jaw are not there."""
    rig = sample_rig()
    above = replace(rig, skin=rig.skin & (rig.neutral[:, 1] > rig.neutral[SIXTY_EIGHT[33], 1] - 1))
    carried = transfer(rig, SIXTY_EIGHT, above)
    assert np.array_equal(carried.absent, ~above.skin[SIXTY_EIGHT])
    assert np.array_equal(carried.vertices[~carried.absent], SIXTY_EIGHT[~carried.absent])
    assert (carried.vertices[carried.absent] == -1).all()


def test_a_mask_has_no_ears_and_no_skull():
    rig = sample_rig()
    mask = rig.skin & (rig.neutral[:, 2] > 60)
    retained = np.flatnonzero(mask)
    number = np.cumsum(mask) - 1
    cut = replace(
        rig,
        neutral=rig.neutral[retained],
        deltas=np.ascontiguousarray(rig.deltas[:, retained]),
        triangles=number[rig.triangles[mask[rig.triangles].all(axis=1)]].astype(np.int32),
        skin=np.ones(len(retained), dtype=bool),
        parts=rig.parts[retained],
        source_index=rig.source_index[retained],
    )
    placement = place_layout(cut, "mpeg4")
    assert {"10.1", "10.3", "11.4", "11.6"} <= set(placement.left_out)
    assert {"2.1", "8.3", "9.3", "4.1"} <= set(placement.names)


def test_a_point_that_is_no_skin_is_refused_in_one_line():
    rig = sample_rig()
    tooth = np.flatnonzero(~rig.skin)[:1]
    with pytest.raises(RigError, match=f"MakeHuman head: vertex {tooth[0]} is no skin"):
        transfer(rig, tooth, rig)


def test_a_mesh_too_coarse_for_68_points_is_refused_in_one_line():
    vertices, triangles = square((0, 0, 0), (50, 0, 0), (0, 50, 0))
    deltas = np.zeros((1, 4, 3), dtype=np.float32)
    deltas[0, 0, 2] = 5
    rig = Rig(
        name="plate",
        neutral=vertices,
        triangles=triangles,
        deltas=deltas,
        names=("up",),
        skin=np.ones(4, dtype=bool),
        parts=np.zeros(4, dtype=np.int32),
        part_names=("plate",),
        source_index=np.arange(4),
    )
    with pytest.raises(RigError, match="plate: 4 skin vertices for 68 points"):
        transfer(sample_rig(), SIXTY_EIGHT, rig)
