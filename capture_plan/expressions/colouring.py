"""Colouring the conflict graph: a colour is an expression, items in conflict get different ones.

Data       graph      conflicts of g items         cover   cliques that together name every conflict
Variables  x[i, e]    item i is performed in expression e
Model      sum_e x[i, e] = 1                       for every i
           sum_{i in C} x[i, e] <= 1               for every clique C of the cover, e
           sum_i things[i] x[i, e] <= most         for every e
           x[C[n], n] = 1                          for one largest clique C: expressions may be renamed at will
Before the model: a greedy colouring may do. Items with fewer than j conflicts can always be coloured last, but for
expressions that are full: only where this fails does the model hold all items.
"""

import numpy as np
from jaxtyping import Bool, Int
from ortools.sat.python import cp_model

from capture_plan.expressions.conflicts import conflict_graph, core, deepest, edge_cover
from capture_plan.expressions.instance import Instance
from capture_plan.solver import UndecidedError, solve


def largest_clique(sets: Bool[np.ndarray, "g n"]) -> Int[np.ndarray, " e"]:
    """A largest set of items that all conflict with each other; at least the deepest vertex's where the limit is hit.

    max sum_i x[i]  s.t.  x[i] + x[j] <= 1 for every i, j without conflict
    """
    known = deepest(sets)
    graph = conflict_graph(sets)
    items = np.flatnonzero(core(graph, len(known)))  # members of a larger clique
    if len(items) == 0:
        return known
    model = cp_model.CpModel()
    x = {i: model.new_bool_var("") for i in items}
    for place, i in enumerate(items):
        for j in items[place + 1 :]:
            if not graph[i, j]:
                model.add_at_most_one(x[i], x[j])
    model.add(sum(x.values()) > len(known))
    model.maximize(sum(x.values()))
    solver, status = solve(model)
    if status in (cp_model.OPTIMAL, cp_model.FEASIBLE):
        return np.array([i for i in items if solver.boolean_value(x[i])])
    return known


def colour(instance: Instance, j: int) -> Int[np.ndarray, " g"] | None:
    """A colour from 0 to j - 1 for every item, or None where it is proven that there is none; places are left aside.

    Raises UndecidedError at the work limit.
    """
    graph = conflict_graph(instance.sets)
    colours = greedy(graph, instance)
    if colours.max(initial=-1) < j:
        return colours
    if instance.least > j:
        return None
    kernel = np.flatnonzero(core(graph, j))
    solved = _colour_kernel(instance.restricted_to(kernel), j) if len(kernel) else np.zeros(0, dtype=int)
    if solved is None:
        return None
    colours = np.full(len(graph), -1)
    colours[kernel] = solved
    spread = _colour_rest(graph, instance, colours, j)
    return _colour_kernel(instance, j) if spread is None else spread


Assigned = list[list[cp_model.IntVar]]


def assignment(instance: Instance, j: int) -> tuple[cp_model.CpModel, Assigned]:
    """The model above without its last line, and its x[i][e]."""
    model = cp_model.CpModel()
    x = [[model.new_bool_var("") for _ in range(j)] for _ in range(len(instance))]
    for row in x:
        model.add_exactly_one(row)
    for column in edge_cover(instance.sets).T:
        items = np.flatnonzero(column)
        for e in range(j):
            model.add_at_most_one(x[i][e] for i in items)
    if instance.crowded:
        for e in range(j):
            model.add(sum(int(t) * x[i][e] for i, t in enumerate(instance.things)) <= instance.most)
    return model, x


def assigned(solver: cp_model.CpSolver, x: Assigned) -> Int[np.ndarray, " g"]:
    """The expression of every item."""
    return np.array([next(e for e, var in enumerate(row) if solver.boolean_value(var)) for row in x])


def _colour_kernel(instance: Instance, j: int) -> Int[np.ndarray, " g"] | None:
    clique = largest_clique(instance.sets)
    if len(clique) > j or instance.least > j:
        return None
    model, x = assignment(instance, j)
    for e, i in enumerate(clique):
        model.add(x[i][e] == 1)
    solver, status = solve(model)
    if status == cp_model.INFEASIBLE:
        return None
    if status not in (cp_model.OPTIMAL, cp_model.FEASIBLE):
        raise UndecidedError
    return assigned(solver, x)


def _colour_rest(
    graph: Bool[np.ndarray, "g g"], instance: Instance, colours: Int[np.ndarray, " g"], j: int
) -> Int[np.ndarray, " g"] | None:
    """Colour the items that `core` removed, the last removed first: each has a free colour left, the emptiest is taken.

    None where every free colour is too full.
    """
    left = colours < 0
    order = []
    while left.any():
        order.append(next(i for i in np.flatnonzero(left) if (graph[i] & (left | (colours >= 0))).sum() < j))
        left[order[-1]] = False
    asked = np.bincount(colours[colours >= 0], weights=instance.things[colours >= 0], minlength=j)
    for i in reversed(order):
        free = np.setdiff1d(np.arange(j), colours[graph[i]])
        e = free[np.argmin(asked[free])]
        if asked[e] + instance.things[i] > instance.most:
            return None
        colours[i] = e
        asked[e] += instance.things[i]
    return colours


def greedy(graph: Bool[np.ndarray, "g g"], instance: Instance) -> Int[np.ndarray, " g"]:
    """DSATUR (Brelaz 1979): always the item that sees most colours, then the one with most conflicts."""
    g = len(graph)
    colours, asked = np.full(g, -1), np.zeros(g, dtype=int)
    seen = np.zeros((g, g), dtype=bool)
    score = graph.sum(axis=1)  # g times the colours seen, plus the conflicts
    for _ in range(g):
        i = int(np.argmax(np.where(colours < 0, score, -1)))
        full = asked + instance.things[i] > instance.most
        colours[i] = np.argmin(seen[i] | full)
        asked[colours[i]] += instance.things[i]
        news = graph[i] & ~seen[:, colours[i]]
        score[news] += g
        seen[news, colours[i]] = True
    return colours
