"""Which sites stand too close to each other, measured straight, and so along the skin too, where no way is shorter.

Data       d(u, v)   straight distance of two vertices; r the spacing, millimetres
           m(u, v)   dots on u and v would meet when the face moves (`contact`)
           P[v, s]   vertex v belongs to site s (one or two vertices)
Close      T[s, t]   some vertex of s is nearer than r to one of t or meets it, or s = t
Cliques    around any vertex v: sites with a vertex nearer than r / 2 to v are close to each other in pairs (triangle
           inequality), so that at most one of them can be chosen. They hold nearly all close pairs in few rows
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.sparse import csr_array
from scipy.spatial import KDTree
from scipy.spatial.distance import pdist

from capture_plan.errors import InfeasibleError
from capture_plan.layout.sites import Sites
from capture_plan.mesh import geodesic_distance
from capture_plan.rig import Rig

MOST_PAIRS = 50_000_000  # of vertices nearer than the spacing: their tables take some 5 GB


def check_density(rig: Rig, at: Bool[np.ndarray, " v"], spacing_mm: float) -> None:
    """InfeasibleError where the close pairs of the vertices `at` do not fit into memory, before any work."""
    tree = KDTree(rig.neutral[at])
    pairs = int(tree.count_neighbors(tree, spacing_mm)) if spacing_mm > 0 else 0
    if pairs > MOST_PAIRS:
        raise InfeasibleError(
            f"{rig.name} has {int(at.sum()):,} places for landmarks, so that {pairs / 1e6:,.0f} million pairs are "
            f"nearer than the spacing of {spacing_mm:g} mm, {MOST_PAIRS / 1e6:.0f} million at most: give a smaller "
            "spacing (--spacing-mm), or a coarser mesh of the face (about 40,000 vertices)"
        )


@dataclass(frozen=True, eq=False)
class Spacing:
    """Least straight distance between landmarks; `near` is `straight_table` of the places at that distance, `met` holds
    pairs of vertices whose dots would meet when the face moves, (v v) of 0 and 1."""

    near: csr_array
    sites: Sites
    spacing_mm: float
    met: csr_array | None = None

    @cached_property
    def members(self) -> csr_array:
        """P: which vertices belong to which site, (v s)."""
        s = np.arange(len(self.sites.vertices))
        row, column = self.sites.vertices.T.ravel(), np.tile(s, 2)
        return csr_array(
            (np.ones(len(row), dtype=np.float32), (row, column)), shape=(len(self.near.indptr) - 1, len(s))
        )

    @cached_property
    def table(self) -> csr_array:
        """T: which sites are too close to each other, (s s)."""
        apart = self._within(self.spacing_mm)
        apart = apart if self.met is None else csr_array(apart + self.met)
        return csr_array((self.members.T @ apart @ self.members).astype(bool))

    @cached_property
    def balls(self) -> csr_array:
        """(q s): a clique around every vertex that has more than one site within half the spacing, each set once."""
        around = csr_array((self._within(self.spacing_mm / 2) @ self.members).astype(bool))
        around.sort_indices()
        several = np.flatnonzero(np.diff(around.indptr) > 1)
        sets = {around.indices[around.indptr[q] : around.indptr[q + 1]].tobytes(): q for q in several[::-1].tolist()}
        return csr_array(around[np.sort(np.array(list(sets.values()), dtype=int))])

    def close(self, chosen: Int[np.ndarray, " n"]) -> Bool[np.ndarray, "n s"]:
        """Rows of T: what each chosen site shuts out, itself among it."""
        close: np.ndarray = self.table[chosen].toarray()
        close[np.arange(len(chosen)), chosen] = True
        return close

    def restricted_to(self, sites: Int[np.ndarray, " n"]) -> "Spacing":
        """The spacing where only these sites can be chosen."""
        less = Sites(
            self.sites.vertices[sites], self.sites.relative_displacement[:, sites], self.sites.visibility[sites]
        )
        return Spacing(self.near, less, self.spacing_mm, self.met) if len(sites) < len(self.sites.vertices) else self

    def _within(self, radius_mm: float) -> csr_array:
        """(v v) of 0 and 1: nearer than a radius."""
        return csr_array(
            ((self.near.data < radius_mm).astype(np.float32), self.near.indices, self.near.indptr),
            shape=self.near.shape,
        )


def taken_by(chosen: Int[np.ndarray, " n"], spacing: Spacing | None, count: int) -> Bool[np.ndarray, " s"]:
    """Of `count` sites those that are chosen or too close to one that is."""
    taken = np.isin(np.arange(count), chosen)
    return taken | spacing.close(chosen).any(axis=0) if spacing and len(chosen) else taken


def nearest_straight(points: Float[np.ndarray, "v 3"], vertices: Int[np.ndarray, " n"]) -> float:
    """Least straight distance between two of these vertices, millimetres; infinite of fewer than two."""
    return float(pdist(points[vertices]).min(initial=np.inf))


def nearest_two(graph: csr_array, vertices: Int[np.ndarray, " n"]) -> float:
    """Least distance along the skin between two of these vertices, millimetres; infinite where no way joins any two."""
    apart = geodesic_distance(graph, vertices)[:, vertices]
    np.fill_diagonal(apart, np.inf)
    return float(apart.min(initial=np.inf))
