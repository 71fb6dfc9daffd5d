"""FBX: one tree from three forms, meshes with their channels, nodes, units and axes."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from capture_plan.errors import RigError
from capture_plan.formats.fbx import read_fbx
from capture_plan.formats.fbx_nodes import local_matrix
from capture_plan.formats.raw import finite
from capture_plan.reader.read import read_rig
from capture_plan.sample import sample_rig
from tests.fbx_files import (
    HEAD,
    LIFT,
    MESH,
    TETRAHEDRON,
    ascii_text,
    binary,
    channel,
    deformer,
    head,
    mesh,
    model,
    node,
    scene,
)  # fmt: skip

FORMS = {
    "ascii": ascii_text,
    "binary with 32-bit headers": lambda tree: binary(tree, 7100),
    "binary with 64-bit headers": lambda tree: binary(tree, 7700),
    "binary without compression": lambda tree: binary(tree, 7400, compress=False),
}


def write(path, tree, form="binary with 32-bit headers"):
    path.write_bytes(FORMS[form](tree))
    return path


def read(tmp_path, *pieces, **settings):
    return read_fbx(write(tmp_path / "r.fbx", scene(*pieces, **settings)))


def sample_tree(k=4, scale=1.0):
    """The sample rig in centimetres, every part a mesh on a node of its own."""
    rig, pieces = sample_rig(), []
    for part, title in enumerate(rig.part_names):
        inside = np.flatnonzero(rig.parts == part)
        corners = np.searchsorted(inside, rig.triangles[np.isin(rig.triangles, inside).all(axis=1)])
        corners[:, 2] = ~corners[:, 2]
        number = 1000 * (part + 1)
        vertices = rig.neutral[inside] / (10 * scale)
        pieces.append((
            [mesh(number, vertices, corners.ravel()), model(number + 1, title, Lcl_Scaling=[scale] * 3)],
            [(number, number + 1), (number + 1, 0)],
        ))  # fmt: skip
        pieces.append(deformer(number + 2, number))
        for i in range(k):
            moved = np.flatnonzero(rig.deltas[i, inside].any(axis=1))
            shape = (moved, rig.deltas[i, inside][moved] / (10 * scale))
            pieces.append(channel(number + 10 + 2 * i, f"shapes.{rig.names[i]}", [shape], number + 2))
    return scene(*pieces, UnitScaleFactor=1.0, UpAxis=1, FrontAxis=2, CoordAxis=0)


@pytest.mark.parametrize("form", FORMS)
def test_every_form_of_the_file_gives_the_same_head(tmp_path, form):
    rig, sample = read_rig(write(tmp_path / "head.fbx", sample_tree(), form)), sample_rig()
    by_part = np.concatenate([np.flatnonzero(sample.parts == part) for part in range(len(sample.part_names))])
    same = by_part[rig.source_index]  # parts came one after another
    assert (rig.unit_mm, rig.unit_found, rig.names) == (10.0, "format", sample.names[:4])
    np.testing.assert_allclose(rig.neutral, sample.neutral[same], atol=1e-4)
    np.testing.assert_allclose(rig.deltas, sample.deltas[:4, same], atol=1e-4)
    assert {rig.part_names[part] for part in rig.parts} == set(sample.part_names)


def test_a_node_scaled_by_100_gives_the_size_it_shows(tmp_path):
    plain = read_rig(write(tmp_path / "a.fbx", sample_tree(k=2)))
    blender = read_rig(write(tmp_path / "b.fbx", sample_tree(k=2, scale=100.0)))
    np.testing.assert_allclose(plain.neutral, blender.neutral, atol=1e-6)
    np.testing.assert_allclose(plain.deltas, blender.deltas, atol=1e-4)
    assert (blender.unit_mm, blender.unit_found, blender.note) == (10.0, "format", plain.note)


def test_vertex_order_polygons_and_offsets_are_the_files(tmp_path):
    quads = [0, 1, 2, ~3, 3, ~2, 1, 3, ~2]  # a quad, a line that is no face, a triangle
    rig = read(tmp_path, *head(mesh_node=mesh(MESH, faces=quads)))
    np.testing.assert_array_equal(rig.neutral, TETRAHEDRON)
    np.testing.assert_array_equal(rig.triangles, [[0, 1, 2], [0, 2, 3], [1, 3, 2]])
    np.testing.assert_array_equal(rig.deltas, [[[0, 0, 0], [0, 0, 0], [0, 0, 0], [0, 0, 2]]])
    assert (rig.names, rig.part_names, rig.note) == (("lift",), ("head",), "")


def test_channels_of_the_same_name_on_two_meshes_are_one_blendshape(tmp_path):
    teeth = ([mesh(11), model(2, "teeth", Lcl_Translation=[5, 0, 0])], [(11, 2), (2, 0)])
    second = deformer(21, 11, "other"), channel(40, "other.lift", [([0], [[1, 0, 0]])], 21)
    rig = read(tmp_path, *head(), teeth, *second)
    assert (rig.names, rig.part_names) == (("lift",), ("head", "teeth"))
    np.testing.assert_array_equal(np.flatnonzero(rig.deltas[0].any(axis=1)), [3, 4])
    np.testing.assert_array_equal(rig.source_index, np.arange(8))
    np.testing.assert_allclose(rig.neutral[4:], TETRAHEDRON + np.array([5, 0, 0]))


def test_a_mesh_shown_twice_is_two_parts_with_the_same_vertex_numbers(tmp_path):
    again = [model(2, "twin", Lcl_Translation=[0, 9, 0])], [(MESH, 2), (2, 0)]
    rig = read(tmp_path, *head(), again)
    assert rig.part_names == ("head", "twin")
    np.testing.assert_array_equal(rig.source_index, [0, 1, 2, 3, 0, 1, 2, 3])
    np.testing.assert_array_equal(rig.deltas[0, :4], rig.deltas[0, 4:])


def test_of_in_betweens_the_full_shape_is_the_blendshape_and_the_others_are_reported(tmp_path):
    half, full = ([3], [[0, 0, 0.3]]), ([3], [[0, 0, 2.0]])
    rig = read(tmp_path, *head(channel(30, "shapes.jawOpen", [half, full], weights=[50, 100])))
    assert rig.deltas[0, 3, 2] == 2
    assert "jawOpen at 50 %" in rig.note


def test_one_weight_for_each_vertex_is_no_list_of_in_betweens(tmp_path):
    rig = read(tmp_path, *head(channel(30, "lift", [LIFT], weights=[100.0] * 4)))
    assert (rig.deltas[0, 3, 2], rig.note, rig.names) == (2, "", ("lift",))


def test_a_dot_belongs_to_the_name_unless_the_deformer_stands_before_it(tmp_path):
    first, second = channel(30, "mouth.L", [LIFT]), channel(40, "shapes.mouthFBXASC046R", [LIFT])
    assert read(tmp_path, *head(first, second)).names == ("mouth.L", "mouth.R")


def test_a_mesh_of_several_materials_has_as_many_parts(tmp_path):
    skin, lips = (node("Material", 50 + i, f"Material::{name}", "") for i, name in enumerate(("skin", "lips")))
    several = mesh(MESH, materials=np.array([0, 1, 1, 0], "i4"))
    rig = read(tmp_path, *head(mesh_node=several), ([skin, lips], [(50, HEAD), (51, HEAD)]))
    assert rig.part_names == ("head/skin", "head/lips")


@pytest.mark.parametrize("order", range(6))
def test_rotation_order_says_which_axis_turns_first(tmp_path, order):
    letters = ("xyz", "xzy", "yzx", "yxz", "zxy", "zyx")[order]
    angles = dict(zip("xyz", (20, 30, 40), strict=True))
    R = np.eye(3)
    for axis in letters:  # turned first, hence rightmost
        R = Rotation.from_euler(axis, angles[axis], degrees=True).as_matrix() @ R
    rig = read(tmp_path, *head(Lcl_Rotation=[20, 30, 40], RotationOrder=order, RotationActive=1))
    np.testing.assert_allclose(rig.neutral, TETRAHEDRON @ R.T, atol=1e-12)
    np.testing.assert_allclose(rig.deltas[0, 3], R @ [0, 0, 2], atol=1e-6)


def test_pre_and_post_rotation_turn_before_and_undo_after_and_only_where_they_are_active():
    angles = {"PreRotation": (90, 0, 0), "Lcl Rotation": (0, 90, 0), "PostRotation": (0, 0, 90)}
    turn = [Rotation.from_euler("xyz", a, degrees=True).as_matrix() for a in angles.values()]
    active = local_matrix(angles | {"RotationActive": (1,)})
    np.testing.assert_allclose(active[:3, :3], turn[0] @ turn[1] @ turn[2].T, atol=1e-12)
    np.testing.assert_allclose(local_matrix(angles)[:3, :3], turn[1], atol=1e-12)


def test_pivots_stay_where_they_are_and_offsets_move_them():
    """The rotation pivot is a fixed point of a rotation, the scaling pivot of a scaling."""
    pivot = np.array([1.0, 2, 3, 1])
    turned = local_matrix({"Lcl Rotation": (10, 20, 30), "RotationPivot": (1, 2, 3)})
    grown = local_matrix({"Lcl Scaling": (2, 3, 4), "ScalingPivot": (1, 2, 3)})
    np.testing.assert_allclose(turned @ pivot, pivot, atol=1e-12)
    np.testing.assert_allclose(grown @ pivot, pivot, atol=1e-12)
    both = {"RotationOffset": (5, 0, 0), "ScalingOffset": (0, 7, 0), "Lcl Translation": (0, 0, 9)}
    np.testing.assert_allclose(local_matrix(both)[:3, 3], [5, 7, 9])


def test_children_inherit_their_parents_place_but_not_its_geometric_one(tmp_path):
    parent = model(5, "parent", "Null", Lcl_Translation=[0, 0, 10], Lcl_Scaling=[2, 2, 2], GeometricScaling=[9, 9, 9])
    rig = read(tmp_path, ([parent], [(HEAD, 5)]), *head(Lcl_Translation=[1, 0, 0], GeometricTranslation=[0, 1, 0]))
    np.testing.assert_allclose(rig.neutral, 2 * (TETRAHEDRON + np.array([1, 1, 0])) + np.array([0, 0, 10]))
    np.testing.assert_allclose(rig.deltas[0, 3], [0, 0, 4])


def volume(rig):
    a, b, c = rig.neutral[rig.triangles].transpose(1, 0, 2)
    return float(np.einsum("fx,fx->", a, np.cross(b, c)) / 6)


def test_mirrored_nodes_and_left_handed_files_keep_their_faces_outward(tmp_path):
    upright = volume(read(tmp_path, *head()))
    assert upright > 0
    assert volume(read(tmp_path, *head(Lcl_Scaling=[-1, 1, 1]))) == pytest.approx(upright)
    left = read(tmp_path, *head(), UpAxis=1, FrontAxis=2, CoordAxis=0, CoordAxisSign=-1)
    assert volume(left) == pytest.approx(upright)
    np.testing.assert_array_equal(left.neutral, TETRAHEDRON * [-1, 1, 1])


@pytest.mark.parametrize(
    ("settings", "axes"),
    [
        ({"UpAxis": 1, "FrontAxis": 2, "CoordAxis": 0}, ("+y", "+z")),
        ({"UpAxis": 2, "FrontAxis": 1, "FrontAxisSign": -1, "CoordAxis": 0}, ("+z", "-y")),
        ({"UpAxis": 1, "FrontAxis": 1, "CoordAxis": 0}, (None, None)),
        ({"UpAxis": 7, "FrontAxis": 2, "CoordAxis": 0}, (None, None)),
        ({}, (None, None)),
    ],
)
def test_axes_are_the_files_or_unknown(tmp_path, settings, axes):
    rig = read(tmp_path, *head(), **settings)
    assert (rig.up, rig.facing) == axes


@pytest.mark.parametrize(("factor", "unit"), [(1.0, 10.0), (100.0, 1000.0), (2.54, 25.4), (0.0, None), (-1.0, None)])
def test_unit_scale_factor_counts_in_centimetres(tmp_path, factor, unit):
    assert read(tmp_path, *head(), UnitScaleFactor=factor).unit_mm == (None if unit is None else pytest.approx(unit))


@pytest.mark.parametrize(
    ("pieces", "says"),
    [
        ([([model(HEAD, "head")], [])], "has no mesh with faces"),
        (head()[:2], "r.fbx: no blendshapes found"),
        (head(mesh_node=mesh(MESH, faces=[0, 1, ~4])), "a face that uses vertex 4 of 4"),
        (head(mesh_node=mesh(MESH, faces=[0, 1, 2])), "a polygon without an end"),
        (head(mesh_node=mesh(MESH, vertices=np.zeros(7))), "no whole FBX file"),
        (head(mesh_node=mesh(MESH, vertices=TETRAHEDRON * np.nan)), "NaN or infinite"),
        ([([model(5, "a"), model(6, "b")], [(HEAD, 5), (5, 6), (6, 5)]), *head()], "a node that lies inside itself"),
        ([([], [(HEAD, HEAD)]), *head()], "a node that lies inside itself"),
        ([([], [(30, 30), (20, 30)]), *head(channel(30, "a", []))], "no blendshapes found"),
    ],
)
def test_what_is_wrong_is_said_in_one_line(tmp_path, pieces, says):
    with pytest.raises(RigError, match=says) as error:
        read(tmp_path, *pieces)
    assert str(error.value).startswith("r.fbx")
    assert len(str(error.value).splitlines()) == 1


@pytest.mark.parametrize("offsets", [([4], [[0, 0, 1]]), ([1, 2], [[0, 0, 1]]), ([-1], [[0, 0, 1]])])
def test_a_shape_of_another_mesh_is_left_out_and_named(tmp_path, offsets):
    raw = finite(read(tmp_path, *head(channel(30, "good", [LIFT]), channel(40, "bad", [offsets]))))
    assert raw.names == ("good",)
    assert "another mesh were left out" in raw.note
    assert raw.note.endswith("bad")
    with pytest.raises(RigError, match="all blendshapes hold NaN"):
        finite(read(tmp_path, *head(channel(30, "bad", [offsets]))))


def test_old_files_are_refused_with_what_to_export(tmp_path):
    for data in (binary(scene(*head()), 6100), ascii_text(scene(*head()), 6100)):
        (tmp_path / "old.fbx").write_bytes(data)
        with pytest.raises(RigError, match=r"old.fbx is FBX version 6100, expected 7100 or newer"):
            read_fbx(tmp_path / "old.fbx")
