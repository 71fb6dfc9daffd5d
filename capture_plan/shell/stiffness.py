"""Thin-shell stiffness of a triangle mesh (Botsch & Sorkine 2008; Le et al. 2013, eqs. 3-6).

Data       x_v in R^3, millimetres; triangles; stretching kS and bending kB
Cotangent  L_uv = (cot alpha + cot beta) / 2 over an edge, L_vv = -sum_u L_vu: symmetric, no eigenvalue above 0
Areas      M = diag of mixed Voronoi areas (Meyer et al. 2003, section 3.3), square millimetres
Stiffness  A = -kS L + kB L M^-1 L: the energy of displacements d is d' A d; constants cost nothing

kB : kS has the unit of a squared length: 10 : 1 holds in millimetres only. A triangle without an area binds nothing.
"""

import numpy as np
from jaxtyping import Float, Int
from scipy.sparse import coo_array, csc_array, csr_array, diags_array

from capture_plan.errors import RigError
from capture_plan.mesh import triangle_areas

FLAT = 1e-7  # a triangle's area over its longest side squared: below it the angles of float32 vertices are noise


def with_area(vertices: Float[np.ndarray, "v 3"], triangles: Int[np.ndarray, "f 3"]) -> Int[np.ndarray, "_ 3"]:
    """The triangles whose angles are known."""
    longest = squared_sides(vertices, triangles).max(axis=1)
    return triangles[triangle_areas(vertices, triangles) > FLAT * longest]


def squared_sides(vertices: Float[np.ndarray, "v 3"], triangles: Int[np.ndarray, "f 3"]) -> Float[np.ndarray, "f 3"]:
    """Squared length of the side opposite to each corner."""
    corners = vertices[triangles]
    return np.square(np.roll(corners, -1, axis=1) - np.roll(corners, -2, axis=1)).sum(axis=2)


def cotangents(vertices: Float[np.ndarray, "v 3"], triangles: Int[np.ndarray, "f 3"]) -> Float[np.ndarray, "f 3"]:
    """cot at each corner: (b^2 + c^2 - a^2) / (4 area) with a opposite."""
    squares = squared_sides(vertices, triangles)
    return (squares.sum(axis=1, keepdims=True) - 2 * squares) / (4 * triangle_areas(vertices, triangles)[:, None])


def cotangent_laplacian(vertices: Float[np.ndarray, "v 3"], triangles: Int[np.ndarray, "f 3"]) -> csr_array:
    """L, (v v)."""
    half = cotangents(vertices, triangles).T.ravel() / 2
    u, v = (np.roll(triangles, -turn, axis=1).T.ravel() for turn in (1, 2))
    n = len(vertices)
    beside = coo_array((np.r_[half, half], (np.r_[u, v], np.r_[v, u])), shape=(n, n)).tocsr()
    return csr_array(beside - diags_array(np.asarray(beside.sum(axis=1)).ravel()))


def mixed_areas(vertices: Float[np.ndarray, "v 3"], triangles: Int[np.ndarray, "f 3"]) -> Float[np.ndarray, " v"]:
    """Diagonal of M: of a triangle each corner gets its Voronoi part, or halves and quarters where one is obtuse."""
    cot, squares = cotangents(vertices, triangles), squared_sides(vertices, triangles)
    area = triangle_areas(vertices, triangles)[:, None]
    part = cot * squares / 8
    voronoi = np.roll(part, -1, axis=1) + np.roll(part, -2, axis=1)
    obtuse = cot < 0
    share = np.where(obtuse.any(axis=1, keepdims=True), np.where(obtuse, area / 2, area / 4), voronoi)
    return np.bincount(triangles.ravel(), weights=share.ravel(), minlength=len(vertices))


def shell_stiffness(
    vertices: Float[np.ndarray, "v 3"], triangles: Int[np.ndarray, "f 3"], *, stretching: float, bending: float
) -> csc_array:
    """A, (v v).

    Raises:
        RigError: a vertex has no triangle with an area.
    """
    triangles = with_area(vertices, triangles)
    loose = np.flatnonzero(np.bincount(triangles.ravel(), minlength=len(vertices)) == 0)
    if len(loose):
        raise RigError(
            f"vertex {loose[0]} and {len(loose) - 1} others of the shell have no triangle with an area: leave them out"
        )
    # A = -kS L + kB L M^-1 L
    L, M = cotangent_laplacian(vertices, triangles), mixed_areas(vertices, triangles)
    return csc_array(-stretching * L + bending * (L @ diags_array(1 / M) @ L))
