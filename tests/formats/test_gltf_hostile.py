"""glTF files that lie, loop or are broken: one line, before memory is taken, and nothing outside their folder."""

import copy
import json
import struct
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from capture_plan.errors import RigError
from capture_plan.formats import gltf, gltf_file
from capture_plan.formats.gltf import read_gltf
from capture_plan.formats.raw import legible
from tests.formats.test_gltf import LIFT, QUAD, SQUARE, Writer, primitive
from tests.formats.test_meshopt import pack, pack_triangles

BILLIONS = 4_000_000_000


def written(change=lambda document: None) -> Writer:
    """A skinned, packed, sparse little rig: one of everything."""
    writer = Writer()
    p = primitive(writer, deltas=(LIFT, 2 * LIFT), sparse=True)
    p["attributes"] |= {
        "JOINTS_0": writer.add(np.zeros((4, 4), np.uint8)),
        "WEIGHTS_0": writer.add(np.tile(np.array([1, 0, 0, 0], np.float32), (4, 1))),
    }
    writer.mesh([p], ["a", "b"], skin=0, name="head")
    writer.mesh([packed(writer)], ["c"], name="tongue")
    inverse = np.eye(4, dtype=np.float32)[None]
    writer.document["nodes"] += [{"children": [0, 1, 3]}, {"translation": [1, 0, 0]}]
    writer.document["skins"] = [{"joints": [3], "inverseBindMatrices": writer.add(inverse)}]
    writer.document |= {"scenes": [{"nodes": [2]}], "scene": 0}
    change(writer.document)
    return writer


def packed(writer: Writer) -> dict:
    """A primitive whose arrays are all packed, quantised to 16 bits."""
    vertices = np.concatenate([SQUARE, np.zeros((4, 1))], axis=1).astype("<i2")
    lift = np.concatenate([LIFT, np.zeros((4, 1))], axis=1).astype("<i2")
    faces = [(0, 1, 2), (0, 2, 3)]
    accessors = []
    for data, mode, count, stride, kind in (
        (pack(vertices.view(np.uint8)), "ATTRIBUTES", 4, 8, {"componentType": 5122, "type": "VEC3", "count": 4}),
        (pack(lift.view(np.uint8), 1, 1), "ATTRIBUTES", 4, 8, {"componentType": 5122, "type": "VEC3", "count": 4}),
        (pack_triangles(faces), "TRIANGLES", 6, 2, {"componentType": 5123, "type": "SCALAR", "count": 6}),
    ):
        view = writer.view(np.frombuffer(data, np.uint8))
        place = {"buffer": 0, "byteOffset": writer.document["bufferViews"][view]["byteOffset"]}
        how = place | {"byteLength": len(data), "byteStride": stride, "count": count, "mode": mode}
        writer.document["bufferViews"][view] = {
            "buffer": 1, "byteLength": count * stride, "extensions": {"EXT_meshopt_compression": how},
        }  # fmt: skip
        writer.document["accessors"].append(kind | {"bufferView": view})
        accessors.append(len(writer.document["accessors"]) - 1)
    writer.document["extensionsRequired"] = ["KHR_mesh_quantization", "EXT_meshopt_compression"]
    return {"attributes": {"POSITION": accessors[0]}, "targets": [{"POSITION": accessors[1]}], "indices": accessors[2]}


def glb(path: Path, writer: Writer) -> Path:
    """As `Writer.glb`, for documents that hold NaN."""
    writer.document["buffers"] = [{"byteLength": len(writer.data)}, {"byteLength": 99_999}]
    text = json.dumps(writer.document, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<II", len(text), 0x4E4F534A) + text
    chunks += struct.pack("<II", len(writer.data), 0x004E4942) + writer.data
    path.write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks)
    return path


def refuse(path: Path) -> str:
    with pytest.raises(RigError, match=path.stem) as error:
        read_gltf(path)
    assert len(str(error.value).splitlines()) == 1
    assert len(str(error.value)) < 500
    return str(error.value)


def test_the_rig_that_is_broken_below_is_whole(tmp_path):
    rig = read_gltf(glb(tmp_path / "r.glb", written()))
    assert rig.names == ("a", "b", "c")
    np.testing.assert_array_equal(rig.neutral, np.concatenate([SQUARE + np.array([1, 0, 0]), SQUARE]))
    np.testing.assert_array_equal(rig.deltas[2, 4:], LIFT)
    np.testing.assert_array_equal(rig.triangles[2:], QUAD.reshape(2, 3) + 4)


def packing(document: dict, view: int) -> dict:
    """How the view that the accessor `view` from the end uses is packed."""
    number = document["accessors"][-view - 1]["bufferView"]
    return document["bufferViews"][number]["extensions"]["EXT_meshopt_compression"]


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda d: d["accessors"][0].update(count=BILLIONS), "more than fit"),
        (lambda d: d["accessors"][1].update(count=BILLIONS), "more than fit"),
        (lambda d: d["accessors"][4].update(count=BILLIONS), "was cut off"),
        (lambda d: d["accessors"][0].update(count=-1), "expected a whole number"),
        (lambda d: d["accessors"][0].update(count=4.0), "expected a whole number"),
        (lambda d: d["accessors"][0].update(count=True), "expected a whole number"),
        (lambda d: d["accessors"][0].update(byteOffset=-12), "expected a whole number"),
        (lambda d: d["bufferViews"][0].update(byteStride=0), "0 bytes apart"),
        (lambda d: d["bufferViews"][0].update(byteStride=1), "1 bytes apart"),
        (lambda d: d["bufferViews"][0].update(byteLength=BILLIONS), "was cut off"),
        (lambda d: d["bufferViews"][0].update(byteLength=8), "was cut off"),
        (lambda d: packing(d, 3).update(count=BILLIONS), "which cannot be"),
        (lambda d: packing(d, 1).update(count=3 * BILLIONS), "which cannot be"),
        (lambda d: packing(d, 3).update(byteStride=0), "which cannot be"),
        (lambda d: packing(d, 3).update(byteStride=10**9), "which cannot be"),
        (lambda d: packing(d, 3).update(mode="MAGIC"), "which cannot be"),
        (lambda d: packing(d, 3).update(filter="MAGIC"), "filter 'MAGIC'"),
        (lambda d: packing(d, 3).update(count=5), "which cannot be"),
        (lambda d: d["nodes"][3].update(children=[2]), "children of themselves"),
        (lambda d: d["nodes"][3].update(children=[0]), "two parents"),
        (lambda d: d["nodes"][3].update(children=[99]), "does not follow glTF|refers to number 99"),
        (lambda d: d["scenes"][0].update(nodes=[2, 0]), "shows a node twice"),
        (lambda d: d["nodes"][2].update(translation=[float("nan"), 0, 0]), "NaN, infinity"),
        (lambda d: d["nodes"][2].update(scale=[1e308, 1e308, 1e308]), "NaN, infinity|NaN or infin"),
        (lambda d: d["nodes"][2].update(matrix=[1, 2]), "no whole matrix"),
        (lambda d: d["skins"][0].update(joints=[77]), "does not follow glTF"),
        (lambda d: d["skins"][0].update(joints=[]), "does not follow glTF"),
        (lambda d: d["meshes"][0]["primitives"][0].update(targets=[{"POSITION": 0}] * 9 + [{}]), "more than fit"),
        (lambda d: d.update(nodes={}), "refers to number 2 of 0 nodes"),
        (lambda d: d.update(meshes="text"), "glTF|refers to"),
    ],
)
def test_documents_that_lie_are_refused_before_memory_is_taken(tmp_path, monkeypatch, change, says):
    monkeypatch.setattr(gltf, "MOST_DISPLACEMENTS", 80)  # of 24 + 8
    path = glb(tmp_path / "r.glb", written(change))
    tracemalloc.start()
    message = refuse(path)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert any(word in message for word in says.split("|")), message
    assert peak < 20_000_000


