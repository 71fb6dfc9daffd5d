"""The cotangent Laplacian of a triangle mesh, and the areas that belong to it.

Data       x_v in R^3, millimetres; triangles
Cotangent  L_uv = (cot alpha + cot beta) / 2 over an edge, L_vv = -sum_u L_vu: symmetric, no eigenvalue above 0
Areas      M = diag of mixed Voronoi areas (Meyer et al. 2003, section 3.3), square millimetres

A triangle without an area has no angles: `with_area` leaves it out.
"""

import numpy as np
from jaxtyping import Float, Int
from scipy.sparse import coo_array, csr_array, diags_array

from capture_plan.mesh.geometry import triangle_areas

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
    """The cotangent Laplacian L of (v v), in which every row sums to 0."""
    half = cotangents(vertices, triangles).T.ravel() / 2
    u, v = (np.roll(triangles, -turn, axis=1).T.ravel() for turn in (1, 2))
    n = len(vertices)
    weights = coo_array((np.r_[half, half], (np.r_[u, v], np.r_[v, u])), shape=(n, n)).tocsr()
    return csr_array(weights - diags_array(np.asarray(weights.sum(axis=1)).ravel()))


def mixed_areas(vertices: Float[np.ndarray, "v 3"], triangles: Int[np.ndarray, "f 3"]) -> Float[np.ndarray, " v"]:
    """Diagonal of M: each corner of a triangle gets its Voronoi part, or half and quarters of one that is obtuse."""
    cot, squares = cotangents(vertices, triangles), squared_sides(vertices, triangles)
    area = triangle_areas(vertices, triangles)[:, None]
    part = cot * squares / 8
    voronoi = np.roll(part, -1, axis=1) + np.roll(part, -2, axis=1)
    obtuse = cot < 0
    share = np.where(obtuse.any(axis=1, keepdims=True), np.where(obtuse, area / 2, area / 4), voronoi)
    return np.bincount(triangles.ravel(), weights=share.ravel(), minlength=len(vertices))
