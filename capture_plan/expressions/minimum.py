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

import numpy as np
from jaxtyping import Bool, Float, Int

from capture_plan.expressions.colouring import colour, greedy, largest_clique
from capture_plan.expressions.conflicts import conflict_graph, core
from capture_plan.expressions.cpsat import UndecidedError
from capture_plan.expressions.sequential import Heaviest, Order, Weigh, heaviest
from capture_plan.progress import track

CUTS = 200  # per expression; real rigs need fewer than 20


def minimum(sets: Bool[np.ndarray, "g n"], weigh: Weigh) -> tuple[Order, int]:
    """The fewest expressions for items that meet in `sets`, and the proven bound on their number."""
    colours, bound = fewest_colours(sets)
    j = int(colours.max()) + 1
    left = np.ones(len(sets), dtype=bool)
    expressions, proven = [], True
    for e in track(range(j), "ordering expressions"):
        try:
            found, colours = _next_expression(sets, weigh(~left), left, j - e - 1)
        except UndecidedError:
            found = Heaviest(_heaviest_colour(sets, weigh(~left), left, colours), proven=False)
            colours[found.items] = -1
        left[found.items] = False
        expressions.append(found.items)
        proven &= found.proven
    return Order(tuple(expressions), proven), bound


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
    sets: Bool[np.ndarray, "g n"], weights: Float[np.ndarray, " g"], left: Bool[np.ndarray, " g"], j: int
) -> tuple[Heaviest, Int[np.ndarray, " g"]]:
    """The heaviest expression after which what is left has a colouring with `j` colours, and that colouring."""
    depth = (sets & left[:, None]).sum(axis=0)
    cuts = [np.flatnonzero(column & left) for column in sets.T[depth > j]]
    for _ in range(CUTS):
        found = heaviest(sets, weights, left, cuts)
        rest = left.copy()
        rest[found.items] = False
        colours = colour(sets[rest], j)
        if colours is not None:
            spread = np.full(len(sets), -1)
            spread[rest] = colours
            return found, spread
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
    sets: Bool[np.ndarray, "g n"],
    weights: Float[np.ndarray, " g"],
    left: Bool[np.ndarray, " g"],
    colours: Int[np.ndarray, " g"],
) -> Int[np.ndarray, " i"]:
    """The heaviest colour of a known colouring, with whatever else of `left` fits beside it."""
    graph = conflict_graph(sets)
    chosen = left & (colours == np.argmax(np.bincount(colours[left], weights=weights[left])))
    for i in np.argsort(-weights, kind="stable"):
        if left[i] and not graph[i, chosen].any():
            chosen[i] = True
    return np.flatnonzero(chosen)
