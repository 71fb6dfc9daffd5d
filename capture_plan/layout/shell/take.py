"""What takes do to a face: the thin shell of the skin that they move, and its motion.

Data     x_v, triangles, skin; X[t, v] the frames of one or several sessions, millimetres
Part     triangles of skin with a vertex that somewhere in the takes is `STILL_MM` from its rest. Left out are loose
         pieces that nothing holds, but for the largest, and crumbs
Held     points of its rim, which is still (`boundary.py`); markers stand on what moves
Error    RMSE = sqrt(mean over the frames and the part's vertices of |X_tv - (W X_tH)_v|^2), each session with the same
         say. A marker on a held point or beyond the rim bends nothing: the rim is still without it
"""

from collections.abc import Sequence as Several
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float, Int

from capture_plan.errors import RigError
from capture_plan.layout.shell.boundary import STILL_MM, find_boundary
from capture_plan.layout.shell.model import Shell
from capture_plan.layout.shell.motion import Motion, together, with_mirror_image
from capture_plan.layout.shell.recording import Recording, in_fewer_frames, record
from capture_plan.layout.shell.skinning import Sizes
from capture_plan.layout.shell.stiffness import with_area
from capture_plan.mesh import pieces
from capture_plan.mesh.mirror import mirror_map
from capture_plan.rig import Rig
from capture_plan.rig.sequence import Sequence

UNUSED = 0.1  # a blendshape whose weight never exceeds it was not performed
CRUMB = 0.01  # of the largest piece: a smaller one is a fold or noise, and asks for a marker where nothing is held
SEARCH_MM = 1e-2  # left out before frames are mirrored: a tenth of what the search leaves out


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
        """The first session."""
        return self.recordings[0].sequence

    @property
    def frames(self) -> int:
        """Of all sessions."""
        return sum(len(one) for one in self.recordings)

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
        return Sizes(len(self.at), len(self.shell.triangles), self.frames)

    def over(self, frames: Int[np.ndarray, " t"]) -> Motion:
        """The motion of some frames, numbered through the sessions."""
        return motion_over(self.recordings, self.at, frames)

    def places(self, vertices: Int[np.ndarray, " m"]) -> Int[np.ndarray, " n"]:
        """Numbers in the shell of those of the rig's vertices where a marker bends it."""
        number = np.full(len(self.rig.neutral), -1)
        number[self.at[~self.shell.fixed]] = np.flatnonzero(~self.shell.fixed)
        found = number[vertices]
        return found[found >= 0]

    def errors(self, vertices: Int[np.ndarray, " m"], counts: Several[int]) -> tuple[float, ...]:
        """RMSE with the first of the rig's vertices as markers, for each of some counts, millimetres."""
        return tuple(self.error(self.places(vertices[:m])) for m in counts)

    def error(self, markers: Int[np.ndarray, " m"]) -> float:
        """RMSE with markers at vertices of the shell, millimetres; all of the motion while a piece floats freely."""
        if not self.holds(markers):
            return float(np.sqrt(np.square(self.motion.rows).sum(axis=1) @ self.motion.weights / self.weight))
        return self.motion.rmse_mm(self.shell.weights(markers), markers)

    @property
    def weight(self) -> float:
        """Of all vertices of the shell together."""
        return float(self.motion.weights.sum())

    def holds(self, markers: Int[np.ndarray, " m"]) -> bool:
        """Whether every piece of the shell has a fixed vertex or one of these markers."""
        return bool(np.isin(self.shell.piece, [-1, *self.shell.piece[markers]]).all())

    def missing(self, names: tuple[str, ...]) -> tuple[str, ...]:
        """Those of some blendshapes that no session shows."""
        shown = np.max([one.shown(self.rig, names) for one in self.recordings], axis=0)
        return tuple(name for name, most in zip(names, shown.tolist(), strict=True) if most <= UNUSED)

    def mirrored(self, mirror: Int[np.ndarray, " v"]) -> "Take":
        """Every frame and its mirror image, on the skin that either moves; `mirror` is of the rig's vertices."""
        twin = take_of(self.rig, self.recordings, mirror=mirror)
        motion = in_fewer_frames(twin.motion, SEARCH_MM)
        return replace(twin, motion=with_mirror_image(motion, twin.mirror))


def face_take(rig: Rig, sequence: Sequence) -> Take:
    """The part of a rig's skin that a take of its mesh moves.

    Raises:
        RigError: the take is of another mesh, or moves nothing.
    """
    return take_of(rig, (record(rig, sequence),))


def take_of(rig: Rig, recordings: tuple[Recording, ...], *, mirror: Int[np.ndarray, " v"] | None = None) -> Take:
    """The sessions together; `mirror`, of the rig's vertices, adds the mirror image of what moves.

    Raises:
        RigError: they move nothing.
    """
    furthest = np.zeros(len(rig.neutral))
    for one in recordings:
        furthest[one.at] = np.maximum(furthest[one.at], one.furthest)
    if mirror is not None:
        furthest = np.where(rig.skin, np.maximum(furthest, furthest[mirror]), 0)
    names, neutral = ", ".join(one.sequence.name for one in recordings), recordings[0].sequence.neutral
    triangles = moved_part(neutral, rig.triangles[rig.skin[rig.triangles].all(axis=1)], furthest)
    if not len(triangles):
        raise RigError(
            f"{names} moves no skin by {STILL_MM:g} mm: check its unit and names, or record more of the face"
        )
    at, inside = np.unique(triangles, return_inverse=True)
    shell_triangles = inside.reshape(-1, 3)
    rim = find_boundary(neutral[at], shell_triangles, furthest[at])
    shell = Shell(neutral[at].astype(float), shell_triangles, rim.fixed)
    everything = np.arange(sum(len(one) for one in recordings))
    return Take(rig, recordings, at, shell, motion_over(recordings, at, everything), rim.moving)


def moved_part(
    neutral: Float[np.ndarray, "v 3"], skin: Int[np.ndarray, "f 3"], furthest: Float[np.ndarray, " v"]
) -> Int[np.ndarray, "_ 3"]:
    """Triangles of the part."""
    moved = furthest >= STILL_MM
    triangles = with_area(neutral, skin[moved[skin].any(axis=1)])
    if not len(triangles):
        return triangles
    piece = pieces(triangles, len(neutral))
    size = np.bincount(piece[np.unique(triangles)])
    fixed = find_boundary(neutral, triangles, furthest).fixed & np.isin(np.arange(len(neutral)), triangles)
    kept = (np.bincount(piece, weights=fixed, minlength=len(size)) > 0)[: len(size)] & (size >= CRUMB * size.max())
    kept[size.argmax()] = True
    return triangles[kept[piece[triangles[:, 0]]]]


def motion_over(recordings: tuple[Recording, ...], at: Int[np.ndarray, " v"], frames: Int[np.ndarray, " t"]) -> Motion:
    """The motion of some of the rig's vertices in some frames, numbered through the sessions."""
    parts, first = [], 0
    for one in recordings:
        own = frames[(frames >= first) & (frames < first + len(one))] - first
        first += len(one)
        parts += [one.over(own, np.searchsorted(one.at, at))] if len(own) else []
    return together(parts)
