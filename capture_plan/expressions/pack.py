"""From a rig to its packing: active sets, pairs, importance, one of two methods, and the record of what was proved.

Items    an item is a blendshape, or a left/right pair performed together: its active set is the union of both (overlap
         inside a pair is allowed), its importance their sum
Rules    two blendshapes that no face performs at once are kept apart as if they shared a vertex
Method   `sequential` is Algorithm 1 of Carrigan et al. 2020, `minimum` the provably shortest list
"""

import numpy as np
from jaxtyping import Bool, Float

from capture_plan.errors import RigError
from capture_plan.expressions.active import active_sets, performed_sets, skin_displacement
from capture_plan.expressions.colouring import largest_clique
from capture_plan.expressions.conflicts import maximal_sets
from capture_plan.expressions.importance import (
    LEAST,
    cosine_similarity,
    displacement_strength,
    triangle_distortion,
    uniqueness,
)
from capture_plan.expressions.minimum import minimum
from capture_plan.expressions.record import Expression, Packing
from capture_plan.expressions.sentences import sentence
from capture_plan.expressions.sequential import Weigh, sequential
from capture_plan.expressions.settings import PackingSettings
from capture_plan.expressions.together import driven, never_together, performed_together
from capture_plan.rig import Rig

Items = list[tuple[int, ...]]


def pack(
    rig: Rig, used: tuple[str, ...], settings: PackingSettings, *, target: Float[np.ndarray, "v 3"] | None = None
) -> Packing:
    """The expressions that show every blendshape of `used` once.

    `target` is the actor's neutral face on the same mesh, in any unit; without it there is no distortion to weigh.
    Raises RigError where the target has another number of vertices, or nothing is used.
    """
    if not used:
        raise RigError(f"{rig.name}: no blendshape moves the skin: nothing to pack into expressions")
    pairs = performed_together(rig, used) if settings.paired else ()
    items = _items(used, pairs)
    drivers = driven(rig, used) if settings.poseable else ()
    active = performed_sets(rig, used, settings.mu, drivers)
    exclusive = never_together(rig, used) if settings.poseable else ()
    sets = maximal_sets(_item_sets(used, items, active, exclusive))
    overlapping = maximal_sets(_item_sets(used, items, active, ()))
    clique = max(largest_clique(overlapping), largest_clique(sets), key=len)  # the plainer one of two equal ones
    worth = blendshape_importance(rig, used, settings, target)
    weigh = _weigh(rig, used, items, worth, settings.uniqueness)
    if settings.method == "minimum":
        order, bound = minimum(sets, weigh)
    else:
        order, bound = sequential(sets, weigh), len(clique)
    chosen = [sorted(k for i in expression for k in items[i]) for expression in order.expressions]
    shot = chosen[: settings.limit]
    done = {k for expression in shot for k in expression}
    return Packing(
        method=settings.method,
        expressions=_expressions(rig, used, shot, worth / worth.sum(), dict(drivers)),
        objective=len(chosen),
        bound=bound,
        proven_optimal=len(chosen) == bound,
        order_proven=order.proven,
        clique=tuple(used[items[i][0]] for i in clique),
        pairs=pairs,
        relaxed=(),
        exclusive=exclusive,
        drivers=drivers,
        left_out=tuple(name for k, name in enumerate(used) if k not in done),
    )


def blendshape_importance(
    rig: Rig, used: tuple[str, ...], settings: PackingSettings, target: Float[np.ndarray, "v 3"] | None
) -> Float[np.ndarray, " k"]:
    """lambda_k of eq. 4 without uniqueness, at least LEAST; alpha = 1 without a target."""
    active = active_sets(rig, used, settings.mu)
    strength = displacement_strength(skin_displacement(rig, used), active)
    if target is None:
        return np.maximum(strength, LEAST)
    if len(target) != len(rig.neutral):
        raise RigError(
            f"the target neutral has {len(target):,} vertices, {rig.name} has {len(rig.neutral):,}: "
            "bring the target onto the rig's mesh first"
        )
    distortion = triangle_distortion(rig.neutral, target, rig.triangles, active)
    return np.maximum((1 - settings.distortion) * strength + settings.distortion * distortion, LEAST)


def _items(used: tuple[str, ...], pairs: tuple[tuple[str, str], ...]) -> Items:
    partner = {used.index(a): used.index(b) for a, b in pairs}
    seconds = set(partner.values())
    return [(k, partner[k]) if k in partner else (k,) for k in range(len(used)) if k not in seconds]


def _item_sets(
    used: tuple[str, ...], items: Items, active: Bool[np.ndarray, "k v"], exclusive: tuple[tuple[str, str], ...]
) -> Bool[np.ndarray, "g n"]:
    """The active vertices of each item, and a made-up one for every two blendshapes that are never together."""
    of_item = {used[k]: i for i, item in enumerate(items) for k in item}
    made_up = np.zeros((len(items), len(exclusive)), dtype=bool)
    for column, (a, b) in enumerate(exclusive):
        made_up[[of_item[a], of_item[b]], column] = True
    return np.hstack([np.array([active[list(item)].any(axis=0) for item in items]), made_up])


def _weigh(rig: Rig, used: tuple[str, ...], items: Items, worth: Float[np.ndarray, " k"], beta: float) -> Weigh:
    """Importance of each item once some are packed: eq. 4 with its term for uniqueness."""
    belongs = np.zeros((len(items), len(used)))
    for i, item in enumerate(items):
        belongs[i, list(item)] = 1
    if beta == 0:
        fixed = belongs @ worth
        return lambda packed: fixed
    rows = [rig.names.index(name) for name in used]
    cosine = cosine_similarity(rig.deltas[rows][:, rig.skin])
    return lambda packed: belongs @ (worth + beta * uniqueness(cosine, packed.astype(float) @ belongs > 0))


def _expressions(
    rig: Rig, used: tuple[str, ...], chosen: list[list[int]], share: Float[np.ndarray, " k"], driver_of: dict[str, str]
) -> tuple[Expression, ...]:
    gain = np.array([share[expression].sum() for expression in chosen])
    covered = np.minimum(np.cumsum(gain), 1)
    names = [tuple(used[k] for k in expression) for expression in chosen]
    return tuple(
        Expression(
            name=f"E{number:02d}",
            blendshapes=names[number - 1],
            weights=(1.0,) * len(names[number - 1]),
            gain=round(float(gain[number - 1]), 6),
            covered=round(float(covered[number - 1]), 6),
            sentence=sentence(rig, names[number - 1]),
            drivers=tuple(driver_of[name] for name in names[number - 1] if name in driver_of),
        )
        for number in range(1, len(chosen) + 1)
    )
