"""The greedy baseline (Carrigan et al. 2020): the heaviest item that fits, then the next, expression by expression.

A person may refuse an item, which is then left for a later expression. No solver is needed, so that who checks a plan
makes the list again.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Int

from capture_plan.expressions.conflicts import conflict_graph
from capture_plan.expressions.instance import Instance, check_assignment
from capture_plan.expressions.listing import Weigh

Accept = Callable[[tuple[int, ...], int], bool]  # (items of the expression so far, the item proposed for it)


@dataclass(frozen=True)
class Order:
    """Items of every expression in order, and whether each was proved the heaviest that its rule allows."""

    expressions: tuple[Int[np.ndarray, " _"], ...]
    proven: bool


def one_after_another(instance: Instance, weigh: Weigh, accept: Accept) -> Order:
    """The list; the first item of an expression is not asked for, else the list might never end."""
    graph = conflict_graph(instance.sets)
    left = np.ones(len(instance), dtype=bool)
    expressions = []
    while left.any():
        candidates, must = instance.candidates(left, len(expressions))
        if not candidates.any():
            check_assignment(instance, len(expressions))
        chosen = must.tolist()
        for i in np.argsort(-weigh(~left), kind="stable").tolist():
            fits = not graph[i, chosen].any() and instance.things[[*chosen, i]].sum() <= instance.most
            if candidates[i] and i not in chosen and fits and (not chosen or accept(tuple(chosen), i)):
                chosen.append(i)
        left[chosen] = False
        expressions.append(np.array(sorted(chosen)))
    return Order(tuple(expressions), proven=False)
