"""The actor's neutral face on the rig's mesh, for what depends on how the two differ."""

import os
from pathlib import Path

import numpy as np
from jaxtyping import Float

from capture_plan.errors import RigError
from capture_plan.formats.obj import is_obj, load_text, parse_vertices
from capture_plan.formats.raw import FARTHEST
from capture_plan.reader.read import read_raw
from capture_plan.rig.record import Rig


def read_neutral(path: Path, rig: Rig) -> Float[np.ndarray, "v 3"]:
    """Vertices in the rig's order and the file's own unit and axes: an OBJ file, or the neutral of another rig.

    Raises:
        RigError: unreadable, another number of vertices, or coordinates that are no numbers.
    """
    if not os.path.exists(path):
        raise RigError(f"{path} does not exist: give an OBJ file of the actor's neutral, or a rig")
    if is_obj(path):
        vertices = parse_vertices(load_text(path), path)
        numbers = np.arange(len(vertices))
    else:
        raw = read_raw(path)
        vertices, numbers = raw.neutral, raw.source_index
    if len(vertices) > len(rig.neutral) and np.isin(rig.source_index, numbers).all():
        order = np.argsort(numbers, kind="stable")  # the rig is a part of the mesh, such as the head of a figure
        vertices = vertices[order[np.searchsorted(numbers[order], rig.source_index)]]
    if len(vertices) != len(rig.neutral):
        raise RigError(
            f"{path.name} has {len(vertices):,} vertices, {rig.name} has {len(rig.neutral):,}: "
            "bring the actor's neutral onto the rig's mesh first"
        )
    if not (np.abs(vertices) < FARTHEST).all():
        raise RigError(
            f"{path.name} holds NaN, infinite or coordinates beyond {FARTHEST:.0e}: clean the mesh and export it"
        )
    return vertices
