"""One packing problem as the solvers see it: items without names, and what limits the expressions they share.

Data   sets[g, n]   items that exclude each other, a column for each set of them: shared vertices and rules alike
       things[g]    separate movements that item g asks of the actor      most    of an expression, at most
       place[g]     the expression that item g is locked to, from 0; FREE where it may be anywhere
       costs        (i, j, c): items i and j in one expression cost c
Bound  no fewer expressions than a clique has items, nor than sum things / most
"""

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from jaxtyping import Bool, Int

from capture_plan.expressions.conflicts import maximal_sets

FREE = -1
Costs = tuple[tuple[int, int, int], ...]


class PlaceError(Exception):
    """An item is locked to a number that the list does not reach."""

    def __init__(self, item: int, number: int, length: int) -> None:
        super().__init__(f"item {item} is locked to expression {number + 1} of {length}")
        self.item, self.number, self.length = item, number, length


@dataclass(frozen=True, eq=False)
class Instance:
    """Items that share expressions, and which of them exclude each other."""

    sets: Bool[np.ndarray, "g n"]
    things: Int[np.ndarray, " g"]
    most: int
    place: Int[np.ndarray, " g"]
    costs: Costs = ()

    @classmethod
    def free(cls, sets: Bool[np.ndarray, "g n"]) -> "Instance":
        """Items that only their sets keep apart."""
        g = len(sets)
        return cls(sets, np.ones(g, dtype=int), max(g, 1), np.full(g, FREE))

    def __len__(self) -> int:
        return len(self.sets)

    def restricted_to(self, items: Int[np.ndarray, " i"]) -> "Instance":
        """The problem of some of the items, numbered anew; costs are left to who asks for the whole."""
        return Instance(self.sets[items], self.things[items], self.most, self.place[items])

    def apart(self, pairs: Iterable[tuple[int, int]]) -> "Instance":
        """The problem with further pairs of items that exclude each other."""
        return Instance(
            maximal_sets(np.hstack([self.sets, pair_sets(len(self), pairs)])), self.things, self.most, self.place
        )

    @property
    def crowded(self) -> bool:
        """Whether an expression could ever ask for too much."""
        return int(self.things.sum()) > self.most

    @property
    def least(self) -> int:
        """No fewer expressions than this, by counting movements."""
        return -(-int(self.things.sum()) // self.most)

    def cost(self, items: Iterable[int]) -> int:
        """What an expression of these items costs."""
        chosen = set(items)
        return sum(c for i, j, c in self.costs if i in chosen and j in chosen)

    def candidates(self, left: Bool[np.ndarray, " g"], e: int) -> tuple[Bool[np.ndarray, " g"], Int[np.ndarray, " i"]]:
        """Who of `left` may be performed in expression e, and who must."""
        return left & ((self.place == FREE) | (self.place == e)), np.flatnonzero(left & (self.place == e))


def pair_sets(g: int, pairs: Iterable[tuple[int, int]]) -> Bool[np.ndarray, "g n"]:
    """A set of its own for every two items that exclude each other."""
    columns = [np.isin(np.arange(g), pair) for pair in pairs]
    return np.array(columns, dtype=bool).reshape(-1, g).T


def locked_apart(place: Int[np.ndarray, " g"]) -> list[tuple[int, int]]:
    """Items locked to different expressions."""
    locked = np.flatnonzero(place != FREE)
    return [(i, j) for i, j in combinations(locked.tolist(), 2) if place[i] != place[j]]


def check_assignment(instance: Instance, length: int) -> None:
    """PlaceError where an item is locked beyond the end of the list."""
    if len(instance) and (last := int(instance.place.max())) >= length:
        raise PlaceError(int(instance.place.argmax()), last, length)
