"""What the paper tried in the place of displacement and discarded (Zell & McDonnell 2022, section 3.1.3).

Data       n_v, A_v       normal and barycentric area of vertex v, square millimetres; D_v (3 k) its deltas
Curvature  H_v            mean: (L x)_v . n_v / 2 A_v, L x = sum over edges of (cot + cot) / 2 (x_v - x_u); 1/mm
           K_v            Gaussian: (2 pi - sum of the angles at v) / A_v; 1/mm^2
Saliency   S_v            sum over scales s of |G(H, s) - G(H, 2s)|, G(H, s) the mean of H around v with weights
                          exp(-d^2 / 2s^2), cut off at 2s (center-surround of Lee, Varshney & Jacobs 2005; scales are
                          2 to 6 times 0.3 % of the diagonal; their suppression of many equal peaks is left out)
Condition  1 / cond(D_v)  smallest over largest singular value: does the vertex move in all directions?

The border of an open mesh has no curvature. SIFT, the fourth discarded metric, is a feature of pictures and is not
offered: a rig comes without a texture.
"""

import numpy as np
from jaxtyping import Float, Int
from scipy.sparse import csr_array
from scipy.spatial import KDTree

from capture_plan.layout.cover import solve_cover
from capture_plan.layout.face import Face
from capture_plan.layout.quality import importance_weights, total_quality
from capture_plan.layout.settings import LayoutSettings
from capture_plan.mesh import (
    boundary_vertices,
    cotangent_laplacian,
    cotangents,
    vertex_areas,
    vertex_normals,
    with_area,
)

FINEST_SHARE, SCALES = 0.003, (2, 3, 4, 5, 6)
CUT_OFF = 2.0  # standard deviations
TOP = 0.95  # the quantile of the skin that counts as 1: the creases of the lids would leave all else at 0


def mean_curvature(vertices: Float[np.ndarray, "v 3"], triangles: Int[np.ndarray, "f 3"]) -> Float[np.ndarray, " v"]:
    """H, 1/mm, positive where the surface bulges outwards."""
    Lx = -cotangent_laplacian(vertices, with_area(vertices, triangles)) @ vertices
    along = np.einsum("vx,vx->v", Lx, vertex_normals(vertices, triangles))
    return _inside(along / _positive(2 * vertex_areas(vertices, triangles)), triangles)


def gaussian_curvature(
    vertices: Float[np.ndarray, "v 3"], triangles: Int[np.ndarray, "f 3"]
) -> Float[np.ndarray, " v"]:
    """The Gaussian curvature K of every vertex, 1/mm^2."""
    solid = with_area(vertices, triangles)
    angles = np.arctan2(1, cotangents(vertices, solid))
    left = 2 * np.pi - np.bincount(solid.ravel(), weights=angles.ravel(), minlength=len(vertices))
    return _inside(left / _positive(vertex_areas(vertices, triangles)), triangles)


def saliency(
    vertices: Float[np.ndarray, "v 3"], H: Float[np.ndarray, " v"], *, diagonal_mm: float
) -> Float[np.ndarray, " v"]:
    """S of the vertices given, of curvature H."""
    finest = FINEST_SHARE * diagonal_mm
    farthest = CUT_OFF * 2 * max(SCALES) * finest
    pairs = KDTree(vertices).query_pairs(farthest, output_type="ndarray")
    away = np.linalg.norm(vertices[pairs[:, 0]] - vertices[pairs[:, 1]], axis=1)

    def smooth(s: float) -> Float[np.ndarray, " v"]:
        near = away <= CUT_OFF * s
        weight = np.exp(-(away[near] ** 2) / (2 * s**2))
        W = csr_array((weight, pairs[near].T), shape=(len(H), len(H)))
        return (H + W @ H + W.T @ H) / (1 + W.sum(axis=1) + W.sum(axis=0))

    return np.sum([np.abs(smooth(n * finest) - smooth(2 * n * finest)) for n in SCALES], axis=0)


def conditioning(deltas: Float[np.ndarray, "k v 3"]) -> Float[np.ndarray, " v"]:
    """1 / cond(D_v), 0 (moves along a line or in a plane) to 1 (alike in all directions)."""
    D = np.moveaxis(deltas, 1, 0).astype(np.float64)
    squares = np.linalg.eigvalsh(np.einsum("vki,vkj->vij", D, D))
    return np.sqrt(np.clip(squares[:, 0], 0, None) / _positive(squares[:, 2]))


def discarded_metrics(face: Face) -> dict[str, Float[np.ndarray, " v"]]:
    """Each metric on the markable skin by name, 0 to 1, NaN elsewhere."""
    rig, skin = face.rig, face.markable
    diagonal = float(np.linalg.norm(np.ptp(rig.neutral[rig.skin], axis=0)))
    H = mean_curvature(rig.neutral, rig.triangles)
    found = {
        "mesh saliency": saliency(rig.neutral[skin], H[skin], diagonal_mm=diagonal),
        "mean curvature": np.abs(H[skin]),
        "Gaussian curvature": np.abs(gaussian_curvature(rig.neutral, rig.triangles)[skin]),
        "condition number": conditioning(rig.deltas[face.rows][:, skin]),
    }
    return {name: _shares(values, skin) for name, values in found.items()}


def cover_by_metric(face: Face, settings: LayoutSettings, metric: Float[np.ndarray, " v"]) -> Int[np.ndarray, " m"]:
    """The paper's cover with `metric` in the place of displacement in the weight; candidates stay those of eq. 3."""
    sites = face.sites(settings)
    covers = sites.covers(settings.epsilon)
    covers = covers[covers.any(axis=1)]
    q = np.nan_to_num(metric)[sites.vertices].max(axis=1)
    w = importance_weights(np.tile(q, (len(covers), 1)), sites.visibility, settings.alpha)
    return sites.members(solve_cover(covers, total_quality(covers, w)).chosen)


def _shares(values: Float[np.ndarray, " n"], skin: np.ndarray) -> Float[np.ndarray, " v"]:
    """0 to 1 on the skin, `TOP` of which lies below 1."""
    shares = np.full(len(skin), np.nan)
    shares[skin] = np.clip(values / (float(np.quantile(values, TOP)) or 1.0), 0, 1)
    return shares


def _positive(values: np.ndarray) -> np.ndarray:
    return np.where(values > 0, values, 1.0)


def _inside(values: Float[np.ndarray, " v"], triangles: Int[np.ndarray, "f 3"]) -> Float[np.ndarray, " v"]:
    values[boundary_vertices(triangles)] = 0
    return values
