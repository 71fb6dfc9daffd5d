"""Findings on blendshapes that were exported wrongly: what is wrong with each, and what to export instead."""

import re

from capture_plan.anatomy.delta_relations import Finding
from capture_plan.anatomy.whole_head import slips
from capture_plan.face.misexported import SAYS, misexported
from capture_plan.rig.record import Rig

MISSING = re.compile("left out|not used")


def wrongly_exported(rig: Rig) -> list[Finding]:
    """One finding for each fault, for who made the rig."""
    findings = []
    for fault, words in SAYS.items():
        found = [one for one in misexported(rig) if one.fault == fault]
        if not found:
            continue
        names, several = tuple(one.name for one in found), len(found) > 1
        message = "; ".join(f"{one.name} {one.why}" for one in found)
        if several and all(one.why == words.one for one in found):
            message = f"{len(found)} blendshapes {words.several}: {', '.join(names)}"
        change = words.change_several if several else words.change
        until = "they are not planned" if several else "it is not planned"
        findings.append(Finding("export", names, message, f"{change} Until then {until}.", True, "stop"))
    return findings


def unread(rig: Rig) -> list[Finding]:
    """One finding for each thing that the file holds and that could not be read: it is missing from the plan."""
    asks = [sentence for sentence in rig.note.split("; ") if "export" in sentence and MISSING.search(sentence)]
    return [
        Finding("export", (), sentence, "What could not be read is not in the plan.", False, "rigger")
        for sentence in asks
    ]


def slipped(rig: Rig, used: tuple[str, ...]) -> list[Finding]:
    """A finding on blendshapes that carry the whole head along: every marker would seem to move with each of them."""
    far = dict(zip(used, slips(rig.neutral, rig.deltas[rig.rows(used)]).tolist(), strict=True))
    names = tuple(name for name in used if far[name])
    if not names:
        return []
    listing = ", ".join(f"{name} ({far[name]:.1f} mm)" for name in names)
    several = len(names) > 1
    message = f"the whole head goes along in {listing}"
    change = "Lay these heads onto the neutral's" if several else "Lay this head onto the neutral's"
    until = f"{change}, by what the face does not move. Until then markers seem to move that do not."
    return [Finding("export", names, message, until, False, "stop")]
