"""Folders of PLY files: the file's vertex order in every encoding, declared sizes that lie, files cut anywhere."""

import struct
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from capture_plan.errors import RigError
from capture_plan.formats.ply import read_ply_folder
from capture_plan.reader.read import read_raw

SQUARE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [9, 9, 9]], dtype=np.float32)
MOVED = SQUARE + np.array([[0, 0, 0], [0, 0, 0], [0, 0, 2], [0, 0, 0], [0, 0, 0]], dtype=np.float32)
MIXED = [[0, 1, 2], [0, 2, 3, 4]]
FORMATS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}


def ply(vertices: np.ndarray, polygons: list[list[int]], kind: str = "ascii", colours: bool = False) -> bytes:
    """A file whose vertices may be followed by colours, with an element of edges that nobody needs."""
    extra = "property uchar red\n" if colours else ""
    text = (
        f"ply\nformat {kind} 1.0\ncomment made by hand\nelement vertex {len(vertices)}\n"
        f"property float x\nproperty float y\nproperty float z\n{extra}"
        "element edge 2\nproperty short a\n"
        f"element face {len(polygons)}\nproperty list uchar int vertex_indices\nproperty double quality\nend_header\n"
    )
    if kind == "ascii":
        rows = [" ".join(map(str, row)) + (" 200" if colours else "") for row in vertices.tolist()] + ["1", "2"]
        return (text + "\n".join(rows + [f"{len(p)} {' '.join(map(str, p))} 0.5" for p in polygons]) + "\n").encode()
    order = FORMATS[kind]
    body = b"".join(struct.pack(order + "3f", *row) + (b"\xc8" if colours else b"") for row in vertices.tolist())
    body += struct.pack(order + "2h", 1, 2)
    body += b"".join(struct.pack(f"{order}B{len(p)}id", len(p), *p, 0.5) for p in polygons)
    return text.encode() + body


def write(folder: Path, **files: bytes) -> Path:
    folder.mkdir(exist_ok=True)
    for stem, data in files.items():
        (folder / f"{stem}.ply").write_bytes(data)
    return folder


@pytest.mark.parametrize("kind", FORMATS)
@pytest.mark.parametrize("colours", [False, True])
@pytest.mark.parametrize("polygons", [[[0, 1, 2], [0, 2, 3]], [[0, 1, 2, 3]], MIXED])
def test_every_encoding_gives_the_file_s_vertices_in_its_order(tmp_path, kind, colours, polygons):
    folder = write(tmp_path / "r", neutral=ply(SQUARE, polygons, kind, colours), a=ply(MOVED, polygons, kind, colours))
    rig = read_raw(folder)
    np.testing.assert_array_equal(rig.neutral, SQUARE)
    np.testing.assert_array_equal(rig.deltas[0], MOVED - SQUARE)
    fans = [[p[0], p[i], p[i + 1]] for p in polygons for i in range(1, len(p) - 1)]
    np.testing.assert_array_equal(rig.triangles, fans)
    assert rig.names == ("a",)


def test_numbered_blendshapes_are_counted_as_people_count(tmp_path):
    shapes = {f"face_{i}": ply(MOVED * np.float32(i), MIXED) for i in (10, 2, 1)}
    assert read_ply_folder(write(tmp_path / "r", neutral=ply(SQUARE, MIXED), **shapes)).names == (
        "face_1", "face_2", "face_10",
    )  # fmt: skip


def test_windows_line_ends_change_nothing(tmp_path):
    text = ply(SQUARE, MIXED).replace(b"\n", b"\r\n")
    rig = read_ply_folder(write(tmp_path / "r", neutral=text, a=ply(MOVED, MIXED, "binary_big_endian")))
    np.testing.assert_array_equal(rig.deltas[0], MOVED - SQUARE)


@pytest.mark.parametrize("kind", FORMATS)
@pytest.mark.parametrize("element", ["vertex 5", "face 2", "edge 2"])
@pytest.mark.parametrize("count", [4_000_000_000, 10**30, -1])
def test_declared_counts_that_lie_are_refused_before_anything_is_made(tmp_path, kind, element, count):
    name = element.split()[0]
    lie = ply(SQUARE, MIXED, kind).replace(f"element {element}".encode(), f"element {name} {count}".encode())
    with pytest.raises(RigError, match="declares"):
        read_ply_folder(write(tmp_path / "r", neutral=lie, a=ply(MOVED, MIXED)))


