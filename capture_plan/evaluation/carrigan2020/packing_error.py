"""What a list of expressions is worth beside other lists: the error of another face's rig after its first scans.

Lists   early, minimum, sequential, greedy   the methods of a packing, all of the same problem (`pack.py`)
        paper's importance            minimum, weighed by displacement as Carrigan et al. 2020 do, where the others
                                      are weighed as the settings say
        random                        greedy by random importance: full expressions in a random order; some, by seed
        one at a time                 every blendshape for itself, the most important first: no packing
Errors  root mean square over blendshapes and skin, mm; before the first scan it is that of deformation transfer
"""

from collections.abc import Mapping, Sequence

import msgspec
import numpy as np
from jaxtyping import Float
from msgspec.structs import replace

from capture_plan.cache import cached, digest
from capture_plan.expressions.compatibility import bases_of
from capture_plan.expressions.greedy import Order
from capture_plan.expressions.listing import Weigh, blendshape_importance, item_importance
from capture_plan.expressions.pack import early_list, list_expressions, places_by_name
from capture_plan.expressions.problem import Pairs, Problem, state_problem
from capture_plan.expressions.settings import PackingSettings
from capture_plan.rig import Rig
from capture_plan.transfer.score import Pose, RebuildScore, score_orders
from capture_plan.transfer.targets import all_targets, another_person

PAPER, RANDOM, ALONE = "paper's importance", "random", "one at a time"
METHODS = ("minimum", "sequential", "greedy")  # beside `early`
SEEDS = (0, 1, 2)  # of the random lists
PEOPLE_SEED = 7  # any: the same persons every time
COUNTS = (0, 1, 2, 3, 4, 5, 6, 8, 10, 12, 15, 18, 20, 25, 30, 40, 60, 80, 120)  # scans after which the error is taken
ENTRIES = 200  # on disk, 50 kB each
ANSWER = "1"  # raise it when the same lists would give other errors

Lists = dict[str, tuple[Pose, ...]]
Curve = tuple[tuple[int, ...], tuple[float, ...]]  # scans, and the error after them, mm
ErrorCurves = dict[str, dict[str, Curve]]  # by target, by list


def rival_lists(rig: Rig, used: tuple[str, ...], settings: PackingSettings, *, apart: Pairs = ()) -> Lists:
    """The lists by name, in the order of the table above; random ones by 'random' and their seed."""
    problem = state_problem(rig, used, settings, None, apart)
    weigh = item_importance(rig, problem, settings, None)
    with places_by_name(problem):
        best, _ = early_list(rig, problem, settings, None)
    lists = {"early": _poses(problem, best)}
    lists |= {method: _list(problem, method, weigh) for method in METHODS}
    of_paper = item_importance(rig, problem, replace(settings, importance="paper"), None)
    lists[PAPER] = _list(problem, "minimum", of_paper)
    for seed in SEEDS:
        lists[f"{RANDOM} {seed + 1}"] = _list(problem, "greedy", _by_chance(len(problem.items), seed))
    importance = blendshape_importance(rig, problem.names, settings, None)
    first = np.argsort(-importance, kind="stable").tolist()
    return lists | {ALONE: tuple(_pose(problem, (problem.names[k],)) for k in first)}


def errors_of_lists(rig: Rig, lists: Mapping[str, Sequence[Pose]], *, people: int) -> ErrorCurves:
    """The error of each list on every target (`transfer/targets.py`), `people` of them other persons; cached."""
    name = digest(
        [ANSWER, rig.fingerprint, rig.skin, np.array([*COUNTS, people, PEOPLE_SEED]), msgspec.json.encode(lists)]
    )

    def scored() -> dict[str, np.ndarray]:
        scores = score_orders(rig, all_targets(rig, people=people, seed=PEOPLE_SEED), lists, counts=COUNTS)
        return {"scores": np.frombuffer(msgspec.json.encode(scores), dtype=np.uint8)}

    retained = cached(scored, "packing-error", name, entries=ENTRIES)["scores"]
    return error_curves(msgspec.json.decode(retained.tobytes(), type=tuple[RebuildScore, ...]))


def typical_target(rig: Rig) -> Float[np.ndarray, "v 3"]:
    """The neutral of another person, for what hangs on the actor's face before that is known."""
    return another_person(rig, PEOPLE_SEED, name="person 1").neutral


def error_curves(scores: Sequence[RebuildScore]) -> ErrorCurves:
    """Scores as curves; of the random lists their mean."""
    targets, orders = (tuple(dict.fromkeys(of)) for of in zip(*((s.target, s.order) for s in scores), strict=True))
    found: ErrorCurves = {}
    for target in targets:
        single = {
            order: _curve([score for score in scores if (score.target, score.order) == (target, order)])
            for order in orders
        }
        by_chance = [order for order in orders if order.startswith(f"{RANDOM} ")]
        curves = {order: curve for order, curve in single.items() if order not in by_chance}
        if by_chance:
            curves[RANDOM] = mean_curve([single[order] for order in by_chance])
        found[target] = {order: curves[order] for order in sorted(curves, key=lambda order: order == ALONE)}
    return found


def mean_curve(curves: Sequence[Curve]) -> Curve:
    """The mean of curves at every count that one of them has; a list that has ended stays as it is."""
    counts = tuple(sorted({count for x, _ in curves for count in x}))
    return counts, tuple(float(np.mean([np.interp(count, x, y) for x, y in curves])) for count in counts)


def error_after(curve: Curve, count: int) -> float | None:
    """The error after so many scans, mm; nothing where the list has fewer."""
    x, y = curve
    return dict(zip(x, y, strict=True)).get(count) if count <= x[-1] else None


def _curve(scores: Sequence[RebuildScore]) -> Curve:
    return tuple(score.count for score in scores), tuple(score.rms_mm for score in scores)


def _list(problem: Problem, method: str, weigh: Weigh) -> tuple[Pose, ...]:
    with places_by_name(problem):
        order, _ = list_expressions(problem, method, weigh)
    return _poses(problem, order)


def _poses(problem: Problem, order: Order) -> tuple[Pose, ...]:
    chosen = [problem.blendshapes(items.tolist()) for items in order.expressions]
    return tuple(_pose(problem, tuple(problem.names[k] for k in expression)) for expression in chosen)


def _by_chance(count: int, seed: int) -> Weigh:
    chance = np.random.default_rng(seed).random(count)
    return lambda packed: chance


def _pose(problem: Problem, names: tuple[str, ...]) -> Pose:
    return dict.fromkeys((*names, *bases_of(names, problem.drivers)), 1.0)
