"""The swarm that was tried to spread landmarks, two for every blendshape, that stand side by side.

Zell & McDonnell 2022, section 3.3.2: landmarks of a double cover without spacing move over the skin so that they stand
apart; rejected in the paper, "a bit random"; here as the baseline that it is. The method `distance` has the spacing
inside the program instead.

Swarm      x[p, m]      place of landmark m in particle p, on the nearest vertex that may carry a landmark
           E(x)         - sum_m min_n |x_m - x_n|  +  penalty x (landmarks that blendshapes lack)
           v, x         v = inertia v + pull (a (own best - x) + b (best of all - x)), a and b uniform; x = x + v

The best particle is kept, so that a swarm never ends worse than it starts; the same seed gives the same answer.
"""

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.spatial import KDTree

from capture_plan.layout.face import Face
from capture_plan.layout.settings import LayoutSettings

DEMAND = 2
PARTICLES, ROUNDS = 24, 80
INERTIA, PULL = 0.7, 1.4  # our own choice: the swarm settles within the rounds
START_MM = 6.0  # spread of the first particles around the layout
PENALTY_MM = 1000.0  # more than any distance between landmarks can gain


def swarm(
    face: Face, settings: LayoutSettings, start: Int[np.ndarray, " m"], *, demand: int = DEMAND, seed: int = 0
) -> Int[np.ndarray, " m"]:
    """`start` spread over the skin, each blendshape still on as many landmarks of it, up to `demand`."""
    rng = np.random.default_rng(seed)
    allowed = np.flatnonzero(face.allowed(settings))
    points, covers = face.rig.neutral[allowed], face.relative_displacement(settings)[:, allowed] >= settings.epsilon
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
