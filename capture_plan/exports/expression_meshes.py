"""Expressions for a sculptor and for example-based rigging: meshes, keyframes and which weights each example has.

`neutral.obj`, `E01.obj`   the rig's mesh in that pose, in millimetres and its own vertex order
`keyframes.csv`            frame, then a weight for every blendshape: the neutral on frame 0, expression i on frame i
`examples.json`            for example-based facial rigging (Li, Weise & Pauly 2010): the template, its blendshapes,
                           and for every example its file, its frame and its weights
"""

import json
from pathlib import Path

import numpy as np
from jaxtyping import Float, Int

from capture_plan.exports.tables import write_rows
from capture_plan.expressions.record import Packing
from capture_plan.output import write_whole
from capture_plan.rig import Rig


def write_expression_meshes(rig: Rig, used: tuple[str, ...], packing: Packing, folder: Path) -> list[Path]:
    """Write one OBJ per expression, the keyframes and the description of the examples."""
    poses: list[tuple[str, dict[str, float]]] = [("neutral", {}), *((e.name, e.pose) for e in packing.expressions)]
    written = []
    for name, pose in poses:
        weights = np.array([pose.get(each, 0.0) for each in rig.names])
        written.append(folder / f"{name}.obj")
        write_whole(written[-1], obj_bytes(rig.pose(weights), rig.triangles))
    rows = [[frame, *(pose.get(name, 0.0) for name in used)] for frame, (_, pose) in enumerate(poses)]
    written.append(write_rows(folder / "keyframes.csv", [["frame", *used], *rows]))
    examples = {
        "template": "neutral.obj",
        "unit": "millimetre",
        "blendshapes": list(used),
        "examples": [
            {"name": name, "mesh": f"{name}.obj", "frame": frame, "weights": pose}
            for frame, (name, pose) in enumerate(poses)
            if frame
        ],
        "not_shown": list(packing.left_out),
    }
    written.append(folder / "examples.json")
    write_whole(written[-1], json.dumps(examples, indent=1).encode() + b"\n")
    return written


def obj_bytes(vertices: Float[np.ndarray, "v 3"], triangles: Int[np.ndarray, "f 3"]) -> bytes:
    """A mesh as Wavefront OBJ, to a ten-thousandth of a millimetre; vertices are numbered from 1."""
    lines = [f"v {x:.4f} {y:.4f} {z:.4f}" for x, y, z in vertices.tolist()]
    lines += [f"f {a} {b} {c}" for a, b, c in (triangles + 1).tolist()]
    return ("\n".join(lines) + "\n").encode()
