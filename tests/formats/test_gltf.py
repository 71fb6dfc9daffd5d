"""glTF morph targets: accessors of every kind, nodes and skins, several meshes; what is not understood is refused."""

import base64
import json
import struct
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from capture_plan.errors import RigError
from capture_plan.formats.gltf import read_gltf
from capture_plan.formats.raw import finite
from capture_plan.sample import sample_rig

COMPONENT = {"int8": 5120, "uint8": 5121, "int16": 5122, "uint16": 5123, "uint32": 5125, "float32": 5126}
TYPE = {1: "SCALAR", 3: "VEC3", 4: "VEC4", 16: "MAT4"}
SQUARE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], dtype=np.float32)
LIFT = np.array([[0, 0, 0], [0, 0, 0], [0, 0, 2], [0, 0, 0]], dtype=np.float32)
QUAD = np.array([0, 1, 2, 0, 2, 3], dtype=np.uint16)


class Writer:
    """A glTF document under construction: `add` puts an array into the buffer and returns its accessor."""

    def __init__(self) -> None:
        self.data = b""
        self.document = {"asset": {"version": "2.0"}, "bufferViews": [], "accessors": [], "meshes": [], "nodes": []}

    def view(self, array: np.ndarray) -> int:
        self.data += b"\0" * (-len(self.data) % 4)
        self.document["bufferViews"].append({"buffer": 0, "byteOffset": len(self.data), "byteLength": array.nbytes})
        self.data += array.tobytes()
        return len(self.document["bufferViews"]) - 1

    def add(self, array: np.ndarray, **extra) -> int:
        rows = array.reshape(len(array), -1)
        accessor = {
            "componentType": COMPONENT[array.dtype.name], "type": TYPE[rows.shape[1]], "count": len(rows),
            "bufferView": self.view(array),
        }  # fmt: skip
        self.document["accessors"].append(accessor | extra)
        return len(self.document["accessors"]) - 1

    def add_sparse(self, array: np.ndarray) -> int:
        """Only the rows that are not zero, and no buffer view: what Blender writes."""
        rows = np.flatnonzero(array.any(axis=1)).astype(np.uint16)
        sparse = {
            "count": len(rows),
            "indices": {"bufferView": self.view(rows), "componentType": 5123},
            "values": {"bufferView": self.view(array[rows])},
        }
        self.document["accessors"].append(
            {"componentType": 5126, "type": "VEC3", "count": len(array), "sparse": sparse}
        )
        return len(self.document["accessors"]) - 1

    def mesh(self, primitives: list[dict], names: list[str] | None = None, **node) -> None:
        mesh = {"primitives": primitives} | ({} if names is None else {"extras": {"targetNames": names}})
        self.document["meshes"].append(mesh)
        self.document["nodes"].append({"mesh": len(self.document["meshes"]) - 1} | node)

    def glb(self, path: Path) -> Path:
        self.document["buffers"] = [{"byteLength": len(self.data)}]
        text = json.dumps(self.document).encode()
        text += b" " * (-len(text) % 4)
        data = self.data + b"\0" * (-len(self.data) % 4)
        chunks = struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(data), 0x004E4942) + data
        path.write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks)
        return path


def primitive(writer: Writer, vertices=SQUARE, corners=QUAD, deltas=(LIFT,), sparse=False, **extra) -> dict:
    add = writer.add_sparse if sparse else writer.add
    return {
        "attributes": {"POSITION": writer.add(vertices)},
        "indices": writer.add(corners),
        "targets": [{"POSITION": add(delta)} for delta in deltas],
    } | extra


def write_sample_glb(path: Path, *, k: int = 52, sparse: bool = True) -> Path:
    """The sample rig as a GLB in metres, every part a mesh of its own."""
    rig, writer = sample_rig(), Writer()
    for part, title in enumerate(rig.part_names):
        inside = np.flatnonzero(rig.parts == part)
        triangles = rig.triangles[np.isin(rig.triangles, inside).all(axis=1)]
        corners = np.searchsorted(inside, triangles).astype(np.uint16).ravel()
        deltas = [(rig.deltas[i, inside] / 1000).astype(np.float32) for i in range(k)]
        vertices = (rig.neutral[inside] / 1000).astype(np.float32)
        writer.mesh([primitive(writer, vertices, corners, deltas, sparse)], list(rig.names[:k]), name=title)
    return writer.glb(path)


