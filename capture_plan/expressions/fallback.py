"""What to shoot instead where an actor cannot do an expression: two simpler ones that show the same blendshapes.

Items      left/right partners, what one phrase says, and a corrective with what it corrects stay together
Choice     of all ways to split the items in two the first by: fewest halves whose surfaces collide; fewest items on the
           wrong side of the line between eyes and mouth; the easier of the two hardest halves; halves of like size
"""

from collections.abc import Iterator
from functools import cache
from itertools import product

import numpy as np
from jaxtyping import Bool
from msgspec import Struct

from capture_plan.expressions.collision import collisions
from capture_plan.expressions.compatibility import driven
from capture_plan.expressions.difficulty import difficulty
from capture_plan.expressions.groups import grouped
from capture_plan.expressions.movement import regions_of
from capture_plan.expressions.record import Expression
from capture_plan.expressions.sentences import sentence
from capture_plan.rig import Rig

UPPER = ("brow", "forehead", "temple", "upper eyelid", "lower eyelid", "scalp", "ear")
MOST_ITEMS = 8  # 254 ways to split; expressions of more are split between eyes and mouth, or in order


class ItemPart(Struct, frozen=True, forbid_unknown_fields=True):
    """Half of an expression, named after it (`E07a`), with what is held besides and what the actor is told."""

    name: str
    blendshapes: tuple[str, ...]
    drivers: tuple[str, ...]
    sentence: str

    @property
    def pose(self) -> dict[str, float]:
        """The weight of every blendshape that is not at rest."""
        return dict.fromkeys(self.blendshapes + self.drivers, 1.0)


def fallback(rig: Rig, used: tuple[str, ...], expression: Expression) -> tuple[ItemPart, ...]:
    """Two simpler expressions in place of one, brows and eyes first; none where it is one movement already."""
    items = grouped(rig, expression.blendshapes)
    if len(items) < 2:
        return ()
    upper = np.array([is_upper(rig, item) for item in items])
    driver_of = dict(driven(rig, used)) if expression.drivers else {}

    def halves(first: Bool[np.ndarray, " i"]) -> list[tuple[str, ...]]:
        return [tuple(n for item, of in zip(items, first == half, strict=True) if of for n in item) for half in (1, 0)]

    def held(names: tuple[str, ...]) -> tuple[str, ...]:
        return tuple(dict.fromkeys(driver_of[name] for name in names if name in driver_of))

    @cache
    def trouble(names: tuple[str, ...]) -> tuple[bool, int]:
        every = names + held(names)
        return bool(collisions(rig, dict.fromkeys(every, 1.0))), difficulty(rig, every).level

    def badness(first: Bool[np.ndarray, " i"]) -> tuple[int, int, int, int]:
        colliding, hard = zip(*(trouble(half) for half in halves(first)), strict=True)
        misplaced = int((first != upper).sum()) if upper.any() and not upper.all() else 0
        return sum(colliding), misplaced, max(hard), abs(2 * int(first.sum()) - len(first))

    best = halves(min(_splits(upper), key=badness))
    return tuple(
        ItemPart(expression.name + letter, names, held(names), sentence(rig, names))
        for names, letter in zip(best, "ab", strict=True)
    )


def is_upper(rig: Rig, item: tuple[str, ...]) -> bool:
    """Whether a movement is that of brows and eyes rather than of nose, cheeks and mouth, by its squared length."""
    regions = regions_of(rig)
    squared = (rig.displacement[rig.rows(item)] ** 2).sum(axis=0) * rig.skin
    of_upper = np.isin(regions.of_vertex, [regions.names.index(name) for name in UPPER])
    return bool(squared[of_upper].sum() > squared[~of_upper].sum())


def _splits(upper: Bool[np.ndarray, " i"]) -> Iterator[Bool[np.ndarray, " i"]]:
    """Ways to choose a first half that is neither empty nor everything."""
    if len(upper) > MOST_ITEMS:
        yield upper if upper.any() and not upper.all() else np.arange(len(upper)) < len(upper) / 2
        return
    for chosen in product((True, False), repeat=len(upper)):
        if any(chosen) and not all(chosen):
            yield np.array(chosen)
