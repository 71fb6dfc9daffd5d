"""The bundled head is a whole human face in millimetres, and what rebuilds it reads its source rightly."""

import numpy as np
import pytest

from capture_plan.face.of_rig import rig_points
from capture_plan.sample import sample_rig
from capture_plan.sample.rebuild import fan, read_base, read_target, trim

ARKIT = 52


def test_the_head_is_as_large_as_a_person():
    rig = sample_rig()
    width, height, depth = np.ptp(rig.neutral[rig.skin], axis=0)
    assert 150 < width < 220
    assert 200 < height < 350
    assert 150 < depth < 260
    left, right = rig_points(rig).eyes.places
    assert 54 < left[0] - right[0] < 74


def test_every_blendshape_of_arkit_is_there_and_moves():
    rig = sample_rig()
    assert len(rig.names) == ARKIT
    assert list(rig.names) == sorted(rig.names)
    assert (rig.displacement.max(axis=1) > 1).all()
    assert rig.displacement.max() < 60


def test_left_and_right_are_the_subjects_own():
    rig = sample_rig()
    for name, length in zip(rig.names, rig.displacement, strict=True):
        side = length @ rig.neutral[:, 0] / length.sum()
        if name.endswith("Left") and not name.startswith(("jaw", "mouth")):
            assert side > 10, name
        if name.endswith("Right") and not name.startswith(("jaw", "mouth")):
            assert side < -10, name


def test_the_mouth_opens_downward_and_the_tongue_comes_out_forward():
    rig = sample_rig()
    jaw, tongue = (rig.deltas[rig.names.index(name)] for name in ("jawOpen", "tongueOut"))
    assert jaw[np.linalg.norm(jaw, axis=1).argmax()][1] < -10
    assert tongue[np.linalg.norm(tongue, axis=1).argmax()][2] > 10


def test_the_neutral_is_its_own_mirror_image():
    rig = sample_rig()
    order = np.lexsort(rig.neutral.round(2).T)
    mirrored = np.lexsort((rig.neutral * [-1, 1, 1]).round(2).T)
    apart = rig.neutral[order] - (rig.neutral * [-1, 1, 1])[mirrored]
    assert np.median(np.linalg.norm(apart, axis=1)) < 0.1


def test_eyes_teeth_tongue_lashes_and_the_mouth_bag_are_no_skin():
    rig = sample_rig()
    for part, name in enumerate(rig.part_names):
        share = rig.skin[rig.parts == part].mean()
        assert 0.5 < share < 1 if name == "skin" else share == 0, name


def test_every_vertex_is_used_and_comes_from_the_source_once():
    rig = sample_rig()
    assert np.array_equal(np.unique(rig.triangles), np.arange(len(rig.neutral)))
    assert (np.diff(rig.source_index) > 0).all()
    assert not rig.neutral.flags.writeable


def test_base_mesh_is_read_by_groups():
    vertices, polygons = read_base("# c\nv 0 0 1\nv 1 0 0\nv 1 1 0\ng a\nf 1/2 2/2 3/3\ng b\nf 3 2 1\ng a\nf 2 3 1\n")
    np.testing.assert_array_equal(vertices[0], [0, 0, 1])
    assert polygons == {"a": [[0, 1, 2], [1, 2, 0]], "b": [[2, 1, 0]]}


def test_targets_are_read_by_vertex_number():
    np.testing.assert_array_equal(read_target("# c\n\n2 .5 -1 0\n", 3), [[0, 0, 0], [0, 0, 0], [0.5, -1, 0]])


@pytest.mark.parametrize("n", [3, 4, 7])
def test_a_polygon_of_n_corners_is_a_fan_of_n_minus_two_triangles(n):
    triangles = fan(list(range(n)))
    assert len(triangles) == n - 2
    assert all(t[0] == 0 and t[2] == t[1] + 1 for t in triangles)


def test_trimming_moves_vertices_only_up_and_down():
    rig = sample_rig()
    v = rig.neutral / 100
    trimmed = trim(v, rig.triangles, rig.parts == 0)
    np.testing.assert_array_equal(trimmed[:, [0, 2]], v[:, [0, 2]])
