"""What of a glTF file is whole enough to be read: a broken hat is left out and named, a broken face refuses the file.

Data     per mesh of the scene how many blendshapes k move it and how many vertices v it has
Carrier  of the meshes that at least MANY of the most blendshapes move, the largest, and those of LARGE of its vertices:
         they carry the face, be it in one mesh or in several
Broken   a mesh that cannot be read, or whose vertices lie at NaN; with a carrier's k and v the file is refused
Target   a morph target that cannot be read leaves its blendshape out where a carrier has it; elsewhere, on teeth say,
         it moves nothing
"""

import json
import struct
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from capture_plan.errors import RigError
from capture_plan.formats.gltf_file import AGAIN, Gltf, whole_number
from capture_plan.formats.gltf_scene import scene_nodes
from capture_plan.formats.naming import listed, one_line

TRIANGLES, STRIP, FAN = 4, 5, 6
MANY = 0.5  # of the blendshapes that move the mesh that most of them move
LARGE = 0.5  # of the vertices of the largest such mesh: eyes, teeth and lashes have fewer
UNKNOWN = 10**12  # vertices of a mesh that does not say how many it has
DAMAGE = (
    *(KeyError, IndexError, TypeError, ValueError, AttributeError, OverflowError, ArithmeticError),
    *(RecursionError, MemoryError, struct.error),
)


@dataclass(frozen=True, eq=False)
class Piece:
    """One mesh of the scene, placed in the world; `labels` says of which of `part_names` a triangle is.

    `flaws` says of morph targets that cannot be read what is wrong with them; their deltas are NaN.
    """

    title: str
    vertices: Float[np.ndarray, "v 3"]
    triangles: Int[np.ndarray, "f 3"]
    labels: Int[np.ndarray, " f"]
    part_names: tuple[str, ...]
    names: tuple[str, ...]
    deltas: Float[np.ndarray, "k v 3"]
    flaws: dict[str, str] = field(default_factory=dict)

    @cached_property
    def moving(self) -> int:
        """How many blendshapes move it."""
        return sum(bool(delta.any()) for delta in self.deltas)


@dataclass(frozen=True)
class Broken:
    """A mesh that cannot be used: its name, what is wrong with it, how many blendshapes and vertices it has."""

    title: str
    reason: str
    blendshapes: int
    vertices: int


@dataclass(frozen=True)
class Size:
    """Vertices and corners of triangles that a mesh says it has."""

    vertices: int
    corners: int


def damage_words(error: BaseException) -> str:
    """An error in half a sentence that follows the name of what is broken, without advice."""
    if isinstance(error, RigError):
        return one_line(str(error).removesuffix(f": {AGAIN}"))
    found = " ".join(f"{type(error).__name__}: {error}".split())[:160]
    return one_line(f"does not follow glTF 2.0 ({found})")


def mesh_of(gltf: Gltf, index: int) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    """A mesh, and those of its primitives that are surfaces."""
    mesh = gltf.entry("meshes", index)
    surfaces = [
        primitive
        for primitive in mesh["primitives"]
        if primitive.get("mode", TRIANGLES) in (TRIANGLES, STRIP, FAN) and "POSITION" in primitive["attributes"]
    ]
    return mesh, surfaces


def target_count(primitives: list[dict[str, Any]]) -> int:
    """How many morph targets a mesh has; primitives with fewer stand still in the last ones."""
    return max((len(primitive.get("targets") or []) for primitive in primitives), default=0)


def size_of(gltf: Gltf, index: int) -> Size:
    """What the mesh of node `index` says of its size; vertices that several primitives share count once."""
    _, primitives = mesh_of(gltf, gltf.entry("nodes", index)["mesh"])
    blocks = {block_of(primitive): primitive["attributes"]["POSITION"] for primitive in primitives}
    v = sum(whole_number(gltf.entry("accessors", position), "count") for position in blocks.values())
    counted = [primitive.get("indices", primitive["attributes"]["POSITION"]) for primitive in primitives]
    return Size(v, sum(whole_number(gltf.entry("accessors", number), "count") for number in counted))


def block_of(primitive: dict[str, Any]) -> str:
    """What tells sets of vertices apart, of which several primitives may use the same."""
    targets = [target.get("POSITION") for target in primitive.get("targets") or []]
    return json.dumps([primitive["attributes"], targets], sort_keys=True)


