"""What a person can perform: which blendshapes go together, and which never do.

Together  left and right partners, from geometry (rig/pairs.py). Eyes are the exception: both eyes turned outwards is
          what no actor can do, both turned inwards few, so the left eye's look to one side goes with the right eye's
          look to the same side, by what turns (rig/gaze.py); one that has no such partner is performed alone
Never     rules (rules.py) by names that motion confirms (rig/meaning.py): closed and wide eyes, closed lips and bared
          teeth. Geometry cannot tell, since the active sets need not overlap. What a corrective needs counts too: who
          closes the lips over an open jaw cannot do what excludes an open jaw. Eyes never part, whatever the rules
"""

from itertools import combinations

from capture_plan.anatomy.blendshape_pairs import blendshape_pairs
from capture_plan.anatomy.delta_relations import correctives
from capture_plan.anatomy.gaze import Gaze, outwards, sideways
from capture_plan.anatomy.meaning import arkit_by_motion, base_name
from capture_plan.expressions.rules import Rules, default_rules
from capture_plan.names.arkit import side_of
from capture_plan.once import once
from capture_plan.rig import Rig


def performed_together(rig: Rig, used: tuple[str, ...]) -> tuple[tuple[str, str], ...]:
    """Pairs of `used` blendshapes, (of the left half, of the right half), in the order of the left ones in the rig."""
    looks = {name: gaze for name, gaze in sideways(rig).items() if name in used}
    halves = [pair for pair in blendshape_pairs(rig) if set(pair) <= set(used) and not set(pair) & looks.keys()]
    pairs = [*halves, *_same_way(looks)]
    return tuple(sorted(pairs, key=lambda pair: rig.names.index(pair[0])))


def _same_way(looks: dict[str, Gaze]) -> list[tuple[str, str]]:
    """(of the left eye, of the right eye) that turn to the same side; of several the ones alike in strength."""
    pairs = []
    for way in ("left", "right"):
        left, right = (
            sorted(
                (name for name in looks if (looks[name].eye, looks[name].way) == (eye, way)),
                key=lambda name: looks[name].strength,
            )
            for eye in (1, -1)
        )
        pairs += list(zip(left[::-1], right[::-1], strict=False))
    return pairs


def eyes_that_part(rig: Rig, used: tuple[str, ...]) -> tuple[tuple[str, str], ...]:
    """(left, right) of `used` that at once would turn both eyes outwards, which no face does."""
    out = {name: gaze.eye for name, gaze in sideways(rig).items() if name in used and outwards(gaze)}
    return tuple((a, b) for a in out for b in out if out[a] > out[b])


def driven(rig: Rig, used: tuple[str, ...], rules: Rules | None = None) -> tuple[tuple[str, str], ...]:
    """(corrective, what it corrects) among `used`: what cannot be performed for itself, as ARKit's mouthClose."""
    by_shape = _correctives(rig, used)
    needed = {(a, b) for a, others in (rules or default_rules()).requires.items() for b in others}
    calls = {name: _called(rig, name) for name in used}
    meant = {b: _meant(rig, used, b) for _, b in needed}
    by_rule = [
        (name, base)
        for name in used
        for base in used
        if name != base and any(a in calls[name] and base in meant[b] for a, b in needed)
    ]
    message = {name for name, _ in by_rule}  # a viseme that the shape speaks for would open the jaw a second time
    return tuple(dict.fromkeys([*(pair for pair in by_shape if pair[0] not in message), *by_rule]))


def _meant(rig: Rig, used: tuple[str, ...], call: str) -> tuple[str, ...]:
    """Blendshapes that a rule means by a call: those that bear the name, else what moves like it. The 'a' of a mouth
    opens the jaw too, and is not needed besides."""
    moving = tuple(name for name in used if call in _called(rig, name))
    bearing = [(name, arkit) for name in moving for arkit in (name, rig.arkit(name)) if arkit]
    return tuple(dict.fromkeys(name for name, own in bearing if call in (own, base_name(own)))) or moving


@once
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
    calls = {name: _called(rig, name) for name in used}
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
    calls = {name: _called(rig, name) for name in used}
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


def _called(rig: Rig, name: str) -> frozenset[str]:
    """What rules may call a blendshape: its own name, ARKit's, and ARKit's without side."""
    arkit = arkit_by_motion(rig, name)
    return frozenset({name, arkit, base_name(arkit)}) if arkit else frozenset({name})


def side_called(rig: Rig, name: str) -> str | None:
    """The side of the face that a blendshape's name tells."""
    return side_of(arkit_by_motion(rig, name) or name)


def _both_ways(table: dict[str, tuple[str, ...]]) -> set[frozenset[str]]:
    return {frozenset((a, b)) for a, others in table.items() for b in others}
