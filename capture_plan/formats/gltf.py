"""Rigs as glTF 2.0 with named morph targets: `.glb`, `.gltf` with its buffers beside it, and `.vrm`.

Every mesh of the scene, placed by its nodes (or its skin's joints), becomes a part; blendshapes of equal name are one.
glTF splits a vertex where texture, shading or material breaks; seams within a mesh are welded again (`weld.py`). A
vertex is called by its number in the file, all primitives counted in a row. Where a primitive has fewer morph targets
than others of its mesh, or a target has no POSITION, its vertices stand still. Meshes that KHR_node_visibility hides,
by a node or one above it, are left out.

Letters: v vertices, f triangles, k blendshapes. Sections are those of the glTF 2.0 specification.
"""

import re
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from capture_plan.errors import RigError
from capture_plan.formats import vrm
from capture_plan.formats.gltf_file import AGAIN, Gltf, load_gltf, whole_number
from capture_plan.formats.gltf_scene import (
    Worlds,
    hidden_nodes,
    placement,
    scene_messages,
    titles,
    world_matrices,
)
from capture_plan.formats.gltf_whole import (
    DAMAGE,
    FAN,
    TRIANGLES,
    Piece,
    Size,
    block_of,
    broken_mesh,
    damage_words,
    faults_in_words,
    mesh_of,
    readable,
    target_count,
    usable,
    without_flaws,
)
from capture_plan.formats.hidden import SceneMesh, choose_shown
from capture_plan.formats.naming import LISTED, fitting, left_on, numbered, one_line, sentences
from capture_plan.formats.raw import RawRig
from capture_plan.formats.scene import Offsets, PlacedMesh, join_meshes
from capture_plan.formats.weld import weld_seams
from capture_plan.input.bounds import MOST_BLENDSHAPES, MOST_DISPLACEMENTS
from capture_plan.input.source import Source

TECHNICAL = re.compile(r"accessor|buffer|position|mesh|target", re.IGNORECASE)  # what programs call data
MOST_CORNERS = 48_000_000


def read_gltf(path: Source) -> RawRig:
    """The rig in the file at `path`: metres, +y up and facing +z by the format. RigError when it holds none."""
    try:
        with np.errstate(all="ignore"):  # NaN and infinity are told when the rig is whole
            return read_document(path.stem, load_gltf(path))
    except RigError as error:
        message = str(error)
        named = message.startswith((f"{path.stem}:", f"{path.name} "))
        raise RigError(message if named else f"{path.name} {message}") from error
    except DAMAGE as error:
        raise RigError(f"{path.name} {damage_words(error)}: {AGAIN} as .glb") from error


def read_document(name: str, gltf: Gltf) -> RawRig:
    """The rig of a document, with what VRM says of it."""
    worlds = world_matrices(gltf)
    nodes, sizes, broken = readable(gltf)
    nodes, left_out, hiding = shown_meshes(gltf, nodes)
    shown, expressions = titles(gltf, nodes), vrm.read_expressions(gltf)
    named, said = target_names(gltf, shown, vrm.given_names(expressions))
    _check_size([sizes[index] for index in nodes], named)
    pieces: list[Piece] = []
    for index, title in shown.items():
        try:
            pieces.append(_read_mesh(gltf, index, title, worlds, named))
        except (RigError, *DAMAGE) as error:
            broken.append(broken_mesh(gltf, index, error))
    pieces, broken = usable([piece for piece in pieces if len(piece.triangles)], broken)
    if not pieces:
        raise RigError("has no mesh with triangles in its scene: export the face mesh")
    pieces, flawed = without_flaws(pieces)

    def blendshape(mesh: int, target: int) -> str | None:
        names = named.get(mesh, ())
        return names[target] if 0 <= target < len(names) else None

    found = (scene_messages(gltf), hiding, faults_in_words(broken), *flawed)
    message = sentences(
        vrm.expression_note(expressions, blendshape), *said, default_weights(gltf, shown, named), *found
    )
    left_out = (*left_out, *dict.fromkeys(one.title for one in broken))
    rig = join_meshes(name, placed_meshes(pieces), unit_mm=1000.0, up="+y", facing=vrm.facing(gltf), note=message)
    rig = replace(rig, left_out=left_out)
    assert rig.meshes is not None
    return weld_seams(rig, rig.meshes)


def shown_meshes(gltf: Gltf, nodes: list[int]) -> tuple[list[int], tuple[str, ...], str]:
    """Of these nodes those whose meshes belong to the rig, names of meshes left out, and the sentence about them."""
    hidden = hidden_nodes(gltf)
    title = titles(gltf, nodes)
    counts = [target_count(mesh_of(gltf, gltf.entry("nodes", index)["mesh"])[1]) for index in nodes]
    retained, left_out, message = choose_shown(
        [SceneMesh(one_line(title[index]), index in hidden, k) for index, k in zip(nodes, counts, strict=True)]
    )
    return [index for index, belongs in zip(nodes, retained, strict=True) if belongs], left_out, message


