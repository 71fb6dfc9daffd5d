"""Rigs as FBX, binary or ASCII: every mesh of the scene, placed by its nodes, with its blend shape channels.

Objects      meshes, models (nodes), deformers and shapes, linked by the file's list of connections:
             Shape -> BlendShapeChannel -> BlendShape -> mesh -> Model -> parent Model
Mesh         Vertices, and PolygonVertexIndex, in which ~i ends a polygon at vertex i; both kept in their order
Shape        Indexes and Vertices: which vertices move by how much where the channel stands at the shape's full weight;
             see `fbx_shapes.py`
Skin         a mesh with bones stands where they put it (`fbx_skin.py`)
Hidden       what is not shown is left out (`fbx_scene.py`, `hidden.py`)
Own code, because no library on the package index reads both forms of FBX without crashing or losing channels.

Letters: v vertices, f triangles, p polygons, c corners of polygons, i moved vertices.
"""

import struct
import zlib
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from jaxtyping import Float, Int

from capture_plan.errors import RigError
from capture_plan.formats.fbx_file import Node, read_tree
from capture_plan.formats.fbx_nodes import axes, geometric_matrix, properties, unit_mm
from capture_plan.formats.fbx_scene import Scene, connect, is_hidden
from capture_plan.formats.fbx_shapes import Shapes, read_blendshapes, shapes_note
from capture_plan.formats.fbx_skin import Cluster, skinned_places
from capture_plan.formats.hidden import SceneMesh, choose_shown
from capture_plan.formats.naming import left_on, sentences
from capture_plan.formats.raw import RawRig, fan
from capture_plan.formats.scene import (
    Offsets,
    PlacedMesh,
    broken_words,
    check_corners,
    join_meshes,
    place_mesh,
    place_vertices,
    plain_line,
    whole_or_none,
)
from capture_plan.input.bounds import check_sides, content
from capture_plan.input.source import Source

BROKEN = (KeyError, IndexError, TypeError, ValueError, AttributeError, OverflowError, RecursionError, struct.error)


def read_fbx(path: Source) -> RawRig:
    """The rig in the file at `path`, its unit and axes as the file says. RigError when it holds none."""
    data = content(path)
    try:
        with np.errstate(all="ignore"):
            return _read_scene(path.stem, read_tree(data))
    except RigError as error:
        raise RigError(f"{path.name} {error}".replace(f"{path.name} {path.stem}:", f"{path.name}:")) from error
    except (*BROKEN, zlib.error) as error:
        found = plain_line(f"{type(error).__name__}: {error}")
        raise RigError(f"{path.name} is no whole FBX file ({found}): export it again as FBX 2014 or newer") from error


def _read_scene(name: str, root: Node) -> RawRig:
    """The rig of a file's tree."""
    scene, settings = connect(root), properties(root.child("GlobalSettings"))
    mirror, up, facing = axes(settings)
    found, first = [], 0
    for number in scene.objects:
        if not scene.is_a(number, "Geometry", "Mesh"):
            continue
        vertices = scene.objects[number].child("Vertices").array().reshape(-1, 3)
        shapes = read_blendshapes(scene, number, len(vertices))
        found += [
            _Instance(number, node, first, vertices, shapes)
            for node in [o for o in scene.outputs.get(number, []) if o in scene.models] or [None]
        ]
        first += len(vertices)
    retained, left_out, hiding = choose_shown([one.listed(scene) for one in found])
    instances = [one for one, belongs in zip(found, retained, strict=True) if belongs]
    broken: list[str] = []
    still = not any(one.shapes.offsets for one in instances)
    placed = [
        whole_or_none(one.title(scene), still or bool(one.shapes.offsets), partial(one.place, scene, mirror), broken)
        for one in instances
    ]
    between = shapes_note([b for one in instances for b in one.shapes.between])
    message = sentences(between, *_instance_messages(instances), hiding, broken_words(broken))
    meshes = [mesh for mesh in placed if mesh is not None]
    rig = join_meshes(name, meshes, unit_mm=unit_mm(settings), up=up, facing=facing, note=message)
    gone = (one.title(scene) for one, mesh in zip(instances, placed, strict=True) if mesh is None)
    return replace(rig, left_out=(*left_out, *gone))


