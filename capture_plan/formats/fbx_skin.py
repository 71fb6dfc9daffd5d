"""Where the bones of an FBX file put the vertices of a skinned mesh.

Cluster    one bone's share of a skin: Indexes and Weights of vertices, and two matrices at the moment of binding:
           TransformLink L, the bone's place in the world, and Transform T, the mesh's place seen from the bone
Place      v' = sum_j w_j B_j T_j G v, where B_j is the bone's place now and G the node's geometric matrix; the node of
           the mesh counts only for vertices without weights
T or X     some programs write for T the mesh's place in the world, X, which the FBX SDK hands out: T = L^-1 X. X is one
           for all clusters, and mostly where the node stands: the reading of which that is truer is taken

Letters: v vertices, j clusters, i weighted vertices.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from capture_plan.errors import RigError


@dataclass(frozen=True, eq=False)
class Cluster:
    """Weights of one bone, its place now, and the two matrices of binding; T is None where the file has none."""

    indices: Int[np.ndarray, " i"]
    weights: Float[np.ndarray, " i"]
    bone: Float[np.ndarray, "4 4"]
    L: Float[np.ndarray, "4 4"]
    T: Float[np.ndarray, "4 4"] | None


def skinned_places(
    clusters: Sequence[Cluster], node: Float[np.ndarray, "4 4"], geometric: Float[np.ndarray, "4 4"], v: int
) -> Float[np.ndarray, "v 4 4"] | None:
    """Matrix that places each of `v` vertices; None where no matrix of the bones is one that can place anything.

    `node` is the world matrix of the mesh's own node.
    """
    clusters = [cluster for cluster in clusters if len(cluster.indices)]
    if not clusters:
        return None
    total, M = np.zeros(v), np.zeros((v, 4, 4))
    for cluster, T in zip(clusters, binding(clusters, node), strict=True):
        _check(cluster, v)
        np.add.at(total, cluster.indices, cluster.weights)
        np.add.at(M, cluster.indices, cluster.weights[:, None, None] * (cluster.bone @ T @ geometric))
    weighted = total > 0
    M[weighted] /= total[weighted, None, None]
    M[~weighted] = node @ geometric
    solid = np.abs(np.linalg.det(M[:, :3, :3])) if np.isfinite(M).all() else np.zeros(v)
    return M if (solid > 0).all() else None


def binding(clusters: Sequence[Cluster], node: Float[np.ndarray, "4 4"]) -> list[Float[np.ndarray, "4 4"]]:
    """T of every cluster, whichever of T and X the file holds."""
    inverse = [np.linalg.pinv(cluster.L) for cluster in clusters]
    T = [L @ node if c.T is None else c.T for c, L in zip(clusters, inverse, strict=True)]
    as_T = np.stack([cluster.L @ one for cluster, one in zip(clusters, T, strict=True)])  # X, if these are T
    as_X = np.stack(T)
    if disagreement(as_T, node) <= disagreement(as_X, node):
        return T
    return [L @ X for L, X in zip(inverse, T, strict=True)]


def disagreement(X: Float[np.ndarray, "j 4 4"], node: Float[np.ndarray, "4 4"]) -> tuple[float, float]:
    """How far places of the mesh at binding differ from one another, to a thousandth, and then from the node's."""
    spread = np.abs(X - X.mean(axis=0)).max() / (1 + np.abs(X).max())
    return round(float(spread), 3), float(np.abs(X - node).max())


def _check(cluster: Cluster, v: int) -> None:
    """RigError unless the cluster has one weight for each vertex that it names, and these are there."""
    if len(cluster.indices) != len(cluster.weights):
        raise RigError(
            f"has a bone with {len(cluster.weights):,} weights for {len(cluster.indices):,} vertices: export it again"
        )
    if cluster.indices.min() < 0 or cluster.indices.max() >= v:
        raise RigError(f"has a bone that moves vertex {cluster.indices.max():,} of {v:,}: export it again")
