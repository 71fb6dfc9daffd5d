"""The head as glTF: `head.glb`, for the web, Blender and Unreal. Metres, +y up, facing +z, as glTF has it.

Head      the neutral, each expression a morph target by its name, all at weight 0
Dots      a ball as wide as the dot for each marker, in the head's mesh: they move with its morph targets
Markers   a node by the name of each marker under one called markers, where it stands on the neutral
Own code of JSON and NumPy, because trimesh 5.2 writes no morph targets. Sections are those of glTF 2.0.

Letters: v vertices, f triangles.
"""

import json
import struct
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from jaxtyping import Float, Int

from capture_plan.exports.delivery import NEUTRAL, Delivery, dots_mm, head_of, posed_dots_mm, poses_mm
from capture_plan.exports.marker_names import distinct_names
from capture_plan.mesh import vertex_normals
from capture_plan.output import write_whole
from capture_plan.plan.record import head_words, number_of

MM = 1000  # in a metre
LONGEST = 200  # letters of a name
JSON_CHUNK, BINARY_CHUNK = 0x4E4F534A, 0x004E4942  # 4.4.3
VERTICES, INDICES = 34962, 34963  # 5.11.5: what a view is for
FLOAT, UNSIGNED_INT = 5126, 5125  # 5.1.3
SKIN, DOT = 0, 1  # materials
ROUND = 1  # subdivisions of a dot's ball


@dataclass
class Binary:
    """The arrays of a file, one view and one accessor each."""

    data: bytearray = field(default_factory=bytearray)
    views: list[dict[str, Any]] = field(default_factory=list)
    accessors: list[dict[str, Any]] = field(default_factory=list)

    def points(self, values: Float[np.ndarray, "v 3"]) -> int:
        """Add vectors; the number of their accessor."""
        exact = values.astype("<f4")
        bounds = {"min": exact.min(axis=0).tolist(), "max": exact.max(axis=0).tolist()}
        return self._add(exact.tobytes(), VERTICES, componentType=FLOAT, type="VEC3", count=len(exact), **bounds)

    def corners(self, triangles: Int[np.ndarray, "f 3"]) -> int:
        """Add triangles; the number of their accessor."""
        flat = triangles.astype("<u4").ravel()
        return self._add(flat.tobytes(), INDICES, componentType=UNSIGNED_INT, type="SCALAR", count=len(flat))

    def _add(self, content: bytes, target: int, **accessor: Any) -> int:
        view = {"buffer": 0, "byteOffset": len(self.data), "byteLength": len(content), "target": target}
        self.views.append(view)
        self.accessors.append({"bufferView": len(self.views) - 1} | accessor)
        self.data += content  # of four bytes a number, so that all begin where 3.6.2.4 wants them to
        return len(self.accessors) - 1


def write(of: Delivery, folder: Path) -> list[Path]:
    """Write the head with its expressions and markers."""
    path = of.place(folder, "head", ".glb")
    write_whole(path, glb_bytes(*gltf_of(of)))
    return [path]


def gltf_of(of: Delivery) -> tuple[dict[str, Any], bytes]:
    """The file's JSON and its binary part."""
    binary = Binary()
    names = distinct_names(of.names, longest=LONGEST)
    places = (dots_mm(of.plan, of.inputs) / MM).tolist()
    dots = [
        {"name": name, "translation": place, "extras": {"place": marker.label}}
        for name, place, marker in zip(names, places, of.plan.layout.markers, strict=True)
    ]
    head = {"name": "head", "mesh": 0}
    group = {"name": "markers", "children": list(range(2, 2 + len(dots)))} if dots else {"name": "markers"}
    made = {
        "asset": {
            "version": "2.0",
            "generator": "capture-plan",
            "extras": {
                "unit": "metre",
                "up": "+y",
                "facing": "+z",
                "plan": number_of(of.plan),
                "of": head_words(of.plan),
            },
        },
        "scene": 0,
        "scenes": [{"nodes": [0, 1]}],
        "nodes": [head, group, *dots],
        "meshes": [head_mesh(of, binary)],
        "materials": [material("skin", 0.8, 0.6, 0.5), material("marker", 0.02, 0.02, 0.02)],
    }
    made |= {"accessors": binary.accessors, "bufferViews": binary.views, "buffers": [{"byteLength": len(binary.data)}]}
    return made, bytes(binary.data)


def head_mesh(of: Delivery, binary: Binary) -> dict[str, Any]:
    """The neutral and its dots, with a morph target of both for each expression."""
    head, named = head_of(of.inputs), list(of.poses)[1:]
    moved = (vertices - head.neutral for name, vertices in poses_mm(of.plan, of.inputs) if name != NEUTRAL)
    parts = [primitive(head.neutral / MM, head.triangles, SKIN, binary, (each / MM for each in moved))]
    if of.names:
        posed = posed_dots_mm(of.plan, of.inputs)
        balls, corners, turns = dots_as_balls(of)
        each_ball = (np.repeat(way, turns, axis=0) / MM for way in posed[1:] - posed[0])
        parts.append(primitive(balls / MM, corners, DOT, binary, each_ball))
    mesh = {"name": "head", "primitives": parts}
    return mesh | ({"weights": [0.0] * len(named), "extras": {"targetNames": named}} if named else {})


def dots_as_balls(of: Delivery) -> tuple[Float[np.ndarray, "v 3"], Int[np.ndarray, "f 3"], int]:
    """A ball as wide as the dot around every marker, millimetres, and how many vertices each has."""
    ball = trimesh.creation.icosphere(subdivisions=ROUND, radius=of.plan.settings.landmarks.dot_mm / 2)
    points, faces, places = np.asarray(ball.vertices), np.asarray(ball.faces), dots_mm(of.plan, of.inputs)
    first = len(points) * np.arange(len(places))[:, None, None]
    return (places[:, None] + points).reshape(-1, 3), (faces + first).reshape(-1, 3), len(points)


def primitive(
    vertices: Float[np.ndarray, "v 3"],
    triangles: Int[np.ndarray, "f 3"],
    of_material: int,
    binary: Binary,
    moved: Iterable[Float[np.ndarray, "v 3"]],
) -> dict[str, Any]:
    """A surface with smooth normals, and how far each morph target has `moved` it."""
    normals = vertex_normals(vertices, triangles)
    normals[~normals.any(axis=1)] = (0, 0, 1)  # 3.7.2.1 wants unit vectors, also where nothing is drawn
    attributes = {"POSITION": binary.points(vertices), "NORMAL": binary.points(normals)}
    made = {"attributes": attributes, "indices": binary.corners(triangles), "material": of_material}
    targets = [{"POSITION": binary.points(each)} for each in moved]
    return made | ({"targets": targets} if targets else {})


def material(name: str, red: float, green: float, blue: float) -> dict[str, Any]:
    """A matt colour that is seen from both sides."""
    shade = {"baseColorFactor": [red, green, blue, 1], "metallicFactor": 0, "roughnessFactor": 0.7}
    return {"name": name, "pbrMetallicRoughness": shade, "doubleSided": True}


def glb_bytes(made: dict[str, Any], data: bytes) -> bytes:
    """The container: header, JSON, binary part (4.4)."""
    text = json.dumps(made, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<II", len(text), JSON_CHUNK) + text + struct.pack("<II", len(data), BINARY_CHUNK) + data
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks
