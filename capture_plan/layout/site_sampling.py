"""Which vertices are asked whether a dot stands there: all skin, but of a mesh finer than dots can be placed.

Data    x[v] neutral and d[k, v] displacement, millimetres;  m[v] mirror image
Order   by the largest share that a vertex has of a blendshape's movement, max_k d[k, v] / max_u d[k, u], then by number
Rule    one after another each vertex becomes a place, unless one nearer than `GRAIN_MM` is; its mirror image with it
So the vertex that a blendshape moves most is a place, or has one beside it, and places cover the skin.
"""

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.spatial import KDTree

from capture_plan.audit.mesh import GRAIN_MM, is_fine
from capture_plan.rig import Rig


def places_on(
    rig: Rig, displacement: Float[np.ndarray, "k v"], mirror: Int[np.ndarray, " v"]
) -> Bool[np.ndarray, " v"]:
    """The skin, or of a fine mesh vertices of it that stand `GRAIN_MM` apart."""
    if not is_fine(rig):
        return rig.skin
    largest = displacement.max(axis=1, keepdims=True, initial=0)
    share = (displacement / np.where(largest > 0, largest, 1)).max(axis=0, initial=0)
    at = np.flatnonzero(rig.skin)
    return spread_sites(rig.neutral, at[np.argsort(-share[at], kind="stable")], mirror, GRAIN_MM)


def spread_sites(
    points: Float[np.ndarray, "v 3"], order: Int[np.ndarray, " n"], mirror: Int[np.ndarray, " v"], radius_mm: float
) -> Bool[np.ndarray, " v"]:
    """Of the vertices of `order`, first come first served, those that keep a distance; each with its mirror image."""
    tree, rank = KDTree(points[order]), np.full(len(points), -1)
    rank[order] = np.arange(len(order))
    chosen, shut = np.zeros(len(points), dtype=bool), np.zeros(len(order), dtype=bool)
    for v in order.tolist():
        if shut[rank[v]]:
            continue
        image = int(mirror[v])
        both = [v, image] if mirror[image] == v and rank[image] >= 0 else [v]
        chosen[both] = True
        for near in tree.query_ball_point(points[both], radius_mm):
            shut[near] = True
    return chosen
