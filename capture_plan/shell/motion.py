"""Dense motion as few rows per vertex that every squared error of a layout can be computed from.

Data       X (t v 3)  displacements from rest in F frames, millimetres; or weights w (F k) and deltas D (k v 3) of a rig
           s_v        perceptual weight of a vertex, 1 where nothing is said (Le et al. 2013, section 8)
Answer     Y (v r)    Y Y' = mean over the frames of X_t X_t', so that E = sum_v s_v |(Y - W Y_H)_v|^2 is the mean over
                      the frames of the squared error, and RMSE = sqrt(E / sum_v s_v), millimetres
From a rig Y = D' (chol(w'w / F) ⊗ I_3) exactly: F is gone
Sessions   Y = [Y_1, Y_2, ...] / sqrt(their number): each counts 1 / F_d per frame, so that no long one rules
Compressed Y U_r with U_r the leading eigenvectors of Y' S Y; what is lost is at most `tail_mm` of RMSE
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from jaxtyping import Float, Int
from scipy.linalg import eigh, get_blas_funcs

from capture_plan.errors import RigError

TAIL_MM = 0.1  # rows that a search leaves out at first: a face keeps 20 to 50; finer ones follow where these tell
ROUNDING = 1e-14  # share of the squared motion: rows below it are rounding of the others
BLOCK = 1024  # vertices whose rows are held once more


@dataclass(frozen=True, eq=False)
class Motion:
    """`rows` are Y in millimetres, `weights` are s; `in_threes` while the rows are x, y, z, x, y, z and so on."""

    rows: Float[np.ndarray, "v r"]
    weights: Float[np.ndarray, " _"]
    in_threes: bool = False

    def __post_init__(self) -> None:
        if len(self.weights) != len(self.rows):
            raise RigError(f"{len(self.weights)} weights for {len(self.rows)} vertices: give one for each")
        if not (np.isfinite(self.rows).all() and (self.weights >= 0).all() and self.weights.sum() > 0):
            raise RigError("a displacement is not finite, or weights are negative or all 0: repair them")

    def weighted(self, s: Float[np.ndarray, " v"]) -> "Motion":
        """The motion where errors count by s."""
        return replace(self, weights=s.astype(float))

    def at(self, vertices: Int[np.ndarray, " n"]) -> "Motion":
        """The motion of some vertices."""
        return replace(self, rows=self.rows[vertices], weights=self.weights[vertices])

    def blocks(self) -> Iterator[slice]:
        """All vertices, some at a time."""
        return (slice(start, start + BLOCK) for start in range(0, len(self.rows), BLOCK))

    @cached_property
    def spectrum(self) -> tuple[Float[np.ndarray, " r"], Float[np.ndarray, "r r"]]:
        """Eigenvalues of Y' S Y, the least first, and U."""
        # syrk fills one half
        gram = np.zeros((self.rows.shape[1],) * 2, order="F")
        (syrk,) = get_blas_funcs(("syrk",), (gram,))
        for some in self.blocks():
            scaled = self.rows[some] * np.sqrt(self.weights[some, None])
            gram = syrk(1.0, scaled.T, beta=1.0, c=gram, lower=1, overwrite_c=1)
        return eigh(gram, lower=True, overwrite_a=True)

    def compressed(self, tail_mm: float = TAIL_MM) -> "Motion":
        """Fewest rows that leave out at most `tail_mm` of RMSE."""
        power, U = self.spectrum
        left_out = np.cumsum(np.maximum(power, 0)) <= tail_mm**2 * self.weights.sum() + ROUNDING * power.sum()
        return replace(self, rows=self.rows @ U[:, ~left_out][:, ::-1], in_threes=False)

    def squared_error(self, W: Float[np.ndarray, "v m"], markers: Int[np.ndarray, " m"]) -> float:
        """The squared error E of the motion rebuilt by W from markers, mm^2."""
        total = 0.0
        for some in self.blocks():
            R = self.rows[some] - W[some] @ self.rows[markers]
            total += float(np.einsum("vr,vr,v->", R, R, self.weights[some]))
        return total

    def rmse_mm(self, W: Float[np.ndarray, "v m"], markers: Int[np.ndarray, " m"]) -> float:
        """sqrt(E / sum_v s_v): over all vertices and frames, millimetres."""
        return float(np.sqrt(self.squared_error(W, markers) / self.weights.sum()))


def motion_of(displacements: Float[np.ndarray, "t v 3"]) -> Motion:
    """All rows of recorded displacements: three a frame."""
    t, v, _ = displacements.shape
    if not t:
        raise RigError("a motion without frames: give at least one")
    rows = displacements.transpose(1, 0, 2).reshape(v, 3 * t).astype(float)
    rows /= np.sqrt(t)
    return Motion(rows, np.ones(v), in_threes=True)


def motion_from_rig(weights: Float[np.ndarray, "t k"], deltas: Float[np.ndarray, "k v 3"]) -> Motion:
    """Three rows a blendshape, however many frames."""
    t, k = weights.shape
    # w'w / F = (root root'), also where it is singular
    power, U = eigh(weights.T.astype(float) @ weights / t)
    root = U * np.sqrt(np.maximum(power, 0))
    rows = np.einsum("kvx,kr->vrx", deltas, root[:, ::-1], optimize=True)
    return Motion(rows.reshape(rows.shape[0], 3 * k), np.ones(deltas.shape[1]), in_threes=True)


def stack_sessions(sessions: Sequence[Motion]) -> Motion:
    """Sessions of one face, each with the same say; the first one's weights hold."""
    sizes = {len(one.rows) for one in sessions}
    if len(sizes) != 1:
        raise RigError(f"sessions with {sorted(sizes)} vertices: give motions of one mesh")
    rows = np.hstack([one.rows for one in sessions]) / np.sqrt(len(sessions))
    return replace(sessions[0], rows=rows, in_threes=all(one.in_threes for one in sessions))


def with_mirror_image(motion: Motion, mirror: Int[np.ndarray, " v"]) -> Motion:
    """Every frame and its mirror image in a plane across x (Le et al. 2013, section 4.6), so that no side rules.

    X_t',i = S(X_t,m(i)): the displacement of the mirrored vertex, its x turned round. The motion is not compressed yet.
    """
    if not motion.in_threes:
        raise RigError("a compressed motion has no x, y, z to mirror: mirror first, then compress")
    turned = motion.rows[mirror] * np.tile([-1.0, 1.0, 1.0], motion.rows.shape[1] // 3)
    return stack_sessions([motion, replace(motion, rows=turned)])
