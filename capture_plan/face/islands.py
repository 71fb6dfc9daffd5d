"""What moves apart from a face: a card beside the head that shows a mouth, a hand, a prop.

Data      a head in any axes and unit, a[v] areas, d[k, v] deltas; rho the size of what moves
Islands   the surface, parted where nothing lies within GAP rho
Variety   (tr G)^2 / tr G^2 of an island, G[k, l] = sum a d_k . d_l over it, each blendshape of length 1 in all: how
          many movements it shows that are unlike each other
Off face  an island with less than LESS of the variety of the richest, and more than OFF times as far from the middle
          of what that moves as this is large: eyes and teeth lie nearer, and of two heads both are rich
"""

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from capture_plan.mesh import pieces

GAP = 0.25  # rho: brows and lids that float before a head lie nearer
LESS = 0.4  # a card that flaps shows one movement, a face of seven blendshapes five
OFF = 1.7  # brows 1.3, tongues 0.9
SPEAKS = 1e-3  # share of all that moves: an island with less says nothing


def off_face(
    neutral: Float[np.ndarray, "v 3"],
    triangles: Int[np.ndarray, "f 3"],
    deltas: Float[np.ndarray, "k v 3"],
    a: Float[np.ndarray, " v"],
    rho: float,
) -> Bool[np.ndarray, " v"]:
    """Vertices that move with the face and belong to something poorer that stands apart from it; mostly none."""
    energy = a * np.einsum("kvx,kvx->kv", deltas, deltas)
    total = energy.sum(axis=1, keepdims=True)
    share = (energy / np.where(total > 0, total, 1)).mean(axis=0)
    used = np.isin(np.arange(len(a)), triangles)
    island = islands(neutral, triangles, used, GAP * rho)
    speaks = np.flatnonzero(np.bincount(island[used], share[used]) > SPEAKS)
    if len(speaks) < 2:
        return np.zeros(len(a), dtype=bool)
    parts = [used & (island == i) for i in speaks]
    varied = np.array([variety(deltas[:, part], a[part], total) for part in parts])
    rich = parts[int(np.argmax(varied))]
    middle, size = _spread(neutral[rich], share[rich])
    off = np.array([np.linalg.norm(_spread(neutral[part], share[part])[0] - middle) for part in parts])
    return used & np.isin(island, speaks[(varied < LESS * varied.max()) & (off > OFF * size)])


def _spread(points: Float[np.ndarray, "n 3"], w: Float[np.ndarray, " n"]) -> tuple[Float[np.ndarray, " 3"], float]:
    """Middle and root mean square distance from it, with weights."""
    middle = w @ points / w.sum()
    return middle, float(np.sqrt(w @ ((points - middle) ** 2).sum(axis=1) / w.sum()))


def islands(
    neutral: Float[np.ndarray, "v 3"], triangles: Int[np.ndarray, "f 3"], some: Bool[np.ndarray, " v"], within: float
) -> Int[np.ndarray, " v"]:
    """Number of the island of every vertex, of those in `some`: pieces, and cells of space that lie within a distance
    of each other."""
    cell, of = np.unique(np.floor(2 * neutral[some] / within), axis=0, return_inverse=True)
    c = len(cell)
    near = KDTree(cell).query_pairs(2.0, output_type="ndarray")
    piece = pieces(triangles, len(neutral))[some]
    i, j = np.r_[near[:, 0], of.ravel()], np.r_[near[:, 1], c + piece]
    size = c + int(piece.max(initial=0)) + 1
    _, label = connected_components(
        coo_array((np.ones(len(i), dtype=bool), (i, j)), shape=(size, size)), directed=False
    )
    found = np.zeros(len(neutral), dtype=np.int64)
    found[some] = label[of.ravel()]
    return found


def variety(d: Float[np.ndarray, "k n 3"], a: Float[np.ndarray, " n"], total: Float[np.ndarray, "k 1"]) -> float:
    """How many unlike movements a part shows, of blendshapes whose energy in all is `total`."""
    flat = (d * np.sqrt(a)[None, :, None]).reshape(len(d), -1) / np.sqrt(np.where(total > 0, total, 1))
    G = flat @ flat.T
    squared = float((G**2).sum())
    return float(np.trace(G)) ** 2 / squared if squared > 0 else 0.0
