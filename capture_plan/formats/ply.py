"""Rigs as a folder of PLY files, ASCII or binary: the neutral, and one file for each blendshape, called after its file.

A PLY file is a text header, which declares elements (vertex, face ...) of properties, and the rows of each element in
turn. A property is a number, or a list: its length, then that many numbers. Taken are x, y, z of the vertices, in the
file's order, and the faces' list of vertex numbers; colours, normals and other elements are passed over.
A declared count is held against the bytes that are left before anything of that size is made.
Own code, because trimesh 5.2 refuses binary files in which triangles and quads are mixed ("unexpected length").

Source: G. Turk, "The PLY Polygon File Format", 1994.
"""

import re
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from capture_plan.errors import RigError
from capture_plan.formats.neutral_file import find_neutral
from capture_plan.formats.obj import COMMA, check_same_faces, natural
from capture_plan.formats.raw import RawRig
from capture_plan.formats.shapes import Faces, rig_of_shapes
from capture_plan.input.bounds import MOST_FACES, MOST_TEXT_BYTES, check_line_sizes, content
from capture_plan.input.source import Source, is_kind

TYPES = {
    "char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4", "float": "f4",
    "double": "f8", "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4",
    "float32": "f4", "float64": "f8",
}  # fmt: skip
ORDERS = {"ascii": None, "binary_little_endian": "<", "binary_big_endian": ">"}
END = re.compile(rb"\A(.{0,65536}?)\bend_header[ \t]*(?:\r\n|\n|\r)", re.DOTALL)
CORNERS = ("vertex_indices", "vertex_index")
CUT = "was cut off or declares more than it holds: export it again"
BROKEN = "does not follow the PLY format"


@dataclass(frozen=True)
class Property:
    """A number of type `dtype` in each row, or a list of them whose length is of type `length`."""

    name: str
    dtype: str
    length: str | None


@dataclass(frozen=True)
class Element:
    """`count` rows of equal properties."""

    name: str
    count: int
    properties: tuple[Property, ...]


_Column = tuple[np.ndarray, np.ndarray]  # lengths of a property in each row (1 unless a list), its numbers in a row
_Table = dict[str, _Column]


def read_ply_folder(folder: Source) -> RawRig:
    """The rig in `folder`; unit and axes are unknown. RigError when the files do not make one rig."""
    paths = sorted((path for path in folder.iterdir() if is_kind(path, ".ply")), key=natural)
    neutral, message = find_neutral(folder, paths, read_vertices)
    shapes = [path for path in paths if path != neutral]
    return rig_of_shapes(
        folder, neutral, shapes, read_faces(neutral), read_vertices, check_shape_faces, message=message
    )


def read_vertices(path: Source) -> Float[np.ndarray, "v 3"]:
    """Places of all vertices, in the file's order."""
    table = read_ply(path).get("vertex", {})
    if not {"x", "y", "z"} <= set(table):
        raise RigError(f"{path.name} has no vertices with x, y and z: export it again")
    with np.errstate(all="ignore"):
        return np.stack([table[axis][1].astype(np.float64) for axis in "xyz"], axis=1)


def check_shape_faces(faces: Faces, neutral: Source, path: Source) -> None:
    """RigError unless the blendshape at `path` joins its vertices as the neutral does, or has no faces at all."""
    table = read_ply(path).get("face", {})
    if any(len(table[name][0]) for name in CORNERS if name in table):
        found = read_faces(path)
        if found.sizes.min() < 1:
            raise RigError(f"{path.name} has faces without corners: it is damaged, export it again")
        check_same_faces(faces, neutral, found, path)


def read_faces(path: Source) -> Faces:
    """The polygons of a file, all of one part."""
    tables = read_ply(path)
    found = next((tables["face"][name] for name in CORNERS if name in tables.get("face", {})), None)
    if found is None:
        advice = "triangle strips: export triangles" if "tristrips" in tables else "no faces: export it with its faces"
        raise RigError(f"{path.name} has {advice}")
    sizes, corners = found
    if corners.dtype.kind == "f" or (corners.size and not 0 <= corners.min() <= corners.max() < 2**31):
        raise RigError(f"{path.name} has faces that are not lists of vertex numbers: export it again")
    return Faces(corners.astype(np.int32), sizes.astype(np.int32), np.zeros(len(sizes), np.int32), ("mesh",))


