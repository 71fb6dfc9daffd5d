"""The record of a list of expressions: all of it follows from who is in which expression and from what was proved.

No solver is needed, so that who checks a plan writes it again.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from capture_plan.errors import RigError
from capture_plan.expressions.active_sets import active_sets, skin_displacement
from capture_plan.expressions.compatibility import bases_of
from capture_plan.expressions.importance import (
    LEAST,
    cosine_similarity,
    displacement_strength,
    triangle_distortion,
    uniqueness,
)
from capture_plan.expressions.problem import Pairs, Problem
from capture_plan.expressions.record import Expression, Packing
from capture_plan.expressions.sentences import distinct_sentences
from capture_plan.expressions.settings import PackingSettings
from capture_plan.rig import Rig
from capture_plan.transfer.importance import transfer_importance

Weigh = Callable[[Bool[np.ndarray, " g"]], Float[np.ndarray, " g"]]
TargetDeltas = Float[np.ndarray, "v 3"] | tuple[Float[np.ndarray, "v 3"], ...] | None


@dataclass(frozen=True)
class Proofs:
    """What was proved of a list: the solver's lower limit on its length, whether its order is the best, and a clique by
    names."""

    bound: int
    order_proven: bool
    clique: tuple[str, ...]


def packing_record(
    rig: Rig,
    problem: Problem,
    settings: PackingSettings,
    chosen: list[tuple[int, ...]],
    importance: Float[np.ndarray, " k"],
    proofs: Proofs,
    *,
    unmoved: int | None = None,
) -> Packing:
    """The record of a list: all of it follows from `chosen`, the blendshapes of every expression by their number in the
    problem, and from what was proved."""
    names, things = problem.names, int(problem.instance.things.sum())
    bound = max(len(proofs.clique), problem.instance.least if problem.most_things else 0)
    shot = chosen[: settings.limit]
    done = {k for expression in shot for k in expression}
    return Packing(
        method=settings.method,
        expressions=_expressions(rig, names, shot, importance / importance.sum(), problem.drivers),
        objective=len(chosen),
        bound=bound,
        solver_bound=proofs.bound,
        proven_optimal=len(chosen) == bound,
        order_proven=proofs.order_proven,
        clique=proofs.clique,
        pairs=problem.pairs,
        relaxed=problem.relaxed,
        exclusive=problem.exclusive,
        drivers=problem.drivers,
        left_out=tuple(name for k, name in enumerate(names) if k not in done),
        unscanned=tuple(tuple(names[k] for k in expression) for expression in chosen[len(shot) :]),
        local=problem.local,
        colliding=problem.colliding,
        most_things=problem.most_things,
        things=things,
        hard=problem.hard_in(chosen),
        overlaps=problem.overlaps,
        edits=problem.edits,
        unmoved=unmoved,
    )


def blendshape_importance(
    rig: Rig, used: tuple[str, ...], settings: PackingSettings, target: TargetDeltas
) -> Float[np.ndarray, " k"]:
    """What a scan of each blendshape is worth, uniqueness left aside; at most 1, at least LEAST.

    Raises:
        RigError: a target has another number of vertices.
    """
    targets = target_list(rig, target)
    if settings.importance == "error":
        return expected_error(rig, used, targets)
    active = active_sets(rig, used, settings.mu)
    strength = displacement_strength(skin_displacement(rig, used), active)
    if not targets:
        return np.maximum(strength, LEAST)  # alpha = 1 without a target
    distortion = triangle_distortion(rig.neutral, targets, rig.triangles, active, settings.distortion_form)
    return np.maximum((1 - settings.distortion) * strength + settings.distortion * distortion, LEAST)


def item_importance(rig: Rig, problem: Problem, settings: PackingSettings, target: TargetDeltas) -> Weigh:
    """Importance of each item once some are packed: eq. 4 with its term for uniqueness."""
    importance = blendshape_importance(rig, problem.names, settings, target)
    belongs = np.zeros((len(problem.items), len(problem.names)))
    for i, item in enumerate(problem.items):
        belongs[i, list(item)] = 1
    if settings.uniqueness == 0:
        fixed = belongs @ importance
        return lambda packed: fixed
    rows = rig.rows(problem.names)
    cosine = cosine_similarity(rig.deltas[rows][:, rig.skin])
    beta = settings.uniqueness
    return lambda packed: belongs @ (importance + beta * uniqueness(cosine, packed.astype(float) @ belongs > 0))


def target_list(rig: Rig, target: TargetDeltas) -> tuple[Float[np.ndarray, "v 3"], ...]:
    """None, one or several targets. RigError where one has another number of vertices."""
    targets = target if isinstance(target, tuple) else () if target is None else (target,)
    for one in targets:
        if len(one) != len(rig.neutral):
            raise RigError(
                f"the target neutral has {len(one):,} vertices, {rig.name} has {len(rig.neutral):,}: "
                "bring the target onto the rig's mesh first"
            )
    return targets


def expected_error(
    rig: Rig, used: tuple[str, ...], targets: tuple[Float[np.ndarray, "v 3"], ...]
) -> Float[np.ndarray, " k"]:
    """The squared error that each scan is expected to take from the rebuilt rig, as a share of the largest; the mean
    over several targets."""
    rows = rig.rows(used)
    errors = np.mean([transfer_importance(rig, one)[rows] for one in targets or (None,)], axis=0)
    return np.maximum(errors / (errors.max() or 1), LEAST)


def _expressions(
    rig: Rig, used: tuple[str, ...], chosen: list[tuple[int, ...]], share: Float[np.ndarray, " k"], drivers: Pairs
) -> tuple[Expression, ...]:
    gain = np.array([share[list(expression)].sum() for expression in chosen])
    covered = np.minimum(np.cumsum(gain), 1)
    names = [tuple(used[k] for k in expression) for expression in chosen]
    sentences = distinct_sentences(rig, names)
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
