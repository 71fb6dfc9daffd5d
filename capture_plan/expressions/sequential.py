"""Sequential packing: the heaviest expression first, then the heaviest of what is left (Carrigan et al. 2020, Alg. 1).

Data       lambda[i]  importance of item i, asked for anew in every round      sets   items that meet at a vertex
Variables  w[i]       item i is performed in this expression
Model      max sum_i lambda[i] w[i]                                                          (eq. 3a)
           s.t. sum_{i in S} w[i] <= 1    for every set S                                    (eq. 3b)
                sum_{i in H} w[i] >= 1    for every H that must be hit (none in Alg. 1; minimum.py has some)
The heaviest expression comes first, yet their number need not be the least.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int
from ortools.sat.python import cp_model

from capture_plan.expressions.cpsat import UndecidedError, solve

Weigh = Callable[[Bool[np.ndarray, " g"]], Float[np.ndarray, " g"]]
UNIT = 1_000_000  # importance is compared to a millionth: CP-SAT counts in integers


@dataclass(frozen=True)
class Order:
    """Items of every expression in order, and whether each was proved the heaviest that its rule allows."""

    expressions: tuple[Int[np.ndarray, " _"], ...]
    proven: bool


def sequential(sets: Bool[np.ndarray, "g n"], weigh: Weigh) -> Order:
    """The heaviest expressions one after the other; `weigh(packed)` is the importance once `packed` items are done."""
    left = np.ones(len(sets), dtype=bool)
    expressions, proven = [], True
    while left.any():
        found = heaviest(sets, weigh(~left), left)
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
    sets: Bool[np.ndarray, "g n"],
    weights: Float[np.ndarray, " g"],
    left: Bool[np.ndarray, " g"],
    must_hit: Sequence[Int[np.ndarray, " _"]] = (),
) -> Heaviest:
    """The items among `left` that fit together, hit all of `must_hit` and weigh most.

    Raises UndecidedError where the work limit is reached without any.
    """
    items = np.flatnonzero(left)
    model = cp_model.CpModel()
    w = {i: model.new_bool_var("") for i in items}
    rows = np.unique(sets[left], axis=1).T
    for row in rows[rows.sum(axis=1) > 1]:
        model.add_at_most_one(w[i] for i in items[row])
    for group in must_hit:
        model.add_at_least_one(w[i] for i in group)
    model.maximize(sum(max(1, round(UNIT * weights[i])) * w[i] for i in items))
    solver, status = solve(model)
    if status not in (cp_model.OPTIMAL, cp_model.FEASIBLE):
        raise UndecidedError
    return Heaviest(np.array([i for i in items if solver.boolean_value(w[i])]), status == cp_model.OPTIMAL)