def test_format_promises_metres_y_up_and_facing_z(tmp_path):
    writer = Writer()
    writer.mesh([primitive(writer)], ["lift"])
    rig = read_gltf(writer.glb(tmp_path / "r.glb"))
    assert (rig.unit_mm, rig.up, rig.facing, rig.names) == (1000.0, "+y", "+z", ("lift",))
    np.testing.assert_array_equal(rig.neutral, SQUARE)
    np.testing.assert_array_equal(rig.triangles, [[0, 1, 2], [0, 2, 3]])
    np.testing.assert_array_equal(rig.deltas[0], LIFT)


def test_sparse_accessors_without_a_buffer_view_are_what_their_dense_twins_are(tmp_path):
    dense = read_gltf(write_sample_glb(tmp_path / "dense.glb", k=5, sparse=False))
    sparse = read_gltf(write_sample_glb(tmp_path / "sparse.glb", k=5, sparse=True))
    np.testing.assert_array_equal(dense.deltas, sparse.deltas)
    assert dense.deltas.any()


def test_interleaved_rows_are_taken_apart(tmp_path):
    writer = Writer()
    p = primitive(writer)
    both = np.concatenate([SQUARE, np.full_like(SQUARE, 7)], axis=1)
    view = writer.view(both)
    writer.document["bufferViews"][view]["byteStride"] = 24
    writer.document["accessors"][p["attributes"]["POSITION"]] |= {"bufferView": view}
    writer.mesh([p], ["lift"])
    np.testing.assert_array_equal(read_gltf(writer.glb(tmp_path / "r.glb")).neutral, SQUARE)


def test_normalised_integers_reach_from_minus_one_to_one(tmp_path):
    writer = Writer()
    p = primitive(writer)
    p["targets"] = [
        {"POSITION": writer.add(np.array([[127, -127, -128, 0]] * 4, np.int8), normalized=True, type="VEC3")}
    ]
    writer.document["bufferViews"][-1]["byteStride"] = 4
    writer.mesh([p], ["lift"])
    np.testing.assert_allclose(read_gltf(writer.glb(tmp_path / "r.glb")).deltas[0], [[1, -1, -1]] * 4)


def test_nodes_place_vertices_and_turn_deltas(tmp_path):
    """world = T R S of the parent, then of the child; a delta is turned and scaled but not moved."""
    writer = Writer()
    R = Rotation.from_euler("xyz", [20, 30, 40], degrees=True)
    writer.mesh([primitive(writer)], ["lift"], translation=[1, 2, 3], rotation=R.as_quat().tolist(), scale=[1, 2, 3])
    matrix = [2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0, 7, 8, 9, 1]  # column by column: twice as large, moved by (7, 8, 9)
    writer.document["nodes"].append({"children": [0], "matrix": matrix})
    writer.document |= {"scenes": [{"nodes": [1]}], "scene": 0}
    rig = read_gltf(writer.glb(tmp_path / "r.glb"))
    np.testing.assert_allclose(
        rig.neutral, 2 * (R.apply(SQUARE * [1, 2, 3]) + np.array([1, 2, 3])) + np.array([7, 8, 9]), atol=1e-6
    )
    np.testing.assert_allclose(rig.deltas[0], 2 * R.apply(LIFT * [1, 2, 3]), atol=1e-6)


def test_a_mirrored_node_turns_its_triangles_over(tmp_path):
    writer = Writer()
    writer.mesh([primitive(writer)], ["lift"], scale=[-1, 1, 1])
    np.testing.assert_array_equal(read_gltf(writer.glb(tmp_path / "r.glb")).triangles, [[2, 1, 0], [3, 2, 0]])