def read_ply(path: Source) -> dict[str, _Table]:
    """Every element's properties. RigError when the file is none, or was cut off."""
    try:
        data = content(path, MOST_TEXT_BYTES)
    except OSError as error:
        raise RigError(f"{path.name} cannot be read ({error.strerror}): check the file and its permissions") from error
    match = END.match(data)
    if not data.startswith(b"ply") or not match:
        raise RigError(f"{path.name} is not a PLY file, or its header was cut off: export it again")
    try:
        order, elements = parse_header(match[1].decode("ascii", errors="replace"))
        body = data[match.end() :]
        if order is None:
            check_line_sizes(body, "")
            return read_text(body, elements)
        return _read_binary(body, elements, order)
    except RigError as error:
        raise RigError(f"{path.name} {error}") from error
    except (ValueError, KeyError, IndexError, OverflowError) as error:
        found = " ".join(str(error).split())[:100]
        raise RigError(f"{path.name} {BROKEN} ({found}): export it again") from error


def parse_header(text: str) -> tuple[str | None, list[Element]]:
    """Byte order, None for text, and the elements in their order."""
    order, elements = "", []
    for words in (line.split() for line in text.splitlines()[1:]):
        if not words or words[0] in ("comment", "obj_info"):
            continue
        if words[0] == "format":
            order = ORDERS[words[1]]
        elif words[0] == "element":
            elements.append(Element(words[1], int(words[2]), ()))
            if elements[-1].count < 0:
                raise RigError(f"declares {words[2]} of {words[1]}: export it again")
        elif words[0] == "property":
            if words[1] == "list":
                found = Property(words[4], TYPES[words[3]], TYPES[words[2]])
            else:
                found = Property(words[2], TYPES[words[1]], None)
            last = elements.pop()
            elements.append(Element(last.name, last.count, (*last.properties, found)))
        else:
            raise RigError(f"{BROKEN}: its header says {words[0][:40]!r}: export it again")
    if order == "":
        raise RigError(f"{BROKEN}: its header names no format: export it again")
    return order, elements


def read_text(body: bytes, elements: list[Element]) -> dict[str, _Table]:
    """Elements of an ASCII file: numbers parted by any white space."""
    if b"," in body and b"." not in body:  # decimal commas
        body = COMMA.sub(b".", body)
    words = (match[0] for match in re.finditer(rb"\S+", body))
    numbers, at, tables = np.fromiter(map(float, words), np.float64), 0, {}
    for element in elements:
        if element.count * len(element.properties) > len(numbers) - at:
            raise RigError(CUT)
        lists = [p.length is not None for p in element.properties]
        sizes = np.ones((element.count, len(lists)), np.int64)
        starts = np.zeros_like(sizes)
        if not any(lists):
            starts = at + np.arange(sizes.size).reshape(sizes.shape)
            at += sizes.size
        else:
            _check_faces(element)
            for row in range(element.count):
                for column, is_list in enumerate(lists):
                    if is_list:
                        sizes[row, column], at = _whole(numbers[at]), at + 1
                    starts[row, column] = at
                    at += int(sizes[row, column])
                if at > len(numbers):
                    raise RigError(CUT)
        tables[element.name] = {
            p.name: (sizes[:, i], cast(numbers[ranges(starts[:, i], sizes[:, i])], p))
            for i, p in enumerate(element.properties)
        }
    return tables


def _check_faces(element: Element) -> None:
    """RigError where there are more lists than are read one by one."""
    if element.count > MOST_FACES:
        message = f"{element.count:,} of {element.name[:40]}, of which at most {MOST_FACES:,} are read"
        raise RigError(f"has {message}: triangulate it, and export it as binary")