def target_names(
    gltf: Gltf, shown: dict[int, str], given: dict[tuple[int, int], str]
) -> tuple[dict[int, tuple[str, ...]], list[str]]:
    """Names of the morph targets of every mesh shown: the file's own, else VRM's, else target_0, target_1, ...; notes.

    Unnamed targets of equal number are the same blendshape only when all unnamed meshes have as many of them.
    """
    title = {gltf.entry("nodes", index)["mesh"]: name for index, name in reversed(shown.items())}
    said: list[str] = []
    found = {index: _own_names(gltf, *mesh_of(gltf, index), name, said) for index, name in title.items()}
    several = len({k for names, k in found.values() if names is None and k}) > 1
    named = {}
    for index, (names, k) in found.items():
        if names is None:
            plain = tuple(f"{title[index]}/target_{i}" if several else f"target_{i}" for i in range(k))
            names = tuple(given.get((index, i), name) for i, name in enumerate(plain))
            names = names if len(set(names)) == k else plain
        named[index], message = numbered(names)
        said.append(message)
    return named, said


def _own_names(
    gltf: Gltf, mesh: dict[str, Any], primitives: list[dict[str, Any]], title: str, said: list[str]
) -> tuple[tuple[str, ...] | None, int]:
    """Names of a mesh's morph targets, None where the file has none, and how many there are; notes go to `said`."""
    k, problem = target_count(primitives), ""
    counts = sorted({len(primitive.get("targets") or []) for primitive in primitives} - {0})
    if len(counts) > 1:
        message = " and ".join(map(str, counts[:LISTED]))
        said.append(f"parts of {one_line(title)} have {message} blendshapes: what a part lacks does not move it")
    for names in given_lists(gltf, mesh, primitives, k) if k else ():
        fits, message = fitting(names, k, one_line(title))
        if fits is not None:
            said.append(message)
            return fits, k
        problem = problem or message
    said.append(problem)
    return None, k


