"""One broken mesh, morph target or scene does not refuse a glTF file whose face is whole; a broken face is named."""

import numpy as np
import pytest

from capture_plan.errors import RigError
from capture_plan.formats.gltf import read_gltf
from tests.formats.test_gltf import LIFT, QUAD, SQUARE, Writer, primitive

FACE = np.concatenate(
    [SQUARE + np.array([0, 2 * row, 0], np.float32) for row in range(4)]
)  # four squares, sixteen vertices
FACES = np.concatenate([QUAD + 4 * row for row in range(4)]).astype(np.uint16)
DELTAS = np.concatenate([LIFT * np.float32(1 + row) for row in range(4)])


def face_and(writer: Writer, *others: dict) -> Writer:
    """A face with two blendshapes, and meshes called hat beside it."""
    writer.mesh([primitive(writer, FACE, FACES, deltas=(DELTAS, -DELTAS))], ["smile", "frown"], name="face")
    for other in others:
        writer.mesh([other], ["smile"] if other.get("targets") else [], name="hat")
    return writer


def nan_vertex(vertices: np.ndarray) -> np.ndarray:
    vertices = vertices.copy()
    vertices[1, 1] = np.nan
    return vertices


def hats(writer: Writer) -> dict[str, tuple[dict, str]]:
    """Hats that are broken in one way each, and what is to be said of them."""
    far = np.array([0, 1, 99, 0, 2, 3], np.uint16)
    torn = primitive(writer)
    view = writer.document["accessors"][torn["attributes"]["POSITION"]]
    view["bufferView"] = 12345
    return {
        "nan": (primitive(writer, nan_vertex(SQUARE)), "hat holds NaN or infinite coordinates"),
        "index": (primitive(writer, SQUARE, far), "hat has a face that uses vertex 99 of 4"),
        "view": (torn, "hat refers to number 12345 of"),
        "accessor": (primitive(writer) | {"attributes": {"POSITION": 4321}}, "hat refers to number 4321 of"),
        "wild": (primitive(writer) | {"attributes": {"POSITION": "x"}}, "hat refers to number x of"),
    }


@pytest.mark.parametrize("kind", ["nan", "index", "view", "accessor", "wild"])
def test_a_broken_hat_is_left_out_and_named_and_the_face_is_read_as_without_it(tmp_path, kind):
    plain = read_gltf(face_and(Writer()).glb(tmp_path / "plain.glb"))
    writer = Writer()
    hat, says = hats(writer)[kind]
    hat.pop("targets", None)
    rig = read_gltf(face_and(writer, hat).glb(tmp_path / "r.glb"))
    np.testing.assert_array_equal(rig.neutral, plain.neutral)
    np.testing.assert_array_equal(rig.deltas, plain.deltas)
    assert (rig.names, rig.part_names, rig.left_out) == (plain.names, plain.part_names, ("hat",))
    assert says in rig.note


@pytest.mark.parametrize("kind", ["nan", "index", "accessor"])
def test_a_broken_face_refuses_the_file_and_names_itself(tmp_path, kind):
    writer = Writer()
    writer.mesh([primitive(writer, deltas=())], [], name="hat")
    vertices = nan_vertex(FACE) if kind == "nan" else FACE
    face = primitive(writer, vertices, FACES + np.uint16(99 * (kind == "index")), deltas=(DELTAS, -DELTAS))
    if kind == "accessor":
        face["attributes"]["POSITION"] = 4321
    writer.mesh([face], ["smile", "frown"], name="head")
    writer.mesh([primitive(writer, deltas=(LIFT,))], ["smile"], name="tongue")
    with pytest.raises(RigError, match=r"r\.glb has a broken face mesh: head ") as error:
        read_gltf(writer.glb(tmp_path / "r.glb"))
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("kind", ["accessor", "view", "rows"])
@pytest.mark.parametrize("whose", ["face", "hat"])
def test_a_broken_morph_target_costs_its_blendshape_on_the_face_and_nothing_elsewhere(tmp_path, whose, kind):
    writer = Writer()
    hat = primitive(writer, deltas=(LIFT,))
    writer = face_and(writer, hat)
    number = ["face", "hat"].index(whose)
    target = writer.document["meshes"][number]["primitives"][0]["targets"][0]
    accessor = writer.document["accessors"][target["POSITION"]]
    if kind == "accessor":
        target["POSITION"] = 4321
    elif kind == "view":
        writer.document["bufferViews"][accessor["bufferView"]]["byteLength"] = 10
    else:
        accessor["count"] = 3
    rig = read_gltf(writer.glb(tmp_path / "r.glb"))
    assert np.isnan(rig.deltas[0]).any() == (whose == "face")
    assert np.isfinite(rig.deltas[1]).all()
    assert f"{whose}" in rig.note
    assert "smile " in rig.note
    if whose == "hat":
        np.testing.assert_array_equal(rig.deltas[0, :16], DELTAS)
        assert not rig.deltas[0, 16:].any()


