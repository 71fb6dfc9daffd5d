"""Whether an order of expressions that is called proved is refuted by an exchange, without a solver.

Data       w_e[i]     importance of item i once the expressions before e are done     rivals    whom an item excludes
Proved     `sequential`: expression e is the heaviest of all that is left; `minimum`: of those that keep the list
           shortest. `greedy` proves nothing, nor does a list that was edited
Chain      items of e and of a later expression that conflict with each other, and with each other's, change places:
           no expression is added, so that either method would have done so where e becomes heavier
Star       one item of a later expression for all its rivals in e (`sequential`)
An exchange counts where it asks for no more that is hard, and for no more movements than one expression may.
"""

from collections.abc import Iterator, Sequence

import numpy as np

from capture_plan.expressions.conflicts import conflict_graph
from capture_plan.expressions.early import Items, chains
from capture_plan.expressions.instance import FREE, Instance
from capture_plan.expressions.listing import Weigh

HEAVIER = 1e-4  # solvers compare importance, of each item, to a millionth
PROVING = ("sequential", "minimum")


def order_refuted(instance: Instance, weigh: Weigh, method: str, parts: Sequence[Items]) -> bool:
    """Whether an exchange makes an expression heavier than the method would have left it; nobody asks where items are
    locked to a place."""
    if (instance.place != FREE).any():
        return False
    rivals = tuple(frozenset(np.flatnonzero(row).tolist()) for row in conflict_graph(instance.sets))
    packed = np.zeros(len(instance), dtype=bool)
    for e, one in enumerate(parts):
        w = weigh(packed)
        for later in parts[e + 1 :]:
            for new, other in _exchanges(rivals, one, later, stars=method == "sequential"):
                heavier = w[list(new)].sum() > w[list(one)].sum() + HEAVIER
                if heavier and _allowed(instance, (one, later), (new, other)):
                    return True
        packed[list(one)] = True
    return False


def _exchanges(rivals: Sequence[Items], one: Items, later: Items, *, stars: bool) -> Iterator[tuple[Items, Items]]:
    """What two expressions become; by a star only the first is one."""
    for chain in chains(rivals, one, later):
        yield (one - chain) | (later & chain), (later - chain) | (one & chain)
    for i in later if stars else ():
        yield (one - rivals[i]) | {i}, frozenset()


def _allowed(instance: Instance, before: tuple[Items, Items], after: tuple[Items, Items]) -> bool:
    """Whether nothing becomes harder, in the first expression and in both."""
    cost = [(instance.cost(a), instance.cost(b)) for a, b in zip(before, after, strict=True)]
    things = max(int(instance.things[list(items)].sum()) for items in after)
    return things <= instance.most and cost[0][1] <= cost[0][0] and sum(b for _, b in cost) <= sum(a for a, _ in cost)
