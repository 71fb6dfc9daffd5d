"""Vertices spread over the moving skin: each next as far along it as can be from those before (Gonzalez 1985)."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from capture_plan.layout.face import Face
from capture_plan.mesh import surface_graph
from capture_plan.mesh.geodesic import geodesic_distance


@dataclass(frozen=True, eq=False)
class Candidates:
    """Moving skin: ascending vertex numbers, and the whole skin around it; `deltas` of the used blendshapes."""

    vertices: Int[np.ndarray, " n"]
    deltas: Float[np.ndarray, "k v 3"]
    neutral: Float[np.ndarray, "v 3"]
    skin_triangles: Int[np.ndarray, "f 3"]

    @property
    def rows(self) -> Float[np.ndarray, "n r"]:
        """X, the movements of all candidates, a row each."""
        return self.rows_at(self.vertices)

    def rows_at(self, vertices: Int[np.ndarray, " m"]) -> Float[np.ndarray, "m r"]:
        """The movements X of any vertices, a row each."""
        return np.moveaxis(self.deltas[:, vertices], 0, 1).reshape(len(vertices), -1).astype(np.float64)


def candidates(face: Face) -> Candidates:
    """Skin that moves, seen or not: still vertices are out for everybody."""
    rig = face.rig
    vertices = np.flatnonzero(face.moving_skin)
    triangles = rig.triangles[rig.skin[rig.triangles].all(axis=1)]
    return Candidates(vertices, rig.deltas[face.rows], rig.neutral, triangles)


def farthest_points(candidates: Candidates, count: int, seed: int) -> Int[np.ndarray, " m"]:
    """Spread over the skin, from a random first vertex on."""
    graph = surface_graph(candidates.neutral, candidates.skin_triangles)
    chosen = [int(np.random.default_rng(seed).choice(candidates.vertices))]
    gap = np.full(len(candidates.vertices), np.inf)
    while len(chosen) < count:
        gap = np.minimum(gap, geodesic_distance(graph, np.array(chosen[-1:]))[0, candidates.vertices])
        gap[np.isin(candidates.vertices, chosen)] = -1
        chosen.append(int(candidates.vertices[gap.argmax()]))
    return np.array(chosen)