def readable(gltf: Gltf) -> tuple[list[int], dict[int, Size], list[Broken]]:
    """Nodes of the scene that show meshes, what those say of their sizes, and meshes that do not even say that."""
    sizes: dict[int, Size] = {}
    broken: list[Broken] = []
    for index in (index for index in scene_nodes(gltf) if "mesh" in gltf.entry("nodes", index)):
        try:
            sizes[index] = size_of(gltf, index)
        except (RigError, *DAMAGE) as error:
            broken.append(broken_mesh(gltf, index, error))
    return list(sizes), sizes, broken


def broken_mesh(gltf: Gltf, index: int, error: BaseException) -> Broken:
    """The mesh of node `index` after an error, with what it still says of itself."""
    node = gltf.entry("nodes", index)
    name, k, v = str(node.get("name") or f"mesh {node.get('mesh')}"), 0, UNKNOWN
    try:
        mesh, primitives = mesh_of(gltf, node["mesh"])
        name, k = str(node.get("name") or mesh.get("name") or name), target_count(primitives)
        v = sum(gltf.shape(primitive["attributes"]["POSITION"])[0] for primitive in primitives)
    except (RigError, *DAMAGE):
        pass
    return Broken(one_line(name), damage_words(error), k, v)


def usable(pieces: list[Piece], broken: list[Broken]) -> tuple[list[Piece], list[Broken]]:
    """The pieces whose vertices are somewhere, and what is broken with the others among it.

    RigError that names the mesh where what is broken carries the face.
    """
    lost = [piece for piece in pieces if not np.isfinite(piece.vertices).all()]
    nowhere = "holds NaN or infinite coordinates"
    broken = broken + [Broken(one_line(p.title), nowhere, p.moving, len(p.vertices)) for p in lost]
    pieces = [piece for piece in pieces if np.isfinite(piece.vertices).all()]
    carries = carrier(pieces, [one.blendshapes for one in broken])
    still = not any(piece.moving for piece in pieces)
    for one in broken:
        if still or carries(one.blendshapes, one.vertices):
            raise RigError(f"has a broken face mesh: {one.title} {one.reason}: clean it and {AGAIN}")
    return pieces, broken


def carrier(pieces: list[Piece], others: Sequence[int] = ()) -> Callable[[int, int], bool]:
    """Whether a mesh that k blendshapes move and that has v vertices carries the face, as a function of k and v.

    `others` are the numbers of blendshapes of meshes beside the pieces.
    """
    sizes = [(piece.moving, len(piece.vertices)) for piece in pieces]
    many = MANY * max([*others, *(k for k, _ in sizes)], default=0)
    large = LARGE * max((v for k, v in sizes if k >= many), default=0)
    return lambda k, v: k > 0 and k >= many and v >= large


def without_flaws(pieces: list[Piece]) -> tuple[list[Piece], list[str]]:
    """The pieces, with broken morph targets at rest where the face does not hang on them; what is to be said of it."""
    carries = carrier(pieces)
    found, said = [], []
    for piece in pieces:
        lost = {name for name, d in zip(piece.names, piece.deltas, strict=True) if not np.isfinite(d).all()}
        messages = [
            f"{name} {piece.flaws.get(name, 'holds NaN or infinite coordinates')}"
            for name in piece.names
            if name in lost
        ]
        if messages and not carries(piece.moving, len(piece.vertices)):
            retained = np.array([name not in lost for name in piece.names])
            piece = replace(piece, deltas=np.where(retained[:, None, None], piece.deltas, np.float32(0)))
            said.append(f"broken blendshapes do not move {one_line(piece.title)}, {AGAIN}: {listed(messages)}")
        elif flaws := [one for one in messages if not one.endswith("coordinates")]:
            said.append(f"broken blendshapes of {one_line(piece.title)}: {listed(flaws)}")
        found.append(piece)
    return found, said


def faults_in_words(broken: list[Broken]) -> str:
    """The sentence about meshes that were left out."""
    reasons = listed(f"{one.title} {one.reason}" for one in broken)
    return f"broken meshes were left out, clean them and export again: {reasons}" if broken else ""
