"""Takes as USD (`.usd`, `.usda`, `.usdc`, `.usdz`): points of meshes, or weights of blendshapes, with time samples.

Data      x[t, v] or x[v]   points of each mesh over time, or one set of them where it only moves as a whole
          M[t]              its place in the stage: transform stack, or that of its skeleton, as for rigs
Frames    X[t, v] = M[t] x[t, v]   meshes one after the other in the stage's order, as the rig of the same file
Weights   of the UsdSkel animations that skeletons play, which drive a rig by name; these come before points
Times     one frame for each time code (closer where the samples are closer), between samples in a straight line;
          frames in a second from timeCodesPerSecond, unit and axes from metersPerUnit and upAxis
The stage is opened in a process of its own (`usd_scene.py`), which gives at most 1 GiB of motion: 3,300 frames of
26,719 vertices. A longer take is refused before memory is asked for: cut it into parts.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from capture_plan.curves.weights import WeightTable
from capture_plan.errors import RigError
from capture_plan.formats import usd
from capture_plan.formats.raw import FARTHEST
from capture_plan.formats.scene import plain_line
from capture_plan.sequence.meshes import MeshTake


@dataclass(frozen=True, eq=False)
class PlacedPoints:
    """Points of one mesh, of every frame or one set for all, and its place in every frame."""

    points: Float[np.ndarray, "s v 3"]
    places: Float[np.ndarray, "t 4 4"]

    def block(self, start: int, stop: int) -> Float[np.ndarray, "n v 3"]:
        """M[t] x[t, v] of frames `start` to `stop` - 1."""
        x = self.points if len(self.points) == 1 else self.points[start:stop]
        M = self.places[start:stop]
        return np.matmul(x.astype(np.float64), M[:, :3, :3].transpose(0, 2, 1)) + M[:, None, :3, 3]


@dataclass(frozen=True, eq=False)
class StageFrames:
    """Frames of all meshes of a stage."""

    meshes: tuple[PlacedPoints, ...]

    def __len__(self) -> int:
        return len(self.meshes[0].places)

    def block(self, start: int, stop: int) -> Float[np.ndarray, "t v 3"]:
        """Frames `start` to `stop` - 1."""
        return np.concatenate([mesh.block(start, stop) for mesh in self.meshes], axis=1)


def read_usd_take(path: Path) -> MeshTake | WeightTable:
    """The take in the file at `path`. RigError where nothing in it moves, or when usd-core is missing."""
    with np.errstate(all="ignore"):
        return build_take(*usd.run(path, "take"))


def build_take(scene: dict[str, Any], arrays: dict[str, np.ndarray]) -> MeshTake | WeightTable:
    """The take of a scene."""
    if "names" in scene:
        columns = tuple(plain_line(name) for name in scene["names"])
        return WeightTable(
            columns, arrays["weights"], scene["fps"], (), tuple(plain_line(note) for note in scene["notes"])
        )
    meshes = usd.read_meshes(scene, arrays)
    triangles = np.concatenate([mesh.triangles + mesh.first for mesh in meshes])
    if len(triangles) == 0:
        raise RigError("has no mesh with faces: export the face mesh")
    moved = [arrays[one["moving"]] if "moving" in one else arrays[one["points"]][None] for one in scene["meshes"]]
    placed = [PlacedPoints(x, arrays[one["places"]]) for x, one in zip(moved, scene["meshes"], strict=True)]
    if not all((np.abs(x) < FARTHEST).all() for one in placed for x in (one.places, one.points)):
        raise RigError("moves a mesh to where no number is: export it again")
    up, facing = usd.FACING.get(scene["up"], (None, None))
    notes = (note,) if (note := usd.scene_note(scene)) else ()
    frames = StageFrames(tuple(placed))
    return MeshTake(frames, triangles.astype(np.int32), None, scene["fps"], usd.unit(scene), up, facing, notes)
