"""What a person can perform: which blendshapes go together, and which never do.

Together  left and right partners, from geometry (rig/pairs.py). Eyes are the exception: both eyes turned outwards is
          what no actor can do, both turned inwards few, so the left eye's outward look goes with the right eye's
          inward look. Those four blendshapes are known by their names
Never     rules (rules.py) by names: closed and wide eyes, closed lips and bared teeth. Geometry cannot tell, since the
          active sets need not overlap. What a corrective needs counts too: who closes the lips over an open jaw cannot
          do what excludes an open jaw. ARKit's names are known in any spelling, so that most rigs have these rules
"""

from functools import lru_cache
from itertools import combinations

from capture_plan.expressions.rules import Rules, default_rules
from capture_plan.rig import Rig
from capture_plan.rig.findings import correctives
from capture_plan.rig.names import side_of
from capture_plan.rig.pairs import blendshape_pairs

LOOK_LEFT = ("eyeLookOutLeft", "eyeLookInRight")
LOOK_RIGHT = ("eyeLookInLeft", "eyeLookOutRight")
DIRECTIONS = ("jawLeft", "jawRight", "mouthLeft", "mouthRight")  # no side of the face


def performed_together(rig: Rig, used: tuple[str, ...]) -> tuple[tuple[str, str], ...]:
    """Pairs of `used` blendshapes, (of the left half, of the right half), in the order of the left ones in the rig."""
    pairs = [pair for pair in blendshape_pairs(rig) if set(pair) <= set(used)]
    named = {rig.arkit(name): name for pair in pairs for name in pair}
    if not {*LOOK_LEFT, *LOOK_RIGHT} <= named.keys():
        return tuple(pairs)
    right_of = {left: right for left, right in pairs} | {
        named[left]: named[right] for left, right in (LOOK_LEFT, LOOK_RIGHT)
    }
    return tuple((left, right_of[left]) for left, _ in pairs)


def driven(rig: Rig, used: tuple[str, ...], rules: Rules | None = None) -> tuple[tuple[str, str], ...]:
    """(corrective, what it corrects) among `used`: what cannot be performed for itself, as ARKit's mouthClose."""
    by_shape = _correctives(rig, used)
    needed = {(a, b) for a, others in (rules or default_rules()).requires.items() for b in others}
    calls = {name: called(rig, name) for name in used}
    by_rule = [
        (name, base)
        for name in used
        for base in used
        if name != base and any(a in calls[name] and b in calls[base] for a, b in needed)
    ]
    return tuple(dict.fromkeys([*by_shape, *by_rule]))


@lru_cache(maxsize=8)  # every edit of a list asks again
def _correctives(rig: Rig, used: tuple[str, ...]) -> tuple[tuple[str, str], ...]:
    found = [finding.blendshapes for finding in correctives(rig, used)]
    return tuple((names[0], names[1]) for names in found if len(names) == 2)


def bases_of(blendshapes: tuple[str, ...], drivers: tuple[tuple[str, str], ...]) -> tuple[str, ...]:
    """What is held at full weight besides, each once, in the order of those that need it."""
    return tuple(dict.fromkeys(base for name in blendshapes for of, base in drivers if of == name))


def never_together(rig: Rig, used: tuple[str, ...], rules: Rules | None = None) -> tuple[tuple[str, str], ...]:
    """Pairs of `used` blendshapes that no face performs at once, in the order of `used`."""
    rules = rules or default_rules()
    same_side, any_side = _both_ways(rules.same_side), _both_ways(rules.any_side)
    calls = {name: called(rig, name) for name in used}
    side = {name: side_called(rig, name) for name in used}
    needs = {name: [name] for name in used}
    for name, base in driven(rig, used, rules):
        needs[name].append(base)

    def excluded(a: str, b: str) -> bool:
        said = {frozenset((i, j)) for i in calls[a] for j in calls[b]}
        return bool(said & any_side) or (bool(said & same_side) and side[a] == side[b])

    return tuple(
        (a, b) for a, b in combinations(used, 2) if any(excluded(i, j) for i in needs[a] for j in needs[b] if i != j)
    )


def hard_together(rig: Rig, used: tuple[str, ...], rules: Rules | None = None) -> tuple[tuple[str, str, int], ...]:
    """(a, b, cost) for pairs of `used` blendshapes that are hard to perform at once; the dearest where several tell."""
    calls = {name: called(rig, name) for name in used}
    costs = {
        (a, b): [
            hard.cost
            for hard in (rules or default_rules()).hard
            for one, other in (hard.names, hard.names[::-1])
            if one in calls[a] and other in calls[b]
        ]
        for a, b in combinations(used, 2)
    }
    return tuple((a, b, max(found)) for (a, b), found in costs.items() if found)


def groups(names: tuple[str, ...], links: list[tuple[str, ...]]) -> list[tuple[str, ...]]:
    """Names that are linked, directly or by others, as groups in the order of their first member."""
    group_of = {name: {name} for name in names}
    for link in links:
        merged = set[str]().union(*(group_of[name] for name in link if name in group_of))
        for name in merged:
            group_of[name] = merged
    unique = {id(group): group for group in group_of.values()}
    return [tuple(name for name in names if name in group) for group in unique.values()]


def called(rig: Rig, name: str) -> frozenset[str]:
    """What rules may call a blendshape: its own name, ARKit's, and ARKit's without side."""
    arkit = rig.arkit(name)
    return frozenset({name, arkit, base_name(arkit)}) if arkit else frozenset({name})


def side_called(rig: Rig, name: str) -> str | None:
    """The side of the face that a blendshape's name tells."""
    return side_of(rig.arkit(name) or name)


def base_name(arkit: str) -> str:
    """ARKit's name without the side of the face: 'eyeBlink', but 'jawLeft', which says where the jaw moves."""
    return arkit if arkit in DIRECTIONS else arkit.removesuffix("Left").removesuffix("Right")


def _both_ways(table: dict[str, tuple[str, ...]]) -> set[frozenset[str]]:
    return {frozenset((a, b)) for a, others in table.items() for b in others}
