"""Distances along the skin, so that the upper lip is far from the lower one although it touches it.

Paths run along edges and, unfolded into the plane, across pairs of neighbouring triangles. Every such path lies on the
surface, so the distance is never too short; with the crossings it is a few per cent too long where edges alone are 15.
"""

import numpy as np
from jaxtyping import Float, Int
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import KDTree

from capture_plan.mesh.geometry import half_edges

BLOCK = 256  # sources whose searches share one small graph


def _crossings(
    vertices: Float[np.ndarray, "v 3"], triangles: Int[np.ndarray, "f 3"]
) -> tuple[Int[np.ndarray, "e 2"], Float[np.ndarray, " e"]]:
    """Pairs of vertices opposite to each other across an edge, and the length of the straight way over it.

    With the edge from a to b along the first axis, the apexes lie at (x, y) and (x', -y') in the unfolded plane. Where
    the straight line misses the edge, there is no way.
    """
    directed = half_edges(triangles)
    apex = np.concatenate([triangles[:, 2], triangles[:, 0], triangles[:, 1]])
    order = np.lexsort(np.sort(directed, axis=1).T)
    first, second = order[:-1], order[1:]
    shared = (np.sort(directed[first], axis=1) == np.sort(directed[second], axis=1)).all(axis=1)
    first, second = first[shared], second[shared]
    a, b = vertices[directed[first, 0]], vertices[directed[first, 1]]
    length = np.linalg.norm(b - a, axis=1)
    safe = np.where(length > 0, length, 1)
    along = (b - a) / safe[:, None]

    def plane(corner: Int[np.ndarray, " e"]) -> tuple[np.ndarray, np.ndarray]:
        offset = vertices[apex[corner]] - a
        x = np.einsum("ex,ex->e", offset, along)
        return x, np.linalg.norm(offset - x[:, None] * along, axis=1)

    (x1, y1), (x2, y2) = plane(first), plane(second)
    height = y1 + y2
    crossing = (x1 * y2 + x2 * y1) / np.where(height > 0, height, 1)
    inside = (crossing > 0) & (crossing < length) & (height > 0)
    pairs = np.stack([apex[first], apex[second]], axis=1)
    return pairs[inside], np.hypot(x1 - x2, height)[inside]


def surface_graph(vertices: Float[np.ndarray, "v 3"], triangles: Int[np.ndarray, "f 3"]) -> csr_array:
    """Sparse symmetric (v v) matrix of the lengths of edges and crossings, millimetres."""
    sides = half_edges(triangles)
    across, across_length = _crossings(vertices, triangles)
    side_length = np.linalg.norm(vertices[sides[:, 0]] - vertices[sides[:, 1]], axis=1)
    pairs = np.concatenate([sides, across])
    length = np.maximum(np.concatenate([side_length, across_length]), 1e-9)  # zero would mean no edge
    pairs, length = np.concatenate([pairs, pairs[:, ::-1]]), np.tile(length, 2)
    keep = np.lexsort((length, pairs[:, 1], pairs[:, 0]))
    pairs, length = pairs[keep], length[keep]
    first = np.ones(len(pairs), dtype=bool)
    first[1:] = (pairs[1:] != pairs[:-1]).any(axis=1)
    v = len(vertices)
    return csr_array(coo_array((length[first], (pairs[first, 0], pairs[first, 1])), shape=(v, v)))


def geodesic_distance(
    graph: csr_array, sources: Int[np.ndarray, " m"], *, limit: float = np.inf
) -> Float[np.ndarray, "m v"]:
    """Distance in millimetres from each source to every vertex along `surface_graph`; infinite beyond `limit`.

    Example:
        >>> square = np.array([[0.0, 0, 0], [3, 0, 0], [3, 4, 0], [0, 4, 0]])
        >>> graph = surface_graph(square, np.array([[0, 1, 2], [0, 2, 3]]))
        >>> geodesic_distance(graph, np.array([0])).tolist()
        [[0.0, 3.0, 5.0, 4.0]]
    """
    return np.atleast_2d(dijkstra(graph, directed=False, indices=sources, limit=limit))


def near_table(graph: csr_array, points: Float[np.ndarray, "v 3"], radius_mm: float) -> csr_array:
    """Sparse symmetric (v v) matrix of all distances along `surface_graph` below a radius, millimetres.

    A vertex is at distance 0 from itself, which the table holds. No way of a length is longer than as the crow flies,
    so that a block of sources needs only the vertices within the radius of its box.
    """
    on_skin = np.flatnonzero(np.diff(graph.indptr))
    rows, columns, lengths = [], [], []
    for block in _blocks(points, on_skin):
        low, high = points[block].min(axis=0) - radius_mm, points[block].max(axis=0) + radius_mm
        around = on_skin[((points[on_skin] >= low) & (points[on_skin] <= high)).all(axis=1)]
        inside = csr_array(graph[around][:, around])
        along = geodesic_distance(inside, np.searchsorted(around, block), limit=radius_mm)
        row, column = np.nonzero(along < radius_mm)
        rows.append(block[row])
        columns.append(around[column])
        lengths.append(along[row, column])
    v = len(points)
    return csr_array((np.concatenate(lengths), (np.concatenate(rows), np.concatenate(columns))), shape=(v, v))


def straight_table(points: Float[np.ndarray, "v 3"], at: Int[np.ndarray, " n"], radius_mm: float) -> csr_array:
    """Sparse symmetric (v v) matrix of all straight distances below a radius between the points `at`, millimetres.

    A point is at distance 0 from itself, which the table holds. No way along a surface is shorter, so that points which
    are kept apart straight are kept apart along it too.
    """
    tree = KDTree(points[at])
    pairs = tree.query_pairs(radius_mm, output_type="ndarray")
    a, b = at[pairs[:, 0]], at[pairs[:, 1]]
    apart = np.maximum(np.linalg.norm(points[a] - points[b], axis=1), 1e-9)  # stored, though on one place
    a, b, apart = a[apart < radius_mm], b[apart < radius_mm], apart[apart < radius_mm]
    lengths = np.concatenate([apart, apart, np.zeros(len(at))])
    rows, columns = np.concatenate([a, b, at]), np.concatenate([b, a, at])
    table = csr_array((lengths, (rows, columns)), shape=(len(points), len(points)))
    table.sort_indices()
    return table


def _blocks(points: Float[np.ndarray, "v 3"], at: Int[np.ndarray, " n"]) -> list[Int[np.ndarray, " _"]]:
    """Halves of halves along the longest side, until no block has more than `BLOCK` vertices."""
    if len(at) <= BLOCK:
        return [at]
    axis = np.ptp(points[at], axis=0).argmax()
    at = at[np.argsort(points[at, axis], kind="stable")]
    return [block for half in (at[: len(at) // 2], at[len(at) // 2 :]) for block in _blocks(points, half)]
