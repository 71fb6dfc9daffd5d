"""Findings on blendshapes that are no expression of the face to scan: planned apart, and said."""

from capture_plan.anatomy import delta_relations
from capture_plan.anatomy.delta_relations import Finding
from capture_plan.anatomy.kinds import Kind
from capture_plan.anatomy.motion_kinds import MotionKind

FOUND: dict[MotionKind, tuple[delta_relations.FindingKind, str]] = {
    "head movement": (
        "head",
        "Film it with the head's own markers if the character needs it; no scan of the face shows more.",
    ),
    "not of the face": ("elsewhere", "Capture or animate it without the face's markers, if the character needs it."),
    "calls others": ("calls", "Scan its parts and mix them; to see the mix itself, ask for it as an extra take."),
}


def apart_findings(kinds: tuple[Kind, ...], said: set[str]) -> list[Finding]:
    """One finding for each blendshape that is planned apart, but for those of which it is `said` already."""
    return [
        Finding(FOUND[one.kind][0], (one.name,), f"{one.name} {one.why}", FOUND[one.kind][1], True)
        for one in kinds
        if one.kind in FOUND and one.name not in said
    ]
