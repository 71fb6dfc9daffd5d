"""Rigs as FBX, binary or ASCII: every mesh of the scene, placed by its nodes, with its blend shape channels.

Objects      meshes, models (nodes), deformers and shapes, linked by the file's list of connections:
             Shape -> BlendShapeChannel -> BlendShape -> mesh -> Model -> parent Model
Mesh         Vertices, and PolygonVertexIndex, in which ~i ends a polygon at vertex i; both kept in their order
Shape        Indexes and Vertices: which vertices move by how much where the channel stands at the shape's full weight
In-between   a channel may have several shapes, each with a full weight; the largest is the blendshape, the others are
             left out and reported
Own code, because no library on the package index reads both forms of FBX without crashing or losing channels.

Letters: v vertices, f triangles, p polygons, c corners of polygons, i moved vertices.
"""

import re
import struct
import zlib
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from capture_plan.errors import RigError
from capture_plan.rig.formats.fbx_file import Node, read_tree
from capture_plan.rig.formats.fbx_nodes import axes, geometric_matrix, properties, unit_mm, world_matrix
from capture_plan.rig.formats.raw import RawRig, fan
from capture_plan.rig.formats.scene import (
    Offsets,
    PlacedMesh,
    check_corners,
    check_moved,
    join_meshes,
    place_mesh,
    plain,
)
from capture_plan.rig.formats.source import Source

BROKEN = (KeyError, IndexError, TypeError, ValueError, AttributeError, OverflowError, RecursionError, struct.error)
LISTED = 5  # in-betweens that a note names


@dataclass(frozen=True, eq=False)
class Scene:
    """Objects by their number, and those of each object's inputs, in the file's order."""

    objects: dict[int, Node]
    inputs: dict[int, list[int]]
    outputs: dict[int, list[int]]

    def of(self, number: int, kind: str, sort: str | None = None) -> list[int]:
        """Inputs of an object that are of this kind (and sort: "Mesh", "Shape", "BlendShape", ...)."""
        return [i for i in self.inputs.get(number, []) if self.is_a(i, kind, sort)]

    def is_a(self, number: int, kind: str, sort: str | None = None) -> bool:
        """Whether an object is of this kind and sort."""
        node = self.objects.get(number)
        return node is not None and node.name == kind and (sort is None or node.values[2] == sort)

    def name(self, number: int) -> str:
        """What the file calls an object, without its class; FBX writes a dot as FBXASC046."""
        words = str(self.objects[number].values[1]).partition("::")
        return plain(re.sub(r"FBXASC(\d{3})", lambda code: chr(int(code[1])), words[2] if words[1] else words[0]))


def read_fbx(path: Source) -> RawRig:
    """The rig in the file at `path`, its unit and axes as the file says. RigError when it holds none."""
    try:
        with np.errstate(all="ignore"):
            return read_scene(path.stem, read_tree(path.read_bytes()))
    except RigError as error:
        raise RigError(f"{path.name} {error}".replace(f"{path.name} {path.stem}:", f"{path.name}:")) from error
    except (*BROKEN, zlib.error) as error:
        found = plain(f"{type(error).__name__}: {error}")
        raise RigError(f"{path.name} is no whole FBX file ({found}): export it again as FBX 2014 or newer") from error


def read_scene(name: str, root: Node) -> RawRig:
    """The rig of a file's tree."""
    scene, settings = connect(root), properties(root.child("GlobalSettings"))
    models = {number: node for number, node in scene.objects.items() if node.name == "Model"}
    parent_of = {n: parents[0] for n in models if (parents := [o for o in scene.outputs.get(n, []) if o in models])}
    mirror, up, facing = axes(settings)
    meshes, between, first = [], [], 0
    for number in scene.objects:
        if not scene.is_a(number, "Geometry", "Mesh"):
            continue
        nodes = [o for o in scene.outputs.get(number, []) if o in models] or [None]
        vertices = scene.objects[number].child("Vertices").array().reshape(-1, 3)
        blendshapes, left_out = read_blendshapes(scene, number, len(vertices))
        between += left_out
        for node in nodes:
            mesh = read_mesh(scene, number, node, vertices, first, blendshapes)
            M = mirror if node is None else mirror @ place_of(node, models, parent_of)
            meshes.append(place_mesh(mesh, M))
        first += len(vertices)
    return join_meshes(name, meshes, unit_mm=unit_mm(settings), up=up, facing=facing, note=note(between))


def place_of(node: int, models: dict[int, Node], parent_of: dict[int, int]) -> Float[np.ndarray, "4 4"]:
    """W G of `fbx_nodes`."""
    return world_matrix(node, models, parent_of) @ geometric_matrix(properties(models[node]))


