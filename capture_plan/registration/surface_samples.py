"""A surface as points spread evenly over it, so that neither its triangles nor its vertices decide what is matched.

Data       q, m       points and unit normals of the surface, millimetres; normals interpolated within triangles
           inner      which do not lie beside the border of the mesh, where a scan ends and a face goes on
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import trimesh
from jaxtyping import Bool, Float, Int
from scipy.spatial import KDTree

from capture_plan.mesh import border_edges, vertex_normals
from capture_plan.mesh.geometry import triangle_areas

STEP_MM = 1.3  # between samples: finer tells no more under the noise of scanners
FACING_MM = 26.0  # what a normal counts beside a distance: opposite ones lie 52 mm apart, so that lips do not meet
MOST = 60_000
BESIDE_BORDER_MM = 4.0  # what lies nearer to the end of a mesh attracts nothing


@dataclass(frozen=True, eq=False)
class Samples:
    """Points of a surface, millimetres, their normals, and which attract."""

    q: Float[np.ndarray, "s 3"]
    m: Float[np.ndarray, "s 3"]
    inner: Bool[np.ndarray, " s"]

    @cached_property
    def tree(self) -> KDTree:
        """For the nearest of the points."""
        return KDTree(self.q)

    @cached_property
    def facing_tree(self) -> KDTree:
        """For the nearest of the points that face alike."""
        return KDTree(np.hstack([self.q, FACING_MM * self.m]))

    @property
    def inside_out(self) -> "Samples":
        """The other side of the surface."""
        return replace(self, m=-self.m)

    def thinned(self, step_mm: float) -> "Samples":
        """One sample of each cube of this side."""
        _, first = np.unique(np.floor(self.q / step_mm).astype(np.int64), axis=0, return_index=True)
        first = np.sort(first)
        return Samples(self.q[first], self.m[first], self.inner[first])


def sampled(vertices: Float[np.ndarray, "v 3"], triangles: Int[np.ndarray, "f 3"]) -> Samples:
    """Samples of a surface, the same for the same surface."""
    mesh = trimesh.Trimesh(vertices, triangles, process=False)
    count = int(np.clip(triangle_areas(vertices, triangles).sum() / STEP_MM**2, 100, MOST))
    found = trimesh.sample.sample_surface(mesh, count, seed=0)
    q, corners = np.asarray(found[0]), triangles[np.asarray(found[1])]
    share = trimesh.triangles.points_to_barycentric(vertices[corners], q)
    m = np.einsum("sc,scx->sx", share, vertex_normals(vertices, triangles)[corners])
    length = np.linalg.norm(m, axis=1)
    ends = border_edges(triangles)
    away = KDTree(vertices[ends].mean(axis=1)).query(q)[0] if len(ends) else np.full(len(q), np.inf)
    return Samples(q, m / np.where(length > 0, length, 1)[:, None], (away > BESIDE_BORDER_MM) & (length > 0))
