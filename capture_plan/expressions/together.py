"""What a person can perform: which blendshapes go together, and which never do.

Together  left and right partners, from geometry (rig/pairs.py). Eyes are the exception: both eyes turned outwards is
          what no actor can do, both turned inwards few, so the left eye's outward look goes with the right eye's
          inward look. Those four blendshapes are known by their names
Never     expressions/data/exclusive.toml, by ARKit's names: closed and wide eyes, closed lips and bared teeth. Geometry
          cannot tell, since the active sets need not overlap. Rigs with other names have no such rules
"""

import tomllib
from functools import cache
from importlib.resources import files
from itertools import combinations

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


def driven(rig: Rig, used: tuple[str, ...]) -> tuple[tuple[str, str], ...]:
    """(corrective, what it corrects) among `used`: what cannot be performed for itself, as ARKit's mouthClose."""
    found = [finding.blendshapes for finding in correctives(rig, used)]
    return tuple((names[0], names[1]) for names in found if len(names) == 2)


def never_together(rig: Rig, used: tuple[str, ...]) -> tuple[tuple[str, str], ...]:
    """Pairs of `used` blendshapes that no face performs at once, in the order of `used`."""
    same_side, any_side = _rules()
    known = {name: arkit for name in used if (arkit := rig.arkit(name))}

    def never(a: str, b: str) -> bool:
        bases = frozenset((base_name(known[a]), base_name(known[b])))
        return bases in any_side or (bases in same_side and side_of(known[a]) == side_of(known[b]))

    return tuple((a, b) for a, b in combinations(known, 2) if never(a, b))


def base_name(arkit: str) -> str:
    """ARKit's name without the side of the face: 'eyeBlink', but 'jawLeft', which says where the jaw moves."""
    return arkit if arkit in DIRECTIONS else arkit.removesuffix("Left").removesuffix("Right")


@cache
def _rules() -> tuple[frozenset[frozenset[str]], frozenset[frozenset[str]]]:
    """Two ARKit names without side that exclude each other: on the same side of the face, and on any."""
    text = files("capture_plan.expressions").joinpath("data", "exclusive.toml").read_text("utf-8")
    table = tomllib.loads(text)
    same_side, any_side = (
        frozenset(frozenset((a, b)) for a, others in table[which].items() for b in others)
        for which in ("same_side", "any_side")
    )
    return same_side, any_side
