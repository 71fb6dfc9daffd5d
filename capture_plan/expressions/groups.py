"""Which blendshapes of an expression people make as one movement.

One movement   left and right partners, and what one phrase says of several, as both lips rolled in; whatever hangs
               together by these
"""

from functools import cache

from capture_plan.anatomy.meaning import arkit_by_motion, base_name
from capture_plan.expressions.compatibility import performed_together
from capture_plan.expressions.sentences import phrases
from capture_plan.once import once
from capture_plan.rig import Rig

Group = tuple[str, ...]


def grouped(rig: Rig, names: tuple[str, ...]) -> tuple[Group, ...]:
    """`names` sorted into movements, in the order of their first blendshapes."""
    partner = dict(pairs_of(rig))
    groups: list[Group] = []
    for name in names:
        mine = [group for group in groups if any(_one(rig, partner, name, other) for other in group)]
        rest = [group for group in groups if group not in mine]
        groups = [*rest, (*(other for group in mine for other in group), name)]
    place = {name: number for number, name in enumerate(names)}
    return tuple(sorted((tuple(sorted(group, key=place.__getitem__)) for group in groups), key=lambda g: place[g[0]]))


def said_as_one(rig: Rig, names: Group) -> bool:
    """Whether these blendshapes have one phrase in common, whatever their side."""
    of = _bases(rig)
    bases = {of[name] for name in names}
    return len(bases) > 1 and any(bases <= merged for merged in _merged())


@once
def _bases(rig: Rig) -> dict[str, str]:
    """What each blendshape of a rig does, without its side; its name where that is not known."""
    return {name: base_name(arkit) if (arkit := arkit_by_motion(rig, name)) else name for name in rig.names}


@cache
def _merged() -> tuple[frozenset[str], ...]:
    """What each phrase says at once, without sides."""
    return tuple(frozenset(base_name(name) for name in merged) for merged, _ in phrases()[1])


@once
def pairs_of(rig: Rig) -> tuple[tuple[str, str], ...]:
    """Left and right partners of a rig, found once."""
    return performed_together(rig, rig.names)


def _one(rig: Rig, partner: dict[str, str], a: str, b: str) -> bool:
    return partner.get(a) == b or partner.get(b) == a or said_as_one(rig, (a, b))
