"""Markers as bones of a skin: what it costs to store a take so, and what corrections fitted to the take bring.

Data          X (t v 3) displacements in F frames of N vertices and T triangles; M markers, weights W; r vectors
Full          3 N (F + 1) + 3 T numbers: every frame, the rest pose and the triangles
Ours          3 N + 3 T + 3 F M: W follows from the rest pose; what is missed is R = X - W X_H
EigenSkin     R ~ C B with r vectors B (r 3v) and C (t r) fitted to R itself, as the correction of Le et al. 2013,
              section 7.1 (after Kry et al. 2002) is: 3 N r + F r more. This is compression of a take that is known;
              markers alone do not give C, so that none of its errors are errors of prediction
Key points    KPSA (Meyer & Anderson 2007, which we know from Le et al. 2013 alone; our reading): X ~ C B with the r
              leading vectors B; C from the displacements of M key points by least squares: 3 T + 3 N r + 3 F M.
              One key point where each vector, turned to be sparse (varimax, Kaiser 1958), moves most; then each next
              where the take is missed most
Every vertex counts the same. The rows Y of a `Motion` serve as frames, since errors are quadratic in them.
"""

import numpy as np
from jaxtyping import Float, Int
from msgspec import Struct

from capture_plan.errors import InfeasibleError
from capture_plan.shell.model import Shell
from capture_plan.shell.motion import Motion
from capture_plan.shell.take import ShellSizes

TURNS, SETTLED = 100, 1e-8  # varimax ends when a turn gains less than this share
FLOOR = 1e-12  # share of the largest singular value below which a vector is none


class Skinning(Struct, frozen=True):
    """Root mean square errors in millimetres and compression ratios of one take with M markers.

    `corrected_mm` and `key_points_mm` are `fitted`: their coefficients or vectors come from the very take that they
    are measured on. `markers_mm` needs the rest pose and the markers alone.
    """

    markers: int
    rank: int
    markers_mm: float
    corrected_mm: float
    key_points_mm: float
    markers_ratio: float
    corrected_ratio: float
    key_points_ratio: float
    fitted: tuple[str, ...] = ("corrected_mm", "key_points_mm")


def full_size(n: ShellSizes) -> int:
    """Numbers of the take as it is."""
    return 3 * n.vertices * (n.frames + 1) + 3 * n.triangles


def markers_ratio(n: ShellSizes, markers: int) -> float:
    """How many times smaller the take is as markers."""
    return full_size(n) / (3 * n.vertices + 3 * n.triangles + 3 * n.frames * markers)


def corrected_ratio(n: ShellSizes, markers: int, rank: int) -> float:
    """The compression ratio with the correction's vectors and coefficients."""
    own = 3 * n.vertices + 3 * n.triangles + 3 * n.frames * markers
    return full_size(n) / (own + 3 * n.vertices * rank + n.frames * rank)


def key_points_ratio(n: ShellSizes, points: int, rank: int) -> float:
    """How many times smaller the take is as key points and vectors."""
    return full_size(n) / (3 * n.triangles + 3 * n.vertices * rank + 3 * n.frames * points)


def skinning(shell: Shell, motion: Motion, markers: Int[np.ndarray, " m"], sizes: ShellSizes) -> Skinning:
    """All of Le et al. 2013, Table 4, for one layout; the rank is half the number of markers."""
    m, r = len(markers), len(markers) // 2
    v, left = len(motion.rows), spectrum(_missed(shell, motion, markers))
    return Skinning(
        markers=m,
        rank=r,
        markers_mm=_rms(left, v),
        corrected_mm=_rms(left[r:], v),
        key_points_mm=key_points_error(motion, m, r),
        markers_ratio=markers_ratio(sizes, m),
        corrected_ratio=corrected_ratio(sizes, m, r),
        key_points_ratio=key_points_ratio(sizes, m, r),
    )


def shapes(rows: Float[np.ndarray, "v r"]) -> Float[np.ndarray, "t v 3"]:
    """Rows of a motion as shapes of the face: three columns of Y are x, y and z of one shape.

    The sum of their products is the mean over the frames. Rows that were compressed are no shapes any more.
    """
    return rows.reshape(len(rows), -1, 3).transpose(1, 0, 2)


