"""Expressions for a sculptor and for example-based rigging: meshes, keyframes and which weights each example has.

`neutral.obj`, `E01.obj`   the pose on the artist's own file where the rig is OBJ or PLY files: all its vertices,
                           polygons, textures and groups, its unit and axes; only lines of vertices that move differ.
                           Of other rigs the plan's mesh, millimetres, +y up, facing +z
`keyframes.csv`            frame, then a weight for every blendshape: the neutral on frame 0, expression i on frame i
`examples.json`            for example-based facial rigging (Li, Weise & Pauly 2010): the template, its unit, axes and
                           blendshapes, and for every example its file, its frame and its weights

Letters: v vertices of the rig, n vertices of the artist's file, f triangles.
"""

import json
import math
from pathlib import Path

import numpy as np
from jaxtyping import Float, Int

from capture_plan.errors import RigError
from capture_plan.exports.delivery import Delivery, head_of, poses_mm
from capture_plan.exports.rows import write_rows
from capture_plan.exports.units import Frame, frame_of_file, frame_of_plan
from capture_plan.formats.naming import one_line
from capture_plan.formats.obj import VERTEX
from capture_plan.output import write_whole
from capture_plan.plan.record import head_words, number_of, words_of
from capture_plan.progress import tell
from capture_plan.reader.artist_mesh import ArtistMesh, artist_mesh
from capture_plan.rig import Rig

DIGITS_MM = 4  # behind the point of a millimetre


def write(of: Delivery, folder: Path) -> list[Path]:
    """Write one OBJ per pose, the keyframes and the description of the examples."""
    folder = of.place(folder, "expressions")
    rig = of.inputs.rig
    mesh, why_not = mesh_of(of)
    if why_not:
        tell([f"note: expression meshes are the plan's own mesh in millimetres, not the artist's file: {why_not}"])
    written, said = [], words_of(of.plan)
    for name, vertices in poses_mm(of.plan, of.inputs):
        written.append(folder / f"{name}.obj")
        write_whole(written[-1], on_file(mesh, rig, vertices) if mesh else obj_bytes(vertices, rig.triangles, said))
    frame = frame_of_file(rig) if mesh else frame_of_plan()
    return [*written, write_keyframes(of, folder), write_examples(of, folder, frame, mesh.name if mesh else "")]


def mesh_of(of: Delivery) -> tuple[ArtistMesh | None, str]:
    """The artist's own mesh; None where it cannot be had, with the reason where a person may change that."""
    if of.rig_file is None or head_of(of.inputs) is not of.inputs.rig:
        return None, ""
    try:
        return artist_mesh(of.rig_file), ""
    except RigError as error:
        return None, str(error).rpartition(": ")[0]


def write_keyframes(of: Delivery, folder: Path) -> Path:
    """A row a pose: its frame, and the weight of every blendshape."""
    used = of.plan.audit.used
    rows = [[frame, *(pose.get(name, 0.0) for name in used)] for frame, pose in enumerate(of.poses.values())]
    return write_rows(folder / "keyframes.csv", [["frame", *used], *rows])


def write_examples(of: Delivery, folder: Path, frame: Frame, file: str) -> Path:
    """The description of the examples, whose meshes lie in this frame on this file of the artist's, if on one."""
    examples = {
        "plan": number_of(of.plan),
        "head": head_words(of.plan),
        "template": "neutral.obj",
        "template_is": file or "the plan's own mesh",
        **frame.record(),
        "blendshapes": list(of.plan.audit.used),
        "examples": [
            {"name": name, "mesh": f"{name}.obj", "frame": number, "weights": pose}
            for number, (name, pose) in enumerate(of.poses.items())
            if number
        ],
        "not_shown": list(of.plan.packing.left_out),
    }
    path = folder / "examples.json"
    write_whole(path, json.dumps(examples, indent=1).encode() + b"\n")
    return path


def on_file(mesh: ArtistMesh, rig: Rig, pose: Float[np.ndarray, "v 3"]) -> bytes:
    """The artist's mesh as OBJ with the vertices moved that a pose of the rig moves, in its own unit and axes."""
    moves = np.flatnonzero((pose != rig.neutral).any(axis=1))
    digits = DIGITS_MM + max(0, math.ceil(math.log10(rig.unit_mm)))
    moved = mesh.vertices.copy()
    moved[rig.source_index[moves]] += rig.in_file(pose[moves] - rig.neutral[moves])
    if mesh.obj is None:
        return polygons_as_obj(mesh, moved, digits, rig)
    return replaced_vertices(mesh.obj, moved, rig.source_index[moves], digits)


def replaced_vertices(text: bytes, vertices: Float[np.ndarray, "n 3"], at: Int[np.ndarray, " i"], digits: int) -> bytes:
    """An OBJ file's text with other coordinates for the vertices `at`; decimal commas and colours stay."""
    lines = [*VERTEX.finditer(text)]
    commas = not any(b"." in line[1] for line in lines) and any(b"," in line[1] for line in lines)
    pieces, end = [], 0
    for i in np.unique(at).tolist():
        line = lines[i]
        xyz = " ".join(f"{x:.{digits}f}" for x in vertices[i].tolist())
        xyz = xyz.replace(".", ",") if commas else xyz
        pieces += [text[end : line.start(1)], b" ".join((xyz.encode(), *line[1].split()[3:]))]
        end = line.end(1)
    return b"".join([*pieces, text[end:]])


def polygons_as_obj(mesh: ArtistMesh, vertices: Float[np.ndarray, "n 3"], digits: int, rig: Rig) -> bytes:
    """A mesh that was no OBJ file as one, with its polygons."""
    lines = [f"# {frame_of_file(rig).words()}"]
    lines += [" ".join(("v", *(f"{x:.{digits}f}" for x in vertex))) for vertex in vertices.tolist()]
    polygons = np.split(mesh.faces.corners + 1, np.cumsum(mesh.faces.sizes)[:-1])
    lines += [" ".join(("f", *map(str, polygon.tolist()))) for polygon in polygons]
    return ("\n".join(lines) + "\n").encode()


def obj_bytes(vertices: Float[np.ndarray, "v 3"], triangles: Int[np.ndarray, "f 3"], said: str = "") -> bytes:
    """A mesh as Wavefront OBJ, to a ten-thousandth of a millimetre; vertices are numbered from 1. A comment holds what
    is `said` of it."""
    lines = [f"# {text}" for text in (frame_of_plan().words(), one_line(said)) if text]
    lines += [f"v {x:.4f} {y:.4f} {z:.4f}" for x, y, z in vertices.tolist()]
    lines += [f"f {a} {b} {c}" for a, b, c in (triangles + 1).tolist()]
    return ("\n".join(lines) + "\n").encode()
