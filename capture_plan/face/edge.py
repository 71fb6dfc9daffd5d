"""What of a movement is on the mesh: of a head that was cut below the eyes, a blink shows its last trace at the cut.

Data    d[k, v] deltas; the outer edge: borders of the surface that are wider than WIDE rho, so no eye and no mouth,
        that no other border meets, as the two sides of a seam do, and of no small piece: half an eyeball has one too
Cut     blendshapes that move this edge by at least MOST of their largest displacement: they go on where no mesh is,
        and the middle of what is left of them is no place of the face
"""

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from capture_plan.mesh import border_edges, piece_areas, pieces

WIDE = 2.0  # rho: mouths that stand open 1.2, below the nose alone 1.9
MOST = 0.7  # of the largest displacement: of four whole heads and their masks 0.5 at most but for jaws and brows
LARGE = 0.2  # of the area of the largest piece
SEAM = 1e-3  # rho between two borders that meet


def outer_edge(
    neutral: Float[np.ndarray, "v 3"], triangles: Int[np.ndarray, "f 3"], rho: float
) -> Int[np.ndarray, " n"]:
    """Vertices of the outer edge of a surface."""
    piece = pieces(triangles, len(neutral))
    area = piece_areas(neutral, triangles, piece)
    edge = border_edges(triangles)
    edge = edge[area[piece[edge[:, 0]]] > LARGE * area.max()]
    vertex, index = np.unique(edge, return_inverse=True)
    if len(vertex) < 2:
        return vertex
    alone = KDTree(neutral[vertex]).query(neutral[vertex], k=2)[0][:, 1] > SEAM * rho
    index = index.reshape(edge.shape)
    index = index[alone[index].all(axis=1)]
    graph = coo_array((np.ones(len(index), dtype=bool), index.T), shape=(len(vertex),) * 2)
    _, label = connected_components(graph, directed=False)
    low, high = np.full((label.max() + 1, 3), np.inf), np.full((label.max() + 1, 3), -np.inf)
    np.minimum.at(low, label, neutral[vertex])
    np.maximum.at(high, label, neutral[vertex])
    return vertex[((high - low).max(axis=1) > WIDE * rho)[label]]


def cut_off(
    deltas: Float[np.ndarray, "k v 3"], face: Bool[np.ndarray, " v"], edge: Int[np.ndarray, " n"]
) -> Bool[np.ndarray, " k"]:
    """Which blendshapes move the edge about as far as they move anything of the face."""
    if len(edge) == 0:
        return np.zeros(len(deltas), dtype=bool)
    most = np.einsum("kvx,kvx->kv", deltas, deltas).max(axis=1, where=face, initial=0)
    at_edge = np.einsum("kvx,kvx->kv", deltas[:, edge], deltas[:, edge]).max(axis=1)
    return (most > 0) & (at_edge >= MOST**2 * most)