def test_a_skinned_mesh_stands_where_its_joints_put_it(tmp_path):
    """v' = sum_j w_j J_j B_j v; the node of the mesh itself counts for nothing."""
    writer = Writer()
    p = primitive(writer)
    p["attributes"] |= {
        "JOINTS_0": writer.add(np.tile(np.array([0, 1, 0, 0], np.uint8), (4, 1))),
        "WEIGHTS_0": writer.add(np.tile(np.array([0.25, 0.75, 0, 0], np.float32), (4, 1))),
    }
    writer.mesh([p], ["lift"], translation=[99, 99, 99], skin=0)
    writer.document["nodes"] += [{"translation": [4, 0, 0]}, {"scale": [3, 3, 3]}]
    inverse = np.stack([np.eye(4), np.diag([2, 2, 2, 1])]).astype(np.float32)
    writer.document["skins"] = [{"joints": [1, 2], "inverseBindMatrices": writer.add(inverse)}]
    rig = read_gltf(writer.glb(tmp_path / "r.glb"))
    np.testing.assert_allclose(rig.neutral, 0.25 * (SQUARE + np.array([4, 0, 0])) + 0.75 * 6 * SQUARE, atol=1e-6)
    np.testing.assert_allclose(rig.deltas[0], (0.25 + 0.75 * 6) * LIFT, atol=1e-6)


def test_primitives_that_use_the_same_vertices_keep_one_copy(tmp_path):
    writer = Writer()
    writer.document["materials"] = [{"name": "skin"}, {"name": "lips"}]
    first = primitive(writer, corners=QUAD[:3], material=0)
    second = first | {"indices": writer.add(QUAD[3:]), "material": 1}
    writer.mesh([first, second], ["lift"], name="head")
    rig = read_gltf(writer.glb(tmp_path / "r.glb"))
    assert len(rig.neutral) == 4
    assert rig.part_names == ("head/skin", "head/lips")
    np.testing.assert_array_equal(rig.triangles, [[0, 1, 2], [0, 2, 3]])


def test_vertices_split_at_a_seam_are_welded_and_keep_their_first_number(tmp_path):
    """Same place and same motion; lips that only touch stay two."""
    writer = Writer()
    vertices, deltas = np.concatenate([SQUARE, SQUARE]), np.concatenate([LIFT, LIFT])
    deltas[4] = 5  # the twin of vertex 0 moves on its own
    corners = np.array([0, 1, 2, 4, 6, 7], np.uint16)
    writer.mesh([primitive(writer, vertices, corners, (deltas,))], ["lift"])
    rig = read_gltf(writer.glb(tmp_path / "r.glb"))
    np.testing.assert_array_equal(rig.source_index, [0, 1, 2, 3, 4])
    np.testing.assert_array_equal(rig.triangles, [[0, 1, 2], [4, 2, 3]])


def test_meshes_share_blendshapes_by_name(tmp_path):
    writer = Writer()
    writer.mesh([primitive(writer, deltas=(LIFT, 2 * LIFT))], ["a", "b"], name="head")
    writer.mesh([primitive(writer, vertices=SQUARE + 5, deltas=(3 * LIFT, 4 * LIFT))], ["b", "c"], name="tongue")
    writer.mesh([primitive(writer, vertices=SQUARE - 5, deltas=())], name="teeth")
    rig = read_gltf(writer.glb(tmp_path / "r.glb"))
    assert rig.names == ("a", "b", "c")
    assert rig.part_names == ("head", "tongue", "teeth")
    np.testing.assert_array_equal(rig.deltas[:, [2, 6, 10], 2], [[2, 0, 0], [4, 6, 0], [0, 8, 0]])
    np.testing.assert_array_equal(rig.source_index, np.arange(12))


def test_targets_without_names_are_numbered(tmp_path):
    writer = Writer()
    writer.mesh([primitive(writer, deltas=(LIFT, 2 * LIFT))])
    assert read_gltf(writer.glb(tmp_path / "r.glb")).names == ("target_0", "target_1")


@pytest.mark.parametrize(("mode", "triangles"), [(5, [[0, 1, 2], [1, 3, 2]]), (6, [[0, 1, 2], [0, 2, 3]])])
def test_strips_and_fans_are_unrolled(tmp_path, mode, triangles):
    writer = Writer()
    writer.mesh([primitive(writer, corners=np.arange(4, dtype=np.uint8), mode=mode)], ["lift"])
    np.testing.assert_array_equal(read_gltf(writer.glb(tmp_path / "r.glb")).triangles, triangles)


def test_a_text_file_with_its_buffer_inside_or_beside_reads_the_same(tmp_path):
    writer = Writer()
    writer.mesh([primitive(writer)], ["lift"])
    binary = read_gltf(writer.glb(tmp_path / "r.glb"))
    (tmp_path / "the data.bin").write_bytes(writer.data)
    for uri in ("the%20data.bin", "data:application/octet-stream;base64," + base64.b64encode(writer.data).decode()):
        document = writer.document | {"buffers": [{"byteLength": len(writer.data), "uri": uri}]}
        (tmp_path / "r.gltf").write_text(json.dumps(document))
        np.testing.assert_array_equal(read_gltf(tmp_path / "r.gltf").deltas, binary.deltas)


