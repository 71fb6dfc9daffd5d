"""Where a marker may stand beside others, and where one of its own, or a mirrored pair, does best.

Data      candidates; spacing: near_table of the skin, whose every stored pair is too close; mirror image of each vertex
Site      a single vertex; under mirroring a pair (v, mirror of v), or a vertex of the middle, its own image
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.sparse import csr_array

Best = tuple[float, tuple[int, ...]]  # the error that a site would leave, and its vertices; infinite without a site


@dataclass(frozen=True, eq=False)
class MarkerSites:
    """Candidates, `spacing` between markers and the `mirror` image of each vertex, where there are such constraints."""

    candidates: Bool[np.ndarray, " v"]
    spacing: csr_array | None = None
    mirror: Int[np.ndarray, " v"] | None = None

    @cached_property
    def near(self) -> csr_array | None:
        """1 for each pair that is too close, whatever its distance: also for one of length 0."""
        table = self.spacing
        return table if table is None else csr_array((np.ones(table.nnz), table.indices, table.indptr), table.shape)

    def clear_of(self, markers: Sequence[int]) -> Bool[np.ndarray, " v"]:
        """Candidates that are not too close to any of these markers."""
        if self.near is None or not len(markers):
            return self.candidates
        return self.candidates & ~(self.near[list(markers)].sum(axis=0) > 0)

    def too_close(self, a: Int[np.ndarray, " p"], b: Int[np.ndarray, " q"]) -> Bool[np.ndarray, "p q"]:
        """Which two of them cannot both carry a marker."""
        return np.zeros((len(a), len(b)), dtype=bool) if self.near is None else self.near[a][:, b].toarray() > 0

    @cached_property
    def apart(self) -> Bool[np.ndarray, " v"]:
        """Vertices that are not too close to their mirror image."""
        if self.near is None or self.mirror is None:
            return np.ones(len(self.candidates), dtype=bool)
        return np.asarray(self.near[np.arange(len(self.mirror)), self.mirror]).ravel() == 0

    def best_middle(self, scores: Float[np.ndarray, " v"], free: Bool[np.ndarray, " v"]) -> Best:
        """Of the free vertices that are their own mirror image."""
        assert self.mirror is not None, "a layout that is not mirrored has no middle"
        return least(scores, free & (self.mirror == np.arange(len(self.mirror))))

    def best_pair(self, scores: Float[np.ndarray, " v"], free: Bool[np.ndarray, " v"]) -> Best:
        """Of the pairs of which both vertices are free."""
        assert self.mirror is not None, "a layout that is not mirrored has no pairs"
        score, one = least(scores, free & free[self.mirror] & self.apart)
        return score, (*one, *(int(self.mirror[v]) for v in one))


def least(scores: Float[np.ndarray, " v"], may: Bool[np.ndarray, " v"]) -> Best:
    """The vertex with the least finite score among some."""
    subset = np.where(may, scores, np.inf)
    v = int(subset.argmin())
    return (float(subset[v]), (v,)) if np.isfinite(subset[v]) else (np.inf, ())
