"""One recorded take on a rig's skin, as shapes and how much of each is in every frame.

Data       X[t, v]   displacements of the skin from the take's own neutral, millimetres
Basis      X[t] = sum_r C[t, r] S[r]: recorded weights C and deltas S of a rig as they are, without a frame being posed;
           of meshes, read in chunks, S are the leading shapes and C has orthonormal columns
Left out   `EXACT_MM` root mean square, or more where a noisy take has more than `MOST_SHAPES` shapes: `lost_mm`
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float, Int
from scipy.linalg import eigh

from capture_plan.curves.frames import PosedFrames
from capture_plan.errors import RigError
from capture_plan.rig import Rig
from capture_plan.sequence import Sequence
from capture_plan.shell.motion import ROUNDING, Motion, motion_from_rig

EXACT_MM = 2e-3  # errors add in squares: an error of 0.4 mm changes by 5e-6 mm
MOST_SHAPES = 400  # 0.25 GB for skin of 26,000 vertices
BLOCK = 64  # frames at once
DEPENDENT = 1e-6  # share of the largest eigenvalue: blendshapes that mix into one another are not distinguished


@dataclass(frozen=True, eq=False)
class Recording:
    """`weights` C and `shapes` S of the rig's vertices `at`, which are its skin, ascending; `share` is its say beside
    other sessions."""

    sequence: Sequence
    at: Int[np.ndarray, " n"]
    weights: Float[np.ndarray, "t r"]
    shapes: Float[np.ndarray, "r n 3"]
    share: float = 1.0
    lost_mm: float = 0.0

    def __len__(self) -> int:
        return len(self.weights)

    def over(self, frames: Int[np.ndarray, " t"], some: Int[np.ndarray, " p"]) -> Motion:
        """The motion in some frames of some of the vertices `at`, by their places there."""
        return motion_from_rig(self.weights[frames], self.shapes[:, some])

    @cached_property
    def furthest(self) -> Float[np.ndarray, " n"]:
        """How far each vertex gets from the neutral, millimetres."""
        S, far = self.shapes.reshape(len(self.shapes), -1), np.zeros(len(self.at))
        for start in range(0, len(self), BLOCK):
            X = (self.weights[start : start + BLOCK].astype(S.dtype) @ S).reshape(-1, len(self.at), 3)
            np.maximum(far, np.sqrt(np.einsum("tvx,tvx->tv", X, X).max(axis=0)), out=far)
        return far

    def shown(self, rig: Rig, names: tuple[str, ...]) -> Float[np.ndarray, " k"]:
        """The largest weight of each blendshape in any frame: as recorded, or of the nearest pose of these."""
        k = rig.rows(names)
        if isinstance(self.sequence.frames, PosedFrames):
            return self.weights[:, k].max(axis=0)
        D = rig.deltas[k][:, self.at].reshape(len(k), 3 * len(self.at)).astype(float)
        # w = argmin |D'w - x|^2 of each shape, which frames mix
        w = self.shapes.reshape(len(self.shapes), -1) @ D.T @ np.linalg.pinv(D @ D.T, rcond=DEPENDENT, hermitian=True)
        return (self.weights @ w).max(axis=0)


def record(rig: Rig, sequence: Sequence, share: float = 1.0) -> Recording:
    """A take of the rig's mesh, read once.

    Raises:
        RigError: it is of another mesh.
    """
    if len(sequence.neutral) != len(rig.neutral):
        raise RigError(
            f"{sequence.name} has {len(sequence.neutral):,} vertices, the rig {rig.name} has {len(rig.neutral):,}: "
            "read the take with this rig"
        )
    at = np.flatnonzero(rig.skin)
    if isinstance(sequence.frames, PosedFrames):
        return Recording(sequence, at, sequence.frames.weights, sequence.frames.rig.deltas[:, at], share)
    return leading_shapes(sequence, at, share)


def leading_shapes(sequence: Sequence, at: Int[np.ndarray, " n"], share: float) -> Recording:
    """C and S of a take of meshes."""
    C, S, power = np.zeros((0, 0)), np.zeros((0, 3 * len(at))), 0.0
    for _, block in sequence.chunks():
        X = (block - sequence.neutral)[:, at].reshape(len(block), -1)
        power += float(np.square(X).sum())
        # X = [C 0; 0 I] [S; X], turned to the leading shapes
        both = np.vstack([S, X])
        U = _leading(both @ both.T, EXACT_MM**2 * len(X) * len(at))[:, :MOST_SHAPES]
        C, S = np.vstack([C @ U[: len(S)], U[len(S) :]]), U.T @ both
    lost_mm = np.sqrt(max(power - float(np.square(S).sum()), 0.0) / (len(C) * len(at)))
    return Recording(sequence, at, C, S.reshape(len(S), -1, 3), share, float(lost_mm))


def _leading(gram: Float[np.ndarray, "r r"], spare: float) -> Float[np.ndarray, "r n"]:
    """The fewest eigenvectors that leave out no more than a power, the strongest first; one at least."""
    power, U = eigh(gram)
    left_out = np.cumsum(np.maximum(power, 0)) <= spare + ROUNDING * power.sum()
    left_out[-1] = False
    return U[:, ~left_out][:, ::-1]


def in_fewer_frames(motion: Motion, tail_mm: float) -> Motion:
    """The fewest mixes of frames that leave out at most `tail_mm` of RMSE; the rows stay x, y, z."""
    Y = (motion.rows * np.sqrt(motion.weights[:, None])).reshape(len(motion.rows), -1, 3)
    P = Y.transpose(1, 0, 2).reshape(Y.shape[1], -1)
    U = _leading(P @ P.T, tail_mm**2 * motion.weights.sum())
    rows = np.einsum("vtx,tr->vrx", motion.rows.reshape(Y.shape), U, optimize=True)
    return Motion(rows.reshape(len(rows), -1), motion.weights, in_threes=True)
