"""From a rig to its packing: the problem, importance, one of three methods, and the record of what was proved.

Items    an item is a blendshape, or what is performed together with it (problem.py); its importance is their sum
Method   `sequential` is Algorithm 1 of Carrigan et al. 2020, `greedy` its baseline, `minimum` the shortest list
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np
from jaxtyping import Float

from capture_plan.errors import InfeasibleError, RigError
from capture_plan.expressions.active import active_sets, skin_displacement
from capture_plan.expressions.colouring import largest_clique
from capture_plan.expressions.importance import (
    LEAST,
    cosine_similarity,
    displacement_strength,
    triangle_distortion,
    uniqueness,
)
from capture_plan.expressions.instance import PlaceError
from capture_plan.expressions.minimum import minimum
from capture_plan.expressions.problem import Pairs, Problem, state_problem
from capture_plan.expressions.record import Expression, Packing
from capture_plan.expressions.rules import Rules
from capture_plan.expressions.sentences import told_apart
from capture_plan.expressions.sequential import Order, Weigh, one_after_another, sequential
from capture_plan.expressions.settings import PackingSettings
from capture_plan.expressions.together import bases_of
from capture_plan.rig import Rig
from capture_plan.transfer.importance import transfer_importance

Target = Float[np.ndarray, "v 3"] | tuple[Float[np.ndarray, "v 3"], ...] | None
Answer = Callable[[tuple[str, ...], str], bool]  # (blendshapes of the expression so far, the one proposed for it)


def always(chosen: tuple[str, ...], proposed: str) -> bool:
    """Yes to every blendshape that is proposed."""
    return True


def pack(
    rig: Rig,
    used: tuple[str, ...],
    settings: PackingSettings,
    *,
    target: Target = None,
    rules: Rules | None = None,
    apart: Pairs = (),
    accept: Answer = always,
) -> Packing:
    """The expressions that show every blendshape of `used` once.

    `target` is the actor's neutral face on the same mesh, in any unit, or several that the actor may be like; without
    it there is no distortion to weigh. `rules` stand in for those that the settings name. `apart` are blendshapes whose
    surfaces run through each other when performed at once. `accept` is a person's yes or no to each blendshape that
    the greedy method proposes.

    Raises:
        RigError: a target has another number of vertices, a rule an unknown name, or nothing is used.
        InfeasibleError: no list follows the edits.
    """
    if not used:
        raise RigError(f"{rig.name}: no blendshape moves the skin: nothing to pack into expressions")
    problem = state_problem(rig, used, settings, rules, apart)
    weigh = item_importance(rig, problem, settings, target)
    with places_by_name(problem):
        order, bound = list_expressions(problem, settings.method, weigh, accept)
    chosen = [problem.blendshapes(items.tolist()) for items in order.expressions]
    worth = blendshape_importance(rig, problem.names, settings, target)
    return packing_record(rig, problem, settings, chosen, worth, bound=bound, order_proven=order.proven)


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


def list_expressions(problem: Problem, method: str, weigh: Weigh, accept: Answer = always) -> tuple[Order, int]:
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


def packing_record(
    rig: Rig,
    problem: Problem,
    settings: PackingSettings,
    chosen: list[tuple[int, ...]],
    worth: Float[np.ndarray, " k"],
    *,
    bound: int,
    order_proven: bool,
    kept: int | None = None,
) -> Packing:
    """The record of a list; `chosen` are the blendshapes of every expression, by their number in the problem."""
    names = problem.names
    shot = chosen[: settings.limit]
    done = {k for expression in shot for k in expression}
    plain, all_told = largest_clique(problem.overlapping), largest_clique(problem.instance.sets)
    clique = max(plain, all_told, key=len)  # the plainer one of two equal ones
    return Packing(
        method=settings.method,
        expressions=_expressions(rig, names, shot, worth / worth.sum(), problem.drivers),
        objective=len(chosen),
        bound=bound,
        proven_optimal=len(chosen) == bound,
        order_proven=order_proven,
        clique=tuple(problem.labels(i)[0] for i in clique.tolist()),
        pairs=problem.pairs,
        relaxed=problem.relaxed,
        exclusive=problem.exclusive,
        drivers=problem.drivers,
        left_out=tuple(name for k, name in enumerate(names) if k not in done),
        local=problem.local,
        colliding=problem.colliding,
        most_things=problem.most_things,
        things=int(problem.instance.things.sum()),
        hard=problem.hard_in(chosen),
        overlaps=problem.overlaps,
        edits=problem.edits,
        kept=kept,
    )


def blendshape_importance(
    rig: Rig, used: tuple[str, ...], settings: PackingSettings, target: Target
) -> Float[np.ndarray, " k"]:
    """What a scan of each blendshape is worth, uniqueness left aside; at most 1, at least LEAST.

    Raises:
        RigError: a target has another number of vertices.
    """
    targets = target if isinstance(target, tuple) else () if target is None else (target,)
    for one in targets:
        if len(one) != len(rig.neutral):
            raise RigError(
                f"the target neutral has {len(one):,} vertices, {rig.name} has {len(rig.neutral):,}: "
                "bring the target onto the rig's mesh first"
            )
    if settings.importance == "error":
        return expected_error(rig, used, targets)
    active = active_sets(rig, used, settings.mu)
    strength = displacement_strength(skin_displacement(rig, used), active)
    if not targets:
        return np.maximum(strength, LEAST)  # alpha = 1 without a target
    distortion = triangle_distortion(rig.neutral, targets, rig.triangles, active, settings.distortion_form)
    return np.maximum((1 - settings.distortion) * strength + settings.distortion * distortion, LEAST)


def expected_error(
    rig: Rig, used: tuple[str, ...], targets: tuple[Float[np.ndarray, "v 3"], ...]
) -> Float[np.ndarray, " k"]:
    """The squared error that each scan is expected to take from the rebuilt rig, as a share of the largest; the mean
    over several targets."""
    rows = [rig.names.index(name) for name in used]
    errors = np.mean([transfer_importance(rig, one)[rows] for one in targets or (None,)], axis=0)
    return np.maximum(errors / (errors.max() or 1), LEAST)


def item_importance(rig: Rig, problem: Problem, settings: PackingSettings, target: Target) -> Weigh:
    """Importance of each item once some are packed: eq. 4 with its term for uniqueness."""
    worth = blendshape_importance(rig, problem.names, settings, target)
    belongs = np.zeros((len(problem.items), len(problem.names)))
    for i, item in enumerate(problem.items):
        belongs[i, list(item)] = 1
    if settings.uniqueness == 0:
        fixed = belongs @ worth
        return lambda packed: fixed
    rows = [rig.names.index(name) for name in problem.names]
    cosine = cosine_similarity(rig.deltas[rows][:, rig.skin])
    beta = settings.uniqueness
    return lambda packed: belongs @ (worth + beta * uniqueness(cosine, packed.astype(float) @ belongs > 0))


def _expressions(
    rig: Rig, used: tuple[str, ...], chosen: list[tuple[int, ...]], share: Float[np.ndarray, " k"], drivers: Pairs
) -> tuple[Expression, ...]:
    gain = np.array([share[list(expression)].sum() for expression in chosen])
    covered = np.minimum(np.cumsum(gain), 1)
    names = [tuple(used[k] for k in expression) for expression in chosen]
    sentences = told_apart(rig, names)
    return tuple(
        Expression(
            name=f"E{number:02d}",
            blendshapes=names[number - 1],
            weights=(1.0,) * len(names[number - 1]),
            gain=round(float(gain[number - 1]), 6),
            covered=round(float(covered[number - 1]), 6),
            sentence=sentences[number - 1],
            drivers=bases_of(names[number - 1], drivers),
        )
        for number in range(1, len(chosen) + 1)
    )
