"""Empirical layouts: the 68 points of iBUG 300-W (Sagonas et al. 2013), placed on any rig.

The points are known as vertices of the bundled sample head. The sample's face is laid onto the skin of the rig:

Data       p_i, n_i     vertices and normals of the sample's face; u the distance between the pupils, the unit
           q_j, m_j     vertices and normals of the rig's skin
           L            p - mean of its neighbours, on the sample's mesh
Start      p = a thin spline through eyes, mouth, nose, chin and ears of both faces (radial kernel r, affine part)
Repeat     j(i) = nearest skin vertex in (q / u, a m): near and facing the same way;  c_i = trust in the pair
           p    = argmin  sum_i c_i |p_i - q_j(i)|² + b |L (p - p_start)|²       for b falling from stiff to soft
Answer     for each of the 68 points a skin vertex of its own, the least sum of distances (assignment problem)

This is non-rigid registration by closest points (Allen et al. 2003; Amberg et al. 2007) with a Laplacian for stiffness.
"""

import json
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

import numpy as np
from jaxtyping import Float, Int
from scipy.interpolate import RBFInterpolator
from scipy.optimize import linear_sum_assignment
from scipy.sparse import csc_array, diags_array, eye_array
from scipy.sparse.linalg import splu
from scipy.spatial import KDTree
from scipy.spatial.distance import cdist

from capture_plan.errors import RigError
from capture_plan.mesh import half_edges, vertex_normals
from capture_plan.rig import Rig, sample_rig
from capture_plan.rig.anchors import Anchors, face_anchors

NORMAL_WEIGHT = 0.4  # a: opposite normals count like 0.8 pupil distances, so that lips do not meet each other's
STIFFNESS = np.geomspace(3000, 30, 20)  # b, per round
SMOOTHING = 0.5  # control points are a few millimetres wrong
FAR, DOUBTFUL = 0.4, 0.1  # pupil distances: pairs further apart are dropped, pairs this far apart count half
FACE_ABOVE, FACE_BELOW = 1.2, 0.4  # pupil distances above the eyes and below the chin: the part that is fitted


@dataclass(frozen=True, eq=False)
class Placement:
    """Skin vertices of the 68 points, and how far the fitted face lies from the skin: root mean square, millimetres."""

    vertices: Int[np.ndarray, "68"]
    residual_mm: float


def place_ibug68(rig: Rig) -> Int[np.ndarray, "68"]:
    """The skin vertices of a rig nearest to the 68 points of iBUG, in their order, no vertex twice."""
    return fit_ibug68(rig).vertices


def fit_ibug68(rig: Rig) -> Placement:
    """The 68 points on a rig, with the residual of the fit that placed them.

    Raises:
        RigError: the skin has fewer than 68 vertices.
    """
    sample, points = sample_rig(), ibug68_of_sample()
    here, there = face_anchors(sample), face_anchors(rig)
    u = there.pupils
    controls = control_points(here, there)
    if rig.skin.sum() < len(points):
        raise RigError(f"{rig.name}: {rig.skin.sum()} skin vertices for {len(points)} points: a finer mesh is needed")
    at, triangles = face_part(sample, here)
    start = spline_start(sample.neutral[at], controls, here.pupils, u)
    skin = np.flatnonzero(rig.skin)
    q = rig.neutral[skin] / u
    m = vertex_normals(rig.neutral, rig.triangles[rig.skin[rig.triangles].all(axis=1)])[skin]
    p = fit(start / u, triangles, q, m)
    number = np.searchsorted(at, points)
    normals = vertex_normals(p, triangles)
    gap = KDTree(q).query(p[number])[0]
    chosen = skin[own_nearest(p[number], normals[number], q, m)]
    return Placement(chosen, float(u * np.sqrt(np.mean(gap**2))))


@cache
def ibug68_of_sample() -> Int[np.ndarray, "68"]:
    """The 68 points as vertices of the sample head."""
    data = json.loads(files("capture_plan.layout").joinpath("data/ibug68.json").read_text(encoding="utf-8"))
    return np.array(data["vertices"])


def face_part(rig: Rig, anchors: Anchors) -> tuple[Int[np.ndarray, " n"], Int[np.ndarray, "f 3"]]:
    """Skin vertices in front of the ears from neck to forehead, in rising order, and the triangles among them."""
    u, points = anchors.pupils, rig.neutral
    back = (anchors.ear_left[2] + anchors.ear_right[2]) / 2
    front = rig.skin & (points[:, 2] > back)
    front &= (points[:, 1] > anchors.chin[1] - FACE_BELOW * u) & (points[:, 1] < anchors.eye_left[1] + FACE_ABOVE * u)
    triangles = rig.triangles[front[rig.triangles].all(axis=1)]
    at, inside = np.unique(triangles, return_inverse=True)
    return at, inside.reshape(-1, 3)


def control_points(here: Anchors, there: Anchors) -> tuple[Float[np.ndarray, "a 3"], Float[np.ndarray, "a 3"]]:
    """Points of the sample and the same points of the rig, in millimetres of each."""
    names = (
        "eye_left",
        "eye_right",
        "mouth",
        "corner_left",
        "corner_right",
        "nose_tip",
        "chin",
        "ear_left",
        "ear_right",
    )
    return (
        np.stack([getattr(here, name) for name in names]),
        np.stack([getattr(there, name) for name in names]),
    )


def spline_start(
    points: Float[np.ndarray, "n 3"],
    controls: tuple[Float[np.ndarray, "a 3"], Float[np.ndarray, "a 3"]],
    unit_here: float,
    unit_there: float,
) -> Float[np.ndarray, "n 3"]:
    """The points of the sample, bent so that its control points come near those of the rig."""
    here, there = controls
    bend = RBFInterpolator(here / unit_here, there / unit_there, kernel="linear", degree=1, smoothing=SMOOTHING)
    return bend(points / unit_here) * unit_there


def fit(
    start: Float[np.ndarray, "n 3"],
    triangles: Int[np.ndarray, "f 3"],
    q: Float[np.ndarray, "s 3"],
    m: Float[np.ndarray, "s 3"],
) -> Float[np.ndarray, "n 3"]:
    """The start laid onto the skin q with normals m, all in pupil distances."""
    tree = KDTree(np.hstack([q, NORMAL_WEIGHT * m]))
    LL = stiffness(triangles, len(start))
    p = start
    for b in STIFFNESS:
        n = vertex_normals(p, triangles)
        j = tree.query(np.hstack([p, NORMAL_WEIGHT * n]))[1]
        gap = np.linalg.norm(q[j] - p, axis=1)
        facing = np.einsum("nx,nx->n", n, m[j]) > 0.5
        c = facing * (gap < FAR) / (1 + (gap / DOUBTFUL) ** 2)
        # (C + b LᵀL) (p - start) = C (q - start)
        A = csc_array(diags_array(c + 1e-6) + b * LL)
        solver = splu(A, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0, options={"SymmetricMode": True})
        p = start + solver.solve(c[:, None] * (q[j] - start))
    return p


def stiffness(triangles: Int[np.ndarray, "f 3"], n: int) -> csc_array:
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
