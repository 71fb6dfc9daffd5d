"""The error that a rig is expected to have once some expressions are scanned, before anybody sits for a scan.

Data    v[k, t]   expected squared error of blendshape k before any scan, in triangle t of the skin; sums over t are
                  what `importance.py` expects of the blendshape, mean over the skin, mm^2
        u[k, t]   how freely blendshape k may change there (`prior.py`);  beta: trust in the prior (`example.py`)
Scan    A scan of the blendshapes S shows the sum of what the person does otherwise. The rebuild shares it out by
        s[k, t] = u[k, t] / (sum_S u + beta), so that blendshape k ends with
        (1 - s)^2 v[k] + s^2 (V - v[k])    its own part that stayed behind, and what it took of the others; V = sum_S v
Left    L(S) = sum_t sum_S of this           what is hard to take apart counts, and more so where partners are alike
Gain    G(S) = sum_t V - L(S)                what the scan of S takes from the squared error, mm^2

Scans that share no blendshape are independent: their gains add up, and the best order of given scans is by gain.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np
from jaxtyping import Bool, Float
from scipy.sparse import coo_array, csr_array

from capture_plan.rig import Rig
from capture_plan.transfer.deformation import STILL_MM
from capture_plan.transfer.example import BETA
from capture_plan.transfer.importance import foreseen
from capture_plan.transfer.prior import Prior
from capture_plan.transfer.surface import Surface


@dataclass(frozen=True, eq=False)
class Expectation:
    """v (mm^2) and u (without unit) of blendshapes in the triangles of the skin."""

    v: Float[np.ndarray, "k t"]
    u: Float[np.ndarray, "k t"]

    def __len__(self) -> int:
        return len(self.v)

    def restricted_to(self, rows: Iterable[int]) -> "Expectation":
        """The expectation of some blendshapes, numbered anew."""
        chosen = list(rows)
        return Expectation(self.v[chosen], self.u[chosen])

    @property
    def start(self) -> float:
        """Squared error before the first scan, the sum over blendshapes, mm^2."""
        return float(self.importance.sum())

    def weighed(self, importance: Float[np.ndarray, " k"]) -> "Expectation":
        """The expectation at these places where blendshape k has the importance `importance[k]` in all."""
        return Expectation(self.v * (importance / np.where(self.importance > 0, self.importance, 1))[:, None], self.u)

    @cached_property
    def importance(self) -> Float[np.ndarray, " k"]:
        """Squared error of each blendshape before the first scan, mm^2."""
        return self.v.sum(axis=1)

    @cached_property
    def moved(self) -> Bool[np.ndarray, "k t"]:
        """Where any error of a blendshape is expected."""
        return self.v > 0

    def gain(self, scanned: Iterable[int]) -> float:
        """G(S) of one scan of these blendshapes, mm^2."""
        return float(self.gain_of_each(tuple(scanned)).sum())

    @cached_property
    def gain_of_each(self) -> Callable[[tuple[int, ...]], Float[np.ndarray, " s"]]:
        """What each of some blendshapes adds to G(S), mm^2: in proportion to its own v, and negative where less of it
        is told than the others take."""
        return cache(self._gain_of_each)

    def _gain_of_each(self, chosen: tuple[int, ...]) -> Float[np.ndarray, " s"]:
        at = np.ix_(np.array(chosen, dtype=int), np.flatnonzero(self.moved[list(chosen)].any(axis=0)))
        v, u = self.v[at], self.u[at]
        s = u / (u.sum(axis=0) + BETA)
        # V - L with L = sum_k (1 - s)^2 v + s^2 (V - v) = V + sum_k s^2 V - 2 s v
        return 2 * np.einsum("kt,kt->k", s, v) - v @ np.square(s).sum(axis=0)

    def taken(self, persons: Float[np.ndarray, "p k"], scanned: Iterable[int]) -> Float[np.ndarray, " p"]:
        """The share of each person's squared error that a scan takes, where blendshape k has `persons[p, k]` v[k]."""
        chosen = tuple(scanned)
        return persons[:, chosen] @ self.gain_of_each(chosen) / (persons @ self.importance)


def expectation(rig: Rig, target: Float[np.ndarray, "n 3"] | None = None) -> Expectation:
    """What is expected of every blendshape of the rig. `target` is the neutral of the face to be scanned, on its mesh.

    Raises:
        RigError: the target has another number of vertices.
    """
    deltas, squares = foreseen(rig, target)
    inside = rig.triangles[rig.skin[rig.triangles].all(axis=1)]
    neutral = rig.neutral if target is None else target
    surface = Surface(neutral, inside, np.ones(len(neutral), dtype=bool))
    still = np.linalg.norm(rig.deltas, axis=2) <= STILL_MM
    u = Prior(surface, deltas, still).freedom(hard=True)
    share = _spread(inside, rig.skin)
    return Expectation((share @ squares.T).T, u).weighed(squares.mean(axis=1))


def mean_expectation(known: Sequence[Expectation]) -> Expectation:
    """What is expected where the face to be scanned may be any of several."""
    return Expectation(np.mean([one.v for one in known], axis=0), np.mean([one.u for one in known], axis=0))


def _spread(triangles: np.ndarray, skin: np.ndarray) -> csr_array:
    """A value at each vertex of the skin, shared out evenly among its triangles."""
    number = np.cumsum(skin) - 1
    corner = number[triangles]
    degree = np.bincount(corner.ravel(), minlength=int(skin.sum()))
    row = np.repeat(np.arange(len(triangles)), 3)
    return csr_array(
        coo_array((1 / degree[corner.ravel()], (row, corner.ravel())), shape=(len(triangles), len(degree)))
    )