def poses(rows: Float[np.ndarray, "v r"]) -> Float[np.ndarray, "t c"]:
    """Rows of shapes put side by side, each shape in one row."""
    return shapes(rows).reshape(-1, 3 * len(rows))


def spectrum(rows: Float[np.ndarray, "v r"]) -> Float[np.ndarray, " n"]:
    """Singular values of the shapes, the largest first; their squares add up to the squared error."""
    P = poses(rows)
    return np.sqrt(np.maximum(np.linalg.eigvalsh(P @ P.T)[::-1], 0))


def corrected_error(shell: Shell, motion: Motion, markers: Int[np.ndarray, " m"], rank: int) -> float:
    """RMSE (mm) with a correction of `rank` vectors fitted to the residual: what its other vectors hold."""
    return _rms(spectrum(_missed(shell, motion, markers))[rank:], len(motion.rows))


def key_points_error(motion: Motion, points: int, rank: int) -> float:
    """RMSE (mm) of the take rebuilt from key points."""
    P = poses(motion.rows)
    B = leading(P, rank)
    at = key_points(P, B, points)
    R = P - coefficients(P, B, at) @ B
    return float(np.sqrt((R**2).sum() / len(motion.rows)))


def leading(P: Float[np.ndarray, "t c"], rank: int) -> Float[np.ndarray, "r c"]:
    """Up to `rank` orthonormal shapes that hold most of the take."""
    power, U = np.linalg.eigh(P @ P.T)
    there = [i for i in range(len(power) - 1, -1, -1) if power[i] > FLOOR * power[-1]][:rank]
    return (U[:, there].T @ P) / np.sqrt(power[there])[:, None]


def key_points(P: Float[np.ndarray, "t c"], B: Float[np.ndarray, "r c"], points: int) -> Int[np.ndarray, " m"]:
    """Vertices: one for each vector made sparse, then where the take is missed most.

    Raises:
        InfeasibleError: there are fewer points than vectors or fewer vertices than points.
    """
    v = B.shape[1] // 3
    if not len(B) <= points <= v:
        raise InfeasibleError(
            f"{points} key points for {len(B)} vectors on {v} vertices: give at least as many as vectors"
        )
    free = np.ones(v, dtype=bool)
    at: list[int] = []
    for shape in varimax(B):
        at.append(int(np.where(free, _lengths(shape[None]), -1).argmax()))
        free[at[-1]] = False
    while len(at) < points:
        missed = _lengths(P - coefficients(P, B, np.array(at)) @ B)
        at.append(int(np.where(free, missed, -1).argmax()))
        free[at[-1]] = False
    return np.array(at)


def coefficients(
    P: Float[np.ndarray, "t c"], B: Float[np.ndarray, "r c"], at: Int[np.ndarray, " m"]
) -> Float[np.ndarray, "t r"]:
    """C: the combination of B that is nearest to P at these vertices."""
    columns = (3 * at[:, None] + np.arange(3)).ravel()
    return np.linalg.lstsq(B[:, columns].T, P[:, columns].T, rcond=None)[0].T


def varimax(B: Float[np.ndarray, "r c"]) -> Float[np.ndarray, "r c"]:
    """The basis of the space of B with the variance of the squared entries turned up."""
    L, turn, before = B.T, np.eye(len(B)), 0.0
    for _ in range(TURNS):
        Z = L @ turn
        # sum Z^4 is all of varimax that turning can change: the columns of Z have length 1
        U, sigma, V = np.linalg.svd(L.T @ Z**3)
        turn = U @ V
        if sigma.sum() <= before * (1 + SETTLED):
            break
        before = sigma.sum()
    return (L @ turn).T


def _missed(shell: Shell, motion: Motion, markers: Int[np.ndarray, " m"]) -> Float[np.ndarray, "v r"]:
    return motion.rows - shell.weights(markers) @ motion.rows[markers]


def _lengths(shapes: Float[np.ndarray, "t c"]) -> Float[np.ndarray, " v"]:
    """Squared displacement of each vertex over all shapes."""
    return (shapes**2).sum(axis=0).reshape(-1, 3).sum(axis=1)


def _rms(sigma: Float[np.ndarray, " n"], v: int) -> float:
    return float(np.sqrt((sigma**2).sum() / v))
