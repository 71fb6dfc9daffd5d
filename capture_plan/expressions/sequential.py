"""Sequential packing: the heaviest expression first, then the heaviest of what is left (Carrigan et al. 2020, Alg. 1).

Data       lambda[i]  importance of item i, asked for anew in every round      sets   items that meet at a vertex
Variables  w[i]       item i is performed in this expression
Model      max sum_i lambda[i] w[i]                                                          (eq. 3a)
           s.t. sum_{i in S} w[i] <= 1    for every set S                                    (eq. 3b)
                sum_{i in H} w[i] >= 1    for every H that must be hit (none in Alg. 1; minimum.py has some)
The heaviest expression comes first, yet their number need not be the least.
"""

from collections.abc import Callable, Sequence

import numpy as np
from jaxtyping import Bool, Float, Int
from ortools.sat.python import cp_model

from capture_plan.expressions.cpsat import UndecidedError, solve

Weigh = Callable[[Bool[np.ndarray, " g"]], Float[np.ndarray, " g"]]
UNIT = 1_000_000  # importance is compared to a millionth: CP-SAT counts in integers


def sequential(sets: Bool[np.ndarray, "g n"], weigh: Weigh) -> list[Int[np.ndarray, " i"]]:
    """Items of every expression, in order; `weigh(packed)` gives the importance once `packed` items are done.

    Raises UndecidedError where a round cannot be solved to optimality within the work limit.
    """
    left = np.ones(len(sets), dtype=bool)
    expressions = []
    while left.any():
        expression = heaviest(sets, weigh(~left), left)
        assert expression is not None  # each item fits alone
        left[expression] = False
        expressions.append(expression)
    return expressions


def heaviest(
    sets: Bool[np.ndarray, "g n"],
    weights: Float[np.ndarray, " g"],
    left: Bool[np.ndarray, " g"],
    must_hit: Sequence[Int[np.ndarray, " h"]] = (),
) -> Int[np.ndarray, " i"] | None:
    """The items among `left` that fit together and weigh most, or None where nothing hits all of `must_hit`.

    Raises UndecidedError at the work limit.
    """
    model = cp_model.CpModel()
    w = {i: model.new_bool_var("") for i in np.flatnonzero(left)}
    rows = np.unique(sets[left], axis=1).T
    for row in rows[rows.sum(axis=1) > 1]:
        model.add_at_most_one(w[i] for i in np.flatnonzero(left)[row])
    for group in must_hit:
        model.add_at_least_one(w[i] for i in group)
    model.maximize(sum(max(1, round(UNIT * weights[i])) * w[i] for i in w))
    solver, status = solve(model)
    if status == cp_model.INFEASIBLE:
        return None
    if status != cp_model.OPTIMAL:
        raise UndecidedError
    return np.array([i for i in w if solver.boolean_value(w[i])])
