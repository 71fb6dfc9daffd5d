"""What the takes of one person do to a face: the thin shell of the skin that they move, and its motion.

Data     x_v the person's neutral; X[t, v] the frames of one or several sessions, millimetres; a `MovingPart`
Error    RMSE = sqrt(mean over the frames and the part's vertices of |X_tv - (W X_tH)_v|^2), each session with its
         share whatever its length
A marker on a held point or beyond the rim bends nothing: the rim is still without it.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float, Int
from msgspec import Struct

from capture_plan.mesh.mirror import mirror_map
from capture_plan.rig import Rig
from capture_plan.sequence import Sequence
from capture_plan.sequence.record import UNUSED
from capture_plan.shell.model import Shell, held_shell
from capture_plan.shell.motion import Motion, stack_sessions
from capture_plan.shell.moving_region import MovingPart, part_of
from capture_plan.shell.take_basis import Recording, record


class ShellSizes(Struct, frozen=True):
    """A mesh and a take: N vertices, T triangles, F frames."""

    vertices: int
    triangles: int
    frames: int


@dataclass(frozen=True, eq=False)
class Take:
    """`at` are the rig's vertices of the shell, ascending; `motion` is of all frames, its rows x, y, z.

    `candidates` are the vertices of the shell that may carry a marker.
    """

    rig: Rig
    recordings: tuple[Recording, ...]
    at: Int[np.ndarray, " v"]
    shell: Shell
    motion: Motion
    candidates: Bool[np.ndarray, " v"]

    @property
    def sequence(self) -> Sequence:
        """The sequence of the first session."""
        return self.recordings[0].sequence

    @property
    def frames(self) -> int:
        """How many frames all sessions have."""
        return sum(len(one) for one in self.recordings)

    @cached_property
    def loose(self) -> Shell:
        """The shell of the take with nothing held."""
        return replace(self.shell, fixed=np.zeros(len(self.at), dtype=bool))

    @cached_property
    def mirror(self) -> Int[np.ndarray, " v"]:
        """The mirror image of each vertex of the shell."""
        return mirror_map(self.shell.vertices)

    @property
    def sizes(self) -> ShellSizes:
        """What compression is counted from."""
        return ShellSizes(len(self.at), len(self.shell.triangles), self.frames)

    def over(self, frames: Int[np.ndarray, " t"]) -> Motion:
        """The motion of some frames, numbered through the sessions."""
        return motion_over(self.recordings, self.at, frames)

    def places(self, vertices: Int[np.ndarray, " m"]) -> Int[np.ndarray, " n"]:
        """Numbers in the shell of those of the rig's vertices where a marker bends it."""
        number = np.full(len(self.rig.neutral), -1)
        number[self.at[~self.shell.fixed]] = np.flatnonzero(~self.shell.fixed)
        found = number[vertices]
        return found[found >= 0]

    def squared_error(self, markers: Int[np.ndarray, " m"]) -> float:
        """E with markers at vertices of the shell; all of the motion while a piece floats freely."""
        if not self.holds(markers):
            return float(np.square(self.motion.rows).sum(axis=1) @ self.motion.weights)
        return self.motion.squared_error(self.shell.weights(markers), markers)

    def holds(self, markers: Int[np.ndarray, " m"]) -> bool:
        """Whether every piece of the shell has a fixed vertex or one of these markers."""
        return bool(np.isin(self.shell.piece, [-1, *self.shell.piece[markers]]).all())

    def missing(self, names: tuple[str, ...]) -> tuple[str, ...]:
        """Those of some blendshapes that no session shows."""
        shown = np.max([one.shown(self.rig, names) for one in self.recordings], axis=0)
        return tuple(name for name, most in zip(names, shown.tolist(), strict=True) if most <= UNUSED)


def face_take(rig: Rig, sequence: Sequence) -> Take:
    """The part of a rig's skin that a take of its mesh moves.

    Raises:
        RigError: the take is of another mesh, or moves nothing.
    """
    recordings = (record(rig, sequence),)
    part = part_of(rig, furthest_of(rig, recordings), sequence.name)
    return take_on(rig, part, recordings, np.ones(len(rig.neutral)))


def take_on(rig: Rig, part: MovingPart, recordings: tuple[Recording, ...], s: Float[np.ndarray, " n"]) -> Take:
    """The sessions of one person on a part, where errors count by s at the rig's vertices."""
    shell = held_shell(recordings[0].sequence.neutral[part.at].astype(float), part.triangles, part.fixed)
    motion = motion_over(recordings, part.at, np.arange(sum(len(one) for one in recordings)))
    return Take(rig, recordings, part.at, shell, motion.weighted(s[part.at]), part.moving)


def furthest_of(rig: Rig, recordings: tuple[Recording, ...]) -> Float[np.ndarray, " n"]:
    """How far each of the rig's vertices gets from rest in any session, millimetres; 0 beyond the skin."""
    furthest = np.zeros(len(rig.neutral))
    for one in recordings:
        furthest[one.at] = np.maximum(furthest[one.at], one.furthest)
    return furthest


def motion_over(recordings: tuple[Recording, ...], at: Int[np.ndarray, " v"], frames: Int[np.ndarray, " t"]) -> Motion:
    """The motion of some of the rig's vertices in some frames, numbered through the sessions."""
    parts, shares, first = [], [], 0
    for one in recordings:
        own = frames[(frames >= first) & (frames < first + len(one))] - first
        first += len(one)
        if len(own):
            parts.append(one.over(own, np.searchsorted(one.at, at)))
            shares.append(one.share)
    # `stack_sessions` gives each the same say
    say = np.sqrt(np.array(shares) / np.mean(shares))
    return stack_sessions(
        [replace(motion, rows=motion.rows * g) for motion, g in zip(parts, say.tolist(), strict=True)]
    )
