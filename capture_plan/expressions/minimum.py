"""Minimum packing: the fewest expressions, proved; among the shortest lists the easiest, whose prefixes weigh most.

Number   J is the least j for which the items have a colouring with j colours. A largest clique and the number of
         movements bound it from below; each j from there on is coloured or proved impossible.
Cost     Given J: the least sum of what is hard to perform at once. Mostly it is 0: then what is hard excludes itself.
Order    Given both: the first expression is the heaviest after which the rest fits into J - 1 expressions, the second
         the heaviest of what is left after which the rest fits into J - 2, and so on. Each is found by cuts:
             S = the heaviest set of items that fit together and hit every cut
             if the rest without S can be coloured with the colours that are left, S is the expression;
             else its kernel, or a clique in it that is too large, is a set that S must hit: a new cut
         A cut never removes an S that works, so the first S that works is the heaviest. Where cuts are many, or cost
         is not 0, one program holds S and the colouring of the rest (whole.py).
         All of an expression's programs share its part of the work that is left for the order. Where that is used up,
         the heaviest colour of the last colouring is taken, which is no proved heaviest.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from capture_plan.expressions.colouring import colour, greedy, largest_clique
from capture_plan.expressions.conflicts import conflict_graph, core
from capture_plan.expressions.greedy import Order
from capture_plan.expressions.instance import Instance, check_assignment
from capture_plan.expressions.list_program import heaviest_and_rest, least_cost
from capture_plan.expressions.listing import Weigh
from capture_plan.expressions.sequential import Heaviest, heaviest
from capture_plan.progress import track
from capture_plan.solver import UndecidedError, work_within

CUTS = 40  # per expression; real rigs need fewer than 20
ORDER_WORK = 120.0  # for all expressions together, CP-SAT's deterministic time; real rigs need less than 1


@dataclass(frozen=True, eq=False)
class Shortest:
    """As few expressions as could be found: `colours` of the items at cost `budget`, each number with its proof."""

    instance: Instance
    colours: Int[np.ndarray, " g"]
    budget: int
    easiest: bool
    bound: int


def minimum(instance: Instance, weigh: Weigh) -> tuple[Order, int]:
    """The fewest expressions for the items, and the proven bound on their number.

    Raises PlaceError where an item is locked beyond the last expression.
    """
    found = shortest(instance)
    return heaviest_first(found, weigh), found.bound


def shortest(instance: Instance) -> Shortest:
    """The fewest expressions at the least cost, in no order yet, for as many orders as are wanted.

    Raises PlaceError where an item is locked beyond the last expression.
    """
    colours, bound = fewest_colours(instance)
    j = int(colours.max()) + 1
    check_assignment(instance, j)
    return Shortest(*_easiest(instance, colours, j), bound)


def heaviest_first(found: Shortest, weigh: Weigh) -> Order:
    """As many expressions, each the heaviest that is possible after those before it."""
    instance, colours, budget, proven = found.instance, found.colours, found.budget, found.easiest
    j, left, expressions = int(colours.max()) + 1, np.ones(len(instance), dtype=bool), []
    work = ORDER_WORK
    for e in track(range(j), "Ordering expressions"):
        if not left.any():
            break  # without a proof of the number, filling up expressions may save one
        with work_within(work / (j - e)) as part:
            try:
                one, colours = _next_expression(instance, weigh(~left), left, e, j - e - 1, budget)
            except UndecidedError:
                one = Heaviest(_heaviest_colour(instance, weigh(~left), left, colours, e), proven=False)
                colours = np.where(np.isin(np.arange(len(colours)), one.items), -1, colours)
        work -= work / (j - e) - part.left
        left[one.items] = False
        budget -= instance.cost(one.items.tolist())
        expressions.append(one.items)
        proven &= one.proven
    return Order(tuple(expressions), proven)


def fewest_colours(instance: Instance) -> tuple[Int[np.ndarray, " g"], int]:
    """A colouring with as few colours as could be found, and the proven bound on their number."""
    best = greedy(conflict_graph(instance.sets), instance)
    bound = max(len(largest_clique(instance.sets)), instance.least)
    while bound <= best.max():
        try:
            colours = colour(instance, bound)
        except UndecidedError:
            break
        if colours is not None:
            return colours, bound
        bound += 1
    return best, bound


def _easiest(
    instance: Instance, colours: Int[np.ndarray, " g"], j: int
) -> tuple[Instance, Int[np.ndarray, " g"], int, bool]:
    """The problem of ordering at the least cost: a colouring with j colours, what it costs, whether it is the least."""
    if not instance.costs:
        return instance, colours, 0, True
    apart = instance.apart((a, b) for a, b, _ in instance.costs)
    try:
        free = colour(apart, j)
        if free is not None:
            return apart, free, 0, True
        colours, cost, proven = least_cost(instance, j)
    except UndecidedError:
        return instance, colours, sum(instance.cost(np.flatnonzero(colours == e)) for e in range(j)), False
    return instance, colours, cost, proven


def _next_expression(
    instance: Instance,
    weights: Float[np.ndarray, " g"],
    left: Bool[np.ndarray, " g"],
    e: int,
    j: int,
    budget: int,
) -> tuple[Heaviest, Int[np.ndarray, " g"]]:
    """The heaviest expression e after which what is left has a colouring with `j` colours, and that colouring."""
    if instance.costs:
        return heaviest_and_rest(instance, weights, left, e, j, budget)
    candidates, must = instance.candidates(left, e)
    depth = (instance.sets & left[:, None]).sum(axis=0)
    cuts = [must[[n]] for n in range(len(must))]
    cuts += [np.flatnonzero(column & left) for column in instance.sets.T[depth > j]]
    for _ in range(CUTS):
        found = heaviest(instance, weights, candidates, cuts)
        rest = left.copy()
        rest[found.items] = False
        colours = colour(instance.restricted_to(np.flatnonzero(rest)), j)
        if colours is not None:
            spread = np.full(len(instance), -1)
            spread[rest] = colours
            return found, spread
        cuts.append(_obstruction(instance, rest, j))
    return heaviest_and_rest(instance, weights, left, e, j, budget)


def _obstruction(instance: Instance, rest: Bool[np.ndarray, " g"], j: int) -> Int[np.ndarray, " h"]:
    """Items of `rest` that cannot all be coloured with `j` colours: a clique where there is one, else the kernel."""
    items = np.flatnonzero(rest)
    clique = largest_clique(instance.sets[items])
    if len(clique) > j:
        return items[clique]
    kernel = items[core(conflict_graph(instance.sets[items]), j)]
    if instance.crowded and (len(kernel) == 0 or colour(instance.restricted_to(kernel), j) is not None):
        return items
    return kernel


def _heaviest_colour(
    instance: Instance,
    weights: Float[np.ndarray, " g"],
    left: Bool[np.ndarray, " g"],
    colours: Int[np.ndarray, " g"],
    e: int,
) -> Int[np.ndarray, " i"]:
    """The colour of a known colouring that is locked here or else the heaviest, filled up with what fits beside it."""
    graph = conflict_graph(instance.sets)
    candidates, must = instance.candidates(left, e)
    open_colours = np.setdiff1d(colours[left], colours[left & ~candidates])
    load = np.array([weights[left & (colours == c)].sum() for c in open_colours])
    chosen = np.zeros(len(instance), dtype=bool)
    if len(must) or len(open_colours):
        chosen = left & (colours == (colours[must[0]] if len(must) else open_colours[np.argmax(load)]))
    for i in np.argsort(-weights, kind="stable").tolist():
        fits = candidates[i] and not chosen[i] and not graph[i, chosen].any()
        if fits and instance.things[chosen].sum() + instance.things[i] <= instance.most:
            others = np.flatnonzero(chosen).tolist()
            if instance.cost([*others, i]) == instance.cost(others):
                chosen[i] = True
    return np.flatnonzero(chosen)
