"""FBX files that lie: cut off anywhere, any byte changed, asking for more than they have: one line, little memory."""

import struct
import tracemalloc
import zlib

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from capture_plan.errors import RigError
from capture_plan.formats import fbx_file
from capture_plan.formats.fbx import read_fbx
from capture_plan.formats.fbx_file import Packed, read_tree
from capture_plan.formats.scene import check_room
from tests.fbx_files import MESH, ascii_text, binary, head, node, scene

TREE = scene(*head(), UnitScaleFactor=1.0, UpAxis=1, FrontAxis=2, CoordAxis=0)
FILES = {"narrow": binary(TREE, 7400), "wide": binary(TREE, 7500), "ascii": ascii_text(TREE)}


def outcome(path, data):
    """The rig, or the one line that refuses the file."""
    path.write_bytes(data)
    try:
        return read_fbx(path)
    except RigError as error:
        line = str(error)
    assert line.startswith(path.name)
    assert len(line.splitlines()) == 1
    return line


@pytest.mark.parametrize("form", FILES)
def test_a_file_cut_off_at_any_byte_is_refused_or_whole(tmp_path, form):
    data = FILES[form]
    whole, retained = read_fbx(tmp_path / "r.fbx") if outcome(tmp_path / "r.fbx", data) else None, 0
    for length in range(len(data)):
        found = outcome(tmp_path / "r.fbx", data[:length])
        if not isinstance(found, str):  # nothing that matters was cut off: the footer, or the last links
            retained += 1
            np.testing.assert_array_equal(found.deltas, whole.deltas)
            np.testing.assert_array_equal(found.triangles, whole.triangles)
    assert retained < 0.05 * len(data)


@settings(max_examples=300, deadline=None)
@given(
    form=st.sampled_from(sorted(FILES)),
    changes=st.lists(st.tuples(st.integers(0, 10**6), st.binary(max_size=6)), min_size=1, max_size=4),
)
def test_a_damaged_file_gives_a_rig_or_one_line(tmp_path_factory, form, changes):
    data = bytearray(FILES[form])
    for at, new in changes:
        at %= len(data)
        data[at : at + len(new)] = new
    outcome(tmp_path_factory.getbasetemp() / "mutated.fbx", bytes(data))


def refused_cheaply(tmp_path, data, says, megabytes=20):
    """The file is refused, and without more memory than a small file deserves."""
    tracemalloc.start()
    try:
        assert says in outcome(tmp_path / "r.fbx", data)
        assert tracemalloc.get_traced_memory()[1] < megabytes * 1e6
    finally:
        tracemalloc.stop()


def test_four_billion_vertices_in_a_small_file_are_refused_before_anything_is_allocated(tmp_path):
    data = FILES["narrow"].replace(struct.pack("<III", 12, 1, 0)[:8], struct.pack("<II", 2**32 - 1, 1), 1)
    assert data != FILES["narrow"]
    refused_cheaply(tmp_path, data, "bytes of numbers but has only")
    text = FILES["ascii"].replace(b"*12 {", b"*4000000000 {", 1)
    refused_cheaply(tmp_path, text, "bytes of numbers but has only")
    refused_cheaply(tmp_path, FILES["ascii"].replace(b"*12 {", b"*" + b"9" * 5000 + b" {", 1), "bytes of numbers")


def test_a_zlib_bomb_is_unpacked_no_further_than_it_declares():
    bomb = memoryview(zlib.compress(bytes(50_000_000)))
    tracemalloc.start()
    try:
        assert len(Packed(10, "<f8", bomb, True).unpack()) == 10
        assert tracemalloc.get_traced_memory()[1] < 1e6
    finally:
        tracemalloc.stop()


def test_all_arrays_together_have_a_bound(tmp_path, monkeypatch):
    monkeypatch.setattr(fbx_file, "ROOM", 1000)
    many = [node("Vertices", np.zeros(10_000)) for _ in range(100)]
    refused_cheaply(tmp_path, binary([node("Objects", children=many)]), "declares 8,000,000 bytes of numbers")


def test_an_array_of_fewer_numbers_than_declared_was_cut_off():
    for packed in (Packed(4, "", memoryview(b"1,2,3")), Packed(4, "<i4", memoryview(bytes(12)))):
        with pytest.raises(RigError, match="an array has 3 numbers, expected 4"):
            packed.unpack()


@pytest.mark.parametrize("write", [binary, ascii_text])
def test_nodes_within_nodes_end_somewhere(tmp_path, write):
    deep = node("a")
    for _ in range(70):
        deep = node("a", children=[deep])
    refused_cheaply(tmp_path, write([deep]), "nodes more than 64 levels deep")
    refused_cheaply(tmp_path, b"; FBX\n" + b"a: {" * 100_000, "nodes more than 64 levels deep")


@pytest.mark.parametrize("data", [b"", b"\0" * 99, b"; FBX\n" + b";" * 100_000, b'; FBX\na: "' + b"x" * 10**6, b"}"])
def test_text_that_makes_no_sense_is_refused_at_once(tmp_path, data):
    assert isinstance(outcome(tmp_path / "r.fbx", data), str)


def test_records_may_not_reach_beyond_their_parent():
    data = bytearray(binary([node("a", children=[node("b", 1)])]))
    inner = 27 + 13 + 1
    data[inner : inner + 4] = struct.pack("<I", len(data) - 1)
    with pytest.raises(RigError, match="was cut off: a record ends at byte"):
        read_tree(bytes(data))


def test_blendshapes_that_would_not_fit_in_memory_are_refused():
    check_room(300, 500_000)
    with pytest.raises(RigError, match=r"has 2,000 blendshapes of 500,000 vertices, which is more than 2 GB"):
        check_room(2000, 500_000)


def test_links_to_nothing_are_no_links(tmp_path):
    pieces = [([], [(99, MESH), (MESH, 98), (97, 96)]), *head()]
    assert not isinstance(outcome(tmp_path / "r.fbx", binary(scene(*pieces))), str)
