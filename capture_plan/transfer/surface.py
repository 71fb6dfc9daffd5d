"""Displacements of a mesh and their gradients, to and fro: a Poisson problem factorised once.

Data       v0 (v 3)      neutral, millimetres; triangles with areas a and orthonormal tangents T (3 2)
           G (2f v)      G x: the gradient of x along both tangents of every triangle, without unit where x is in mm
           held          vertices whose displacement is given; of a piece without any, the mean displacement is given
Variables  x (v 3)       displacement, millimetres
Model      min sum_t a_t |(G x)_t - g_t|^2     =>     G' A G x = G' A g,   A the areas

G' A G is the cotangent Laplacian. Triangles without an area have no gradient and bind nothing.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.sparse import coo_array, csc_array, csr_array, diags_array
from scipy.sparse.linalg import SuperLU, splu

from capture_plan.mesh import pieces, triangle_areas

LEAST_AREA = 1e-12  # of the mean area: below it a triangle is a line


@dataclass(frozen=True, eq=False)
class Surface:
    """A neutral with some vertices held. `solid`: triangles that have an area; the others have gradient 0."""

    neutral: Float[np.ndarray, "v 3"]
    triangles: Int[np.ndarray, "f 3"]
    held: Bool[np.ndarray, " v"]

    @cached_property
    def areas(self) -> Float[np.ndarray, " f"]:
        """Square millimetres; 0 where the triangle is a line."""
        areas = triangle_areas(self.neutral, self.triangles)
        return np.where(areas > LEAST_AREA * areas.mean(), areas, 0)

    @cached_property
    def tangents(self) -> Float[np.ndarray, "f 3 2"]:
        """The unit vector along the first edge, and the one across it in the plane of the triangle."""
        first, second = self._edges
        along = _unit(first)
        across = _unit(second - np.einsum("fx,fx->f", second, along)[:, None] * along)
        return np.stack([along, across], axis=2)

    @cached_property
    def operator(self) -> csr_array:
        """G: two rows a triangle, the derivative of a function of the vertices along its tangents, 1 / mm."""
        first, second = self._edges
        E = np.einsum("fxa,xfb->fab", self.tangents, np.moveaxis(np.stack([first, second], axis=2), 1, 0))
        solid = self.areas > 0
        Q = np.zeros_like(E)
        Q[solid] = np.linalg.inv(E[solid])
        value = np.concatenate([-Q.sum(axis=1, keepdims=True), Q], axis=1)  # (f corner a): [d1 - d0, d2 - d0] Q
        f, v = len(self.triangles), len(self.neutral)
        row = np.broadcast_to(2 * np.arange(f)[:, None, None] + np.arange(2), value.shape)
        column = np.broadcast_to(self.triangles[:, :, None], value.shape)
        return csr_array(coo_array((value.ravel(), (row.ravel(), column.ravel())), shape=(2 * f, v)))

    @cached_property
    def piece(self) -> Int[np.ndarray, " v"]:
        """The number of the loose piece that a vertex is in, -1 where a vertex of the piece is held."""
        whole = pieces(self.triangles[self.areas > 0], len(self.neutral))
        holds = np.bincount(whole, weights=self.held) > 0
        number = np.where(holds, -1, np.cumsum(~holds) - 1)
        return number[whole]

    @cached_property
    def sizes(self) -> Float[np.ndarray, " c"]:
        """Root mean square distance of the vertices of each loose piece from its middle, millimetres; 1 for a point."""
        middle, square = self.loose_means(self.neutral), self.loose_means(np.square(self.neutral))
        size = np.sqrt(np.maximum(square - np.square(middle), 0).sum(axis=1))
        return np.where(size > 0, size, 1)

    @cached_property
    def cell_sizes(self) -> Int[np.ndarray, " t"]:
        """How many numbers tell how a cell moves: 6 for a triangle's gradient, 3 for the mean of a loose piece."""
        return np.repeat([6, 3], [len(self.triangles), len(self.sizes)])

    @cached_property
    def shares(self) -> Float[np.ndarray, " t"]:
        """The area of each triangle, then of each loose piece, against the whole surface."""
        number = self.piece[self.triangles[:, 0]]
        loose = np.bincount(number[number >= 0], weights=self.areas[number >= 0], minlength=len(self.sizes))
        return np.concatenate([self.areas, loose]) / self.areas.sum()

    def loose_means(self, x: Float[np.ndarray, "v n"]) -> Float[np.ndarray, "c n"]:
        """The mean of x over each loose piece."""
        return self._mean @ x

    def gradient(self, x: Float[np.ndarray, "*k v 3"]) -> Float[np.ndarray, "*k f 6"]:
        """The gradients (3 2) of displacements, two rows of three to a triangle."""
        flat = np.moveaxis(x, -2, 0).reshape(len(self.neutral), -1)
        g = (self.operator @ flat).reshape(len(self.triangles), 2, *x.shape[:-2], 3)
        return np.moveaxis(g, (0, 1), (-3, -2)).reshape(*x.shape[:-2], len(self.triangles), 6)

    def integrate(
        self, g: Float[np.ndarray, "f 6"], held: Float[np.ndarray, "v 3"], means: Float[np.ndarray, "c 3"]
    ) -> Float[np.ndarray, "v 3"]:
        """The displacement with gradients nearest to g, equal to `held` where held, of mean `means` on loose pieces."""
        solver, L, free = self._factor
        b = self._weighted @ g.reshape(-1, 3)
        x = np.where(self.held[:, None], held, 0)
        right = b[free] - L[free] @ x
        for axis in range(3):  # a block of columns is slower each
            x[free, axis] = solver.solve(right[:, axis])
        loose = self.piece >= 0
        return x + np.where(loose[:, None], (means - self.loose_means(x))[self.piece], 0) if loose.any() else x

    @cached_property
    def _edges(self) -> tuple[Float[np.ndarray, "f 3"], Float[np.ndarray, "f 3"]]:
        a, b, c = (self.neutral[self.triangles[:, corner]] for corner in range(3))
        return b - a, c - a

    @cached_property
    def _mean(self) -> csr_array:
        loose = np.flatnonzero(self.piece >= 0)
        number = self.piece[loose]
        count = np.bincount(number)
        return csr_array((1 / count[number], (number, loose)), shape=(len(count), len(self.neutral)))

    @cached_property
    def _weighted(self) -> csr_array:
        return csr_array(self.operator.T @ diags_array(np.repeat(self.areas, 2)))

    @cached_property
    def _factor(self) -> tuple[SuperLU, csr_array, Int[np.ndarray, " n"]]:
        pinned = np.unique(self.piece, return_index=True)[1] if (self.piece >= 0).any() else np.empty(0, dtype=int)
        free = np.flatnonzero(~self.held & ~(np.isin(np.arange(len(self.held)), pinned) & (self.piece >= 0)))
        L = csr_array(self._weighted @ self.operator)
        A = csc_array(L[free][:, free])
        return splu(A, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0, options={"SymmetricMode": True}), L, free


def _unit(x: Float[np.ndarray, "f 3"]) -> Float[np.ndarray, "f 3"]:
    length = np.linalg.norm(x, axis=1, keepdims=True)
    return x / np.where(length > 0, length, 1)
