"""Findings on blendshapes that are no expression of the face to scan: planned apart, and said."""

from capture_plan.anatomy import delta_relations
from capture_plan.anatomy.delta_relations import Finding
from capture_plan.anatomy.kinds import Kind
from capture_plan.anatomy.motion_kinds import MotionKind
from capture_plan.names.movements import movement_of

SURE = 0.5  # of what a name says
OF_THE_FACE = frozenset(("blink", "eye wide", "eye squint", "brow up", "brow down", "jaw open", "smile", "pucker"))

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
    return [_finding(one) for one in kinds if one.kind in FOUND and one.name not in said]


def _finding(one: Kind) -> Finding:
    """What is called a movement of the face, jaw or lids, and carries the whole head along is no head movement."""
    kind, advice = FOUND[one.kind]
    called = movement_of(one.name)
    if one.kind != "head movement" or called is None or called.kind not in OF_THE_FACE or called.confidence < SURE:
        return Finding(kind, (one.name,), f"{one.name} {one.why}", advice, True)
    message = f"{one.name} {one.why}, though it is named for a movement of the face"
    again = "Export it with the axes and at the place of the neutral. Until then it is not planned."
    return Finding("export", (one.name,), message, again, True, "stop")
