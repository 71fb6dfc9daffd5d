"""Rigid head markers: where they may stand, and what a head pose fitted to them is worth."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from capture_plan.anatomy.regions import face_regions
from capture_plan.camera import cameras_for, look_at
from capture_plan.errors import InfeasibleError
from capture_plan.layout.face import Face
from capture_plan.layout.head_sites import (
    CHOICE,
    HEAD_LAYOUTS,
    MOST_MM,
    RIGID_MM,
    SECTORS,
    head_candidates,
    pose_error,
    sectors_for,
)
from capture_plan.sample import sample_rig

TRIANGLE = np.array([[60.0, 20, 0], [-60, 20, 0], [0, 80, 40]])


@pytest.fixture(scope="module")
def face():
    rig = sample_rig()
    return Face(rig, rig.names, np.zeros(len(rig.neutral)))


@pytest.fixture(scope="module")
def sites(face):
    return head_candidates(face)


def test_every_sector_of_the_sample_has_candidates_that_hardly_move(face, sites):
    assert set(sites.sector.tolist()) == set(range(len(SECTORS)))
    motion = np.where(face.rig.skin, face.rig.displacement.max(axis=0), np.inf)[sites.vertices]
    assert np.allclose(motion, sites.motion_mm)
    assert (sites.motion_mm <= np.array(sites.limit_mm)[sites.sector]).all()
    assert len(set(sites.vertices.tolist())) == len(sites.vertices)


def test_candidates_lie_on_the_side_their_sector_is_named_for(face, sites):
    x = face.rig.neutral[sites.vertices, 0]
    for number, name in enumerate(SECTORS):
        side = {"left": 1, "right": -1}.get(name.split()[0], 0)
        here = x[sites.sector == number]
        assert (side * here > 0).all() if side else (np.abs(here) < 25).all()


def test_no_candidate_is_hair_ear_or_neck(face, sites):
    regions = face_regions(face.rig)
    found = {regions.names[i] for i in regions.of_vertex[sites.vertices]}
    assert found <= {"temple", "cheek", "forehead", "nose", "brow"}


def test_a_limit_rises_only_where_it_must_and_says_so(face, sites):
    for number, name in enumerate(SECTORS):
        limit, noted = sites.limit_mm[number], [note for note in sites.notes if note.startswith(name)]
        assert bool(noted) == (limit != RIGID_MM)
        assert 0 < limit <= MOST_MM
    faster = replace(face, rig=replace(face.rig, deltas=face.rig.deltas * 3))
    more = head_candidates(faster)
    assert all(a >= b for a, b in zip(more.limit_mm, sites.limit_mm, strict=True) if a)
    assert len(more.notes) >= len(sites.notes)


def test_a_face_that_moves_everywhere_has_no_rigid_place_and_says_so(face):
    wild = face.rig.deltas + np.float32(MOST_MM)
    nowhere = head_candidates(replace(face, rig=replace(face.rig, deltas=wild)))
    assert len(nowhere.vertices) == 0
    assert nowhere.limit_mm == (0.0,) * len(SECTORS)
    assert len(nowhere.notes) == len(SECTORS)


def test_the_best_marker_never_moves_and_is_seen_from_everywhere(sites):
    assert np.allclose(sites.cost, sites.motion_mm / 0.5 + (1 - sites.visibility))
    assert ((sites.visibility >= 0) & (sites.visibility <= 1)).all()
    assert (sites.cost >= 0).all()


def test_a_camera_beside_the_head_sees_the_temple_on_its_side_alone(face, sites):
    (frontal,) = cameras_for("frontal", face.rig.neutral, face.rig.skin)
    beside = frontal.position + np.array([800.0, 0, -frontal.position[2]])
    left = replace(frontal, position=beside, rotation=look_at(beside, np.array([0.0, 720, 60])))
    seen = head_candidates(face, (left,))
    assert np.array_equal(seen.vertices, sites.vertices)
    assert seen.visibility[seen.sector == SECTORS.index("left temple")].mean() > 0.9
    assert not seen.visibility[seen.sector == SECTORS.index("right temple")].any()


def test_layouts_name_one_sector_for_each_marker_and_both_temples():
    for number, sectors in HEAD_LAYOUTS.items():
        assert len(set(sectors)) == len(sectors) == number
        assert {SECTORS[i] for i in sectors} >= {"left temple", "right temple"}
    assert CHOICE >= 1


def fitted(points, measured):
    """Rotation and shift of the points onto the measured ones (Kabsch)."""
    rotation = Rotation.align_vectors(measured - measured.mean(axis=0), points - points.mean(axis=0))[0]
    return rotation, measured.mean(axis=0) - points.mean(axis=0)


@settings(max_examples=5, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(3, 6))
def test_the_closed_form_is_what_repeated_fits_show(seed, m):
    rng = np.random.default_rng(seed)
    points = 60 * rng.normal(size=(m, 3)) + np.array([5.0, 700, 90])
    if np.linalg.svd(points - points.mean(axis=0))[1][1] < 30:
        points[0] += np.array([90.0, -90, 90])
    surface = 40 * rng.normal(size=(30, 3)) + np.array([0.0, 680, 130])
    middle = points.mean(axis=0)
    turns, shifts, errors = [], [], []
    for noise in 0.2 * rng.normal(size=(3000, m, 3)):
        rotation, shift = fitted(points, points + noise)
        turns.append(rotation.magnitude())
        shifts.append(np.linalg.norm(shift))
        errors.append(np.linalg.norm(rotation.apply(surface - middle) + middle + shift - surface, axis=1))
    found = pose_error(points, surface, 0.2)
    rms = [float(np.sqrt(np.mean(np.square(x)))) for x in (turns, shifts, errors)]
    assert found.rotation_degrees == pytest.approx(np.degrees(rms[0]), rel=0.06)
    assert found.translation_mm == pytest.approx(rms[1], rel=0.06)
    assert found.surface_mm == pytest.approx(rms[2], rel=0.06)


def test_error_is_proportional_to_noise_and_does_not_depend_on_the_place_of_the_axes():
    surface = np.array([[0.0, 0, 60], [20, -40, 50]])
    one, two = pose_error(TRIANGLE, surface, 0.1), pose_error(TRIANGLE, surface, 0.2)
    assert two.surface_mm == pytest.approx(2 * one.surface_mm)
    turn = Rotation.from_rotvec([0.3, -1.0, 0.5])
    moved = pose_error(turn.apply(TRIANGLE) + 500, turn.apply(surface) + 500, 0.1)
    for what in ("rotation_degrees", "translation_mm", "surface_mm"):
        assert getattr(moved, what) == pytest.approx(getattr(one, what))


def test_wider_markers_turn_less_and_more_markers_shift_less():
    surface = np.zeros((1, 3))
    assert pose_error(2 * TRIANGLE, surface, 0.2).rotation_degrees == pytest.approx(
        pose_error(TRIANGLE, surface, 0.2).rotation_degrees / 2
    )
    four = np.vstack([TRIANGLE, TRIANGLE.mean(axis=0)])
    assert pose_error(four, surface, 0.2).translation_mm < pose_error(TRIANGLE, surface, 0.2).translation_mm


@pytest.mark.parametrize("points", [TRIANGLE[:2], np.outer([1.0, 2, 5], [3.0, 1, 2])])
def test_markers_that_fix_no_pose_are_refused(points):
    with pytest.raises(InfeasibleError, match="fix no head pose"):
        pose_error(points, TRIANGLE, 0.2)


def test_a_sector_of_which_nothing_is_seen_gives_way_to_one_that_is(sites):
    found = sites
    hidden = replace(found, visibility=np.where(found.sector == 2, 0.0, 1.0))
    assert sectors_for(replace(found, visibility=np.ones(len(found.vertices))), 3, 0.05) == (0, 1, 2)
    assert sectors_for(hidden, 3, 0.05) == (0, 1, 3)
    assert sectors_for(hidden, 4, 0.05) == (0, 1, 4, 3)
    assert sectors_for(replace(found, visibility=np.zeros(len(found.vertices))), 4, 0.05) == (0, 1, 2, 3)
