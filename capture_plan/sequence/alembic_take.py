"""Takes as Alembic (`.abc`): points of meshes over time. The format knows neither unit nor axes.

Data      x[t, v] or x[v], M[t], sizes and corners of each mesh, as `alembic_program.py` writes them
Frames    X[t, v] = M[t] x[t, v], meshes one after the other in the file's order
Rate      from the times of the samples
The library is native code that reads what a stranger wrote, so it has a process of its own, with a limit on memory and
time. It is an extra, `capture-plan[alembic]`.
"""

import importlib.util
from itertools import count
from pathlib import Path

import numpy as np

from capture_plan.curves.clock import timing_of
from capture_plan.errors import RigError
from capture_plan.formats.own_process import BrokenProcessError, arrays_from
from capture_plan.formats.raw import FARTHEST, fan
from capture_plan.sequence.meshes import MeshTake
from capture_plan.sequence.usd_take import PlacedPoints, StageFrames

PROGRAM = Path(__file__).with_name("alembic_program.py")
SECONDS = 600.0
ADVICE = "export it as USD, or as numbered OBJ files"


def read_alembic_take(path: Path) -> MeshTake:
    """The take in the file at `path`.

    Raises:
        RigError: it has no mesh of the same faces in every frame, or the extra is missing.
    """
    if importlib.util.find_spec("alembic3d") is None:
        raise RigError(f"is Alembic: install what reads it with pip install 'capture-plan[alembic]', or {ADVICE}")
    try:
        arrays = arrays_from(PROGRAM, path.resolve(), seconds=SECONDS)
    except BrokenProcessError as error:
        raise RigError(f"cannot be read (it is damaged, or holds more than 1 GiB of motion): {ADVICE}") from error
    if "changing" in arrays:
        raise RigError(f"has a mesh whose faces change from frame to frame: {ADVICE} of one mesh")
    return build_take(arrays)


def build_take(arrays: dict[str, np.ndarray]) -> MeshTake:
    """The take of the program's arrays. RigError where they hold no whole mesh."""
    placed, triangles, first = [], [], 0
    for number in count():
        if f"{number}/points" not in arrays:
            break
        points, places, sizes, corners = (arrays[f"{number}/{n}"] for n in ("points", "places", "sizes", "corners"))
        v = points.shape[1]
        whole = (
            len(sizes) and sizes.min() >= 3 and sizes.sum() == len(corners) and 0 <= corners.min() <= corners.max() < v
        )
        if not whole or not all((np.abs(x) < FARTHEST).all() for x in (points, places)):
            continue
        placed.append(PlacedPoints(points, places))
        triangles.append(fan(corners, sizes) + first)
        first += v
    if not placed:
        raise RigError("has no mesh with faces: export the face mesh")
    timing = timing_of([repr(time) for time in arrays["times"].tolist()], 1.0)
    frames = StageFrames(tuple(placed))
    return MeshTake(frames, np.concatenate(triangles).astype(np.int32), None, timing.fps, notes=timing.notes)
