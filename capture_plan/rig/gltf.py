"""Rigs as plain glTF 2.0: a `.glb`, or a `.gltf` with its buffers beside it, with named morph targets.

Every mesh of the scene, placed by its nodes (or its skin's joints), becomes a part; blendshapes of equal name are one.
glTF splits a vertex where texture or shading breaks; vertices of a mesh that share their place and all their motion are
welded again. A vertex is called by its number in the file, all primitives counted in a row.
Own code of JSON and NumPy, because trimesh drops morph targets and pygltflib leaves accessors, sparse ones too, undone.

Letters: v vertices, f triangles, k blendshapes, j joints. Sections are those of the glTF 2.0 specification.
"""

import base64
import json
import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np
from jaxtyping import Float, Int
from scipy.spatial.transform import Rotation

from capture_plan.errors import RigError
from capture_plan.rig.raw import RawRig, vertex_parts

COMPONENT = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}  # 3.6.2.2
WIDTH = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
HARMLESS = ("KHR_mesh_quantization", "KHR_materials_", "KHR_texture_", "EXT_texture_", "KHR_lights_")
JSON_CHUNK, BINARY_CHUNK = 0x4E4F534A, 0x004E4942
TRIANGLES, STRIP, FAN = 4, 5, 6


@dataclass(frozen=True, eq=False)
class Gltf:
    """The document and the bytes of its buffers."""

    document: dict[str, Any]
    buffers: tuple[bytes, ...]

    def table(self, key: str, index: int) -> dict[str, Any]:
        """Entry `index` of the document's list `key`."""
        if not 0 <= index < len(self.document.get(key, [])):
            raise RigError(f"refers to number {index} of {len(self.document.get(key, []))} {key}: export it again")
        return self.document[key][index]

    def accessor(self, index: int) -> np.ndarray:
        """Values (count width), normalised integers as -1..1, sparse substitutions made (3.6.2)."""
        a = self.table("accessors", index)
        dtype, width, count = np.dtype(COMPONENT[a["componentType"]]), WIDTH[a["type"]], a["count"]
        values = np.zeros((count, width), dtype)
        if "bufferView" in a:
            values = self.view(a["bufferView"], a.get("byteOffset", 0), dtype, count, width).copy()
        if "sparse" in a:
            s = a["sparse"]
            where, what = s["indices"], s["values"]
            dtype_where = np.dtype(COMPONENT[where["componentType"]])
            rows = self.view(where["bufferView"], where.get("byteOffset", 0), dtype_where, s["count"], 1)[:, 0]
            values[rows] = self.view(what["bufferView"], what.get("byteOffset", 0), dtype, s["count"], width)
        if a.get("normalized"):
            return np.maximum(values / np.float32(np.iinfo(dtype).max), -1)
        return values

    def view(self, index: int, offset: int, dtype: np.dtype, count: int, width: int) -> np.ndarray:
        """`count` rows of a buffer view, whose rows may be spaced by `byteStride`."""
        view = self.table("bufferViews", index)
        if not 0 <= view["buffer"] < len(self.buffers):
            raise RigError(f"refers to buffer {view['buffer']} of {len(self.buffers)}: export it again")
        start = view.get("byteOffset", 0) + offset
        row = dtype.itemsize * width
        stride = view.get("byteStride", row)
        buffer = self.buffers[view["buffer"]]
        if count and start + (count - 1) * stride + row > len(buffer):
            needed = start + (count - 1) * stride + row
            raise RigError(f"was cut off: a buffer has {len(buffer):,} bytes, expected {needed:,}: export it again")
        return np.ndarray((count, width), dtype, buffer, start, (stride, dtype.itemsize))


@dataclass(frozen=True, eq=False)
class Piece:
    """One mesh of the scene, placed in the world; `labels` says of which of `part_names` a triangle is.

    `source_index` counts the file's vertices from this mesh's first one on, of which it has `count`.
    """

    vertices: Float[np.ndarray, "v 3"]
    triangles: Int[np.ndarray, "f 3"]
    labels: Int[np.ndarray, " f"]
    part_names: tuple[str, ...]
    names: tuple[str, ...]
    deltas: Float[np.ndarray, "k v 3"]
    source_index: Int[np.ndarray, " v"]
    count: int


