"""What a person performs with both halves of the face at once.

Left and right partners come from geometry (rig/pairs.py). Eyes are the exception: both eyes turned outwards is what no
actor can do, both turned inwards few, so the left eye's outward look goes with the right eye's inward look. Those four
blendshapes are known by their names.
"""

from capture_plan.rig import Rig
from capture_plan.rig.names import arkit_name
from capture_plan.rig.pairs import blendshape_pairs

LOOK_LEFT = ("eyeLookOutLeft", "eyeLookInRight")
LOOK_RIGHT = ("eyeLookInLeft", "eyeLookOutRight")


def performed_together(rig: Rig, used: tuple[str, ...]) -> tuple[tuple[str, str], ...]:
    """Pairs of `used` blendshapes, (of the left half, of the right half), in the order of the left ones in the rig."""
    pairs = [pair for pair in blendshape_pairs(rig) if set(pair) <= set(used)]
    named = {arkit_name(name): name for pair in pairs for name in pair}
    if not {*LOOK_LEFT, *LOOK_RIGHT} <= named.keys():
        return tuple(pairs)
    right_of = {left: right for left, right in pairs} | {
        named[left]: named[right] for left, right in (LOOK_LEFT, LOOK_RIGHT)
    }
    return tuple((left, right_of[left]) for left, _ in pairs)
