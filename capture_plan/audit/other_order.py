"""Names that belong to other shapes: a list of names in another order than the blendshapes.

Doubts    names whose shapes do something else (`agreement.py`): one or two on a rig are slips, many are another list
Moved on  the same names, each for the blendshape before it or behind it: where hardly any doubt is left, that is why
"""

from dataclasses import replace

from capture_plan.anatomy.agreement import agreed_meanings, name_doubts
from capture_plan.anatomy.delta_relations import Finding
from capture_plan.rig.record import Rig

FEWEST, SHARE = 5, 0.15  # doubts, and of the names that say a movement: 19 rigs of the field have 1 at most
SETTLED = 0.3  # of the doubts are left where the names are moved on as they should be
FEW = 3


def other_order(rig: Rig, used: tuple[str, ...]) -> list[Finding]:
    """A finding where the names of so many `used` blendshapes do not fit that they belong to others; else none."""
    doubts = [one for one in name_doubts(rig) if one.name in used]
    said = sum(agreed_meanings(rig)[name] is not None for name in used) + len(doubts)
    if len(doubts) < max(FEWEST, SHARE * said):
        return []
    names, examples = (
        tuple(one.name for one in doubts),
        "; ".join(one.message.partition(":")[0] for one in doubts[:FEW]),
    )
    message = f"{len(doubts)} of {said} names do not say what their shapes do ({examples}; ...)"
    advice = f"Give the names in the order of the shapes{moved_on(rig, len(doubts))}. Until then no name is certain."
    return [Finding("name", names, f"{message}: names and shapes do not belong together", advice, False, "stop")]


def moved_on(rig: Rig, doubts: int) -> str:
    """That each name fits the blendshape before it, or the one behind it, where hardly a doubt is left then."""
    ways = {"behind": rig.names[-1:] + rig.names[:-1], "before": rig.names[1:] + rig.names[:1]}
    for way, names in ways.items():
        if len(name_doubts(replace(rig, names=names))) < SETTLED * doubts:
            return f": each fits the blendshape {way} its own"
    return ""
