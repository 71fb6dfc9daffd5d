"""A small FBX writer for tests: the same tree as a binary file of either header width, or as ASCII."""

import struct
import zlib

import numpy as np

from capture_plan.formats.fbx_file import MAGIC

CODES = {"f4": b"f", "f8": b"d", "i4": b"i", "i8": b"l"}
TETRAHEDRON = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
FACES = [0, 2, -2, 0, 1, -4, 0, 3, -3, 1, 2, -4]  # ~i ends a triangle
LIFT = ([3], [[0, 0, 2.0]])
MESH, HEAD = 10, 1


def node(name, *values, children=()):
    return (name, values, list(children))


def p(name, *values):
    return node("P", name, "", "", "", *values)


def props(**values):
    """Properties70; `Lcl_Scaling` stands for "Lcl Scaling"."""
    rows = [p(name.replace("_", " "), *np.atleast_1d(value).tolist()) for name, value in values.items()]
    return node("Properties70", children=rows)


def binary(tree, version=7400, compress=True) -> bytes:
    """A binary file; 64-bit record headers from version 7500 on."""
    header = struct.Struct("<QQQB" if version >= 7500 else "<IIIB")

    def pack(value) -> bytes:
        if isinstance(value, np.ndarray):
            data = value.astype(value.dtype.newbyteorder("<")).tobytes()
            packed = zlib.compress(data) if compress else data
            return CODES[value.dtype.str[1:]] + struct.pack("<III", value.size, compress, len(packed)) + packed
        if isinstance(value, str):
            kind, mark, name = value.partition("::")
            data = (name + "\0\1" + kind if mark else value).encode()
            return b"S" + struct.pack("<I", len(data)) + data
        return b"L" + struct.pack("<q", value) if isinstance(value, int) else b"D" + struct.pack("<d", value)

    def record(item, start: int) -> bytes:
        name, values, children = item
        packed = b"".join(pack(value) for value in values)
        head = header.size + len(name) + len(packed)
        inner = b""
        for child in children:
            inner += record(child, start + head + len(inner))
        inner += bytes(header.size) if children else b""
        return header.pack(start + head + len(inner), len(values), len(packed), len(name)) + (
            name.encode() + packed + inner
        )

    data = MAGIC + b"\x1a\0" + struct.pack("<I", version)
    for item in tree:
        data += record(item, len(data))
    return data + bytes(header.size) + b"footer"


def ascii_text(tree, version=7400) -> bytes:
    """The same tree as text."""

    def show(value) -> str:
        if isinstance(value, np.ndarray):
            return f"*{value.size} {{\n a: {','.join(repr(x) for x in value.ravel().tolist())}\n}}"
        return f'"{value}"' if isinstance(value, str) else repr(value)

    def lines(item, depth: int):
        name, values, children = item
        tail = " {" if children else ""
        yield "\t" * depth + f"{name}: {', '.join(show(value) for value in values)}{tail}"
        for child in children:
            yield from lines(child, depth + 1)
        if children:
            yield "\t" * depth + "}"

    head = node("FBXHeaderExtension", children=[node("FBXVersion", version)])
    text = "\n".join(line for item in [head, *tree] for line in lines(item, 0))
    return f"; FBX {version // 1000} project file\n; ---\n\n{text}\n".encode()


def mesh(number, vertices=TETRAHEDRON, faces=FACES, name="", materials=None):
    layers = [] if materials is None else [node("LayerElementMaterial", 0, children=[node("Materials", materials)])]
    arrays = [node("Vertices", np.ravel(vertices).astype("f8")), node("PolygonVertexIndex", np.array(faces, "i4"))]
    return node("Geometry", number, f"Geometry::{name}", "Mesh", children=arrays + layers)


def model(number, name, kind="Mesh", **properties):
    return node("Model", number, f"Model::{name}", kind, children=[props(**properties)])


def channel(number, name, shapes, deformer=20, weights=None):
    """A blend shape channel with its shapes [(indices, values)], and its links."""
    weights = np.array([100.0] if weights is None else weights)
    objects = [
        node("Deformer", number, f"SubDeformer::{name}", "BlendShapeChannel", children=[node("FullWeights", weights)])
    ]
    links = [(number, deformer)]
    for i, (indices, values) in enumerate(shapes):
        arrays = [node("Indexes", np.array(indices, "i4")), node("Vertices", np.ravel(values).astype("f8"))]
        objects.append(node("Geometry", number + 1 + i, f"Geometry::{name}", "Shape", children=arrays))
        links.append((number + 1 + i, number))
    return objects, links


def deformer(number, mesh_number, name="shapes"):
    return [node("Deformer", number, f"Deformer::{name}", "BlendShape")], [(number, mesh_number)]


def scene(*pieces, **settings):
    """A file's tree of objects and links [(objects, links), ...]."""
    objects = [item for items, _ in pieces for item in items]
    links = [node("C", "OO", a, b) for _, pairs in pieces for a, b in pairs]
    return [
        node("GlobalSettings", children=[props(**settings)]),
        node("Objects", children=objects),
        node("Connections", children=links),
    ]


def head(*shapes, mesh_node=None, **properties):
    """A tetrahedron on a node with one deformer; without channels given, one that lifts a corner."""
    pieces = [([mesh_node or mesh(MESH), model(HEAD, "head", **properties)], [(HEAD, 0), (MESH, HEAD)])]
    return [*pieces, deformer(20, MESH), *(shapes or [channel(30, "shapes.lift", [LIFT])])]
