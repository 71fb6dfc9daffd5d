"""Exact reductions of a set-cover program: what is left has the same optimum and is often a hundredth as large.

Row k is implied by row i when every site that covers i covers k too. Site i is dominated by site j when j covers at
least the same blendshapes and costs no more; only sites that stand in no spacing constraint may dominate, because any
other might be unable to take i's place.
"""

import numpy as np
from jaxtyping import Bool, Float, Int

BLOCK = 1024  # columns compared at a time: a block's overlap table stays in the cache


def essential_rows(covers: Bool[np.ndarray, "k s"]) -> Int[np.ndarray, " r"]:
    """Rows that no other row implies; of equal rows the first."""
    rows = covers.astype(np.float32)
    size = rows.sum(axis=1)
    within = rows @ rows.T == size[:, None]  # within[i, k]: the sites of row i all cover row k
    k = np.arange(len(size))
    stronger = (size[:, None] < size[None, :]) | ((size[:, None] == size[None, :]) & (k[:, None] < k[None, :]))
    return np.flatnonzero(~(within & stronger).any(axis=0))


def undominated(
    covers: Bool[np.ndarray, "k s"], costs: Float[np.ndarray, "d s"], free: Bool[np.ndarray, " s"]
) -> Int[np.ndarray, " r"]:
    """Sites worth keeping when every one of the d costs counts; of equals the lowest index."""
    size = covers.sum(axis=0)
    order = np.lexsort((np.arange(len(size)), *costs[::-1], ~free, -size))
    order = order[_first_of_equal_sets(covers, costs, free, order)]
    columns = covers[:, order].T.astype(np.float32)
    cost, size, free = costs[:, order], size[order], free[order]
    retained = np.empty(0, dtype=int)
    for start in range(0, len(order), BLOCK):
        block = np.arange(start, min(start + BLOCK, len(order)))
        rivals = np.concatenate([retained, block])[np.r_[free[retained], free[block]]]
        inside = columns[block] @ columns[rivals].T == size[block, None]
        cheaper = (cost[:, rivals][:, None, :] <= cost[:, block][:, :, None]).all(axis=0)
        before = (
            rivals[None, :] < block[:, None]
        )  # the order puts the larger, then the cheaper, then the lower index first
        retained = np.concatenate([retained, block[~(inside & cheaper & before).any(axis=1)]])
    return np.sort(order[retained])


def _first_of_equal_sets(
    covers: Bool[np.ndarray, "k s"],
    costs: Float[np.ndarray, "d s"],
    free: Bool[np.ndarray, " s"],
    order: Int[np.ndarray, " s"],
) -> Bool[np.ndarray, " s"]:
    """Along `order`: False where an earlier free site has the same set and, but for the first, the same costs."""
    sets = np.packbits(covers[:, order], axis=0).T
    keys = np.ascontiguousarray(np.concatenate([sets, costs[1:, order].T.copy().view(np.uint8)], axis=1))
    _, first, group = np.unique(keys.view(f"V{keys.shape[1]}").ravel(), return_index=True, return_inverse=True)
    rival = order[first[group]]
    return (rival == order) | ~free[rival] | (costs[0, order] < costs[0, rival])