def read_gltf(path: Path) -> RawRig:
    """The rig in the file at `path`: metres, +y up and facing +z by the format. RigError when it holds none."""
    try:
        gltf = load(path)
        refuse_extensions(gltf.document)
        worlds = world_matrices(gltf)
        pieces = [read_mesh(gltf, node, worlds) for node in worlds if "mesh" in gltf.table("nodes", node)]
    except RigError as error:
        raise RigError(f"{path.name} {error}") from error
    except (KeyError, IndexError, TypeError, ValueError, AttributeError, RecursionError, struct.error) as error:
        found = " ".join(f"{type(error).__name__}: {error}".split())
        raise RigError(f"{path.name} does not follow glTF 2.0 ({found}): export it again as .glb") from error
    pieces = [piece for piece in pieces if len(piece.triangles)]
    if not pieces:
        raise RigError(f"{path.name} has no mesh with triangles in its scene: export the face mesh")
    return join(path.stem, pieces)


def load(path: Path) -> Gltf:
    """Document and buffers of a `.glb` or `.gltf` (4.4)."""
    data = path.read_bytes()
    if data[:4] != b"glTF":
        document = json.loads(data)
        return Gltf(document, tuple(load_buffer(path, buffer) for buffer in document.get("buffers", [])))
    _, version, length = struct.unpack_from("<4sII", data)
    if version != 2:
        raise RigError(f"is glTF version {version}, expected 2: export it as glTF 2.0")
    if length > len(data):
        raise RigError(f"was cut off: it has {len(data):,} bytes, expected {length:,}: copy or export it again")
    chunks, start = {}, 12
    while start < length:
        size, kind = struct.unpack_from("<II", data, start)
        chunks.setdefault(kind, data[start + 8 : start + 8 + size])
        start += 8 + size
    document = json.loads(chunks[JSON_CHUNK])
    return Gltf(
        document,
        tuple(
            load_buffer(path, buffer) if "uri" in buffer else chunks.get(BINARY_CHUNK, b"")
            for buffer in document.get("buffers", [])
        ),
    )


def load_buffer(path: Path, buffer: dict[str, Any]) -> bytes:
    """The bytes behind a buffer's address: text in the file itself, or a file beside it."""
    uri = buffer.get("uri", "")
    if uri.startswith("data:"):
        return base64.b64decode(uri.partition(",")[2])
    beside = path.parent / unquote(uri)
    if not uri or not beside.is_file():
        raise RigError(f"needs the file '{uri}', which is not beside it: copy it there, or export one .glb")
    return beside.read_bytes()


def refuse_extensions(document: dict[str, Any]) -> None:
    """RigError when reading the geometry needs an extension that is not known here."""
    unknown = [name for name in document.get("extensionsRequired", []) if not name.startswith(HARMLESS)]
    if unknown:
        raise RigError(f"needs {' and '.join(unknown)}, which is not read here: export it as .glb without compression")


def world_matrices(gltf: Gltf) -> dict[int, np.ndarray]:
    """World matrix (4 4) of every node of the scene, parents first (3.5.2)."""
    document = gltf.document
    nodes = document.get("nodes", [])
    roots = sorted(set(range(len(nodes))) - {child for node in nodes for child in node.get("children", [])})
    if document.get("scenes"):
        roots = gltf.table("scenes", document.get("scene", 0)).get("nodes", [])
    worlds: dict[int, np.ndarray] = {}

    def place(index: int, parent: np.ndarray) -> None:
        node = gltf.table("nodes", index)
        worlds[index] = parent @ local_matrix(node)
        for child in node.get("children", []):
            place(child, worlds[index])

    for root in roots:
        place(root, np.eye(4))
    return worlds


def local_matrix(node: dict[str, Any]) -> np.ndarray:
    """The node's matrix (4 4), which a file gives column by column, or T R S."""
    if "matrix" in node:
        return np.array(node["matrix"], dtype=np.float64).reshape(4, 4).T
    matrix = np.eye(4)
    R = Rotation.from_quat(node.get("rotation", [0, 0, 0, 1])).as_matrix()
    matrix[:3, :3] = R * np.array(node.get("scale", [1, 1, 1]), dtype=np.float64)
    matrix[:3, 3] = node.get("translation", [0, 0, 0])
    return matrix


