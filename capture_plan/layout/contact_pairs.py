"""Which vertices must not carry a dot both, because the dots would meet when the face moves.

Data   p[v]  where vertex v stands in the neutral, d[v] how a pose moves it; r the spacing, D + G the least distance of
       two dots (`meeting`), millimetres, or r where that is less
Met    u and v with |p[u] - p[v]| >= r and |p[u] + d[u] - p[v] - d[v]| < D + G in some pose
Torn   such a pair comes nearer by r - (D + G), so that d[u] and d[v] differ as much: skin moves smoothly but at lips
       and lids, and only where neighbours of the pose differ so are pairs looked up
"""

from collections.abc import Iterable, Iterator

import numpy as np
from jaxtyping import Float, Int
from scipy.ndimage import maximum_filter, minimum_filter
from scipy.sparse import coo_array, csr_array
from scipy.spatial import KDTree

from capture_plan.layout.dot_contact import GAP_MM, Poses
from capture_plan.rig import Rig


def met_in(
    points: Float[np.ndarray, "v 3"],
    at: Int[np.ndarray, " n"],
    poses: Iterable[Float[np.ndarray, "n 3"]],
    *,
    dot_mm: float,
    spacing_mm: float,
) -> csr_array:
    """Pairs of the vertices `at` that keep the spacing and whose dots meet in a pose, given by how it moves them; (v v)
    of 0 and 1."""
    least, neutral, pairs = min(dot_mm + GAP_MM, spacing_mm), points[at], [np.empty((0, 2), dtype=int)]
    for moved in poses:
        some = torn(neutral + moved, moved, within=least, by=spacing_mm - least)
        near = KDTree(neutral[some] + moved[some]).query_pairs(least, output_type="ndarray") if len(some) else some
        u, v = some[near].reshape(-1, 2).T
        retained = np.linalg.norm(neutral[u] - neutral[v], axis=1) >= spacing_mm
        pairs.append(at[np.stack([u[retained], v[retained]], axis=1)])
    u, v = np.concatenate(pairs).T
    return paired(u, v, len(points))


def torn(
    posed: Float[np.ndarray, "n 3"], moved: Float[np.ndarray, "n 3"], *, within: float, by: float
) -> Int[np.ndarray, " m"]:
    """Points that may have one `within` a distance of them whose movement differs from theirs at least `by` so much.

    Space is cut into cubes of that distance: movements in a cube and the 26 around it span a box, whose diagonal bounds
    every difference.
    """
    if by <= 0:  # dots as wide as the spacing
        return np.arange(len(moved))
    far = np.linalg.norm(moved, axis=1) >= by / 2  # one of the two
    if not far.any():
        return np.flatnonzero(far)
    near = ((posed > posed[far].min(axis=0) - within) & (posed < posed[far].max(axis=0) + within)).all(axis=1)
    at = np.flatnonzero(near)
    cube = np.floor((posed[at] - posed[at].min(axis=0)) / within).astype(int)
    x, y, z = cube.T
    low = np.full((*(cube.max(axis=0) + 1), 3), np.inf)
    high = -low
    np.minimum.at(low, (x, y, z), moved[at])
    np.maximum.at(high, (x, y, z), moved[at])
    around = (3, 3, 3, 1)
    low, high = minimum_filter(low, around, mode="nearest"), maximum_filter(high, around, mode="nearest")
    return at[np.linalg.norm(high[x, y, z] - low[x, y, z], axis=1) >= by]


def pose_movements(rig: Rig, poses: Poses, at: Int[np.ndarray, " n"]) -> Iterator[Float[np.ndarray, "n 3"]]:
    """How every pose moves the vertices."""
    for pose in poses.values():
        weights = np.array([pose.get(name, 0.0) for name in rig.names])
        moving = np.flatnonzero(weights)
        yield np.tensordot(weights[moving], rig.deltas[moving][:, at], 1)


def without_pairs_of(met: csr_array, some: Int[np.ndarray, " n"]) -> csr_array:
    """`met` without pairs of which both are among `some`."""
    u, v = met.nonzero()
    retained = ~(np.isin(u, some) & np.isin(v, some))
    return paired(u[retained], v[retained], len(met.indptr) - 1)


def paired(u: Int[np.ndarray, " n"], v: Int[np.ndarray, " n"], count: int) -> csr_array:
    """The symmetric table that holds these pairs."""
    table = coo_array((np.ones(2 * len(u)), (np.concatenate([u, v]), np.concatenate([v, u]))), shape=(count, count))
    return csr_array(table.astype(bool).astype(np.float32))
