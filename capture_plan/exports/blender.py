"""Markers as a script for Blender: `markers_blender.py`, which stands alone. Metres, +z up, the face looks along -y.

Script   `blender_scene.py`, with the plan's numbers in it: an empty for each marker, keyed in every pose, and the head
         of the meshes that `--only meshes` writes beside it, in their own unit and axes
Head     x_blender = M x_mesh, M = R diag(unit) of the mesh's frame; without faces that are no part of the plan's rig,
         such as bodies and the fitting shells of MakeHuman

Letters: m markers, e poses.
"""

import json
from importlib.resources import files
from pathlib import Path

import numpy as np
from jaxtyping import Float

from capture_plan.exports.delivery import Delivery, posed_dots_mm
from capture_plan.exports.expression_meshes import mesh_of
from capture_plan.exports.marker_names import distinct_names
from capture_plan.exports.units import Z_UP
from capture_plan.output import write_whole
from capture_plan.plan.record import words_of

MM = 1000  # in a metre
LONGEST = 15  # letters of a name: Blender takes 63 bytes, and a letter may have four
HOLE = "PLAN_AS_JSON"


def write(of: Delivery, folder: Path) -> list[Path]:
    """Write the script with all poses of the plan in it."""
    frames = (posed_dots_mm(of.plan, of.inputs) @ Z_UP.T / MM).round(7)
    markers = [
        {"name": name, "label": marker.label, "frames": places}
        for name, marker, places in zip(
            distinct_names(of.names, longest=LONGEST),
            of.plan.layout.markers,
            frames.transpose(1, 0, 2).tolist(),
            strict=True,
        )
    ]
    scene = {
        "of": words_of(of.plan),
        "poses": list(of.poses),
        "meshes": f"expressions{of.suffix}",
        "mesh_to_blender": mesh_to_blender(of).tolist(),
        "shown": shown(of),
        "dot_radius": of.plan.settings.landmarks.dot_mm / 2 / MM,
        "markers": markers,
    }
    script = files("capture_plan.exports").joinpath("blender_scene.py").read_text(encoding="utf-8")
    path = of.place(folder, "markers_blender", ".py")
    data = json.dumps(scene, indent=1)  # which never has three quotes in a row
    write_whole(path, script.replace(HOLE, data).encode())
    return [path]


def mesh_to_blender(of: Delivery) -> Float[np.ndarray, "4 4"]:
    """The matrix that places the meshes of the expressions, which are in the artist's frame or in the plan's."""
    rig = of.inputs.rig
    M = np.eye(4)
    M[:3, :3] = Z_UP / MM
    if mesh_of(of)[0]:
        M[:3, :3] = rig.unit_mm * Z_UP @ np.reshape(rig.turn, (3, 3)) / MM
    return M


def shown(of: Delivery) -> list[list[int]]:
    """Ranges of vertices of the meshes that the plan's rig has, first and last, counted from 0."""
    rig = of.inputs.rig
    at = np.unique(rig.source_index) if mesh_of(of)[0] else np.arange(len(rig.neutral))
    breaks = np.flatnonzero(np.diff(at) > 1)
    return [[int(run[0]), int(run[-1])] for run in np.split(at, breaks + 1)]
