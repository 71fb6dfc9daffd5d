"""Upper and lower halves of one movement of the lips or lids, found from geometry (Carrigan et al. 2020, section 4.4).

Data    |d[k, v]|^2 over the vertices of the upper and of the lower half of an opening, from the regions of the face
        m[k]     mean displacement of k over its active vertices at the opening
Upper   at least MOSTLY of the movement at the opening lies in its upper half, and the opening has its share of all
Like    cos(m[i], (1, -1, 1) * m[j]) > ALIKE for an upper i and a lower j: raised upper and lowered lower lip
An assignment of most likeness pairs them, each upper with one lower, on the same side of the face. Together with left
and right partners such pairs close loops of four.
"""

import numpy as np
from jaxtyping import Bool, Float
from scipy.optimize import linear_sum_assignment

from capture_plan.anatomy.blendshape_pairs import laterality
from capture_plan.anatomy.regions import FaceRegions, face_regions
from capture_plan.expressions.active_sets import skin_displacement
from capture_plan.rig import Rig

ALIKE = 0.985  # as in the authors' description: 10 degrees
MOSTLY = 0.75  # of the movement at an opening: a lid that closes drags the other one along
SHARE = 0.3  # of all movement: what moves an opening only by the way, as pushing the jaw forward, is no half of it
SIDED = 0.5  # three quarters on one side
OPENINGS = (("upper lip", "lower lip"), ("upper eyelid", "lower eyelid"))


def local_pairs(rig: Rig, used: tuple[str, ...], active: Bool[np.ndarray, "k v"]) -> tuple[tuple[str, str], ...]:
    """(upper, lower) pairs of `used` blendshapes, in their order."""
    regions = face_regions(rig)
    moved = skin_displacement(rig, used).astype(float) ** 2
    side = laterality(rig)[rig.rows(used)]
    sided = np.where(np.abs(side) >= SIDED, np.sign(side), 0)
    pairs = []
    for opening in OPENINGS:
        alike = _likeness(
            rig, used, active & np.isin(regions.of_vertex, [regions.names.index(half) for half in opening])
        )
        upper, lower = (np.flatnonzero(half) for half in _halves(regions, moved, opening))
        fits = (alike[np.ix_(upper, lower)] > ALIKE) & (sided[upper][:, None] == sided[lower])
        rows, columns = linear_sum_assignment(-np.where(fits, alike[np.ix_(upper, lower)], 0))
        pairs += [(upper[i], lower[j]) for i, j in zip(rows, columns, strict=True) if fits[i, j]]
    return tuple((used[i], used[j]) for i, j in sorted(pairs))


def _halves(
    regions: FaceRegions, moved: Float[np.ndarray, "k v"], opening: tuple[str, str]
) -> tuple[Bool[np.ndarray, " k"], Bool[np.ndarray, " k"]]:
    """Who moves mostly the upper half of an opening, and who mostly the lower one."""
    upper, lower = (moved[:, regions.of_vertex == regions.names.index(half)].sum(axis=1) for half in opening)
    both = upper + lower
    here = both > SHARE * moved.sum(axis=1)
    return here & (upper >= MOSTLY * both), here & (lower >= MOSTLY * both)


def _likeness(rig: Rig, used: tuple[str, ...], active: Bool[np.ndarray, "k v"]) -> Float[np.ndarray, "k k"]:
    """cos(m[i], (1, -1, 1) * m[j])."""
    deltas = rig.deltas[rig.rows(used)]
    mean = np.einsum("kv,kvx->kx", active / np.maximum(active.sum(axis=1, keepdims=True), 1), deltas)
    mean /= np.maximum(np.linalg.norm(mean, axis=1, keepdims=True), np.finfo(float).tiny)
    return mean @ (mean * [1, -1, 1]).T