def test_compression_that_is_not_read_is_refused_by_its_name(tmp_path):
    writer = Writer()
    writer.mesh([primitive(writer)], ["lift"])
    writer.document["extensionsRequired"] = ["KHR_mesh_quantization", "XX_packed"]
    with pytest.raises(RigError, match="needs XX_packed, which is not read here"):
        read_gltf(writer.glb(tmp_path / "r.glb"))


def test_a_target_of_another_mesh_is_left_out_and_named(tmp_path):
    writer = Writer()
    writer.mesh([primitive(writer, deltas=(LIFT, LIFT[:3]))], ["good", "bad"])
    raw = finite(read_gltf(writer.glb(tmp_path / "r.glb")))
    assert raw.names == ("good",)
    assert raw.note.endswith("bad")


def test_a_document_cut_anywhere_is_refused_in_one_line(tmp_path):
    writer = Writer()
    writer.mesh([primitive(writer)], ["lift"])
    whole = writer.glb(tmp_path / "r.glb").read_bytes()
    for end in range(1, len(whole) - 1, 37):
        (tmp_path / "cut.glb").write_bytes(whole[:end])
        with pytest.raises(RigError, match=r"cut\.glb") as error:
            read_gltf(tmp_path / "cut.glb")
        assert "\n" not in str(error.value)


def broken(change) -> Writer:
    writer = Writer()
    writer.mesh([primitive(writer)], ["lift"])
    change(writer.document)
    return writer


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda d: d["meshes"].clear(), "refers to number 0 of 0 meshes"),
        (lambda d: d["nodes"].clear(), "no mesh with triangles"),
        (lambda d: d["accessors"][1].update(count=99), "was cut off: a buffer view has"),
        (lambda d: d["accessors"][0].update(componentType=1), "does not follow glTF 2.0"),
        (lambda d: d["bufferViews"][0].update(buffer=3), "refers to buffer 3 of 1"),
        (lambda d: d["meshes"][0]["primitives"][0].update(indices=2), "not a list of vertex numbers"),
        (lambda d: d["meshes"][0]["primitives"][0].update(mode=1), "no mesh with triangles"),
        (lambda d: d["meshes"][0]["primitives"][0].update(targets=[]), "no blendshapes found, only a neutral"),
        (lambda d: d["meshes"][0]["primitives"][0]["attributes"].clear(), "no mesh with triangles"),
        (lambda d: d["nodes"][0].update(children=[0]) or d.update(scenes=[{"nodes": [0]}]), "children of themselves"),
        (lambda d: d["buffers"][0].update(uri="gone.bin"), "needs the file 'gone.bin'"),
    ],
)
def test_documents_that_hold_no_rig_are_refused(tmp_path, change, says):
    writer = broken(lambda _: None)
    writer.glb(tmp_path / "r.glb")
    change(writer.document)
    text = json.dumps(writer.document).encode()
    chunks = struct.pack("<II", len(text), 0x4E4F534A) + text
    chunks += struct.pack("<II", len(writer.data), 0x004E4942) + writer.data
    (tmp_path / "r.glb").write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks)
    with pytest.raises(RigError, match=says):
        read_gltf(tmp_path / "r.glb")


def message(tmp_path, writer):
    """The rig of a document and what its note says."""
    rig = read_gltf(writer.glb(tmp_path / "r.glb"))
    return rig, rig.note


def test_targets_of_equal_names_are_numbered_and_told(tmp_path):
    writer = Writer()
    writer.mesh([primitive(writer, deltas=(LIFT, 2 * LIFT, 3 * LIFT, 4 * LIFT))], ["a", "a", "a 2", "a"])
    rig, note = message(tmp_path, writer)
    assert rig.names == ("a", "a 3", "a 2", "a 4")
    assert "a 3, a 4" in note
    np.testing.assert_array_equal(rig.deltas[:, 2, 2], [2, 4, 6, 8])