@pytest.mark.parametrize(
    ("change", "name", "says"),
    [
        (lambda d: d["accessors"][2].update(count=BILLIONS), "a", "does not hold"),
        (lambda d: d["accessors"][2]["sparse"].update(count=BILLIONS), "a", "was cut off"),
        (lambda d: packing(d, 2).update(count=BILLIONS), "c", "which cannot be"),
    ],
)
def test_morph_targets_that_lie_are_nowhere_and_named_before_memory_is_taken(tmp_path, change, name, says):
    path = glb(tmp_path / "r.glb", written(change))
    tracemalloc.start()
    rig = read_gltf(path)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert [bool(np.isnan(delta).any()) for delta in rig.deltas] == [own == name for own in rig.names]
    assert any(
        message.startswith("broken blendshapes") and says in message and f" {name} " in message
        for message in rig.note.split(";")
    )
    assert peak < 20_000_000


def test_packed_views_that_cannot_be_unpacked_are_tried_once_and_only_a_few_of_them(tmp_path, monkeypatch):
    tried = []

    def decode(*given):
        tried.append(given)
        raise RigError("is torn")

    monkeypatch.setattr(gltf_file.meshopt, "decode", decode)
    writer = Writer()
    writer.mesh([primitive(writer, deltas=(LIFT,))], ["lift"], name="face")
    hats = [packed(writer) for _ in range(gltf_file.MOST_TORN + 4)]
    for hat in hats:
        writer.mesh([hat], ["lift"], name="hat")
        writer.mesh([hat], ["lift"], name="same hat")
    with pytest.raises(RigError, match=r"is torn|cannot be unpacked"):
        read_gltf(glb(tmp_path / "r.glb", writer))
    assert len(tried) == gltf_file.MOST_TORN


def test_a_file_of_200_bytes_that_declares_4_billion_vertices_is_refused(tmp_path):
    accessor = {"componentType": 5126, "type": "VEC3", "count": BILLIONS}
    document = {
        "accessors": [accessor], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
    }  # fmt: skip
    path = tmp_path / "r.gltf"
    path.write_text(json.dumps(document, separators=(",", ":")))
    assert path.stat().st_size < 200
    assert "4,000,000,000 vertices" in refuse(path)


def test_one_mesh_shown_many_times_is_counted_each_time(tmp_path, monkeypatch):
    writer = Writer()
    writer.mesh([primitive(writer)], ["lift"])
    writer.document["nodes"] *= 20
    monkeypatch.setattr(gltf, "MOST_CORNERS", 100)
    assert "120 corners" in refuse(writer.glb(tmp_path / "r.glb"))


@pytest.mark.parametrize(
    "uri",
    [
        "../secret.bin", "a/../../secret.bin", "%2e%2e/secret.bin", "/etc/passwd", "http://example.org/a.bin",
        "file:///etc/passwd", "C:\\secret.bin", "..\\secret.bin", "//host/share.bin", "a%00.bin",
    ],
)  # fmt: skip
def test_addresses_outside_the_folder_are_never_opened(tmp_path, uri):
    (tmp_path / "inner").mkdir()
    (tmp_path / "secret.bin").write_bytes(bytes(1000))
    writer = Writer()
    writer.mesh([primitive(writer)], ["lift"])
    document = writer.document | {"buffers": [{"byteLength": len(writer.data), "uri": uri}]}
    (tmp_path / "inner" / "r.gltf").write_text(json.dumps(document))
    assert "outside its folder and is not read" in refuse(tmp_path / "inner" / "r.gltf")


