"""What a take does to a face: the thin shell of the part that moves, and its motion.

Data     x_v, triangles, skin; X[t, v] the frames, millimetres
Part     triangles of skin with a vertex that somewhere in the take is `STILL_MM` from its rest; the largest piece
Held     points of its rim, which is still (`boundary.py`); markers stand on what moves
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Int

from capture_plan.errors import RigError
from capture_plan.layout.shell.boundary import STILL_MM, find_boundary
from capture_plan.layout.shell.model import Shell
from capture_plan.layout.shell.motion import Motion, motion_from_rig, motion_of
from capture_plan.layout.shell.skinning import Sizes
from capture_plan.mesh import pieces
from capture_plan.mesh.mirror import mirror_map
from capture_plan.rig import Rig
from capture_plan.rig.sequence import Sequence
from capture_plan.rig.sequence.frames import PosedFrames

UNUSED = 0.1  # a blendshape whose weight never exceeds it was not performed


@dataclass(frozen=True, eq=False)
class Take:
    """`at` are the rig's vertices of the shell, ascending; `motion` is of all frames, not compressed.

    `candidates` are the vertices of the shell that may carry a marker.
    """

    rig: Rig
    sequence: Sequence
    at: Int[np.ndarray, " v"]
    shell: Shell
    motion: Motion
    candidates: Bool[np.ndarray, " v"]

    @cached_property
    def loose(self) -> Shell:
        """The same shell with nothing held."""
        return replace(self.shell, fixed=np.zeros(len(self.at), dtype=bool))

    @cached_property
    def mirror(self) -> Int[np.ndarray, " v"]:
        """The mirror image of each vertex of the shell."""
        return mirror_map(self.shell.vertices)

    @property
    def sizes(self) -> Sizes:
        """What compression is counted from."""
        return Sizes(len(self.at), len(self.shell.triangles), len(self.sequence))

    def over(self, frames: Int[np.ndarray, " t"]) -> Motion:
        """The motion of some frames."""
        return motion_over(self.sequence, self.at, frames)

    def places(self, vertices: Int[np.ndarray, " m"]) -> Int[np.ndarray, " n"]:
        """Numbers in the shell of those of the rig's vertices that may carry a marker there."""
        number = np.full(len(self.rig.neutral), -1)
        number[self.at[self.candidates]] = np.flatnonzero(self.candidates)
        found = number[vertices]
        return found[found >= 0]


def face_take(rig: Rig, sequence: Sequence) -> Take:
    """The part of a rig's skin that a take of its mesh moves.

    Raises:
        RigError: the take is of another mesh, or moves nothing.
    """
    if len(sequence.neutral) != len(rig.neutral):
        raise RigError(
            f"{sequence.name} has {len(sequence.neutral):,} vertices, the rig {rig.name} has {len(rig.neutral):,}: "
            "read the take with this rig"
        )
    furthest = sequence.motion()
    moved = rig.skin & (furthest >= STILL_MM)
    triangles = rig.triangles[rig.skin[rig.triangles].all(axis=1) & moved[rig.triangles].any(axis=1)]
    if not len(triangles):
        raise RigError(f"{sequence.name} moves no skin by {STILL_MM:g} mm: give a take in which the face moves")
    piece = pieces(triangles, len(rig.neutral))[triangles[:, 0]]
    triangles = triangles[piece == np.bincount(piece).argmax()]
    at, inside = np.unique(triangles, return_inverse=True)
    vertices, triangles = sequence.neutral[at], inside.reshape(-1, 3)
    rim = find_boundary(vertices, triangles, furthest[at])
    shell = Shell(vertices, triangles, rim.fixed)
    return Take(rig, sequence, at, shell, motion_over(sequence, at, np.arange(len(sequence))), rim.moving)


def motion_over(sequence: Sequence, at: Int[np.ndarray, " n"], frames: Int[np.ndarray, " t"]) -> Motion:
    """The displacements of some vertices in some frames; from the weights where the take has weights."""
    posed = sequence.frames
    if isinstance(posed, PosedFrames):
        return motion_from_rig(posed.weights[frames], posed.rig.deltas[:, at])
    return motion_of(np.stack([sequence.frame(int(t))[at] - sequence.neutral[at] for t in frames]))


def unperformed(sequence: Sequence) -> tuple[str, ...]:
    """Blendshapes whose weight never exceeds `UNUSED`; none are known of a take without weights."""
    posed = sequence.frames
    if not isinstance(posed, PosedFrames):
        return ()
    most = posed.weights.max(axis=0)
    return tuple(name for name, weight in zip(posed.rig.names, most, strict=True) if weight <= UNUSED)