def read_mesh(gltf: Gltf, index: int, worlds: dict[int, np.ndarray]) -> Piece:
    """The mesh of node `index`, all its primitives in one, welded."""
    node = gltf.table("nodes", index)
    mesh = gltf.table("meshes", node["mesh"])
    primitives = [
        primitive
        for primitive in mesh["primitives"]
        if primitive.get("mode", TRIANGLES) in (TRIANGLES, STRIP, FAN) and "POSITION" in primitive["attributes"]
    ]
    names = target_names(mesh, primitives)
    title = node.get("name") or mesh.get("name") or f"mesh {node['mesh']}"
    materials = list(dict.fromkeys(primitive.get("material") for primitive in primitives))
    blocks: dict[str, int] = {}  # first vertex of each set of vertices, which several primitives may use
    count, labels, corners = 0, [np.zeros(0, np.int64)], [np.zeros((0, 3), np.int64)]
    shapes = [np.zeros((1 + len(names), 0, 3))]
    for primitive in primitives:
        attributes, targets = primitive["attributes"], [t.get("POSITION") for t in primitive.get("targets", [])]
        M = placement(gltf, node, attributes, worlds[index], worlds)
        block = json.dumps([attributes, targets], sort_keys=True)
        if block not in blocks:
            blocks[block] = count
            count += len(M)
            shapes.append(placed_shapes(gltf, M, attributes["POSITION"], targets))
        triangles = primitive_triangles(gltf, primitive, len(M))
        if len(M) and np.linalg.det(M[0, :3, :3]) < 0:  # a mirrored node turns its triangles over
            triangles = triangles[:, ::-1]
        corners.append(triangles + blocks[block])
        labels.append(np.full(len(triangles), materials.index(primitive.get("material"))))
    part_names = (title,) if len(materials) < 2 else tuple(f"{title}/{material_name(gltf, m)}" for m in materials)
    vertices, *deltas = np.concatenate(shapes, axis=1)
    return weld(
        Piece(
            vertices=vertices,
            triangles=np.concatenate(corners),
            labels=np.concatenate(labels),
            part_names=part_names,
            names=names,
            deltas=np.array(deltas).reshape(len(names), count, 3),
            source_index=np.arange(count),
            count=count,
        )
    )


def material_name(gltf: Gltf, index: int | None) -> str:
    """What the file calls a material, or its number."""
    return "no material" if index is None else gltf.table("materials", index).get("name") or f"material {index}"


def placed_shapes(gltf: Gltf, M: np.ndarray, position: int, targets: list[int | None]) -> np.ndarray:
    """Vertices and deltas (1 + k, v, 3) of accessor `position` and of `targets`, placed by the matrices M (v 4 4)."""
    deltas = [np.zeros((len(M), 3)) if target is None else gltf.accessor(target) for target in targets]
    for delta in deltas:
        if len(delta) != len(M):
            raise RigError(f"has a blendshape of {len(delta):,} vertices on a mesh of {len(M):,}: export it again")
    placed = np.einsum("vij,kvj->kvi", M[:, :3, :3], np.stack([gltf.accessor(position), *deltas]))
    placed[0] += M[:, :3, 3]
    return placed


def target_names(mesh: dict[str, Any], primitives: list[dict[str, Any]]) -> tuple[str, ...]:
    """Names of a mesh's morph targets, which exporters put in `extras`; without them target_0, target_1, ..."""
    counts = {len(primitive.get("targets", [])) for primitive in primitives}
    if len(counts) > 1:
        raise RigError(
            f"has a mesh whose primitives have {' and '.join(map(str, sorted(counts)))} morph targets: export it again"
        )
    k = counts.pop() if counts else 0
    for owner in (mesh, *primitives):
        names = (owner.get("extras") or {}).get("targetNames")
        if names is not None and len(names) == k:
            if len(set(names)) < k:
                twice = next(name for name in names if names.count(name) > 1)
                raise RigError(f"has two morph targets called '{twice}': give each its own name")
            return tuple(str(name) for name in names)
    return tuple(f"target_{number}" for number in range(k))


