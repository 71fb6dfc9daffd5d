"""Two landmarks for every blendshape in one program, and the swarm that was tried to spread them.

Zell & McDonnell 2022, section 3.3.2, and what became of it:

Distance Off   sum_s c[k, s] f[s] >= 2 for every k: the two stand side by side
Swarm          landmarks of Distance Off move over the skin so that they stand apart; rejected in the paper, "a bit
               random"; here as the baseline that it is
Distance On    Distance Off with the spacing inside the program, exact

Swarm      x[p, m]      place of landmark m in particle p, on the nearest vertex that may carry a landmark
           E(x)         - sum_m min_n |x_m - x_n|  +  penalty x (landmarks that blendshapes lack)
           v, x         v = inertia v + pull (a (own best - x) + b (best of all - x)), a and b uniform; x = x + v

The best particle is kept, so that a swarm never ends worse than it starts; the same seed gives the same answer.
"""

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.spatial import KDTree

from capture_plan.layout.cover import solve_cover
from capture_plan.layout.face import Face
from capture_plan.layout.multicover import MAX_CUTS, Spacing
from capture_plan.layout.quality import importance_weights, mean_quality
from capture_plan.layout.settings import LayoutSettings
from capture_plan.layout.sites import Sites

DEMAND = 2
PARTICLES, ROUNDS = 24, 80
INERTIA, PULL = 0.7, 1.4  # our own choice: the swarm settles within the rounds
START_MM = 6.0  # spread of the first particles around the layout
PENALTY_MM = 1000.0  # more than any distance between landmarks can gain


def trivial_multicover(sites: Sites, settings: LayoutSettings, demand: int = DEMAND) -> Int[np.ndarray, " m"]:
    """Distance Off: the fewest landmarks, and among those the best, with `demand` candidates for each blendshape."""
    return sites.members(_multicover(sites, settings, demand, []))


def spaced_multicover(
    sites: Sites, settings: LayoutSettings, spacing: Spacing, demand: int = DEMAND
) -> Int[np.ndarray, " m"]:
    """The same at the spacing along the skin.

    Raises:
        InfeasibleError: no landmarks do that.
    """
    cliques: list[np.ndarray] = []
    for _ in range(MAX_CUTS):
        chosen = _multicover(sites, settings, demand, cliques)
        cuts = spacing.cliques(chosen)
        if not cuts:
            return sites.members(chosen)
        cliques += cuts
    raise AssertionError("spacing constraints did not settle")


def _multicover(
    sites: Sites, settings: LayoutSettings, demand: int, cliques: list[np.ndarray]
) -> Int[np.ndarray, " n"]:
    covers = sites.covers(settings.epsilon)
    rows = covers.any(axis=1)
    w = importance_weights(sites.reach[rows], sites.visibility, settings.alpha)
    cost = sites.size * mean_quality(covers[rows], w)
    tied = np.unique(np.concatenate([*cliques, np.empty(0, dtype=int)]))
    free = np.setdiff1d(np.arange(len(cost)), tied)
    kept = np.union1d(tied, free[enough_of_each(covers[:, free], cost[free], sites.size[free], demand)])
    covers, cost, size = covers[np.ix_(rows, kept)], cost[kept], sites.size[kept]
    inside = [np.searchsorted(kept, clique) for clique in cliques]
    fewest = solve_cover(covers, size.astype(float), size, cliques=inside, demand=demand)
    limit = round(fewest.objective)
    return kept[solve_cover(covers, cost, size, cliques=inside, limit=limit, demand=demand).chosen]


def enough_of_each(
    covers: Bool[np.ndarray, "k s"], cost: Float[np.ndarray, " s"], size: Int[np.ndarray, " s"], count: int
) -> Int[np.ndarray, " n"]:
    """The `count` cheapest sites of every candidate set and size: a program never needs more of one kind."""
    kinds = np.concatenate([np.packbits(covers, axis=0), size[None].astype(np.uint8)])
    _, kind = np.unique(kinds, axis=1, return_inverse=True)
    order = np.lexsort((cost, kind.ravel()))
    first = np.searchsorted(kind.ravel()[order], kind.ravel()[order])
    return np.sort(order[np.arange(len(order)) - first < count])


def swarm(
    face: Face, settings: LayoutSettings, start: Int[np.ndarray, " m"], *, demand: int = DEMAND, seed: int = 0
) -> Int[np.ndarray, " m"]:
    """`start` spread over the skin, each blendshape still on as many landmarks of it, up to `demand`."""
    rng = np.random.default_rng(seed)
    allowed = np.flatnonzero(face.allowed(settings))
    points, covers = face.rig.neutral[allowed], face.reach(settings)[:, allowed] >= settings.epsilon
    tree, needed = KDTree(points), np.minimum(covers[:, np.searchsorted(allowed, start)].sum(axis=1), demand)
    shape = (PARTICLES, len(start), 3)
    x = face.rig.neutral[start] + rng.normal(scale=START_MM, size=shape)
    x[0] = face.rig.neutral[start]
    v = np.zeros(shape)
    own, own_energy = x.copy(), np.full(PARTICLES, np.inf)
    best, best_energy = start, np.inf
    for _ in range(ROUNDS):
        at = np.asarray(tree.query(x)[1])
        energy = np.array([swarm_energy(points[one], covers[:, one], needed) for one in at])
        better = energy < own_energy
        own[better], own_energy[better] = points[at[better]], energy[better]
        if energy.min() < best_energy:
            best, best_energy = allowed[at[energy.argmin()]], energy.min()
        a, b = rng.uniform(size=shape), rng.uniform(size=shape)
        v = INERTIA * v + PULL * (a * (own - x) + b * (own[own_energy.argmin()] - x))
        x = points[at] + v
    return best


def swarm_energy(
    points: Float[np.ndarray, "m 3"], covers: Bool[np.ndarray, "k m"], needed: Int[np.ndarray, " k"]
) -> float:
    """E of one particle, millimetres."""
    apart = np.linalg.norm(points[:, None] - points[None], axis=2)
    np.fill_diagonal(apart, np.inf)
    lacking = np.clip(needed - covers.sum(axis=1), 0, None).sum()
    return float(PENALTY_MM * lacking - apart.min(axis=1).sum())
