"""The skin that a mask lies on, as a dense cloud of points with normals.

Data     V, F      a head's skin: a coarse rig, or a scan with noise and long triangles
Split    every triangle into four, new vertices lifted onto the curve that the normals suggest (Phong tessellation)
Smooth   x = S (2 x0 - S x0), S = (M - s^2 L)^-1 M: implicit Laplacian smoothing (Desbrun et al. 1999), and what it took
         smoothed again and put back, so that shapes as large as a nose stay; of a wave of length l, (a / (1 + a))^2
         goes, a = (2 pi s / l)^2
Sample   the middles of the smaller triangles that each triangle falls into, at most `SPACING_MM` apart

Letters: v vertices, f triangles, n points; millimetres.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float, Int
from scipy.sparse import diags_array
from scipy.sparse.linalg import splu
from scipy.spatial import KDTree

from capture_plan.mesh import border_edges, cotangent_laplacian, mixed_areas, vertex_normals, with_area
from capture_plan.sheets.head import curved_middles, split_triangles

SMOOTH_MM = 1.5  # s: a wave of 6 mm keeps half of its height, one of 12 mm 85 %, one of 40 mm (a nose) 99.7 %
EDGE_MM = 2.8  # triangles are split until their edges have this length in the mean
SPACING_MM = 1.3  # of the longest edges of the smaller triangles: their middles lie about half of that apart
NEIGHBOURS = 16  # within 1.5 mm or so
LARGEST = 200_000  # triangles that are smoothed: a finer scan is fine enough


@dataclass(frozen=True, eq=False)
class Skin:
    """Points of the skin and their unit normals; `border` are points along open edges of the skin."""

    points: Float[np.ndarray, "n 3"]
    normals: Float[np.ndarray, "n 3"]
    border: Float[np.ndarray, "b 3"]

    @cached_property
    def tree(self) -> KDTree:
        """Finds the points of the skin that lie nearest to a place."""
        return KDTree(self.points)

    @cached_property
    def to_border(self) -> Float[np.ndarray, " n"]:
        """Distance of each point to the nearest open edge, millimetres; infinite where there is none."""
        if not len(self.border):
            return np.full(len(self.points), np.inf)
        return KDTree(self.border).query(self.points)[0]

    @cached_property
    def neighbours(self) -> Int[np.ndarray, "n k"]:
        """The `NEIGHBOURS` nearest points of each, itself first."""
        return np.asarray(self.tree.query(self.points, k=NEIGHBOURS)[1])


def sample_skin(vertices: Float[np.ndarray, "v 3"], triangles: Int[np.ndarray, "f 3"]) -> Skin:
    """Points on the smoothed surface of these triangles."""
    vertices, triangles = _finer(*_compact(vertices, with_area(vertices, triangles)))
    smooth = _smoothed(vertices, triangles)
    ends = smooth[border_edges(triangles)]
    along = np.linspace(0, 1, 1 + int(np.ceil(EDGE_MM / SPACING_MM)))[:, None, None]
    border = ((1 - along) * ends[:, 0] + along * ends[:, 1]).reshape(-1, 3)
    points, normals = _middles(smooth, vertex_normals(smooth, triangles), triangles)
    return Skin(points, normals, border)


def _compact(
    vertices: Float[np.ndarray, "v 3"], triangles: Int[np.ndarray, "f 3"]
) -> tuple[Float[np.ndarray, "u 3"], Int[np.ndarray, "f 3"]]:
    used, local = np.unique(triangles, return_inverse=True)
    return vertices[used].astype(float), local.reshape(-1, 3)


def _finer(
    vertices: Float[np.ndarray, "v 3"], triangles: Int[np.ndarray, "f 3"]
) -> tuple[Float[np.ndarray, "u 3"], Int[np.ndarray, "g 3"]]:
    while _mean_edge(vertices, triangles) > EDGE_MM and 4 * len(triangles) <= LARGEST:
        split = split_triangles(triangles, len(vertices))
        middles = curved_middles(vertices, vertex_normals(vertices, triangles), split.edges)
        vertices, triangles = np.concatenate([vertices, middles]), split.triangles
    return vertices, triangles


def _mean_edge(vertices: Float[np.ndarray, "v 3"], triangles: Int[np.ndarray, "f 3"]) -> float:
    """Of the larger triangles, which make most of the area."""
    return float(np.percentile(_longest(vertices, triangles), 75))


def _longest(vertices: Float[np.ndarray, "v 3"], triangles: Int[np.ndarray, "f 3"]) -> Float[np.ndarray, " f"]:
    corners = vertices[triangles]
    return np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)


def _smoothed(vertices: Float[np.ndarray, "v 3"], triangles: Int[np.ndarray, "f 3"]) -> Float[np.ndarray, "v 3"]:
    L, m = cotangent_laplacian(vertices, triangles), mixed_areas(vertices, triangles)
    m = np.maximum(m, 1e-3 * m.mean())  # a sliver has next to no area
    A = (diags_array(m) - SMOOTH_MM**2 * L).tocsc()
    solver = splu(A, permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True})
    # x = S (2 x0 - S x0), S = (M - s^2 L)^-1 M
    return solver.solve(m[:, None] * (2 * vertices - solver.solve(m[:, None] * vertices)))


def _middles(
    vertices: Float[np.ndarray, "v 3"], normals: Float[np.ndarray, "v 3"], triangles: Int[np.ndarray, "f 3"]
) -> tuple[Float[np.ndarray, "n 3"], Float[np.ndarray, "n 3"]]:
    """Middles of the k^2 smaller triangles of each triangle, and the normals interpolated there."""
    pieces = np.maximum(1, np.ceil(_longest(vertices, triangles) / SPACING_MM)).astype(int)
    points, outward = [], []
    for k in np.unique(pieces):
        b, own = _lattice(int(k)), triangles[pieces == k]
        points.append(np.einsum("nc,fcx->fnx", b, vertices[own]).reshape(-1, 3))
        outward.append(np.einsum("nc,fcx->fnx", b, normals[own]).reshape(-1, 3))
    n = np.concatenate(outward)
    return np.concatenate(points), n / np.maximum(np.linalg.norm(n, axis=1, keepdims=True), 1e-12)


def _lattice(k: int) -> Float[np.ndarray, "n 3"]:
    """Barycentric coordinates of the middles of the k^2 equal triangles of one triangle."""
    i, j = (each.ravel() for each in np.meshgrid(np.arange(k), np.arange(k), indexing="ij"))
    up, down = i + j < k, i + j < k - 1
    ab = np.concatenate([np.stack([i[up], j[up]], 1) + 1 / 3, np.stack([i[down], j[down]], 1) + 2 / 3]) / k
    return np.c_[1 - ab.sum(axis=1), ab]
