"""Minimum packing: the fewest expressions, proved; among the shortest lists the one whose prefixes weigh most.

Number   J is the least j for which the conflict graph has a colouring with j colours. A largest clique bounds it from
         below; each j from there on is coloured or proved impossible.
Order    Given J: the first expression is the heaviest after which the rest fits into J - 1 expressions, the second the
         heaviest of what is left after which the rest fits into J - 2, and so on. Each is found by cuts:
             S = the heaviest set of items that fit together and hit every cut
             if the rest without S can be coloured with the colours that are left, S is the expression;
             else its kernel, or a clique in it that is too large, is a set that S must hit: a new cut
         A cut never removes an S that works, so the first S that works is the heaviest.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Int

from capture_plan.expressions.colouring import colour, greedy, largest_clique
from capture_plan.expressions.conflicts import conflict_graph, core
from capture_plan.expressions.cpsat import UndecidedError
from capture_plan.expressions.sequential import Weigh, heaviest

CUTS = 200  # per expression; real rigs need fewer than 20


@dataclass(frozen=True)
class Minimum:
    """Items of every expression in order; `bound` on their number; whether the order was proved best."""

    expressions: list[Int[np.ndarray, " i"]]
    bound: int
    order_proven: bool


def minimum(sets: Bool[np.ndarray, "g n"], weigh: Weigh) -> Minimum:
    """The fewest expressions for items that meet in `sets`; `weigh(packed)` gives the importance of each item."""
    colours, bound = fewest_colours(sets)
    j = int(colours.max()) + 1
    left = np.ones(len(sets), dtype=bool)
    expressions, proven = [], True
    for e in range(j):
        try:
            expression, colours = _next_expression(sets, weigh, left, j - e - 1)
        except UndecidedError:
            expression, proven = _heaviest_colour(sets, weigh, left, colours), False
        left[expression] = False
        expressions.append(expression)
    return Minimum([e for e in expressions if len(e)], bound, proven)


def fewest_colours(sets: Bool[np.ndarray, "g n"]) -> tuple[Int[np.ndarray, " g"], int]:
    """A colouring with as few colours as could be found, and the proven bound on their number."""
    best = greedy(conflict_graph(sets))
    bound = len(largest_clique(sets))
    while bound <= best.max():
        try:
            colours = colour(sets, bound)
        except UndecidedError:
            break
        if colours is not None:
            return colours, bound
        bound += 1
    return best, bound


def _next_expression(
    sets: Bool[np.ndarray, "g n"], weigh: Weigh, left: Bool[np.ndarray, " g"], j: int
) -> tuple[Int[np.ndarray, " i"], Int[np.ndarray, " g"]]:
    """The heaviest expression after which what is left has a colouring with `j` colours, and that colouring."""
    weights = weigh(~left)
    depth = (sets & left[:, None]).sum(axis=0)
    cuts = [np.flatnonzero(column & left) for column in sets.T[depth > j]]
    for _ in range(CUTS):
        expression = heaviest(sets, weights, left, cuts)
        assert expression is not None  # the colour of a colouring with one more colour works
        rest = left.copy()
        rest[expression] = False
        colours = colour(sets[rest], j)
        if colours is not None:
            spread = np.full(len(sets), -1)
            spread[rest] = colours
            return expression, spread
        cuts.append(_obstruction(sets, rest, j))
    raise UndecidedError


def _obstruction(sets: Bool[np.ndarray, "g n"], rest: Bool[np.ndarray, " g"], j: int) -> Int[np.ndarray, " h"]:
    """Items of `rest` that cannot all be coloured with `j` colours: a clique where there is one, else the kernel."""
    items = np.flatnonzero(rest)
    clique = largest_clique(sets[items])
    if len(clique) > j:
        return items[clique]
    return items[core(conflict_graph(sets[items]), j)]


def _heaviest_colour(
    sets: Bool[np.ndarray, "g n"], weigh: Weigh, left: Bool[np.ndarray, " g"], colours: Int[np.ndarray, " g"]
) -> Int[np.ndarray, " i"]:
    """The heaviest colour of a known colouring, with whatever else of `left` fits beside it."""
    weights = weigh(~left)
    totals = np.bincount(colours[left], weights=weights[left])
    chosen = list(np.flatnonzero(left & (colours == np.argmax(totals))))
    graph = conflict_graph(sets)
    for i in np.flatnonzero(left)[np.argsort(-weights[left], kind="stable")]:
        if i not in chosen and not graph[i, chosen].any():
            chosen.append(i)
    return np.array(sorted(chosen))