def connect(root: Node) -> Scene:
    """Objects and who is connected to whom."""
    objects = {n.values[0]: n for n in root.child("Objects").children if len(n.values) > 2 and type(n.values[0]) is int}
    inputs: dict[int, list[int]] = {}
    outputs: dict[int, list[int]] = {}
    for link in root.child("Connections").all("C"):
        if len(link.values) > 2 and link.values[0] == "OO":
            source, target = link.values[1:3]
            inputs.setdefault(target, []).append(source)  # pyright: ignore[reportArgumentType]
            outputs.setdefault(source, []).append(target)  # pyright: ignore[reportArgumentType]
    return Scene(objects, inputs, outputs)  # pyright: ignore[reportArgumentType]


def read_mesh(
    scene: Scene,
    number: int,
    node: int | None,
    vertices: Float[np.ndarray, "v 3"],
    first: int,
    blendshapes: dict[str, Offsets],
) -> PlacedMesh:
    """Geometry `number` in its own space; parts are called after the node, and after materials where it has several."""
    geometry = scene.objects[number]
    corners, sizes, kept = polygons(geometry.child("PolygonVertexIndex").array().astype(np.int64))
    check_corners(corners, len(vertices))
    title = (scene.name(number) if node is None else scene.name(node)) or f"mesh {first}"
    materials = [] if node is None else [scene.name(material) for material in scene.of(node, "Material")]
    labels = geometry.child("LayerElementMaterial").child("Materials").array()[: len(kept)].astype(np.int64)
    if len(materials) < 2 or len(labels) < len(kept):
        part_names, labels = (title,), np.zeros(len(sizes), np.int64)
    else:
        part_names = tuple(f"{title}/{material}" for material in materials)
        labels = np.clip(labels[kept], 0, len(materials) - 1)
    return PlacedMesh(vertices, fan(corners, sizes), np.repeat(labels, sizes - 2), part_names, first, blendshapes)


def polygons(index: Int[np.ndarray, " c"]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Corners in a row, corner counts, and which polygons these are: all but lines and points."""
    ends = np.flatnonzero(index < 0)
    if len(index) and (len(ends) == 0 or ends[-1] != len(index) - 1):
        raise RigError("has a polygon without an end: it was cut off or is damaged: export it again")
    sizes = np.diff(ends, prepend=-1)
    kept = sizes >= 3
    corners = np.where(index < 0, ~index, index)
    return corners[np.repeat(kept, sizes)], sizes[kept], kept


def read_blendshapes(scene: Scene, mesh: int, v: int) -> tuple[dict[str, Offsets], list[str]]:
    """Blendshapes of a mesh of `v` vertices, and what in-betweens were left out ("jawOpen at 50 %")."""
    found: dict[str, Offsets] = {}
    between: list[str] = []
    for deformer in scene.of(mesh, "Deformer", "BlendShape"):
        for channel in scene.of(deformer, "Deformer", "BlendShapeChannel"):
            shapes = scene.of(channel, "Geometry", "Shape")
            if not shapes:
                continue
            name = channel_name(scene, deformer, channel) or scene.name(shapes[-1]) or f"target_{len(found)}"
            if name in found:
                raise RigError(f"has two blendshapes called '{name}' on one mesh: give each its own name")
            weights = scene.objects[channel].child("FullWeights").array()
            if len(weights) != len(shapes):  # Blender writes one weight for every vertex of a vertex group here
                weights = np.linspace(0, 100, len(shapes) + 1)[1:]
            full = int(np.argmax(weights))
            between += [f"{name} at {weight:g} %" for i, weight in enumerate(weights) if i != full]
            found[name] = read_shape(name, scene.objects[shapes[full]], v)
    return found, between


def channel_name(scene: Scene, deformer: int, channel: int) -> str:
    """The channel's name; Maya puts that of its deformer and a dot before it."""
    return scene.name(channel).removeprefix(f"{scene.name(deformer)}.")


def read_shape(name: str, shape: Node, v: int) -> Offsets:
    """What a shape does to a mesh of `v` vertices."""
    values = shape.child("Vertices").array().reshape(-1, 3).astype(np.float64)
    indices = shape.child("Indexes").array().astype(np.int64)
    if len(indices) == 0 and len(values) == v:
        indices = np.arange(v)
    check_moved(name, indices, values, v)
    return Offsets(indices, values)


def note(between: list[str]) -> str:
    """A sentence about the in-betweens that were left out."""
    if not between:
        return ""
    more = f" and {len(between) - LISTED} more" if len(between) > LISTED else ""
    return f"in-between shapes were left out, so motion is a straight line here: {', '.join(between[:LISTED])}{more}"
