"""Whether what a plan was made from makes sense: recomputed on the rig, whoever said how it lies and how large it is.

Asked    of the rig      how it lies, its sides, its size (`face/sense.py`)
         of the markers  most are seen from the front; left ones lie on the left; a marker's region is one that the
                         blendshape moves which moves it most
Each claim that fails says what to correct, by what the person stated when the plan was made (`advice.py`).
"""

from dataclasses import replace

import numpy as np

from capture_plan.anatomy.regions import UNNAMED
from capture_plan.face.anchors import face_anchors
from capture_plan.face.of_rig import rig_channels
from capture_plan.face.sense import CONTRADICTED, Sense, kinds_of, looks_forward, pose_senses, side_senses
from capture_plan.face.sense_size import size_sense
from capture_plan.face.votes import BROWS, EYES, MOUTH, names_agree
from capture_plan.layout.record import Landmark
from capture_plan.layout.sites import STILL
from capture_plan.mesh.mirror import mirror_plane
from capture_plan.plan.advice import corrections
from capture_plan.plan.claims import Claim
from capture_plan.plan.record import Plan
from capture_plan.rig import Rig

SAME_MM = 0.5  # between two readings of one rig: what another machine's rounding may do
MISPLACED = 0.1  # of the markers whose region and motion may disagree: a lip dragged along by a cheek
GAZE = ("gaze up", "gaze down", "gaze left", "gaze right", "gaze in", "gaze out")
BELOW = frozenset(("upper lip", "lower lip", "mouth corner", "chin", "jaw", "neck"))
ABOVE = frozenset(("forehead", "brow", "upper eyelid", "scalp"))
# What moves a marker most, and the regions that it then cannot lie in.
NEVER_IN = (
    (("jaw open", *MOUTH), ABOVE),
    ((*EYES, *GAZE), BELOW),
    (BROWS, BELOW | {"cheek"}),
)
TELLING = 8  # facial blendshapes: where fewer are, a lid may well move most with the jaw


def reading_claims(plan: Plan, rig: Rig) -> list[Claim]:
    """Every claim about how the rig was understood."""
    senses = (
        *pose_senses(rig),
        *side_senses(rig),
        size_sense(rig),
        *_markers_forward(plan, rig),
        *_markers_sided(plan, rig),
        *_regions_moved(plan, rig),
    )
    senses = _heard(senses)
    mends = corrections(plan.rig, rig, senses)
    return [Claim(sense.what, sense.holds, sense.found, mend) for sense, mend in zip(senses, mends, strict=True)]


def _heard(senses: tuple[Sense, ...]) -> tuple[Sense, ...]:
    """The questions with a single one of how the head lies overruled by all others, as an audit does: a muzzle may look
    down, a stylised jaw forward."""
    against = [sense for sense in senses if sense.about == "axes" and not sense.holds]
    if len(against) >= CONTRADICTED:
        return senses
    agreeing = sum(sense.about == "axes" and sense.holds for sense in senses)
    message = f"; {agreeing} other signs agree with how it lies"
    return tuple(
        replace(one, holds=True, found=one.found + message) if one in against and agreeing >= CONTRADICTED else one
        for one in senses
    )


def _markers_forward(plan: Plan, rig: Rig) -> list[Sense]:
    """Most landmarks look forward; head markers sit on temples and do not."""
    which = np.zeros(len(rig.neutral), dtype=bool)
    which[[m.vertex for m in plan.layout.landmarks]] = True
    return looks_forward(rig, which, "the markers")


def _markers_sided(plan: Plan, rig: Rig) -> list[Sense]:
    """Markers that are called left lie on the subject's left."""
    middle = mirror_plane(rig.neutral[rig.skin])
    sided = [m for m in plan.layout.markers if m.side != "middle"]
    wrong = [m.name for m in sided if (rig.neutral[m.vertex, 0] > middle) != (m.side == "left")]
    found = f"{len(sided) - len(wrong)} of {len(sided)}" + (f", not {', '.join(wrong)}" if wrong else "")
    return [Sense("markers called left lie on the subject's left", not wrong, found, "plan")]


def _regions_moved(plan: Plan, rig: Rig) -> list[Sense]:
    """No marker lies in a region that what moves it most cannot belong to."""
    named = [m for m in plan.layout.landmarks if m.region != UNNAMED]
    if not named or rig_channels(rig).facial.sum() < TELLING:
        return []
    strongest = strongest_kinds(plan, rig, named)
    wrong = [
        f"{m.name} {m.label} moves most with {blendshape}"
        for m, (blendshape, kind) in zip(named, strongest, strict=True)
        if any(kind in kinds and m.region in regions for kinds, regions in NEVER_IN)
    ]
    asked = sum(kind is not None for _, kind in strongest)
    if not asked:
        return []
    found = f"{asked - len(wrong)} of {asked} are" + (f"; {'; '.join(wrong)}" if wrong else "")
    holds = len(wrong) <= max(1, MISPLACED * asked)
    return [Sense("markers are called by regions that move as they do", holds, found, "regions")]


def strongest_kinds(plan: Plan, rig: Rig, markers: list[Landmark]) -> list[tuple[str, str | None]]:
    """For each marker the blendshape that moves it furthest, and the kind of that: by its name, else the jaw by its
    motion; no kind for a marker that none of them moves."""
    rows = [rig.names.index(name) for name in plan.audit.used]
    kinds = kinds_of(rig) if names_agree(rig_channels(rig)) else (None,) * len(rig.names)
    jaw = largest_downward(rig)
    messages = []
    for m in markers:
        k = rows[int(rig.displacement[rows, m.vertex].argmax())]
        kind = kinds[k]
        moves = rig.displacement[k, m.vertex] > STILL * rig.displacement[rows].max()  # its mirror image alone may
        messages.append((rig.names[k], (kind.kind if kind else "jaw open" if k == jaw else None) if moves else None))
    return messages


def largest_downward(rig: Rig) -> int | None:
    """The blendshape that moves most skin most, where that goes down below the middle of eyes and mouth: the jaw's, on
    a whole face. On a drawn one, lids may move most of all."""
    channels = rig_channels(rig)
    if channels.facial.sum() < 8:
        return None
    squared = np.where(channels.facial, (rig.displacement**2 * rig.skin).sum(axis=1), 0)
    k = int(squared.argmax())
    if channels.centre[k, 1] > face_anchors(rig).between_y:
        return None
    return k if channels.direction[k, 1] < -np.abs(channels.direction[k, 0]) else None