def _whole(number: float) -> int:
    """The length of a list as a whole number."""
    if not 0 <= number < 2**31 or number != int(number):
        raise RigError(CUT)
    return int(number)


def cast(numbers: Float[np.ndarray, " n"], p: Property) -> np.ndarray:
    """Numbers of a text as what the header calls them: whole ones as integers."""
    if p.dtype[0] == "f":
        return numbers
    if not np.isfinite(numbers).all() or (numbers != np.floor(numbers)).any() or np.abs(numbers).max(initial=0) > 2**32:
        raise RigError(f"{BROKEN}: {p.name[:40]} holds no whole numbers: export it again")
    return numbers.astype(np.int64)


def ranges(starts: np.ndarray, sizes: np.ndarray) -> np.ndarray:
    """start, start + 1, ... of each row, all in a row."""
    before = np.cumsum(sizes) - sizes
    return np.repeat(starts - before, sizes) + np.arange(int(sizes.sum()))


def _read_binary(body: bytes, elements: list[Element], order: str) -> dict[str, _Table]:
    """Elements of a binary file."""
    at, tables = 0, {}
    for element in elements:
        properties = element.properties
        least = sum(np.dtype(p.length or p.dtype).itemsize for p in properties)
        if element.count * least > len(body) - at:
            raise RigError(CUT)
        if element.count == 0 or not properties:
            tables[element.name] = {p.name: (np.zeros(0, np.int64), np.zeros(0, p.dtype)) for p in properties}
            continue
        found = even_rows(body, at, element, order) or uneven_rows(body, at, element, order)
        tables[element.name], at = found
    return tables


def even_rows(body: bytes, at: int, element: Element, order: str) -> tuple[_Table, int] | None:
    """An element whose lists are all as long as in its first row, and where the next one starts; None for others."""
    fields, sizes, place = [], [], at
    for i, p in enumerate(element.properties):
        size = 1
        if p.length:
            size = list_length(body, place, order + p.length)
            fields.append((f"n{i}", order + p.length))
        if not 0 <= size <= len(body):
            raise RigError(CUT)
        fields.append((f"p{i}", order + p.dtype, (size,)))
        place += np.dtype(fields[-1][1]).itemsize * size + (np.dtype(p.length).itemsize if p.length else 0)
        sizes.append(size)
    dtype = np.dtype(fields)
    if element.count * dtype.itemsize > len(body) - at:
        return None
    rows = np.frombuffer(body, dtype, element.count, at)
    if any((rows[f"n{i}"] != sizes[i]).any() for i, p in enumerate(element.properties) if p.length):
        return None
    table = {
        p.name: (np.full(element.count, sizes[i], np.int64), rows[f"p{i}"].ravel())
        for i, p in enumerate(element.properties)
    }
    return table, at + element.count * dtype.itemsize


def uneven_rows(body: bytes, at: int, element: Element, order: str) -> tuple[_Table, int]:
    """The rows of an element, one list at a time, for triangles mixed with quads."""
    _check_faces(element)
    sizes = {p.name: [] for p in element.properties}
    pieces = {p.name: [] for p in element.properties}
    for _ in range(element.count):
        for p in element.properties:
            size = 1
            if p.length:
                size = list_length(body, at, order + p.length)
                at += np.dtype(p.length).itemsize
            width = np.dtype(p.dtype).itemsize
            if size < 0 or at + size * width > len(body):
                raise RigError(CUT)
            sizes[p.name].append(size)
            pieces[p.name].append(body[at : at + size * width])
            at += size * width
    return {
        p.name: (np.array(sizes[p.name]), np.frombuffer(b"".join(pieces[p.name]), order + p.dtype))
        for p in element.properties
    }, at


def list_length(body: bytes, at: int, dtype: str) -> int:
    """The length that stands at this place."""
    if at + np.dtype(dtype).itemsize > len(body):
        raise RigError(CUT)
    return int(np.frombuffer(body, dtype, 1, at)[0])
