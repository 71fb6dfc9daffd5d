"""A list that changes as little as its edits demand, and another list that is as good.

Data       f(k)       the expression of blendshape k in the former list          place    numbers that edits lock
Variables  x[i, e]    item i is performed in expression e, numbered as in the former list     y[e]   e is used
Model      colouring.assignment; y[e] = max_i x[i, e];  sum_e y[e] = J, the fewest (minimum.py)
           x[i, e] -> sum_{e' < e} y[e'] = place[i]     where expressions fall away, the later ones move up
Repack     max sum_{i, k in i} x[i, f(k)], the blendshapes that stay; then least cost and most value
Value      sum_e (J - e) sum_i lambda[i] x[i, e]: the importance covered after the first expression, the second, ...
Another    max value, no less than ALIKE of the first list's and at no more cost, where of every former list some two
           items that share an expression are in different ones: two lists of J expressions are the same or differ so
"""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from jaxtyping import Int
from msgspec.structs import replace
from ortools.sat.python import cp_model

from capture_plan.errors import InfeasibleError
from capture_plan.expressions.colouring import Assigned, assigned, assignment
from capture_plan.expressions.early import in_promised_order, proves_order
from capture_plan.expressions.instance import FREE, Instance, check_assignment
from capture_plan.expressions.list_program import cost_of
from capture_plan.expressions.listing import TargetDeltas, blendshape_importance, item_importance, packing_record
from capture_plan.expressions.minimum import fewest_colours
from capture_plan.expressions.pack import places_by_name, proofs_of
from capture_plan.expressions.problem import Pairs, Problem, state_problem
from capture_plan.expressions.record import Packing
from capture_plan.expressions.rules import Rules
from capture_plan.expressions.settings import Edits, PackingSettings
from capture_plan.rig import Rig
from capture_plan.solver import solve

ALIKE = 0.99  # of the value of the first list: another one is as good
STEP = 1_000  # importance is compared to a thousandth: whole lists are weighed at once
SOLVED = (cp_model.OPTIMAL, cp_model.FEASIBLE)


def repack(
    rig: Rig,
    used: tuple[str, ...],
    settings: PackingSettings,
    former: Packing,
    edits: Edits,
    *,
    target: TargetDeltas = None,
    rules: Rules | None = None,
    apart: Pairs = (),
) -> Packing:
    """The shortest list that follows `edits` and leaves as many blendshapes as possible where `former` has them.

    `edits` replace those of the settings. Raises InfeasibleError where no list follows them.
    """
    settings = replace(settings, edits=edits)
    problem = state_problem(rig, used, settings, rules, apart)
    colours, bound = fewest_colours(problem.instance)
    j = int(colours.max()) + 1
    with places_by_name(problem):
        check_assignment(problem.instance, j)
    where = _keeping(problem, former, j, _importance(rig, problem, settings, target))
    chosen = [problem.blendshapes(np.flatnonzero(where == e).tolist()) for e in np.unique(where)]
    stayed = _stayed(problem, former, where)
    same = not edits.names and former.as_made and stayed == len(problem.names)
    unmoved = None if same else stayed
    chosen = chosen if edits.names else in_promised_order(rig, problem, settings, target, chosen)
    importance = blendshape_importance(rig, problem.names, settings, target)
    proofs = proofs_of(problem, bound, order_proven=proves_order(rig, problem, settings, target, chosen))
    return packing_record(rig, problem, settings, chosen, importance, proofs, unmoved=unmoved)


def another(
    rig: Rig,
    used: tuple[str, ...],
    settings: PackingSettings,
    formers: Sequence[Packing],
    *,
    target: TargetDeltas = None,
    rules: Rules | None = None,
    apart: Pairs = (),
) -> Packing:
    """A list unlike all of `formers`, of as many expressions as the first and no less than ALIKE of its value.

    Raises InfeasibleError where there is none.
    """
    problem = state_problem(rig, used, settings, rules, apart)
    first, lambda_ = formers[0], _importance(rig, problem, settings, target)
    where = _unlike(problem, formers, lambda_)
    if where is None:
        raise InfeasibleError(
            f"no other list of {first.objective} expressions within {1 - ALIKE:.0%} of the importance was found: "
            "these are the ones to choose from"
        )
    found = [problem.blendshapes(np.flatnonzero(where == e).tolist()) for e in np.unique(where)]
    chosen = in_promised_order(rig, problem, settings, target, found)
    importance = blendshape_importance(rig, problem.names, settings, target)
    proofs = proofs_of(problem, first.solver_bound, order_proven=settings.method == "early")
    return packing_record(rig, problem, settings, chosen, importance, proofs, unmoved=_stayed(problem, first, where))


