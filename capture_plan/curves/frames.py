"""Where the frames of a take come from: an array, weights on a rig, or one file for each frame.

X[t] = v0 + sum_k w[t, k] d[k]     posed from weights
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float, Int

from capture_plan.errors import RigError
from capture_plan.rig.record import Rig


@runtime_checkable
class Frames(Protocol):
    """Where the frames come from."""

    def __len__(self) -> int: ...

    def block(self, start: int, stop: int) -> Float[np.ndarray, "t v 3"]:
        """Frames `start` to `stop` - 1."""
        ...


@dataclass(frozen=True, eq=False)
class StoredFrames:
    """Frames that are in memory."""

    array: Float[np.ndarray, "t v 3"]

    def __len__(self) -> int:
        return len(self.array)

    def block(self, start: int, stop: int) -> Float[np.ndarray, "t v 3"]:
        """Frames `start` to `stop` - 1."""
        return self.array[start:stop].astype(np.float64)


@dataclass(frozen=True, eq=False)
class PosedFrames:
    """A rig driven by `weights`, posed when asked for."""

    rig: Rig
    weights: Float[np.ndarray, "t k"]

    def __len__(self) -> int:
        return len(self.weights)

    def block(self, start: int, stop: int) -> Float[np.ndarray, "t v 3"]:
        """v0 + sum_k w[t, k] d[k], by the blendshapes that move in these frames."""
        w = self.weights[start:stop]
        moving = np.flatnonzero(w.any(axis=0))
        d = self.rig.deltas[moving].reshape(len(moving), self.rig.neutral.size)
        moved = w[:, moving].astype(np.float32) @ d  # float32: the deltas are no finer
        return self.rig.neutral + moved.reshape(len(w), -1, 3)


@dataclass(frozen=True, eq=False)
class FileFrames:
    """One file for each frame, of `count` vertices as the file `like` has them, read when asked for."""

    paths: tuple[Path, ...]
    read: Callable[[Path], Float[np.ndarray, "v 3"]]
    count: int
    like: Path

    def __len__(self) -> int:
        return len(self.paths)

    def block(self, start: int, stop: int) -> Float[np.ndarray, "t v 3"]:
        """Frames `start` to `stop` - 1. RigError that names the file where the mesh changes."""
        return np.stack([self.one(path) for path in self.paths[start:stop]])

    def one(self, path: Path) -> Float[np.ndarray, "v 3"]:
        """The vertices of one file."""
        vertices = self.read(path)
        if len(vertices) != self.count:
            raise RigError(
                f"{path.name} has {len(vertices):,} vertices, the frame {self.like.name} has "
                f"{self.count:,}: every frame must be of the same mesh"
            )
        return vertices


@dataclass(frozen=True, eq=False)
class ChosenFrames:
    """The vertices `chosen` of `frames`: a take of the artist's whole file, of which the rig has a part."""

    frames: Frames
    chosen: Int[np.ndarray, " n"]

    def __len__(self) -> int:
        return len(self.frames)

    def block(self, start: int, stop: int) -> Float[np.ndarray, "t n 3"]:
        """Frames `start` to `stop` - 1."""
        return self.frames.block(start, stop)[:, self.chosen]


@dataclass(frozen=True, eq=False)
class SelectedFrames:
    """The frames `indices` of `frames`, in ascending order: a take without what does not show its mesh."""

    frames: Frames
    indices: Int[np.ndarray, " n"]

    def __len__(self) -> int:
        return len(self.indices)

    def block(self, start: int, stop: int) -> Float[np.ndarray, "n v 3"]:
        """Frames `start` to `stop` - 1 of those kept, each run of neighbours read at once."""
        indices = self.indices[start:stop]
        some = np.split(indices, np.flatnonzero(np.diff(indices) > 1) + 1)
        return np.concatenate([self.frames.block(int(run[0]), int(run[-1]) + 1) for run in some])


def evenly(count: int, most: int) -> Sequence[int]:
    """Up to `most` numbers of `count`, the first and the last among them."""
    return tuple(np.unique(np.linspace(0, count - 1, min(count, most)).round().astype(int)).tolist())
