"""A take: one mesh in many frames, in the rig's unit and axes, with the motion of the head taken out.

Data    v0        neutral of the take, millimetres
        X[t, v]   frames, millimetres: held in memory, posed from weights, or read from files when they are asked for
Frames are asked for in chunks of about `CHUNK_BYTES`, so that a take of any length needs little memory.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float, Int

from capture_plan.curves.frames import Frames, PosedFrames
from capture_plan.curves.mapping import WeightMapping
from capture_plan.curves.take_report import fold, length, mapped
from capture_plan.errors import RigError
from capture_plan.progress import track
from capture_plan.rig.record import Rig

CHUNK_BYTES = 64e6
UNUSED = 0.1  # a blendshape whose weight never exceeds it was not performed


@dataclass(frozen=True, eq=False)
class Sequence:
    """`neutral` and `frames` in millimetres, +y up, facing +z, the head held still; `fps` frames in a second.

    `rig` is the rig whose mesh this is, where there is one; `mapping` says which recorded weight drives what; `notes`
    are sentences about what was assumed or left out.
    """

    name: str
    neutral: Float[np.ndarray, "v 3"]
    triangles: Int[np.ndarray, "f 3"]
    frames: Frames
    fps: float
    rig: Rig | None = None
    mapping: WeightMapping | None = None
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if len(self.frames) == 0:
            raise RigError(f"{self.name} has no frames: export the take again")
        if not (np.isfinite(self.fps) and self.fps > 0):
            raise RigError(f"{self.name}: {self.fps:g} frames in a second, expected a number above 0, such as 60")
        if self.rig is not None and len(self.rig.neutral) != len(self.neutral):
            raise RigError(
                f"{self.name} has {len(self.neutral):,} vertices, the rig {self.rig.name} has "
                f"{len(self.rig.neutral):,}: bring the take onto the rig's mesh first"
            )

    def __len__(self) -> int:
        return len(self.frames)

    @property
    def seconds(self) -> float:
        """How long the take lasts."""
        return len(self) / self.fps

    @cached_property
    def chunk(self) -> int:
        """How many frames are held in memory at a time."""
        return max(1, int(CHUNK_BYTES / (24 * max(len(self.neutral), 1))))

    def messages(self) -> tuple[str, ...]:
        """What was understood of the file: its length, its notes, which weight drives what, and what hardly moves."""
        notes = [line for note in self.notes for line in fold(f"note: {note}", "", "  ")]
        drives = mapped(self.mapping) if self.mapping else []
        still = self.hardly_moved()
        verb = "moves" if len(still) == 1 else "move"
        head = f"{len(still)} of the driven blendshapes hardly {verb} (no weight above {UNUSED:g}):"
        hardly = [head, *fold(", ".join(still), then="  ")]
        lines = [*notes, *drives, *(hardly if still else [])]
        return (f"{self.name}: {length(len(self), self.fps)}", *(f"  {line}" for line in lines))

    def hardly_moved(self) -> tuple[str, ...]:
        """Blendshapes that recorded weights drive, but hardly move."""
        if self.mapping is None or not isinstance(self.frames, PosedFrames):
            return ()
        most = dict(zip(self.frames.rig.names, np.abs(self.frames.weights).max(axis=0).tolist(), strict=True))
        driven = dict.fromkeys(one.blendshape for one in self.mapping.drives if one.share)
        return tuple(name for name in driven if most[name] <= UNUSED)

    def chunks(self) -> Iterator[tuple[int, Float[np.ndarray, "t v 3"]]]:
        """(number of the first frame, frames) of one chunk after the other."""
        starts = range(0, len(self), self.chunk)
        for start in track(starts, f"Reading {self.name}"):
            yield start, self.frames.block(start, min(start + self.chunk, len(self)))

    def frame(self, t: int) -> Float[np.ndarray, "v 3"]:
        """Frame `t`, counted from 0; RigError where there is none."""
        if not 0 <= t < len(self):
            raise RigError(f"{self.name} has the frames 0 to {len(self) - 1:,}, frame {t:,} was asked for")
        return self.frames.block(t, t + 1)[0]

    def places(self, at: Int[np.ndarray, " n"]) -> Float[np.ndarray, "t n 3"]:
        """Where some vertices are in every frame, millimetres."""
        return np.concatenate([block[:, at] for _, block in self.chunks()])

    def motion(self) -> Float[np.ndarray, " v"]:
        """How far each vertex gets from the neutral in the whole take, millimetres."""
        furthest = np.zeros(len(self.neutral))
        for _, block in self.chunks():
            np.maximum(furthest, np.linalg.norm(block - self.neutral, axis=2).max(axis=0), out=furthest)
        return furthest
