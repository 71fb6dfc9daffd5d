"""Constraints as linear constraints: what a person, a face and a camera demand of a layout, each with its name.

Data       n[s]        landmarks that site s places, 1 or 2
Constraint       least <= sum_s amount[s] f[s] <= most      over the chosen sites, f[s] = 1
Examples   a pin       amount 1 at the site that holds the vertex, least 1
           a keep-out  amount 1 at every site that touches the zone, most 0
           a cap       amount n[s] inside a region, most the cap
           a number    amount n[s] everywhere, least = most = M
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Int


@dataclass(frozen=True, eq=False)
class Limit:
    """One constraint; `name` is how a person would say it: 'at most 4 landmarks on the nose'. No `most`: no end."""

    name: str
    amount: Int[np.ndarray, " s"]
    least: int = 0
    most: int | None = None

    def shortfall(self, chosen: Int[np.ndarray, " n"]) -> int:
        """By how much the chosen sites miss the constraint, 0 where they keep it."""
        total = int(self.amount[chosen].sum())
        return max(0, self.least - total) + (max(0, total - self.most) if self.most is not None else 0)

    def restricted_to(self, sites: Int[np.ndarray, " n"]) -> "Limit":
        """The limit where only these sites can be chosen."""
        return Limit(self.name, self.amount[sites], self.least, self.most)

    def after(self, chosen: Int[np.ndarray, " n"]) -> "Limit":
        """What is left of the constraint once these sites are chosen and closed."""
        total = int(self.amount[chosen].sum())
        most = None if self.most is None else max(0, self.most - total)
        return Limit(self.name, self.amount, max(0, self.least - total), most)


def open_under(limits: Sequence[Limit], chosen: Int[np.ndarray, " n"], count: int) -> Bool[np.ndarray, " s"]:
    """Of `count` sites those that may be added to `chosen` without going over any upper end."""
    fits = np.ones(count, dtype=bool)
    for limit in limits:
        if limit.most is not None:
            fits &= (limit.amount == 0) | (limit.amount <= limit.most - int(limit.amount[chosen].sum()))
    return fits