@dataclass(frozen=True, eq=False)
class _Instance:
    """Geometry `number` as the node `node` shows it; `first` counts the file's vertices before it."""

    number: int
    node: int | None
    first: int
    vertices: Float[np.ndarray, "v 3"]
    shapes: Shapes

    def title(self, scene: Scene) -> str:
        """The name that people have given it."""
        return scene.name(self.number if self.node is None else self.node) or f"mesh {self.first}"

    def listed(self, scene: Scene) -> SceneMesh:
        """It among the meshes of the scene."""
        hidden = self.node is not None and is_hidden(scene, self.node)
        return SceneMesh(self.title(scene), hidden, len(self.shapes.offsets))

    def place(self, scene: Scene, mirror: Float[np.ndarray, "4 4"]) -> PlacedMesh:
        """The mesh in the scene's space."""
        mesh = _read_mesh(
            scene, self.number, self.node, self.vertices, self.first, self.shapes.offsets, self.title(scene)
        )
        if self.node is None:
            return place_mesh(mesh, mirror)
        W, G = scene.world(self.node), geometric_matrix(properties(scene.models[self.node]))
        bones = skinned_places(clusters(scene, self.number), W, G, len(self.vertices))
        return place_mesh(mesh, mirror @ W @ G) if bones is None else place_vertices(mesh, mirror @ bones)


def _instance_messages(instances: list[_Instance]) -> list[str]:
    """Sentences about the blendshapes of these meshes: names and weights."""
    on = {name: weight for one in instances for name, weight in one.shapes.weights.items() if weight}
    return [*(message for one in instances for message in one.shapes.said), left_on(on)]


def clusters(scene: Scene, mesh: int) -> list[Cluster]:
    """The bones of a mesh."""
    found = []
    for skin in scene.of(mesh, "Deformer", "Skin"):
        for one in scene.of(skin, "Deformer", "Cluster"):
            bones, node = scene.of(one, "Model"), scene.objects[one]
            T, L = matrix(node.child("Transform")), matrix(node.child("TransformLink"))
            if bones and L is not None:
                indices, weights = node.child("Indexes").array().astype(np.int64), node.child("Weights").array()
                found.append(Cluster(indices, weights.astype(np.float64), scene.world(bones[0]), L, T))
    return found


def matrix(node: Node) -> Float[np.ndarray, "4 4"] | None:
    """A matrix, which a file gives column by column; None where it is none that can be inverted."""
    values = node.array().astype(np.float64)
    M = values.reshape(4, 4).T if len(values) == 16 else np.full((4, 4), np.nan)
    return M if np.isfinite(M).all() and abs(np.linalg.det(M)) > 0 else None


def _read_mesh(
    scene: Scene,
    number: int,
    node: int | None,
    vertices: Float[np.ndarray, "v 3"],
    first: int,
    blendshapes: dict[str, Offsets],
    title: str,
) -> PlacedMesh:
    """Geometry `number` in its own space; parts are called after the node, and after materials where it has several."""
    geometry = scene.objects[number]
    corners, sizes, retained = polygons(geometry.child("PolygonVertexIndex").array().astype(np.int64))
    check_corners(corners, len(vertices))
    materials = [] if node is None else [scene.name(material) for material in scene.of(node, "Material")]
    labels = geometry.child("LayerElementMaterial").child("Materials").array()[: len(retained)].astype(np.int64)
    if len(materials) < 2 or len(labels) < len(retained):
        part_names, labels = (title,), np.zeros(len(sizes), np.int64)
    else:
        part_names = tuple(f"{title}/{material}" for material in materials)
        labels = np.clip(labels[retained], 0, len(materials) - 1)
    return PlacedMesh(vertices, fan(corners, sizes), np.repeat(labels, sizes - 2), part_names, first, blendshapes)


def polygons(index: Int[np.ndarray, " c"]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Corners in a row, corner counts, and which polygons these are: all but lines and points."""
    ends = np.flatnonzero(index < 0)
    if len(index) and (len(ends) == 0 or ends[-1] != len(index) - 1):
        raise RigError("has a polygon without an end: it was cut off or is damaged: export it again")
    sizes = np.diff(ends, prepend=-1)
    check_sides("", int(sizes.max(initial=0)))
    retained = sizes >= 3
    corners = np.where(index < 0, ~index, index)
    return corners[np.repeat(retained, sizes)], sizes[retained], retained
