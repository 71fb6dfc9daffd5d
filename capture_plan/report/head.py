"""A head packed for the browser: what the 3D viewer draws, small enough to travel inside one HTML file.

Data       v0 (v 3), d (k v 3)   neutral and deltas in millimetres, of the blendshapes that the plan uses
           S                     kind of every part, which `viewer.js` gives a look
Packing    positions             int16, v0 = centre + unit * steps; the step is below 0.01 mm for a human head
           deltas                sparse: only vertices that move by a step or more; vertex numbers as differences
           blob                  the arrays one after the other, deflated, base64; a table says where each one lies
"""

import base64
import zlib
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from capture_plan.layout.record import Landmark
from capture_plan.rig import Rig
from capture_plan.rig.parts import part_kind
from capture_plan.sheets import region_looks

DELTA_STEP_MM = 0.01  # a fifth of the thinnest visible line of a head that fills a screen
INT16 = 32767
SHADE = 255


def packed_head(rig: Rig, names: tuple[str, ...], shade: Float[np.ndarray, " v"]) -> dict[str, Any]:
    """What `viewer.js` reads: geometry with the deltas of blendshapes `names`.

    `shade` darkens vertices that little light reaches, 0 to 1.
    """
    centre = (rig.neutral.min(axis=0) + rig.neutral.max(axis=0)) / 2
    unit = float(np.abs(rig.neutral - centre).max() / INT16)
    chosen = rig.rows(names)
    step = max(DELTA_STEP_MM, float(np.abs(rig.deltas).max()) / INT16)
    steps = np.rint(rig.deltas[chosen] / step).astype(np.int16)
    moved_k, moved_v = np.nonzero(steps.any(axis=2))
    materials, of_triangle = triangle_materials(rig)
    blob, table = packed(
        {
            "positions": np.rint((rig.neutral - centre) / unit).astype(np.int16).T,
            "triangles": rig.triangles.astype(np.uint32).T,
            "materials": of_triangle.astype(np.uint8),
            "shade": np.rint(np.clip(shade, 0, 1) * SHADE).astype(np.uint8),
            "delta_counts": np.bincount(moved_k, minlength=len(chosen)).astype(np.uint32),
            "delta_vertices": np.diff(moved_v, prepend=0).astype(np.int32),
            "delta_steps": steps[moved_k, moved_v].T,
        }
    )
    return {
        "centre": centre.tolist(),
        "unit": unit,
        "step": step,
        "blendshapes": names,
        "materials": materials,
        "arrays": table,
        "blob": blob,
    }


def triangle_materials(rig: Rig) -> tuple[list[str], Int[np.ndarray, " f"]]:
    """Kinds of the parts in use, and the number of each triangle's: skin is skin, whatever its name says."""
    kinds = [part_kind(name) for name in rig.part_names]
    of_part = np.array(["inside" if kind == "skin" else kind for kind in kinds])
    of_vertex = np.where(rig.skin, "skin", of_part[rig.parts])
    names, of_vertex = np.unique(of_vertex, return_inverse=True)
    return names.tolist(), of_vertex[rig.triangles[:, 0]]


def packed(arrays: dict[str, np.ndarray]) -> tuple[str, list[list[Any]]]:
    """The arrays as deflated base64, and (name, type, number of entries) of each in the order they lie in it."""
    little = [np.ascontiguousarray(array.astype(array.dtype.newbyteorder("<"))).ravel() for array in arrays.values()]
    table = [[name, str(array.dtype), array.size] for name, array in zip(arrays, little, strict=True)]
    return base64.b64encode(zlib.compress(b"".join(map(bytes, little)), 9)).decode(), table


def packed_landmarks(rig: Rig, landmarks: tuple[Landmark, ...]) -> list[dict[str, Any]]:
    """Name, place, colour and position of every landmark, as the corners of a triangle and their weights."""
    looks = region_looks(landmarks)
    return [
        {
            "name": landmark.name,
            "label": landmark.label,
            "region": landmark.region,
            "side": landmark.side,
            "role": landmark.role,
            "colour": looks[landmark.region].colour,
            "corners": rig.triangles[landmark.triangle].tolist(),
            "barycentric": landmark.barycentric,
            "blendshapes": landmark.blendshapes,
            "visibility": landmark.visibility,
            "vertex": landmark.source_vertex,
        }
        for landmark in landmarks
    ]