@pytest.mark.parametrize("basis", ["Basis", "basis", "Base", "Neutral", "Default"])
def test_the_neutral_among_the_names_is_left_out_and_told(tmp_path, basis):
    writer = Writer()
    writer.mesh([primitive(writer, deltas=(LIFT, 2 * LIFT))], [basis, "a", "b"])
    rig, note = message(tmp_path, writer)
    assert rig.names == ("a", "b")
    assert f"'{basis}'" in note


@pytest.mark.parametrize("names", [["a"], ["a", "b", "c"]])
def test_names_that_do_not_fit_are_not_dropped_in_silence(tmp_path, names):
    writer = Writer()
    writer.mesh([primitive(writer, deltas=(LIFT, 2 * LIFT))], names, name="face")
    rig, note = message(tmp_path, writer)
    assert rig.names == ("target_0", "target_1")
    assert f"face has {len(names)} name" in note


def test_names_given_once_for_each_primitive_are_the_same_names(tmp_path):
    writer = Writer()
    deltas = (LIFT, 2 * LIFT)
    writer.mesh([primitive(writer, deltas=deltas), primitive(writer, SQUARE + 5, deltas=deltas)], ["a", "b"] * 2)
    rig, note = message(tmp_path, writer)
    assert (rig.names, note) == (("a", "b"), "")


@pytest.mark.parametrize("names", [("a", "b"), ("accessor_1", "accessor_2"), ("a", "a")])
def test_data_may_be_called_after_the_blendshape(tmp_path, names):
    writer = Writer()
    p = primitive(writer, deltas=(LIFT, 2 * LIFT))
    for target, name in zip(p["targets"], names, strict=True):
        writer.document["accessors"][target["POSITION"]]["name"] = name
    writer.mesh([p])
    assert message(tmp_path, writer)[0].names == (names if names == ("a", "b") else ("target_0", "target_1"))


def test_what_a_primitive_lacks_in_targets_stands_still(tmp_path):
    writer = Writer()
    second = primitive(writer, SQUARE + 5, deltas=(5 * LIFT,))
    third = primitive(writer, SQUARE + 9, deltas=())
    del third["targets"]
    writer.mesh([primitive(writer, deltas=(LIFT, 2 * LIFT)), second, third], ["a", "b"], name="head")
    rig, note = message(tmp_path, writer)
    np.testing.assert_array_equal(rig.deltas[:, [2, 6, 10], 2], [[2, 10, 0], [4, 0, 0]])
    assert "head have 1 and 2 blendshapes" in note


def test_a_target_of_normals_alone_moves_nothing(tmp_path):
    writer = Writer()
    p = primitive(writer)
    p["targets"].append({"NORMAL": writer.add(LIFT)})
    writer.mesh([p], ["lift", "wrinkle"])
    assert not read_gltf(writer.glb(tmp_path / "r.glb")).deltas[1].any()


@pytest.mark.parametrize("owner", ["meshes", "nodes"])
def test_weights_that_are_left_on_are_told_and_the_neutral_is_without_them(tmp_path, owner):
    writer = Writer()
    writer.mesh([primitive(writer, deltas=(LIFT, 2 * LIFT))], ["a", "b"])
    writer.document[owner][0]["weights"] = [0, 0.8]
    rig, note = message(tmp_path, writer)
    assert "b at 80 %" in note
    assert "a at" not in note
    np.testing.assert_array_equal(rig.neutral, SQUARE)


@pytest.mark.parametrize("above", [False, True])
def test_a_hidden_mesh_is_left_out_and_named(tmp_path, above):
    writer = Writer()
    hidden = {"extensions": {"KHR_node_visibility": {"visible": False}}}
    writer.mesh([primitive(writer)], ["lift"], name="face")
    writer.mesh([primitive(writer, deltas=())], name="cage", **({} if above else hidden))
    if above:
        writer.document["nodes"].append({"children": [1]} | hidden)
    rig, note = message(tmp_path, writer)
    assert (rig.part_names, rig.left_out) == (("face",), ("cage",))
    assert "cage" in note


def test_a_rig_whose_only_blendshapes_are_hidden_is_still_read(tmp_path):
    writer = Writer()
    writer.mesh([primitive(writer)], ["lift"], name="face", extensions={"KHR_node_visibility": {"visible": False}})
    writer.mesh([primitive(writer, SQUARE + 9, deltas=())], name="hat")
    rig, note = message(tmp_path, writer)
    assert (rig.part_names, rig.left_out) == (("face", "hat"), ())
    assert "face" in note
