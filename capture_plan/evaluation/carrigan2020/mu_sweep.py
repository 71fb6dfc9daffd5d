"""How a packing depends on what was decided: curves over mu, and each term of importance left out.

mu          share of the largest movement from which a vertex is active: fewer active vertices clash less
importance  terms of eq. 4 of Carrigan et al. 2020, and beside them the expected error of the rebuilt rig. All orders
            are judged by the same two measures, whatever they were made by: blendshapes shown, and share of
            displacement strength (Dis, eq. 5) shown, after every expression
"""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float
from msgspec import Struct
from msgspec.structs import replace

from capture_plan.expressions.listing import TargetDeltas, Weigh, blendshape_importance, item_importance
from capture_plan.expressions.pack import list_expressions, pack, places_by_name
from capture_plan.expressions.problem import Pairs, Problem, state_problem
from capture_plan.expressions.rules import Rules
from capture_plan.expressions.settings import PackingSettings
from capture_plan.progress import track
from capture_plan.rig import Rig


class MuRow(Struct, frozen=True):
    """Numbers of expressions at one mu: the fewest, their bound and who proves it, and two other methods'."""

    mu: float
    minimum: int
    bound: int
    bound_from: str
    sequential: int
    greedy: int


class AblationRow(Struct, frozen=True):
    """What is shown after each expression in the order that `terms` give: blendshapes, and strength from 0 to 1."""

    terms: str
    shown: tuple[int, ...]
    strength: tuple[float, ...]


def mu_sweep(
    rig: Rig,
    used: tuple[str, ...],
    settings: PackingSettings,
    mus: Sequence[float],
    *,
    rules: Rules | None = None,
    apart: Pairs = (),
) -> tuple[MuRow, ...]:
    """A row for every mu; the other settings stay.

    Example:
        >>> rig = sample_rig()
        >>> [(row.minimum, row.greedy) for row in mu_sweep(rig, audit_rig(rig).used, PackingSettings(), (0.3,))]
        [(18, 18)]
    """
    rows = []
    for mu in track(mus, "Packing for every mu"):
        least, sequence, greedy = (
            pack(rig, used, replace(settings, mu=mu, method=method, limit=None), rules=rules, apart=apart)
            for method in ("minimum", "sequential", "greedy")
        )
        row = MuRow(mu, least.objective, least.solver_bound, least.bound_from, sequence.objective, greedy.objective)
        rows.append(row)
    return tuple(rows)


def importance_ablation(
    rig: Rig,
    used: tuple[str, ...],
    settings: PackingSettings,
    *,
    target: TargetDeltas = None,
    rules: Rules | None = None,
    apart: Pairs = (),
) -> tuple[AblationRow, ...]:
    """Orders without importance, with each of the paper's terms alone, with all, and by expected error.

    Distortion needs a target. An `early` list has no importance of single blendshapes: `minimum` stands for it."""
    problem = state_problem(rig, used, settings, rules, apart)
    method = "minimum" if settings.method == "early" else settings.method  # an order by importance alone
    paper, error = (replace(settings, importance=importance, method=method) for importance in ("paper", "error"))
    strength = blendshape_importance(rig, problem.names, paper, None)
    count = np.array([float(len(item)) for item in problem.items])
    weighs: dict[str, Weigh] = {"none": lambda packed: count}
    forms = {"displacement": (0.0, 0.0), "uniqueness": (0.0, 1.0)}
    if target is not None:
        forms |= {"distortion": (1.0, 0.0), "displacement and distortion": (0.5, 0.0), "all": (0.5, 0.5)}
    for terms, (alpha, beta) in forms.items():
        weighs[terms] = item_importance(rig, problem, replace(paper, distortion=alpha, uniqueness=beta), target)
    weighs["expected error"] = item_importance(rig, problem, error, target)
    return tuple(_judged(problem, method, terms, weigh, strength) for terms, weigh in weighs.items())


def _judged(problem: Problem, method: str, terms: str, weigh: Weigh, strength: Float[np.ndarray, " k"]) -> AblationRow:
    with places_by_name(problem):
        order, _ = list_expressions(problem, method, weigh)
    chosen = [problem.blendshapes(items.tolist()) for items in order.expressions]
    covered = np.cumsum([strength[list(expression)].sum() for expression in chosen]) / strength.sum()
    shown = np.cumsum([len(expression) for expression in chosen])
    return AblationRow(terms, tuple(shown.tolist()), tuple(np.minimum(covered, 1).round(6).tolist()))
