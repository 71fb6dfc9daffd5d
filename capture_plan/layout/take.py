"""A recorded take as a layout is judged by it: how far markers bend a thin shell of the skin away from the frames.

Data       X[t, v]   displacements of the skin from the neutral in F frames of one or several sessions, millimetres
           Y (v r)   rows with Y Y' = mean over the frames of X_t X_t', each session with the same say
Fixed      points 10 mm apart where the motion ends (`shell.boundary`); skin beyond is not counted
Error      RMSE = sqrt(mean over the frames and the moving skin of |X_tv - (W X_tH)_v|^2), millimetres

A take of blendshape weights has its rows from the deltas, without a frame being posed; one of meshes is read in chunks,
and what `EXACT_MM` leaves out changes no digit of an error in a plan.
"""

from collections.abc import Sequence as Several
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from capture_plan.errors import InfeasibleError
from capture_plan.layout.shell.boundary import STILL_MM, find_boundary
from capture_plan.layout.shell.model import Shell
from capture_plan.layout.shell.motion import Motion, motion_from_rig, motion_of, together
from capture_plan.layout.shell.stiffness import with_area
from capture_plan.mesh import pieces
from capture_plan.rig import Rig
from capture_plan.rig.sequence import Sequence
from capture_plan.rig.sequence.frames import PosedFrames

EXACT_MM = 2e-3  # errors add in squares: an error of 0.4 mm changes by 5e-6 mm
BLOCK = 64  # frames at once
MOST_ROWS = 1200  # before rows are made fewer: 0.25 GB for 26,000 vertices
SHOWN = 0.1  # of a full blendshape: what never gets that far is not in the take


@dataclass(frozen=True, eq=False)
class Take:
    """`rows` of the rig's skin vertices, which are `at`; `furthest` from the neutral of every vertex of the rig,
    millimetres; `missing` blendshapes that no frame shows."""

    at: Int[np.ndarray, " n"]
    rows: Motion
    furthest: Float[np.ndarray, " v"]
    frames: int
    missing: tuple[str, ...]


def take_of(rig: Rig, used: tuple[str, ...], sequences: Several[Sequence]) -> Take:
    """The sessions together, on the skin of the rig whose mesh they are."""
    at = np.flatnonzero(rig.skin)
    shown = np.max([most_shown(one, rig, used) for one in sequences], axis=0)
    return Take(
        at=at,
        rows=together([rows_of(one, at) for one in sequences]),
        furthest=np.max([furthest_of(one, at) for one in sequences], axis=0),
        frames=sum(len(one) for one in sequences),
        missing=tuple(name for name, most in zip(used, shown.tolist(), strict=True) if most < SHOWN),
    )


def rows_of(sequence: Sequence, at: Int[np.ndarray, " n"]) -> Motion:
    """Y of some vertices."""
    if isinstance(sequence.frames, PosedFrames):
        return motion_from_rig(sequence.frames.weights, sequence.frames.rig.deltas[:, at]).compressed(EXACT_MM)
    rows, held = [], 0
    for _, block in sequence.chunks():
        part = motion_of((block - sequence.neutral)[:, at]).rows
        rows.append(part * np.sqrt(len(block) / len(sequence)))
        held += part.shape[1]
        if held > MOST_ROWS:
            rows = [Motion(np.hstack(rows), np.ones(len(at))).compressed(EXACT_MM).rows]
            held = rows[0].shape[1]
    return Motion(np.hstack(rows), np.ones(len(at))).compressed(EXACT_MM)


def furthest_of(sequence: Sequence, at: Int[np.ndarray, " n"]) -> Float[np.ndarray, " v"]:
    """How far each of the vertices `at` gets from the neutral, millimetres; 0 elsewhere."""
    far = np.zeros(len(sequence.neutral))
    if not isinstance(sequence.frames, PosedFrames):
        far[at] = sequence.motion()[at]
        return far
    w, d = sequence.frames.weights.astype(np.float32), sequence.frames.rig.deltas[:, at].reshape(-1, 3 * len(at))
    for start in range(0, len(w), BLOCK):
        x = (w[start : start + BLOCK] @ d).reshape(-1, len(at), 3)
        far[at] = np.maximum(far[at], np.sqrt(np.einsum("tvx,tvx->tv", x, x).max(axis=0)))
    return far


def most_shown(sequence: Sequence, rig: Rig, used: tuple[str, ...]) -> Float[np.ndarray, " k"]:
    """The largest weight of each used blendshape in any frame: as recorded, or of the nearest pose of the rig."""
    k = [rig.names.index(name) for name in used]
    if isinstance(sequence.frames, PosedFrames):
        return sequence.frames.weights[:, k].max(axis=0)
    D = rig.deltas[k][:, rig.skin].reshape(len(k), 3 * int(rig.skin.sum())).astype(float)
    # w = argmin |D'w - x|^2
    inverse = np.linalg.pinv(D @ D.T, rcond=1e-6, hermitian=True) @ D
    most = np.zeros(len(k))
    for _, block in sequence.chunks():
        x = (block - sequence.neutral)[:, rig.skin].reshape(len(block), -1)
        np.maximum(most, (x @ inverse.T).max(axis=0), out=most)
    return most


@dataclass(frozen=True, eq=False)
class Skin:
    """The shell of the skin that a take moves: its vertices are those of the rig `at`."""

    shell: Shell
    motion: Motion
    at: Int[np.ndarray, " n"]

    def places(self, vertices: Int[np.ndarray, " m"]) -> Int[np.ndarray, " _"]:
        """Where vertices of the rig are in `at`, those that are."""
        place = np.searchsorted(self.at, vertices).clip(max=len(self.at) - 1)
        return place[self.at[place] == vertices]

    def marks(self, mask: Bool[np.ndarray, " v"]) -> Bool[np.ndarray, " n"]:
        """A mask of the rig's vertices."""
        return mask[self.at]

    def errors(self, markers: Int[np.ndarray, " m"], counts: Several[int]) -> tuple[float, ...]:
        """RMSE with the first of the markers, for each of some counts, millimetres."""
        found = []
        for m in counts:
            first = markers[:m]
            found.append(self.motion.rmse_mm(self.shell.weights(first), first))
        return tuple(found)


def skin_of(rig: Rig, take: Take, markers: Int[np.ndarray, " m"]) -> Skin:
    """The shell that these markers of the rig bend, which move even where the rest is still.

    Loose pieces that nothing holds are left out but for the largest.

    Raises:
        InfeasibleError: the take moves nothing.
    """
    if not (take.furthest[rig.skin] >= STILL_MM).any():
        raise InfeasibleError(
            f"the take moves no skin by {STILL_MM:g} mm: check its unit and names, or record more of the face"
        )
    solid = with_area(rig.neutral, rig.triangles[rig.skin[rig.triangles].all(axis=1)])
    found = find_boundary(rig.neutral, solid, take.furthest)
    piece = pieces(solid, len(rig.neutral))
    holds = np.bincount(piece, weights=found.fixed) > 0
    holds[np.bincount(piece[np.unique(solid)]).argmax()] = True
    at, triangles = np.unique(solid[holds[piece[solid[:, 0]]]], return_inverse=True)
    fixed = found.fixed & ~np.isin(np.arange(len(piece)), markers)
    shell = Shell(rig.neutral[at].astype(float), triangles.reshape(-1, 3), fixed[at])
    motion = take.rows.at(np.searchsorted(take.at, at)).weighted(found.moving[at].astype(float))
    return Skin(shell, motion, at)