def test_what_a_file_says_of_itself_cannot_write_on_the_screen(tmp_path):
    writer = Writer()
    writer.mesh([primitive(writer, deltas=(LIFT, LIFT))], ["\x1b[2J\nred", "\x1b[2J\nred"])
    assert read_gltf(writer.glb(tmp_path / "r.glb")).note.isprintable()
    writer = Writer()
    writer.mesh([primitive(writer, deltas=(LIFT, LIFT))], ["lift", "drop"])
    binds = [{"mesh": 0, "index": 0, "weight": 100}]
    groups = [{"name": "\x1b[2J\nred", "presetName": "unknown", "binds": binds}]
    writer.document["extensions"] = {"VRM": {"blendShapeMaster": {"blendShapeGroups": groups}}}
    note = legible(read_gltf(writer.glb(tmp_path / "r.vrm"))).note
    assert "red = lift" in note
    assert note.isprintable()


def test_deep_documents_and_deep_scenes(tmp_path):
    path = tmp_path / "r.gltf"
    path.write_text('{"nodes":' + "[" * 100_000 + "]" * 100_000 + "}")
    refuse(path)
    writer = Writer()
    writer.mesh([primitive(writer)], ["lift"])
    writer.document["nodes"] += [{"children": [i]} for i in range(5000)]
    read_gltf(writer.glb(tmp_path / "deep.glb"))  # a deep chain is no error


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_a_neutral_with_nan_or_infinity_is_refused(tmp_path, bad):
    writer, vertices = Writer(), SQUARE.copy()
    vertices[1, 1] = bad
    writer.mesh([primitive(writer, vertices, deltas=(LIFT,))], ["lift"])
    assert "holds NaN or infinite coordinates" in refuse(writer.glb(tmp_path / "r.glb"))


def test_a_file_cut_at_any_byte_is_refused_in_one_line(tmp_path):
    whole = glb(tmp_path / "whole.glb", written()).read_bytes()
    for end in range(len(whole)):
        (tmp_path / "r.glb").write_bytes(whole[:end])
        refuse(tmp_path / "r.glb")
        if end % 61 == 0 and end > 12:  # and one whose header agrees with the cut
            (tmp_path / "r.glb").write_bytes(whole[:8] + struct.pack("<I", end) + whole[12:end])
            refuse(tmp_path / "r.glb")


WILD = st.sampled_from(
    [None, -1, 0, 1, 3, 7, 2**31, 2**32, 10**30, 0.5, float("nan"), "", "x", "VEC3", [], {}, [0], [[0]], {"a": 1}, True]
)


def places(value, path=()):
    """Every place in a document."""
    if path:
        yield path
    for key, inner in value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ():
        yield from places(inner, (*path, key))


DOCUMENT = written().document
PLACES = list(places(DOCUMENT))


@settings(max_examples=250, deadline=None)
@given(st.lists(st.tuples(st.sampled_from(PLACES), WILD), min_size=1, max_size=3))
def test_any_wild_value_anywhere_gives_a_rig_or_one_line(tmp_path_factory, changes):
    writer = written()
    writer.document = copy.deepcopy(DOCUMENT)
    for path, value in changes:
        inner = writer.document
        try:
            for key in path[:-1]:
                inner = inner[key]
            inner[path[-1]] = value
        except (KeyError, IndexError, TypeError):
            continue
    read_or_refuse(glb(tmp_path_factory.mktemp("r") / "r.glb", writer))


@settings(max_examples=250, deadline=None)
@given(st.lists(st.tuples(st.floats(0, 1), st.binary(min_size=1, max_size=4)), min_size=1, max_size=4))
def test_any_changed_bytes_give_a_rig_or_one_line(tmp_path_factory, changes):
    path = glb(tmp_path_factory.mktemp("r") / "r.glb", written())
    data = path.read_bytes()
    for share, new in changes:
        place = int(share * (len(data) - 1))
        data = data[:place] + new + data[place + len(new) :]
    path.write_bytes(data)
    read_or_refuse(path)


def read_or_refuse(path: Path) -> None:
    try:
        read_gltf(path)
    except RigError as error:
        assert len(str(error).splitlines()) == 1  # noqa: PT017 - many changes do no harm
        assert len(str(error)) < 500  # noqa: PT017
