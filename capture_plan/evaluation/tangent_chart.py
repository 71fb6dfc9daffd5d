"""The skin around a landmark laid flat, so that a dot can be moved over it by millimetres in any direction.

Data       v        the landmark's vertex, n its normal; u the vertices near it
           (e1, e2) axes of the tangent plane at v
Map        u -> d(v, u) (e1, e2)·(p_u - p_v) / |(e1, e2)·(p_u - p_v)|    the distance along the skin in
           the direction seen from v
Between the vertices deltas are linear on the triangles of the flat points. A place further from every vertex than
any point of a triangle with the longest edge is not on the skin.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.sparse import csr_array
from scipy.spatial import Delaunay, KDTree

from capture_plan.mesh import geodesic_distance


@dataclass(frozen=True, eq=False)
class Chart:
    """`at` are the vertices near the landmark and `flat` their places in the plane of `axes`, millimetres."""

    at: Int[np.ndarray, " n"]
    flat: Float[np.ndarray, "n 2"]
    axes: Float[np.ndarray, "2 3"]
    longest_mm: float

    @cached_property
    def triangles(self) -> Delaunay:
        """The Delaunay triangulation of the flat points."""
        return Delaunay(self.flat)

    def on_skin(self, places: Float[np.ndarray, "p 2"]) -> Bool[np.ndarray, " p"]:
        """Which places of the plane the skin reaches: no point of a triangle is further from all its corners."""
        return KDTree(self.flat).query(places)[0] <= self.longest_mm / np.sqrt(3)

    def deltas(
        self, deltas: Float[np.ndarray, "k v 3"], places: Float[np.ndarray, "p 2"]
    ) -> Float[np.ndarray, "p 3 k"]:
        """Deltas at places of the plane; beyond the outermost vertices those of the nearest one."""
        inside = np.atleast_1d(self.triangles.find_simplex(places))
        to_corner = np.asarray(self.triangles.transform)[inside]
        # two barycentric coordinates, the third adds up to 1
        two = np.einsum("pij,pj->pi", to_corner[:, :2], places - to_corner[:, 2])
        weights = np.column_stack([two, 1 - two.sum(axis=1)])
        corners = np.asarray(self.triangles.simplices)[inside]
        beyond = inside < 0
        corners[beyond] = np.reshape(KDTree(self.flat).query(places[beyond])[1], (-1, 1))
        weights[beyond] = 1 / 3
        row = np.repeat(np.arange(len(places)), 3)
        W = csr_array((weights.ravel(), (row, corners.ravel())), shape=(len(places), len(self.at)))
        values = np.moveaxis(deltas[:, self.at], 0, 2).astype(np.float64).reshape(len(self.at), -1)
        return (W @ values).reshape(len(places), 3, -1)


def flatten(
    neutral: Float[np.ndarray, "v 3"],
    normals: Float[np.ndarray, "v 3"],
    graph: csr_array,
    vertices: Int[np.ndarray, " m"],
    *,
    extent_mm: float,
) -> tuple[Chart, ...]:
    """A chart around each of `vertices`; `graph` is `surface_graph` of the skin.

    It reaches `extent_mm` and one longest edge more, so that every vertex beside a coarse mesh's landmark is in it.
    """
    charts = []
    for vertex in vertices.tolist():
        longest = float(graph[[vertex]].data.max(initial=0.0))
        distance = geodesic_distance(graph, np.array([vertex]), limit=extent_mm + longest)[0]
        at = np.flatnonzero(np.isfinite(distance))
        axes = tangent_axes(normals[vertex])
        seen = (neutral[at] - neutral[vertex]) @ axes.T
        length = np.linalg.norm(seen, axis=1)
        flat = distance[at, None] * seen / np.where(length > 0, length, 1)[:, None]
        longest = max(longest, float(np.median(graph[at].data)))
        charts.append(Chart(at, flat.astype(np.float64), axes, longest))
    return tuple(charts)


def tangent_axes(normal: Float[np.ndarray, "3"]) -> Float[np.ndarray, "2 3"]:
    """Two axes across `normal`, the second as far up the face (+y) as it goes, forward (+z) where the skin is level."""
    up = np.array([0.0, 1.0, 0.0]) if abs(normal[1]) < 0.9 else np.array([0.0, 0.0, 1.0])
    e1 = np.cross(up, normal)
    e1 /= np.linalg.norm(e1)
    return np.stack([e1, np.cross(normal, e1)])


def in_words(direction: Float[np.ndarray, "3"]) -> str:
    """'up', 'down and left', 'forward': the one or two strongest parts; left is the subject's own."""
    words = (("right", "left"), ("down", "up"), ("back", "forward"))
    strong = [a for a in (1, 0, 2) if abs(direction[a]) > 0.5] or [int(np.abs(direction).argmax())]
    return " and ".join(words[a][int(direction[a] > 0)] for a in strong[:2])
