"""One program for a whole list of a given length, where a colouring alone does not tell what is wanted.

Variables  x[i, e]   item i is performed in expression e        z[i, j]   i and j are performed in the same one
Model      colouring.assignment, and z[i, j] >= x[i, e] + x[j, e] - 1 for every e and every pair that costs
Cost       min sum c[i, j] z[i, j]
Heaviest   max sum_i lambda[i] x[i, 0]  s.t.  sum c[i, j] z[i, j] <= budget
Renaming   the items of a largest clique C are in different expressions: C[n] in n, or C[0] in n and C[n] in 0
"""

import numpy as np
from jaxtyping import Bool, Float, Int
from ortools.sat.python import cp_model

from capture_plan.expressions.colouring import Assigned, assigned, assignment, largest_clique
from capture_plan.expressions.instance import Costs, Instance
from capture_plan.expressions.sequential import UNIT, Heaviest
from capture_plan.solver import UndecidedError, solve


def least_cost(instance: Instance, j: int) -> tuple[Int[np.ndarray, " g"], int, bool]:
    """A colouring with j colours that costs least, its cost, and whether that is proved.

    Raises UndecidedError at the work limit without any.
    """
    model, x = assignment(instance, j)
    for e, i in enumerate(largest_clique(instance.sets)):
        model.add(x[i][e] == 1)
    model.minimize(cost_of(model, x, instance.costs))
    solver, status = solve(model)
    if status not in (cp_model.OPTIMAL, cp_model.FEASIBLE):
        raise UndecidedError
    return assigned(solver, x), round(solver.objective_value), status == cp_model.OPTIMAL


def heaviest_and_rest(
    instance: Instance,
    weights: Float[np.ndarray, " g"],
    left: Bool[np.ndarray, " g"],
    e: int,
    j: int,
    budget: int,
) -> tuple[Heaviest, Int[np.ndarray, " g"]]:
    """The heaviest expression e after which what is left costs no more than `budget` in `j` further expressions.

    With it a colouring of what is left. Raises UndecidedError at the work limit without any.
    """
    items = np.flatnonzero(left)
    new = {int(i): n for n, i in enumerate(items)}
    costs = tuple((new[a], new[b], c) for a, b, c in instance.costs if a in new and b in new)
    part = instance.restricted_to(items)
    model, x = assignment(part, j + 1)
    candidates, must = part.candidates(np.ones(len(items), dtype=bool), e)
    for i in np.flatnonzero(~candidates):
        model.add(x[i][0] == 0)
    for i in must:
        model.add(x[i][0] == 1)
    first, *others = largest_clique(part.sets).tolist()
    for n, i in enumerate(others, start=1):
        model.add(x[i][n] + x[i][0] == 1)
        model.add_implication(x[i][0], x[first][n])
    model.add(cost_of(model, x, costs) <= budget)
    model.maximize(sum(max(1, round(UNIT * weights[i])) * x[n][0] for n, i in enumerate(items)))
    solver, status = solve(model)
    if status not in (cp_model.OPTIMAL, cp_model.FEASIBLE):
        raise UndecidedError
    colours = assigned(solver, x)
    spread = np.full(len(instance), -1)
    spread[items] = colours - 1  # expression e itself becomes -1: no longer left
    return Heaviest(items[colours == 0], status == cp_model.OPTIMAL), spread


def cost_of(model: cp_model.CpModel, x: Assigned, costs: Costs) -> cp_model.LinearExpr:
    """sum c z, with the constraints that make z true where both are performed at once."""
    terms = []
    for a, b, c in costs:
        z = model.new_bool_var("")
        for one, other in zip(x[a], x[b], strict=True):
            model.add(z >= one + other - 1)
        terms.append(c * z)
    return cp_model.LinearExpr.sum(terms)