def _stayed(problem: Problem, former: Packing, where: Int[np.ndarray, " g"]) -> int:
    """How many blendshapes are in the expression that had them."""
    was = {name: e for e, expression in enumerate(former.expressions) for name in expression.blendshapes}
    return int(sum(was.get(name) == where[problem.item_of(name)] for name in problem.names))


def _importance(rig: Rig, problem: Problem, settings: PackingSettings, target: TargetDeltas) -> Int[np.ndarray, " g"]:
    """lambda[i] before anything is packed, in whole thousandths, at least one."""
    weights = item_importance(rig, problem, settings, target)(np.zeros(len(problem.items), dtype=bool))
    return np.maximum(1, np.round(STEP * weights)).astype(int)


def _keeping(problem: Problem, former: Packing, j: int, lambda_: Int[np.ndarray, " g"]) -> Int[np.ndarray, " g"]:
    """The expression of every item, numbered as in the former list; those that fall away are not among them."""
    instance = problem.instance
    length = max(j, len(former.expressions))
    model, x = assignment(instance, length)
    used = _counted(model, x, j)
    _place(model, x, used, instance)
    stays = [
        x[problem.item_of(name)][e]
        for e, expression in enumerate(former.expressions)
        for name in expression.blendshapes
        if name in problem.names
    ]
    model.maximize(sum(stays))
    solver, status = solve(model)
    if status not in SOLVED:
        raise InfeasibleError(f"no list of {j} expressions that follows the edits was found: take one back")
    model.add(sum(stays) >= round(solver.objective_value))
    where = assigned(solver, x)
    model.clear_hints()
    for i, row in enumerate(x):
        for e, variable in enumerate(row):
            model.add_hint(variable, bool(where[i] == e))
    model.maximize(_importance_covered(x, lambda_) - STEP * length * cost_of(model, x, instance.costs))
    solver, status = solve(model)
    return assigned(solver, x) if status in SOLVED else where


def _counted(model: cp_model.CpModel, x: Assigned, j: int) -> list[cp_model.IntVar]:
    """y[e], j of which are true."""
    used = [model.new_bool_var("") for _ in x[0]]
    for e, y in enumerate(used):
        model.add_max_equality(y, [row[e] for row in x])
    model.add(sum(used) == j)
    return used


def _place(model: cp_model.CpModel, x: Assigned, used: list[cp_model.IntVar], instance: Instance) -> None:
    for i in np.flatnonzero(instance.place != FREE).tolist():
        for e, here in enumerate(x[i]):
            model.add(sum(used[:e]) == int(instance.place[i])).only_enforce_if(here)


def _importance_covered(x: Assigned, lambda_: Int[np.ndarray, " g"]) -> cp_model.LinearExpr:
    terms = [
        (len(row) - e) * weight * x_
        for row, weight in zip(x, lambda_.tolist(), strict=True)
        for e, x_ in enumerate(row)
    ]
    return cp_model.LinearExpr.sum(terms)


def _unlike(
    problem: Problem, formers: Sequence[Packing], lambda_: Int[np.ndarray, " g"]
) -> Int[np.ndarray, " g"] | None:
    j = formers[0].objective
    model, x = assignment(problem.instance, j)
    _place(model, x, _counted(model, x, j), problem.instance)
    for former in formers:
        split = [_different(model, x[a], x[b]) for a, b in _neighbours(problem, former)]
        model.add(sum(split) >= 1)
    cost = sum(problem.instance.cost(items) for items in _items(problem, formers[0]))
    model.add(cost_of(model, x, problem.instance.costs) <= cost)
    best = sum((j - e) * sum(lambda_[i] for i in items) for e, items in enumerate(_items(problem, formers[0])))
    model.add(_importance_covered(x, lambda_) >= int(np.ceil(ALIKE * best)))
    model.maximize(_importance_covered(x, lambda_))
    solver, status = solve(model)
    return assigned(solver, x) if status in SOLVED else None


def _different(model: cp_model.CpModel, a: list[cp_model.IntVar], b: list[cp_model.IntVar]) -> cp_model.IntVar:
    """True only where two items are in different expressions."""
    different = model.new_bool_var("")
    for one, other in zip(a, b, strict=True):
        model.add_bool_or(~one, ~other, ~different)
    return different


def _items(problem: Problem, packing: Packing) -> list[list[int]]:
    """The items of every expression of a list."""
    return [
        sorted({problem.item_of(name) for name in expression.blendshapes if name in problem.names})
        for expression in packing.expressions
    ]


def _neighbours(problem: Problem, packing: Packing) -> list[tuple[int, int]]:
    """Items that follow each other in an expression: where all these stay together, so does everything."""
    return [pair for items in _items(problem, packing) for pair in pairwise(items)]
