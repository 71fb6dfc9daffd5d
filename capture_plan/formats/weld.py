"""One surface again where a file splits its vertices: along the seams of textures, shading or materials.

Data     x[v] places, d[k, v] deltas, g[v] groups: what may be one surface, such as a mesh or a part of it
Welded   vertices of one group on the border of the surface that share their place and all their motion, but for
         rounding: |x_i - x_j| and every |d_ki - d_kj| <= TOLERANCE times the group's size, and less than TINY of the
         shortest edges that meet there; lips that touch part when the jaw opens and so stay two
Not      the two sides of a sheet, whose normals are opposite: n_i . n_j < BACK; nor strips that lie beside or over one
         another, such as rows of lashes: a seam is an edge that one triangle has forwards and one backwards

Letters: v vertices, f triangles, k blendshapes, p pairs, b candidates, s spots.
"""

from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from capture_plan.formats.raw import NO_PART, RawRig
from capture_plan.mesh import boundary_vertices, half_edges, vertex_normals

TOLERANCE = 2e-5  # of the diagonal: 8 micrometres on a head, one step of 16 bits over 0.5 m
TINY = 0.02  # of an edge: scans may be finer than the tolerance
BACK = -0.9  # cosine: the rim of an ear folds by less
MOST_PAIRS = 64  # for each candidate; more lie on one spot only in files that were made to fill the memory


def weld_seams(raw: RawRig, groups: Int[np.ndarray, " v"]) -> RawRig:
    """The rig with its seams closed; a welded vertex is called by its first number and is of the first of its parts."""
    same = seam_twins(raw, groups)
    _, retained, inverse = np.unique(same, return_index=True, return_inverse=True)
    if len(retained) == len(same):
        return raw
    parts = np.full(len(retained), np.iinfo(np.int32).max, np.int32)
    np.minimum.at(parts, inverse, raw.parts.astype(np.int32))
    unused = raw.part_names[-1] == NO_PART and parts.max() < len(raw.part_names) - 1
    return replace(
        raw,
        neutral=raw.neutral[retained],
        triangles=inverse[raw.triangles].astype(np.int32),
        deltas=np.ascontiguousarray(raw.deltas[:, retained]),
        parts=parts,
        part_names=raw.part_names[:-1] if unused else raw.part_names,
        source_index=raw.source_index[retained],
        meshes=None if raw.meshes is None else raw.meshes[retained],
    )


def seam_twins(raw: RawRig, groups: Int[np.ndarray, " v"]) -> Int[np.ndarray, " v"]:
    """The first vertex of those that each vertex is welded to, itself where there is no other."""
    v = len(raw.neutral)
    at = _candidates(raw.triangles, v)
    same = np.arange(v)
    if len(at) < 2:
        return same
    limit = _tolerances(raw, groups)
    near = close_pairs(raw.neutral[at], float(limit[at].max()))
    i, j = at[near[:, 0]], at[near[:, 1]]
    retained = (groups[i] == groups[j]) & (np.linalg.norm(raw.neutral[i] - raw.neutral[j], axis=1) <= limit[i])
    i, j = i[retained], j[retained]
    retained = move_alike(raw.deltas, i, j, limit[i]) & ~back_to_back(raw, i, j)
    graph = coo_array((np.ones(int(retained.sum()), bool), (i[retained], j[retained])), shape=(v, v))
    label = connected_components(graph, directed=False)[1]
    first = np.full(v, v)
    np.minimum.at(first, label, same)
    spot = first[label]
    return np.where(np.isin(spot, _crowded(raw.triangles, spot)), same, spot)


def _crowded(triangles: Int[np.ndarray, "f 3"], spot: Int[np.ndarray, " v"]) -> Int[np.ndarray, " s"]:
    """Spots on edges of the border that more than two triangles would share, or two in the same direction."""
    edges = half_edges(triangles)
    _, number, count = np.unique(np.sort(edges, axis=1), axis=0, return_inverse=True, return_counts=True)
    border = spot[edges[count[number.ravel()] == 1]]
    border = border[border[:, 0] != border[:, 1]]
    found, times = np.unique(border, axis=0, return_counts=True)
    return np.unique(found[times > 1])


def _candidates(triangles: Int[np.ndarray, "f 3"], v: int) -> Int[np.ndarray, " b"]:
    """Vertices on a border of the surface, and those of no triangle, which a split leaves behind too."""
    unused = np.ones(v, dtype=bool)
    unused[triangles] = False
    return np.union1d(boundary_vertices(triangles), np.flatnonzero(unused))


def _tolerances(raw: RawRig, groups: Int[np.ndarray, " v"]) -> Float[np.ndarray, " v"]:
    """How far apart twins may lie, for each vertex."""
    number = np.unique(groups, return_inverse=True)[1]
    low, high = np.full((number.max() + 1, 3), np.inf), np.full((number.max() + 1, 3), -np.inf)
    np.minimum.at(low, number, raw.neutral)
    np.maximum.at(high, number, raw.neutral)
    limit = (TOLERANCE * np.linalg.norm(high - low, axis=1))[number]
    pairs = half_edges(raw.triangles)
    length = np.linalg.norm(raw.neutral[pairs[:, 0]] - raw.neutral[pairs[:, 1]], axis=1)
    shortest = np.full(len(limit), np.inf)
    np.minimum.at(shortest, pairs.ravel(), np.repeat(np.where(length > 0, length, np.inf), 2))
    return np.minimum(limit, TINY * shortest)


def close_pairs(points: Float[np.ndarray, "b 3"], limit: float) -> Int[np.ndarray, "p 2"]:
    """Pairs no further apart than `limit`, or only neighbours in a row of equal ones where there are too many."""
    spots, number = np.unique(points, axis=0, return_inverse=True)
    order = np.argsort(number.ravel(), kind="stable")
    in_row = number.ravel()[order]
    row = np.stack([order[:-1], order[1:]], axis=1)[in_row[:-1] == in_row[1:]]
    tree = KDTree(points)
    if tree.count_neighbors(tree, limit) > MOST_PAIRS * len(points):
        return row
    return tree.query_pairs(limit, output_type="ndarray").reshape(-1, 2) if len(spots) else row


def move_alike(
    deltas: Float[np.ndarray, "k v 3"],
    i: Int[np.ndarray, " p"],
    j: Int[np.ndarray, " p"],
    limit: Float[np.ndarray, " p"],
) -> Bool[np.ndarray, " p"]:
    """Whether every blendshape moves both vertices of a pair alike."""
    alike = np.ones(len(i), dtype=bool)
    for delta in deltas:
        alike &= np.linalg.norm(delta[i] - delta[j], axis=1) <= limit
    return alike


def back_to_back(raw: RawRig, i: Int[np.ndarray, " p"], j: Int[np.ndarray, " p"]) -> Bool[np.ndarray, " p"]:
    """Whether the two vertices of a pair are on opposite sides of a sheet."""
    n = vertex_normals(raw.neutral, raw.triangles)
    return np.einsum("pi,pi->p", n[i], n[j]) < BACK
