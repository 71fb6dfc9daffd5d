"""A rig for a take that has none: its neutral, coarse enough to plan on, and some of its frames for blendshapes.

Data       v0, X[t]   neutral and frames of a dense scan, millimetres
Coarse     the scan's vertices that `decimate` keeps; the frames follow them, and `source_index` leads back to the scan
Rig        d_k = X[t_k] - v0 for frames t_k, evenly over the take: enough to tell which skin moves and what hides it
Skin       as a person lists it by vertices of the scan, or found as that of a rig
"""

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
from jaxtyping import Bool

from capture_plan.curves.frames import ChosenFrames, evenly
from capture_plan.errors import RigError
from capture_plan.face.skin import find_skin
from capture_plan.mesh.decimate import decimate
from capture_plan.reader.read import listed_skin
from capture_plan.rig.record import Rig
from capture_plan.sequence.record import Sequence

POSES = 40  # frames that stand for blendshapes
SAME_MM = 0.5  # a frame that moves no vertex that far shows the neutral


def stand_in_rig(
    sequence: Sequence, *, triangles: int, skin: Bool[np.ndarray, " v"] | None = None
) -> tuple[Rig, Sequence]:
    """A rig whose blendshapes are frames, and the take on its mesh of at most so many triangles.

    `skin` marks vertices of the scan; without it the skin is found.

    Raises:
        RigError: the take has a rig of its own, no frame of it moves, or no triangle lies on the skin.
    """
    if sequence.rig is not None:
        raise RigError(f"{sequence.name} has blendshapes of its own: plan from the rig, with this take as --sequence")
    retained, corners = decimate(sequence.neutral, sequence.triangles, triangles)
    coarse = replace(
        sequence, neutral=sequence.neutral[retained], triangles=corners, frames=ChosenFrames(sequence.frames, retained)
    )
    deltas = {f"frame_{t}": coarse.frame(t) - coarse.neutral for t in evenly(len(coarse), POSES)}
    moved = {name: d.astype(np.float32) for name, d in deltas.items() if np.linalg.norm(d, axis=1).max() > SAME_MM}
    if not moved:
        raise RigError(f"{sequence.name}: no frame moves by {SAME_MM:g} mm: give a take of a face that moves")
    parts, d = np.zeros(len(retained), dtype=np.int32), np.stack(list(moved.values()))
    found = find_skin(coarse.neutral, coarse.triangles, d, parts, ("mesh",)) if skin is None else skin[retained]
    if not found[coarse.triangles].all(axis=1).any():
        raise RigError(f"{sequence.name}: no triangle of it lies on the skin: list the vertices of the face as skin")
    rig = Rig(
        name=sequence.name,
        neutral=coarse.neutral.astype(np.float64),
        triangles=coarse.triangles.astype(np.int32),
        deltas=d,
        names=tuple(moved),
        skin=found,
        parts=parts,
        part_names=("mesh",),
        source_index=retained.astype(np.int32),
    )
    return rig, replace(coarse, rig=rig)


def skin_of_scan(file: str, sequence: Sequence) -> Bool[np.ndarray, " v"]:
    """The skin of a take that a person lists in a text file of vertex numbers.

    Raises:
        RigError: there is no such file, or it names no vertex.
    """
    if not os.path.isfile(file):
        raise RigError(f"skin: '{file}' is no file, and a take has no parts: give a text file of vertex numbers")
    return listed_skin(Path(file), np.arange(len(sequence.neutral)), sequence.name)
