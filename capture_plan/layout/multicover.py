"""Adaptive multi-cover: more landmarks where one would have to tell too many blendshapes apart.

Zell & McDonnell 2022, Algorithm 1: cover, take away the chosen sites and their neighbourhood, cover again what needs
more. A blendshape is owned by the chosen site that it moves most; where a landmark owns more than a tenth of all
blendshapes, they stay for the next round (section 3.3.2). Unlike the paper's, every single cover keeps the spacing too.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.sparse import csr_array

from capture_plan.layout.cover import Cover, solve_cover
from capture_plan.layout.quality import importance_weights, mean_quality, total_quality
from capture_plan.layout.settings import LayoutSettings
from capture_plan.layout.sites import Sites
from capture_plan.mesh import geodesic_distance

OWNED_SHARE = 0.1  # section 3.3.2: one landmark should not be assigned to more than 10 % of the blendshapes
MAX_CUTS = 60  # rounds of spacing constraints; real faces need fewer than ten


@dataclass(frozen=True, eq=False)
class Spacing:
    """Least distance along the skin between landmarks; `graph` is `surface_graph` of the neutral."""

    graph: csr_array
    sites: Sites
    spacing_mm: float

    def distance(self, vertices: Int[np.ndarray, " m"]) -> Float[np.ndarray, "m s"]:
        """From each vertex to the nearer member of every site, infinite beyond the spacing, millimetres."""
        along = geodesic_distance(self.graph, vertices, limit=self.spacing_mm)
        return np.minimum(along[:, self.sites.vertices[:, 0]], along[:, self.sites.vertices[:, 1]])

    def close(self, chosen: Int[np.ndarray, " n"]) -> Bool[np.ndarray, "n s"]:
        """close[i, s]: site s stands, with one member at least, nearer to chosen site i than the spacing, or is i."""
        near = self.distance(self.sites.vertices[chosen].ravel()) < self.spacing_mm
        close = near[0::2] | near[1::2]
        close[np.arange(len(chosen)), chosen] = True
        return close

    def cliques(self, chosen: Int[np.ndarray, " n"]) -> list[Int[np.ndarray, " q"]]:
        """For every chosen pair that is too close, sites any two of which are: around a vertex between the two."""
        close = self.close(chosen)
        found = []
        for i, j in zip(*np.nonzero(np.triu(close[:, chosen], k=1)), strict=True):
            ends = self.sites.vertices[chosen[[i, j]]]
            along = geodesic_distance(self.graph, ends.ravel(), limit=self.spacing_mm).reshape(2, 2, -1).min(axis=1)
            middle = np.argmin(along.max(axis=0))
            around = self.distance(np.array([middle]))[0] < self.spacing_mm / 2
            found.append(np.union1d(np.flatnonzero(around & close[i] & close[j]), chosen[[i, j]]))
        return found


def best_cover(
    sites: Sites,
    settings: LayoutSettings,
    rows: Int[np.ndarray, " r"],
    open_: Int[np.ndarray, " o"],
    spacing: Spacing | None,
) -> Cover:
    """The cover of blendshapes `rows` by sites `open_` that `settings.weights` calls best, at the spacing if given."""
    reach, size = sites.reach[np.ix_(rows, open_)], sites.size[open_]
    covers = reach >= settings.epsilon
    w = importance_weights(reach, sites.visibility[open_], settings.alpha)
    position = np.full(len(sites.visibility), -1)
    position[open_] = np.arange(len(open_))
    cliques: list[np.ndarray] = []
    for _ in range(MAX_CUTS):
        if settings.weights == "paper":
            cover = solve_cover(covers, total_quality(covers, w), size, cliques=cliques)
        else:
            cover = solve_cover(covers, size.astype(float), size, cliques=cliques)
        if settings.weights == "lexicographic":
            limit = round(cover.objective)
            cover = solve_cover(covers, size * mean_quality(covers, w), size, cliques=cliques, limit=limit)
        cuts = spacing.cliques(open_[cover.chosen]) if spacing else []
        if not cuts:
            return replace(cover, rows=rows, chosen=open_[cover.chosen])
        cliques += [position[cut][position[cut] >= 0] for cut in cuts]
    raise AssertionError("spacing constraints did not settle")


def adaptive_cover(sites: Sites, settings: LayoutSettings, spacing: Spacing | None) -> list[Cover]:
    """The covers of Algorithm 1, one for each round that found something to do."""
    covers = sites.covers(settings.epsilon)
    active, open_ = np.arange(len(covers)), np.arange(len(sites.visibility))
    rounds: list[Cover] = []
    for _ in range(settings.rounds):
        rows = active[covers[np.ix_(active, open_)].any(axis=1)]
        if not len(rows):
            break
        rounds.append(best_cover(sites, settings, rows, open_, spacing))
        chosen = np.concatenate([cover.chosen for cover in rounds])
        taken = spacing.close(chosen).any(axis=0) if spacing else np.isin(np.arange(len(sites.visibility)), chosen)
        open_ = np.flatnonzero(~taken)
        active = crowded(sites, chosen, settings.epsilon)
    return rounds


def crowded(sites: Sites, chosen: Int[np.ndarray, " n"], epsilon: float) -> Int[np.ndarray, " r"]:
    """Blendshapes whose owner among the chosen sites owns more than its share of all blendshapes."""
    reach = np.where(sites.covers(epsilon)[:, chosen], sites.reach[:, chosen], -1)
    owner = np.where(reach.max(axis=1) >= 0, reach.argmax(axis=1), -1)
    owned = np.bincount(owner[owner >= 0], minlength=len(chosen))
    allowed = max(1, int(OWNED_SHARE * len(reach))) * sites.size[chosen]
    return np.flatnonzero((owner >= 0) & (owned > allowed)[owner])
