"""FBX: names, weights, hidden nodes, shapes inside meshes, and bones."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from capture_plan.errors import RigError
from tests.fbx_files import LIFT, MESH, TETRAHEDRON, channel, deformer, head, mesh, model, node, p, props
from tests.formats.test_fbx import read

RAISED = ([3], [[0, 0, 4.0]])
CAGE, CAGE_MESH, GROUP = 201, 200, 210


def cage(parent=0, name="cage", number=CAGE, **properties):
    """A further mesh without blendshapes."""
    objects = [mesh(number - 1, TETRAHEDRON + 9), model(number, name, **properties)]
    return objects, [(number - 1, number), (number, parent)]


def group(kind="Null", **properties):
    return [model(GROUP, "group", kind, **properties)], [(GROUP, 0)]


def test_two_deformers_with_one_name_keep_theirs(tmp_path):
    first = channel(30, "shapes.lift", [LIFT])
    second = channel(40, "corrective.lift", [RAISED], deformer=25)
    third = channel(50, "corrective.wide", [RAISED], deformer=25)
    rig = read(tmp_path, *head(first), deformer(25, MESH, "corrective"), second, third)
    assert rig.names == ("shapes.lift", "corrective.lift", "wide")
    assert "corrective.lift" in rig.note
    np.testing.assert_array_equal(rig.deltas[:, 3, 2], [2, 4, 4])


def test_channels_of_one_name_on_one_deformer_are_numbered(tmp_path):
    rig = read(tmp_path, *head(channel(30, "lift", [LIFT]), channel(40, "lift", [RAISED])))
    assert rig.names == ("lift", "lift 2")
    assert "lift 2" in rig.note


def test_a_shape_of_normals_alone_moves_nothing(tmp_path):
    rig = read(tmp_path, *head(channel(30, "lift", [LIFT]), channel(40, "wrinkle", [([1, 2], np.zeros((0, 3)))])))
    assert not rig.deltas[1].any()


@pytest.mark.parametrize("way", ["property", "node"])
def test_channels_that_are_left_on_are_told(tmp_path, way):
    objects, links = channel(30, "lift", [LIFT])
    name, values, children = objects[0]
    on = props(DeformPercent=80.0) if way == "property" else node("DeformPercent", 80.0)
    rig = read(tmp_path, *head(([(name, values, [*children, on]), *objects[1:]], links)))
    assert "lift at 80 %" in rig.note
    np.testing.assert_array_equal(rig.neutral, TETRAHEDRON)


def test_shapes_inside_the_mesh_are_read(tmp_path):
    name, values, children = mesh(MESH)
    shapes = [
        node("Shape", title, children=[node("Indexes", np.array([3])), node("Vertices", np.array([0, 0, z]))])
        for title, z in (("shapes.lift", 2.0), ("shapes.raise", 4.0))
    ]
    both = (name, values, [*children, *shapes, node("Properties70", children=[p("shapes.raise", 30.0)])])
    rig = read(tmp_path, *head(mesh_node=both)[:1])
    assert rig.names == ("lift", "raise")
    assert "raise at 30 %" in rig.note
    np.testing.assert_array_equal(rig.deltas[:, 3, 2], [2, 4])


@pytest.mark.parametrize(
    ("pieces", "shown"),
    [
        ([cage(Visibility=0.0)], False),
        ([cage(Show=0)], False),
        ([cage(Show=1, Visibility=1.0)], True),
        ([group(Visibility=0.0), cage(GROUP)], False),
        ([group(Show=0), cage(GROUP)], True),
        ([group(Visibility=0.0), cage(GROUP, Visibility_Inheritance=0)], True),
        ([group("LodGroup"), cage(GROUP, "near", 301), cage(GROUP)], False),
    ],
)
def test_what_is_hidden_is_left_out_and_named(tmp_path, pieces, shown):
    rig = read(tmp_path, *head(), *pieces)
    assert ("cage" in rig.part_names) == shown
    assert rig.left_out == (() if shown else ("cage",))
    assert ("cage" in rig.note) != shown


@pytest.mark.parametrize("above", [False, True])
@pytest.mark.parametrize("on", [0, 1])
def test_a_display_layer_that_is_off_hides_what_it_holds(tmp_path, on, above):
    layer = [node("CollectionExclusive", 400, "DisplayLayer::targets", "DisplayLayer", children=[props(Show=on)])]
    pieces = [group(), cage(GROUP), (layer, [(GROUP if above else CAGE, 400)])]
    assert ("cage" in read(tmp_path, *head(), *pieces).part_names) == bool(on)


def test_a_rig_whose_only_blendshapes_are_hidden_is_still_read(tmp_path):
    rig = read(tmp_path, *head(Visibility=0.0), cage())
    assert (rig.part_names, rig.left_out) == (("head", "cage"), ())
    assert "head" in rig.note


def flat(M):
    """A matrix as FBX writes it."""
    return np.asarray(M, dtype=np.float64).T.ravel()


def skin(bones, *, as_world=False):
    """Clusters of the head: for each bone its place now, its place at binding and its weights {vertex: weight}.

    The mesh was bound where the world's origin is; `as_world` writes that place instead of the one seen from the bone.
    """
    objects, links = [node("Deformer", 500, "Deformer::skin", "Skin")], [(500, MESH)]
    for number, (now, bound, weights) in enumerate(bones):
        cluster, bone = 510 + number, 520 + number
        T = np.eye(4) if as_world else np.linalg.pinv(np.nan_to_num(bound))
        arrays = [
            node("Indexes", np.array(list(weights), "i4")),
            node("Weights", np.array(list(weights.values()))),
            node("Transform", flat(T)),
            node("TransformLink", flat(bound)),
        ]
        objects += [
            node("Deformer", cluster, "SubDeformer::", "Cluster", children=arrays),
            model(bone, f"bone{number}", "LimbNode", Lcl_Translation=now),
        ]
        links += [(cluster, 500), (bone, cluster), (bone, 0)]
    return objects, links


def shifted(x, y, z, degrees=0.0):
    M = np.eye(4)
    M[:3, :3] = Rotation.from_euler("z", degrees, degrees=True).as_matrix()
    M[:3, 3] = x, y, z
    return M


EVERY = dict.fromkeys(range(4), 1.0)


@pytest.mark.parametrize("as_world", [False, True])
def test_a_skinned_mesh_stands_where_its_bones_put_it(tmp_path, as_world):
    """v' = sum_j w_j B_j T_j v, whatever the mesh's own node does after binding."""
    half = {vertex: 0.5 for vertex in EVERY}
    bones = [([0, 5, 0], shifted(0, 5, 0, 90), half), ([2, 9, 0], shifted(2, 7, 0), half)]
    turned = np.linalg.inv(shifted(0, 5, 0, 90))[:3]
    want = 0.5 * (TETRAHEDRON @ turned[:, :3].T + turned[:, 3] + np.array([0, 5, 0]))
    want += 0.5 * (TETRAHEDRON + np.array([0, 2, 0]))
    rig = read(tmp_path, *head(Lcl_Translation=[0, 0.25, 0]), skin(bones, as_world=as_world))
    np.testing.assert_allclose(rig.neutral, want, atol=1e-9)
    np.testing.assert_allclose(rig.deltas[0], [[0, 0, 0], [0, 0, 0], [0, 0, 0], [0, 0, 2]], atol=1e-6)


def test_vertices_without_weights_stand_where_their_node_is(tmp_path):
    rig = read(tmp_path, *head(Lcl_Translation=[7, 0, 0]), skin([([0, 5, 0], shifted(0, 5, 0), {0: 1.0})]))
    np.testing.assert_allclose(rig.neutral, TETRAHEDRON + np.outer([0, 7, 7, 7], [1, 0, 0]), atol=1e-9)


def test_a_bone_of_another_mesh_is_refused(tmp_path):
    with pytest.raises(RigError, match="a bone that moves vertex 4 of 4"):
        read(tmp_path, *head(), skin([([0, 0, 0], np.eye(4), {4: 1.0})]))


def test_bones_at_no_place_leave_the_mesh_to_its_node(tmp_path):
    rig = read(tmp_path, *head(Lcl_Translation=[7, 0, 0]), skin([([0, 0, 0], np.eye(4) * [[np.nan]], EVERY)]))
    np.testing.assert_array_equal(rig.neutral, TETRAHEDRON + np.array([7, 0, 0]))


@pytest.mark.parametrize(
    ("vertices", "faces", "says"),
    [
        (TETRAHEDRON, [0, 1, ~9], "hat has a face that uses vertex 9 of 4"),
        (TETRAHEDRON * [1, np.nan, 1], [0, 1, ~2], "hat holds NaN or infinite coordinates"),
    ],
)
def test_a_broken_mesh_that_nothing_moves_is_left_out_and_named(tmp_path, vertices, faces, says):
    hat = [mesh(CAGE_MESH, vertices, faces), model(CAGE, "hat")], [(CAGE_MESH, CAGE), (CAGE, 0)]
    rig = read(tmp_path, *head(), hat)
    assert says in rig.note
    assert rig.left_out == ("hat",)
    np.testing.assert_array_equal(rig.neutral, TETRAHEDRON)
