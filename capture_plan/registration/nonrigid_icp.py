"""Registration: one surface laid onto another of the same kind, non-rigidly, by its nearest points.

Data       p_i, n_i     vertices and normals of the surface that is laid, in any unit; all lengths in that unit
           q_j, m_j     vertices and normals of the surface that stays
           L            p - mean of its neighbours, on the mesh that is laid
Repeat     j(i) = nearest vertex in (q, a m): near and facing the same way;  c_i = trust in the pair
           p    = argmin  sum_i c_i |p_i - q_j(i)|² + b |L (p - p_start)|²       for b falling from stiff to soft
Own        for each of some points one of the q of its own, the least sum of distances (assignment problem)

This is Allen et al. 2003 and Amberg et al. 2007 with a Laplacian for stiffness.
"""

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.interpolate import RBFInterpolator
from scipy.optimize import linear_sum_assignment
from scipy.sparse import csc_array, diags_array, eye_array
from scipy.sparse.linalg import splu
from scipy.spatial import KDTree
from scipy.spatial.distance import cdist

from capture_plan.mesh import half_edges, vertex_normals

NORMAL_WEIGHT = 0.4  # a, units: opposite normals count like 0.8, so that lips do not meet each other's
STIFFNESS = np.geomspace(3000, 30, 20)  # b, per round
FAR, DOUBTFUL = 0.4, 0.1  # units: pairs further apart are dropped, pairs this far apart count half


def spline_start(
    points: Float[np.ndarray, "n 3"],
    controls: tuple[Float[np.ndarray, "a 3"], Float[np.ndarray, "a 3"]],
    unit_here: float,
    unit_there: float,
    *,
    smoothing: float,
) -> Float[np.ndarray, "n 3"]:
    """The points of one surface, bent so that its control points come near those of the other."""
    here, there = controls
    bend = RBFInterpolator(here / unit_here, there / unit_there, kernel="linear", degree=1, smoothing=smoothing)
    return bend(points / unit_here) * unit_there


def fit(
    start: Float[np.ndarray, "n 3"],
    triangles: Int[np.ndarray, "f 3"],
    q: Float[np.ndarray, "s 3"],
    m: Float[np.ndarray, "s 3"],
    inner: Bool[np.ndarray, " s"],
) -> Float[np.ndarray, "n 3"]:
    """The start laid onto the surface q with normals m; only its `inner` vertices attract."""
    tree = KDTree(np.hstack([q, NORMAL_WEIGHT * m]))
    LL = graph_stiffness(triangles, len(start))
    p = start
    for b in STIFFNESS:
        n = vertex_normals(p, triangles)
        j = tree.query(np.hstack([p, NORMAL_WEIGHT * n]))[1]
        gap = np.linalg.norm(q[j] - p, axis=1)
        facing = np.einsum("nx,nx->n", n, m[j]) > 0.5
        c = facing * inner[j] * (gap < FAR) / (1 + (gap / DOUBTFUL) ** 2)
        # (C + b LᵀL) (p - start) = C (q - start)
        A = csc_array(diags_array(c + 1e-6) + b * LL)
        solver = splu(A, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0, options={"SymmetricMode": True})
        p = start + solver.solve(c[:, None] * (q[j] - start))
    return p


def graph_stiffness(triangles: Int[np.ndarray, "f 3"], n: int) -> csc_array:
    """LᵀL of L x = x - mean of the neighbours of x."""
    sides = half_edges(triangles)
    sides = np.concatenate([sides, sides[:, ::-1]])
    W = csc_array((np.ones(len(sides)), (sides[:, 0], sides[:, 1])), shape=(n, n))
    L = eye_array(n) - diags_array(1 / W.sum(axis=1)) @ W
    return csc_array(L.T @ L)


def own_nearest(
    p: Float[np.ndarray, "a 3"],
    n: Float[np.ndarray, "a 3"],
    q: Float[np.ndarray, "s 3"],
    m: Float[np.ndarray, "s 3"],
) -> Int[np.ndarray, " a"]:
    """For each point an index into q of its own, near and facing the same way, with the least sum of distances.

    Where q has fewer points than p, some serve twice.
    """
    weight = NORMAL_WEIGHT / 2
    distance = cdist(np.hstack([p, weight * n]), np.hstack([q, weight * m]))
    return distance.argmin(axis=1) if len(q) < len(p) else linear_sum_assignment(distance)[1]