def placement(
    gltf: Gltf, node: dict[str, Any], attributes: dict[str, int], world: np.ndarray, worlds: dict[int, np.ndarray]
) -> np.ndarray:
    """Matrix (v 4 4) that places each vertex: its node's, or of a skinned mesh the blend of its joints' (3.7.3.3)."""
    v = gltf.table("accessors", attributes["POSITION"])["count"]
    if "skin" not in node or "JOINTS_0" not in attributes:
        return np.broadcast_to(world, (v, 4, 4))
    skin = gltf.table("skins", node["skin"])
    J = np.stack([worlds[joint] for joint in skin["joints"]])
    if "inverseBindMatrices" in skin:
        J = J @ gltf.accessor(skin["inverseBindMatrices"]).reshape(-1, 4, 4).transpose(0, 2, 1)
    sets = sorted(name.removeprefix("JOINTS_") for name in attributes if name.startswith("JOINTS_"))
    joints = np.concatenate([gltf.accessor(attributes[f"JOINTS_{number}"]) for number in sets], axis=1)
    weights = np.concatenate([gltf.accessor(attributes[f"WEIGHTS_{number}"]) for number in sets], axis=1)
    # M = sum_j w_j J_j B_j
    return np.einsum("vj,vjab->vab", weights / weights.sum(axis=1, keepdims=True), J[joints])


def primitive_triangles(gltf: Gltf, primitive: dict[str, Any], v: int) -> np.ndarray:
    """Triangles (f 3) of a primitive of `v` vertices, strips and fans unrolled (3.7.2.1)."""
    corners = gltf.accessor(primitive["indices"]) if "indices" in primitive else np.arange(v, dtype=np.uint32)[:, None]
    if corners.dtype.kind != "u" or corners.shape[1] != 1:
        raise RigError("has faces that are not a list of vertex numbers: export it again")
    corners = corners[:, 0].astype(np.int64)
    if len(corners) and corners.max() >= v:
        raise RigError(f"has a face that uses vertex {corners.max():,} of {v:,}: export it again")
    mode = primitive.get("mode", TRIANGLES)
    if mode == TRIANGLES:
        return corners[: len(corners) // 3 * 3].reshape(-1, 3)
    i = np.arange(max(len(corners) - 2, 0))
    if mode == FAN:
        return corners[np.stack([np.zeros_like(i), i + 1, i + 2], axis=1)]
    return corners[np.stack([i, i + 1 + i % 2, i + 2 - i % 2], axis=1)]


def weld(piece: Piece) -> Piece:
    """The piece with vertices joined that share their place and all their motion, each called by its first number."""
    if piece.count == 0:
        return piece
    rows = np.concatenate([piece.vertices[None], piece.deltas]).transpose(1, 0, 2).reshape(piece.count, -1)
    rows = np.ascontiguousarray(rows.astype(np.float32) + np.float32(0))  # + 0 makes -0 equal to 0
    _, first, inverse = np.unique(rows.view(f"V{rows.shape[1] * 4}")[:, 0], return_index=True, return_inverse=True)
    kept = np.sort(first)
    welded = np.searchsorted(kept, first[inverse])
    return Piece(
        piece.vertices[kept],
        welded[piece.triangles],
        piece.labels,
        piece.part_names,
        piece.names,
        piece.deltas[:, kept],
        piece.source_index[kept],
        piece.count,
    )


def join(name: str, pieces: list[Piece]) -> RawRig:
    """One rig of all pieces: parts and blendshapes of equal name are one."""
    names = tuple(dict.fromkeys(name for piece in pieces for name in piece.names))
    part_names = tuple(dict.fromkeys(name for piece in pieces for name in piece.part_names))
    starts = np.cumsum([0] + [len(piece.vertices) for piece in pieces])
    firsts = np.cumsum([0] + [piece.count for piece in pieces])
    deltas = np.zeros((len(names), starts[-1], 3), dtype=np.float32)
    for piece, start in zip(pieces, starts[:-1], strict=True):
        for blendshape, delta in zip(piece.names, piece.deltas, strict=True):
            deltas[names.index(blendshape), start : start + len(delta)] = delta
    triangles = np.concatenate([piece.triangles + start for piece, start in zip(pieces, starts[:-1], strict=True)])
    labels = np.concatenate([np.array([part_names.index(n) for n in p.part_names])[p.labels] for p in pieces])
    parts, part_names = vertex_parts(triangles, labels, part_names, int(starts[-1]))
    return RawRig(
        name=name,
        neutral=np.concatenate([piece.vertices for piece in pieces]),
        triangles=triangles.astype(np.int32),
        deltas=deltas,
        names=names,
        parts=parts,
        part_names=part_names,
        source_index=np.concatenate([p.source_index + n for p, n in zip(pieces, firsts[:-1], strict=True)]).astype(
            np.int32
        ),
        unit_mm=1000.0,
        up="+y",
        facing="+z",
    )
