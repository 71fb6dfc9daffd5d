"""From a rig to its packing: the problem, importance, one of four methods, and the record of what was proved.

Items    an item is a blendshape, or what is performed together with it (problem.py); its importance is their sum
Method   `sequential` is Algorithm 1 of Carrigan et al. 2020, `greedy` its baseline, `minimum` the shortest list,
         `early` the list of that length whose first expressions leave the least error
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
from jaxtyping import Bool
from msgspec.structs import replace as change

from capture_plan.errors import InfeasibleError, RigError
from capture_plan.expressions.colouring import largest_clique
from capture_plan.expressions.conflicts import conflict_graph
from capture_plan.expressions.early import Items, early, model_of
from capture_plan.expressions.greedy import Order, one_after_another
from capture_plan.expressions.instance import PlaceError
from capture_plan.expressions.listing import (
    Proofs,
    TargetDeltas,
    Weigh,
    blendshape_importance,
    item_importance,
    packing_record,
)
from capture_plan.expressions.minimum import heaviest_first, minimum, shortest
from capture_plan.expressions.problem import Pairs, Problem, state_problem
from capture_plan.expressions.record import Packing
from capture_plan.expressions.rules import Rules
from capture_plan.expressions.sequential import sequential
from capture_plan.expressions.settings import PackingSettings
from capture_plan.rig import Rig

WAYS = ("error", "paper")  # in which blendshapes are weighed for the lists that `early` starts from
_Answer = Callable[[tuple[str, ...], str], bool]  # (blendshapes of the expression so far, the one proposed for it)


def always(chosen: tuple[str, ...], proposed: str) -> bool:
    """Yes to every blendshape that is proposed."""
    return True


def pack(
    rig: Rig,
    used: tuple[str, ...],
    settings: PackingSettings,
    *,
    target: TargetDeltas = None,
    rules: Rules | None = None,
    apart: Pairs = (),
    accept: _Answer = always,
) -> Packing:
    """The expressions that show every blendshape of `used` once.

    `target` is the actor's neutral face on the same mesh, in any unit, or several that the actor may be like; without
    it there is no distortion to weigh. `rules` stand in for those that the settings name. `apart` are blendshapes whose
    surfaces run through each other when performed at once. `accept` is a person's yes or no to each blendshape that
    the greedy method proposes.

    Raises:
        RigError: a target has another number of vertices, a rule an unknown name, or nothing is used.
        InfeasibleError: no list follows the edits.

    Example:
        >>> rig = sample_rig()
        >>> packing = pack(rig, audit_rig(rig).used, PackingSettings(method="minimum"))
        >>> packing.objective, packing.bound, packing.expressions[0].name
        (18, 18, 'E01')
    """
    if not used:
        raise RigError(f"{rig.name}: no blendshape moves the skin: nothing to pack into expressions")
    problem = state_problem(rig, used, settings, rules, apart)
    with places_by_name(problem):
        if settings.method == "early":
            order, bound = early_list(rig, problem, settings, target)
        else:
            weigh = item_importance(rig, problem, settings, target)
            order, bound = list_expressions(problem, settings.method, weigh, accept)
    chosen = [problem.blendshapes(items.tolist()) for items in order.expressions]
    importance = blendshape_importance(rig, problem.names, settings, target)
    proofs = proofs_of(problem, bound, order_proven=order.proven)
    return packing_record(rig, problem, settings, chosen, importance, proofs, unmoved=None if accept is always else 0)


@contextmanager
def places_by_name(problem: Problem) -> Iterator[None]:
    """Says in an InfeasibleError which blendshape is locked beyond the end of the list."""
    try:
        yield
    except PlaceError as beyond:
        name = problem.labels(beyond.item)[0]
        raise InfeasibleError(
            f"'{name}' is locked to E{beyond.number + 1:02d}, the list ends with E{beyond.length:02d}: "
            "lock it to an earlier one"
        ) from None


def early_list(rig: Rig, problem: Problem, settings: PackingSettings, target: TargetDeltas) -> tuple[Order, int]:
    """The shortest list whose first expressions leave little error, and a proven bound on the number.

    It starts from the shortest lists whose first expressions weigh most by expected error and by the paper's
    importance, and from the greedy one where that is as short. Raises PlaceError where an item is locked beyond the end
    of the list.
    """
    found, lists = shortest(problem.instance), list[list[Items]]()
    weighs = {way: item_importance(rig, problem, change(settings, importance=way), target) for way in WAYS}
    for weigh in weighs.values():
        order = heaviest_first(found, weigh)
        lists.append([frozenset(items.tolist()) for items in order.expressions])
    fewest = min(map(len, lists))
    by_greed, _ = list_expressions(problem, "greedy", weighs[settings.importance])
    model = model_of(rig, problem, settings, target)
    lists.append([frozenset(items.tolist()) for items in by_greed.expressions])
    model = replace(model, to_beat=tuple(model.left([parts])[0] for parts in lists))
    best = early(model, [parts for parts in lists if len(parts) == fewest])
    expressions = tuple(np.array(sorted(items)) for items in best)
    return Order(expressions, proven=True), found.bound


def list_expressions(problem: Problem, method: str, weigh: Weigh, accept: _Answer = always) -> tuple[Order, int]:
    """Items of every expression by one of the methods, and a proven bound on their number.

    Raises PlaceError where an item is locked beyond the end of the list.
    """
    instance = problem.instance
    if method == "minimum":
        return minimum(instance, weigh)
    bound = max(len(largest_clique(instance.sets)), instance.least)
    if method == "sequential":
        return sequential(instance, weigh), bound

    def asked(chosen: tuple[int, ...], proposed: int) -> bool:
        so_far = tuple(name for i in chosen for name in problem.labels(i))
        return all(accept(so_far, name) for name in problem.labels(proposed))

    return one_after_another(instance, weigh, asked), bound


def proofs_of(problem: Problem, bound: int, *, order_proven: bool) -> Proofs:
    """The proofs with the largest clique: of overlaps alone if one is as large as those that count rules too."""
    plain, whole = largest_clique(problem.overlapping), largest_clique(problem.instance.sets)
    clique = grown(max(plain, whole, key=len).tolist(), conflict_graph(problem.instance.sets))
    return Proofs(bound, order_proven, tuple(problem.labels(i)[0] for i in clique))


def grown(clique: list[int], graph: Bool[np.ndarray, "g g"]) -> list[int]:
    """The clique with every item that conflicts with all of it: none where the solver found a largest one."""
    for i in range(len(graph)):
        clique = [*clique, i] if i not in clique and graph[i, clique].all() else clique
    return sorted(clique)
