"""The mirror map: for each vertex the one on the other side."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from capture_plan.mesh.mirror import find_mirror_plane, mirror_error, mirror_map, mirror_plane, reflect
from capture_plan.sample import sample_rig


def cloud(seed, plane=0.0, half=60, middle=9):
    """Mirror-symmetric vertices about x = plane: half of them left, half right, some on the plane."""
    left = np.random.default_rng(seed).uniform([2, -80, -80], [80, 80, 80], (half, 3))
    on = np.random.default_rng(seed + 1).uniform([0, -80, -80], [0, 80, 80], (middle, 3))
    return np.vstack([left, left * [-1, 1, 1], on]) + np.array([plane, 0, 0])


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 1000), st.sampled_from([0.0, 3.0, -40.0]))
def test_mirroring_twice_gives_every_vertex_back(seed, plane):
    mirror = mirror_map(cloud(seed, plane))
    assert (mirror[mirror] == np.arange(len(mirror))).all()


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 1000), st.sampled_from([0.0, 3.0, -40.0]))
def test_partners_and_plane_are_those_the_face_was_made_with(seed, plane):
    vertices = cloud(seed, plane)
    assert mirror_plane(vertices) == pytest.approx(plane, abs=1e-3)
    assert (mirror_map(vertices) == np.r_[60:120, 0:60, 120:129]).all()


def test_a_vertex_on_the_plane_is_its_own_mirror_image():
    assert mirror_map(cloud(0))[120:].tolist() == list(range(120, 129))


def test_coincident_vertices_still_pair_off():
    seam = np.repeat(cloud(3), 2, axis=0)
    mirror = mirror_map(seam)
    assert (mirror[mirror] == np.arange(len(seam))).all()
    assert mirror_error(seam).max() < 1e-9


def test_the_map_does_not_depend_on_how_far_the_head_stands_to_the_side():
    head = sample_rig().neutral
    assert (mirror_map(head + np.array([250.0, 0, 0])) == mirror_map(head)).all()


def test_the_error_is_how_far_one_side_was_pushed():
    pushed = cloud(5)
    pushed[7] += [0, 0.5, 0]
    assert mirror_error(pushed)[[7, 67]] == pytest.approx([0.5, 0.5], abs=1e-3)
    assert np.delete(mirror_error(pushed), [7, 67]).max() < 1e-3


def test_reflecting_twice_changes_nothing():
    vertices = cloud(8)
    assert reflect(reflect(vertices, 4.0), 4.0) == pytest.approx(vertices)


def test_the_sample_head_is_symmetric():
    head = sample_rig().neutral
    assert mirror_error(head).max() < 0.01  # millimetres


def test_one_vertex_is_its_own_mirror_image():
    assert mirror_map(np.array([[1.0, 2.0, 3.0]])).tolist() == [0]


@pytest.mark.parametrize("seed", range(3))
def test_the_plane_is_found_however_the_cloud_lies_and_few_points_are_asked_though_a_part_is_missing(seed, monkeypatch):
    monkeypatch.setattr("capture_plan.mesh.mirror.SAMPLE", 100)
    rng = np.random.default_rng(seed)
    whole = cloud(seed, half=150) * rng.uniform(0.5, 1.5, 3)
    turn, shift = Rotation.random(rng=rng), rng.uniform(-300, 300, 3)
    torn = whole[~((whole[:, 0] > 0) & (whole[:, 1] > np.quantile(whole[:, 1], 0.7)))]
    plane, n = find_mirror_plane(turn.apply(torn) + shift), turn.apply([1.0, 0, 0])
    assert abs(np.array(plane.normal) @ n) == pytest.approx(1, abs=1e-9)
    assert plane.offset == pytest.approx(shift @ np.array(plane.normal), abs=1e-3)
