"""Which blendshapes cannot share an expression, seen as a graph.

Data     b[g, v]   active sets of g items; an item is a blendshape or a left/right pair with the union of both sets
Sets     the items active at one vertex exclude each other: a clique of the conflict graph. Only different sets that
         lie in no other one are kept: they say the same as eq. 3b of Carrigan et al. 2020 in far fewer rows
Graph    i and j conflict where b[i] and b[j] share a vertex
Bound    no fewer expressions than items in a clique; the deepest vertex gives one that can be pointed at
"""

import numpy as np
from jaxtyping import Bool, Int

BLOCK = 1024  # sets compared at once: 1024 x 10,000 floats are 40 MB


def maximal_sets(active: Bool[np.ndarray, "g v"]) -> Bool[np.ndarray, "g n"]:
    """Different sets of items that meet at a vertex, without those inside another, the largest first."""
    packed = np.unique(np.packbits(active, axis=0).T, axis=0)
    sets = np.unpackbits(packed, axis=1, count=len(active)).astype(bool)
    size = sets.sum(axis=1)
    order = np.argsort(-size, kind="stable")
    sets, size = sets[order][size[order] > 0], size[order][size[order] > 0]
    real = sets.astype(np.float32)
    keep = np.ones(len(sets), dtype=bool)
    for start in range(0, len(sets), BLOCK):
        block = slice(start, start + BLOCK)
        shared = real[block] @ real.T
        keep[block] = ((shared == size[block, None]) & (size > size[block, None])).sum(axis=1) == 0
    return sets[keep].T


def conflict_graph(sets: Bool[np.ndarray, "g n"]) -> Bool[np.ndarray, "g g"]:
    """Symmetric, False on the diagonal; the active sets and their maximal sets give the same graph."""
    real = sets.astype(np.float32)
    graph = real @ real.T > 0
    np.fill_diagonal(graph, False)
    return graph


def edge_cover(sets: Bool[np.ndarray, "g n"]) -> Bool[np.ndarray, "g m"]:
    """Few of the sets that still name every conflict: each, from the largest on, that adds one."""
    seen = np.zeros((len(sets), len(sets)), dtype=bool)
    retained = []
    for column in np.argsort(-sets.sum(axis=0), kind="stable"):
        items = np.flatnonzero(sets[:, column])
        if len(items) > 1 and not seen[np.ix_(items, items)].all():
            seen[np.ix_(items, items)] = True
            np.fill_diagonal(seen, True)
            retained.append(column)
    return sets[:, retained]


def core(graph: Bool[np.ndarray, "g g"], degree: int) -> Bool[np.ndarray, " g"]:
    """What is left after removing, again and again, every item with fewer than `degree` conflicts."""
    left = np.ones(len(graph), dtype=bool)
    while (drop := left & (graph[:, left].sum(axis=1) < degree)).any():
        left &= ~drop
    return left


def deepest(sets: Bool[np.ndarray, "g n"]) -> Int[np.ndarray, " e"]:
    """The items active at the vertex where most are; one item where none is active."""
    if sets.shape[1] == 0:
        return np.arange(min(1, len(sets)))
    return np.flatnonzero(sets[:, np.argmax(sets.sum(axis=0))])
