"""Findings on blendshapes that are no expression of the face to scan: planned apart, and said."""

from capture_plan.rig.findings import Finding
from capture_plan.rig.kinds import Kind

ADVICE = {
    "head movement": "Film it with the head's own markers if the character needs it; no scan of the face shows more.",
    "not of the face": "Capture or animate it without the face's markers, if the character needs it.",
    "calls others": "Scan its parts and mix them; to see the mix itself, ask for it as an extra take.",
}


def apart_findings(kinds: tuple[Kind, ...], said: tuple[str, ...]) -> list[Finding]:
    """One finding for each blendshape that is planned apart, but for those that are `said` already."""
    return [
        Finding(one.kind, (one.name,), f"{one.name} {one.why}", ADVICE[one.kind], True)
        for one in kinds
        if one.kind in ADVICE and one.name not in said
    ]