@pytest.mark.parametrize("kind", FORMATS)
def test_a_file_cut_anywhere_is_refused_in_one_line(tmp_path, kind):
    whole = ply(SQUARE, MIXED, kind)
    folder = write(tmp_path / "r", neutral=whole, a=ply(MOVED, MIXED))
    for end in range(len(whole) - (4 if kind == "ascii" else 0)):  # 0.5 cut to 0. is a number still
        (folder / "neutral.ply").write_bytes(whole[:end])
        with pytest.raises(RigError, match="neutral") as error:
            read_ply_folder(folder)
        assert "\n" not in str(error.value)


@settings(max_examples=150, deadline=None)
@given(st.sampled_from(list(FORMATS)), st.lists(st.tuples(st.integers(0, 400), st.binary(max_size=6)), max_size=4))
def test_changed_bytes_give_a_rig_or_one_line(tmp_path_factory, kind, changes):
    data = ply(SQUARE, MIXED, kind)
    for place, new in changes:
        data = data[:place] + new + data[place + len(new) :]
    folder = write(tmp_path_factory.mktemp("r"), neutral=data, a=ply(MOVED, MIXED))
    try:
        read_raw(folder)
    except RigError as error:
        assert len(str(error).splitlines()) == 1  # noqa: PT017 - many changes do no harm


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        (b"property float x", b"property float u", "no vertices with x, y and z"),
        (b"property list uchar int vertex_indices", b"property list uchar int other", "has no faces"),
        (b"3 0 1 2", b"3 0 1 7", "vertices beyond its 5"),
        (b"3 0 1 2", b"3 0 1 -1", "not lists of vertex numbers"),
        (b"format ascii", b"format morse", "does not follow the PLY format"),
        (b"format ascii 1.0\n", b"", "names no format"),
    ],
)
def test_files_that_hold_no_mesh_are_refused(tmp_path, old, new, says):
    folder = write(tmp_path / "r", neutral=ply(SQUARE, MIXED).replace(old, new), a=ply(MOVED, MIXED))
    with pytest.raises(RigError, match=says):
        read_ply_folder(folder)


@pytest.mark.parametrize("odd", [b"", b"ply\n", ply(MOVED, MIXED)[:-30], ply(MOVED[:4], [[0, 1, 2]])])
def test_one_file_that_is_no_whole_blendshape_is_left_out_and_named(tmp_path, odd):
    rig = read_ply_folder(write(tmp_path / "r", neutral=ply(SQUARE, MIXED), a=ply(MOVED, MIXED), odd=odd))
    assert rig.names == ("a",)
    assert "odd.ply" in rig.note


def test_blendshapes_of_another_mesh_are_refused(tmp_path):
    with pytest.raises(RigError, match=r"a\.ply has 4 vertices, the neutral neutral\.ply has 5"):
        read_ply_folder(write(tmp_path / "r", neutral=ply(SQUARE, MIXED), a=ply(MOVED[:4], [[0, 1, 2]])))
    with pytest.raises(RigError, match="none of 2 PLY files is called neutral"):
        read_ply_folder(write(tmp_path / "s", a=ply(SQUARE, MIXED), b=ply(MOVED, MIXED)))


@pytest.mark.parametrize("kind", FORMATS)
def test_a_blendshape_of_other_faces_is_refused(tmp_path, kind):
    """Its vertices come in another order, so that its differences from the neutral mean nothing."""
    polygons = [[0, 1, 2], [0, 2, 3]]
    order = np.array([1, 0, 2, 3, 4])
    other = ply(MOVED[order], [[int(order[i]) for i in polygon] for polygon in polygons], kind)
    with pytest.raises(RigError, match=r"smile\.ply joins its vertices into other faces than the neutral"):
        read_ply_folder(write(tmp_path / "r", neutral=ply(SQUARE, polygons, kind), smile=other))


def test_a_blendshape_without_faces_or_with_turned_ones_is_read(tmp_path):
    polygons = [[0, 1, 2], [0, 2, 3]]
    shapes = {"a": ply(MOVED, []), "b": ply(MOVED, [[2, 3, 0], [1, 2, 0]])}
    rig = read_ply_folder(write(tmp_path / "r", neutral=ply(SQUARE, polygons), **shapes))
    np.testing.assert_array_equal(rig.deltas[0], rig.deltas[1])


def test_decimal_commas_are_read(tmp_path):
    polygons = [[0, 1, 2], [0, 2, 3]]
    files = {"neutral": ply(SQUARE, polygons), "a": ply(MOVED + np.float32(0.25), polygons)}
    commas = {stem: text[:80] + text[80:].replace(b".", b",") for stem, text in files.items()}
    straight, read = (read_ply_folder(write(tmp_path / name, **some)) for name, some in (("s", files), ("r", commas)))
    np.testing.assert_array_equal(read.deltas, straight.deltas)
