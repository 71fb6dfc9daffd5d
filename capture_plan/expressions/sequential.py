"""Sequential packing: the heaviest expression first, then the heaviest of what is left (Carrigan et al. 2020, Alg. 1).

Data       lambda[i]  importance of item i, asked for anew in every round      sets   items that meet at a vertex
Variables  w[i]       item i is performed in this expression                   z[i, j]   both are
Model      max sum_i lambda[i] w[i] - price sum c[i, j] z[i, j]                              (eq. 3a)
           s.t. sum_{i in S} w[i] <= 1    for every set S                                    (eq. 3b)
                sum_i things[i] w[i] <= most
                z[i, j] >= w[i] + w[j] - 1
                sum_{i in H} w[i] >= 1    for every H that must be hit (minimum.py has some), w[i] = 1 where i is locked
The heaviest expression comes first, yet their number need not be the least.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int
from ortools.sat.python import cp_model

from capture_plan.expressions.greedy import Order
from capture_plan.expressions.instance import Costs, Instance, check_assignment
from capture_plan.expressions.listing import Weigh
from capture_plan.solver import UndecidedError, solve

UNIT = 1_000_000  # importance is compared to a millionth: CP-SAT counts in integers
PRICE = 0.1  # of the strongest blendshape: what one point of difficulty is worth where the number is not at stake


def sequential(instance: Instance, weigh: Weigh) -> Order:
    """The heaviest expressions one after the other; `weigh(packed)` is the importance once `packed` items are done."""
    left = np.ones(len(instance), dtype=bool)
    expressions, proven = [], True
    while left.any():
        candidates, must = instance.candidates(left, len(expressions))
        if not candidates.any():
            check_assignment(instance, len(expressions))
        found = heaviest(
            instance, weigh(~left), candidates, [must[[n]] for n in range(len(must))], costs=instance.costs
        )
        left[found.items] = False
        expressions.append(found.items)
        proven &= found.proven
    return Order(tuple(expressions), proven)


@dataclass(frozen=True)
class Heaviest:
    """Items that fit together, and whether no heavier ones do."""

    items: Int[np.ndarray, " i"]
    proven: bool


def heaviest(
    instance: Instance,
    weights: Float[np.ndarray, " g"],
    left: Bool[np.ndarray, " g"],
    must_hit: Sequence[Int[np.ndarray, " _"]] = (),
    *,
    costs: Costs = (),
) -> Heaviest:
    """The items among `left` that fit together, hit all of `must_hit` and weigh most.

    Raises UndecidedError where the work limit is reached without any.
    """
    items = np.flatnonzero(left)
    model = cp_model.CpModel()
    w = {i: model.new_bool_var("") for i in items.tolist()}
    rows = np.unique(instance.sets[left], axis=1).T
    for row in rows[rows.sum(axis=1) > 1]:
        model.add_at_most_one(w[i] for i in items[row].tolist())
    if instance.crowded:
        model.add(sum(int(instance.things[i]) * w[i] for i in w) <= instance.most)
    for group in must_hit:
        model.add_at_least_one(w[i] for i in group.tolist() if left[i])
    spent = []
    for i, j, c in costs:
        if left[i] and left[j]:
            z = model.new_bool_var("")
            model.add(z >= w[i] + w[j] - 1)
            spent.append(round(UNIT * PRICE * c) * z)
    model.maximize(sum(max(1, round(UNIT * weights[i])) * w[i] for i in w) - sum(spent))
    solver, status = solve(model)
    if status not in (cp_model.OPTIMAL, cp_model.FEASIBLE):
        raise UndecidedError
    return Heaviest(np.array([i for i in w if solver.boolean_value(w[i])]), status == cp_model.OPTIMAL)