ODD_NODES = {
    "NaN": {"translation": [float("nan"), 0, 0]},
    "infinity": {"matrix": [float("inf")] * 16},
    "short matrix": {"matrix": [1, 0, 0]},
    "text": {"scale": "large"},
}


@pytest.mark.parametrize("kind", ODD_NODES)
def test_a_light_that_lies_nowhere_refuses_nothing_but_a_face_below_it_is_named(tmp_path, kind):
    writer = face_and(Writer())
    writer.document["nodes"].append({"name": "light", **ODD_NODES[kind]})
    writer.document["scenes"] = [{"nodes": [0, 1]}]
    rig = read_gltf(writer.glb(tmp_path / "r.glb"))
    np.testing.assert_array_equal(rig.neutral, FACE)
    assert rig.note == ""
    writer.document["nodes"][1]["children"] = [0]
    writer.document["scenes"] = [{"nodes": [1]}]
    with pytest.raises(
        RigError, match="broken face mesh: face is placed by a node that holds NaN, infinity or no whole"
    ):
        read_gltf(writer.glb(tmp_path / "r.glb"))


@pytest.mark.parametrize("share", [0.0, 0.5])
def test_a_bone_that_lies_nowhere_counts_where_a_vertex_hangs_on_it(tmp_path, share):
    writer = Writer()
    face = primitive(writer, FACE, FACES, deltas=(DELTAS,))
    weights = np.tile(np.array([1 - share, share, 0, 0], np.float32), (16, 1))
    joints = np.tile(np.array([0, 1, 0, 0], np.uint8), (16, 1))
    face["attributes"] |= {"JOINTS_0": writer.add(joints), "WEIGHTS_0": writer.add(weights)}
    writer.mesh([face], ["smile"], name="face", skin=0)
    writer.document["nodes"] += [{"name": "head"}, {"name": "prop", "translation": [float("nan"), 0, 0]}]
    writer.document |= {"skins": [{"joints": [1, 2]}], "scenes": [{"nodes": [0, 1, 2]}]}
    path = writer.glb(tmp_path / "r.glb")
    if share:
        with pytest.raises(RigError, match="broken face mesh: face is placed by a node"):
            read_gltf(path)
    else:
        np.testing.assert_array_equal(read_gltf(path).neutral, FACE)


def test_four_zeros_are_no_rotation(tmp_path):
    writer = face_and(Writer())
    writer.document["nodes"][0]["rotation"] = [0, 0, 0, 0]
    np.testing.assert_array_equal(read_gltf(writer.glb(tmp_path / "r.glb")).neutral, FACE)


@pytest.mark.parametrize("extras", ['{"targetNames": ["smile", "frown"]}', ["smile"], 3, {"targetNames": [None, ""]}])
def test_extras_that_name_nothing_refuse_nothing_and_make_no_names(tmp_path, extras):
    """Anything may stand there."""
    writer = face_and(Writer())
    writer.document["meshes"][0]["extras"] = extras
    writer.document["meshes"][0]["primitives"][0]["targets"][0]["extras"] = extras
    assert read_gltf(writer.glb(tmp_path / "r.glb")).names == ("target_0", "target_1")


@pytest.mark.parametrize("name", [None, "head scene"])
def test_where_the_default_scene_shows_no_mesh_the_first_that_shows_one_is_taken_and_told(tmp_path, name):
    writer = face_and(Writer())
    writer.document["nodes"] += [{}, {"children": [0]}]
    named = {"name": name} if name else {}
    writer.document |= {"scenes": [{"nodes": [1]}, {"nodes": []}, {"nodes": [2], **named}], "scene": 0}
    rig = read_gltf(writer.glb(tmp_path / "r.glb"))
    assert len(rig.neutral) == 16
    assert f"the first that shows one was taken, {name or 'number 2'}" in rig.note


def test_a_default_scene_with_a_mesh_is_taken_though_another_comes_first(tmp_path):
    writer = Writer()
    writer = face_and(writer, primitive(writer, deltas=()))
    writer.document |= {"scenes": [{"nodes": [0, 1]}, {"nodes": [0]}], "scene": 1}
    rig = read_gltf(writer.glb(tmp_path / "r.glb"))
    assert (rig.part_names, rig.note) == (("face",), "")