def given_lists(gltf: Gltf, mesh: dict[str, Any], primitives: list[dict[str, Any]], k: int) -> Iterator[list[str]]:
    """Lists of names that a file may hold for the k morph targets of a mesh, the likeliest to be right first.

    Exporters put them into `extras` of the mesh or a primitive, some once for each primitive; others call the targets
    themselves or their data so.
    """
    for owner in (mesh, *primitives):
        names = extras(owner).get("targetNames")
        if isinstance(names, list) and names:
            found = [one_line("" if name is None else name).strip() or f"target_{i}" for i, name in enumerate(names)]
            repeated = len(found) > k and found == found[:k] * (len(found) // k)
            yield found[:k] if repeated else found
    for targets in (primitive.get("targets") or [] for primitive in primitives):
        own = [extras(target).get("name") for target in targets]
        data = [data_name(gltf, target) for target in targets]
        for names in (own, data):
            if len(names) == k == len(set(names)) and all(names) and not any(map(TECHNICAL.search, map(str, names))):
                yield [one_line(name) for name in names]


def extras(owner: dict[str, Any]) -> dict[str, Any]:
    """What programs say by name in the extras of a part, in which anything may stand; some misspell the word."""
    found = owner.get("extras") or owner.get("extra")
    return found if isinstance(found, dict) else {}


def data_name(gltf: Gltf, target: dict[str, Any]) -> str | None:
    """What a morph target's data are called, if they are there and called anything."""
    try:
        return gltf.entry("accessors", target["POSITION"]).get("name")
    except (RigError, *DAMAGE):
        return None


def default_weights(gltf: Gltf, shown: dict[int, str], named: dict[int, tuple[str, ...]]) -> str:
    """A sentence about weights of nodes, or else of their meshes, that are not 0 (3.7.2.2)."""
    on: dict[str, float] = {}
    for index in shown:
        node = gltf.entry("nodes", index)
        weights = node.get("weights") or gltf.entry("meshes", node["mesh"]).get("weights") or []
        on |= {name: float(w) for name, w in zip(named[node["mesh"]], weights, strict=False) if w}
    return left_on(on)


def _check_size(sizes: list[Size], named: dict[int, tuple[str, ...]]) -> None:
    """RigError when what the scene shows would not fit: small files can show one mesh or one buffer many times."""
    k = len({name for names in named.values() for name in names})
    v, corners = (sum(getattr(size, what) for size in sizes) for what in ("vertices", "corners"))
    if (1 + k) * v > MOST_DISPLACEMENTS or k > MOST_BLENDSHAPES or corners > MOST_CORNERS:
        raise RigError(
            f"shows {v:,} vertices in {corners:,} corners with {k:,} blendshapes, more than fit: export the head alone"
        )


def _read_mesh(gltf: Gltf, index: int, title: str, worlds: Worlds, named: dict[int, tuple[str, ...]]) -> Piece:
    """The mesh of node `index`, all its primitives in one."""
    node = gltf.entry("nodes", index)
    _, primitives = mesh_of(gltf, node["mesh"])
    names = named[node["mesh"]]
    materials = list(dict.fromkeys(primitive.get("material") for primitive in primitives))
    blocks: dict[str, int] = {}  # first vertex of each set of vertices
    flaws: dict[str, str] = {}
    count, labels, corners = 0, [np.zeros(0, np.int64)], [np.zeros((0, 3), np.int64)]
    vertices, deltas = [np.zeros((0, 3))], [np.zeros((len(names), 0, 3), np.float32)]
    for primitive in primitives:
        attributes, block = primitive["attributes"], block_of(primitive)
        v = whole_number(gltf.entry("accessors", attributes["POSITION"]), "count")
        M = placement(gltf, node, attributes, worlds[index], worlds, v)
        if block not in blocks:
            blocks[block] = count
            count += v
            vertices.append(_placed(gltf, M, attributes["POSITION"]) + M[:, :3, 3])
            targets = [target.get("POSITION") for target in primitive.get("targets") or []]
            deltas.append(np.zeros((len(names), v, 3), np.float32))
            for k, target in enumerate(targets):
                try:
                    if target is not None:
                        deltas[-1][k] = _placed(gltf, M, target)
                except (RigError, *DAMAGE) as error:
                    deltas[-1][k], flaws[names[k]] = np.nan, damage_words(error)
        triangles = primitive_triangles(gltf, primitive, v)
        if v and np.linalg.det(M[0, :3, :3]) < 0:  # a mirrored node turns its triangles over
            triangles = triangles[:, ::-1]
        corners.append(triangles + blocks[block])
        labels.append(np.full(len(triangles), materials.index(primitive.get("material"))))
    part_names = (title,) if len(materials) < 2 else tuple(f"{title}/{material_name(gltf, m)}" for m in materials)
    return Piece(
        title=title,
        flaws=flaws,
        vertices=np.concatenate(vertices),
        triangles=np.concatenate(corners),
        labels=np.concatenate(labels),
        part_names=part_names,
        names=names,
        deltas=np.concatenate(deltas, axis=1),
    )


def material_name(gltf: Gltf, index: int | None) -> str:
    """What the file calls a material, or its number."""
    return "no material" if index is None else str(gltf.entry("materials", index).get("name") or f"material {index}")


def _placed(gltf: Gltf, M: Float[np.ndarray, "v 4 4"], index: int) -> Float[np.ndarray, "v 3"]:
    """Vectors of an accessor, turned and scaled but not moved. RigError where they are of another mesh."""
    vectors = gltf.accessor(index)
    if vectors.shape != (len(M), 3):
        raise RigError(f"has {len(vectors):,} rows of {vectors.shape[1]} numbers, expected {len(M):,} of 3: {AGAIN}")
    return np.einsum("vij,vj->vi", M[:, :3, :3], vectors)


def primitive_triangles(gltf: Gltf, primitive: dict[str, Any], v: int) -> Int[np.ndarray, "f 3"]:
    """Triangles of a primitive of `v` vertices, strips and fans unrolled (3.7.2.1)."""
    corners = gltf.accessor(primitive["indices"]) if "indices" in primitive else np.arange(v, dtype=np.uint32)[:, None]
    if corners.dtype.kind != "u" or corners.shape[1] != 1:
        raise RigError(f"has faces that are not a list of vertex numbers: {AGAIN}")
    corners = corners[:, 0].astype(np.int64)
    if len(corners) and corners.max() >= v:
        raise RigError(f"has a face that uses vertex {corners.max():,} of {v:,}: {AGAIN}")
    mode = primitive.get("mode", TRIANGLES)
    if mode == TRIANGLES:
        return corners[: len(corners) // 3 * 3].reshape(-1, 3)
    i = np.arange(max(len(corners) - 2, 0))
    if mode == FAN:
        return corners[np.stack([np.zeros_like(i), i + 1, i + 2], axis=1)]
    return corners[np.stack([i, i + 1 + i % 2, i + 2 - i % 2], axis=1)]


def placed_meshes(pieces: list[Piece]) -> list[PlacedMesh]:
    """The pieces as a scene's meshes, their vertices counted in a row."""
    starts = np.cumsum([0] + [len(piece.vertices) for piece in pieces])
    return [
        PlacedMesh(
            vertices=piece.vertices,
            triangles=piece.triangles,
            labels=piece.labels,
            part_names=piece.part_names,
            first=int(first),
            blendshapes={
                name: Offsets(np.arange(len(delta)), delta)
                for name, delta in zip(piece.names, piece.deltas, strict=True)
            },
        )
        for piece, first in zip(pieces, starts[:-1], strict=True)
    ]
