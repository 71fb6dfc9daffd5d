"""Findings on blendshapes that were exported wrongly: what is wrong with each, and what to export instead."""

import re

import numpy as np
from jaxtyping import Bool

from capture_plan.anatomy.agreement import agreed_meanings
from capture_plan.anatomy.delta_relations import Finding
from capture_plan.anatomy.meaning import other_ways
from capture_plan.anatomy.whole_head import slips
from capture_plan.face.anchors import Anchors
from capture_plan.face.misexported import SAYS, misexported
from capture_plan.face.reading import face_reading
from capture_plan.names.arkit import side_of
from capture_plan.rig.record import Rig

LIDS, CHIN, MOVES, UPWARDS = 0.3, 0.35, 0.1, 0.6  # pupil distances around; moved at least; share that goes up
CORNER = 0.15  # pupil distances around a mouth corner
LIFTS, ASIDE = 0.5, 0.25  # of the largest lift; sideways, of the lift itself: smiles 0.56 and more
FEW = 4
SIDEWAYS = re.compile("eyeLook(In|Out)(Left|Right)|(jaw|mouth)(Left|Right)")
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


def inverted(rig: Rig, used: tuple[str, ...], anchors: Anchors) -> list[Finding]:
    """Whether chin and lids go up where `used` blendshapes move them most: a jaw opens and a blink closes downwards,
    whatever blendshapes are called, so that the offsets were exported the wrong way round."""
    if not used or not {"eyes", "mouth"} <= set(anchors.found):
        return []
    x, u = rig.neutral, anchors.pupils
    eyes = np.stack([anchors.eye_left, anchors.eye_right])
    lids = rig.skin & (np.linalg.norm(x[:, None] - eyes, axis=2).min(axis=1) < LIDS * u)
    chin = rig.skin & (np.linalg.norm(x - anchors.chin, axis=1) < CHIN * u)
    most = [_largest(rig, used, part) for part in (chin, lids)]
    if not all(part.any() for part in (chin, lids)) or min(length for _, _, length in most) < MOVES * u:
        return []
    if any(up < UPWARDS * length for _, up, length in most):
        return []
    names = tuple(dict.fromkeys(name for name, _, _ in most))
    message = f"chin and lids go up where they move most ({', '.join(names)}): jaws open and lids close downwards"
    advice = "The offsets look inverted: export them from the neutral to each shape."
    return [Finding("export", names, message, advice, False, "stop")]


def mirrored(rig: Rig, used: tuple[str, ...], anchors: Anchors) -> list[Finding]:
    """Whether what moves is mirrored sideways against the neutral, or the neutral against it: mouth corners that go up
    go inwards, whatever blendshapes are called, and of their names either the ways or the sides are wrong, not both."""
    ways, turned = _that_say_a_way(rig, used), set(other_ways(rig))
    halves = [name for name in used if side_of(name) and name not in ways]
    wrong_sides = [name for name in halves if name in face_reading(rig).sides.disagree]
    wrong_ways = [name for name in ways if name in turned]
    both = 2 * len(wrong_ways) > len(ways), 2 * len(wrong_sides) > len(halves)
    if not ways or not halves or both[0] == both[1] or not _smiles_inwards(rig, used, anchors):
        return []
    names, what = (wrong_ways, "left and right, in and out") if both[0] else (wrong_sides, "sides")
    message = (
        f"lifted mouth corners go inwards, as no smile does, and {what} are exchanged in {len(names)} blendshapes "
        f"({', '.join(names[:FEW])}{', ...' if len(names) > FEW else ''}): what moves is mirrored against the neutral"
    )
    advice = "Export neutral and blendshapes with the same axes, x of one of them is turned over; the names are right."
    return [Finding("export", tuple(names), message, advice, False, "stop")]


def _that_say_a_way(rig: Rig, used: tuple[str, ...]) -> list[str]:
    """Blendshapes whose names say that an eye, a jaw or a mouth goes sideways."""
    meant = agreed_meanings(rig)
    return [name for name in used if (meaning := meant[name]) and any(map(SIDEWAYS.fullmatch, meaning.arkit))]


def _smiles_inwards(rig: Rig, used: tuple[str, ...], anchors: Anchors) -> bool:
    """Whether both mouth corners go inwards in the blendshapes that lift them most, and aside as well."""
    rows = rig.rows(used)
    for side, corner in ((1, anchors.corner_left), (-1, anchors.corner_right)):
        at = rig.skin & (np.linalg.norm(rig.neutral - corner, axis=1) < CORNER * anchors.pupils)
        d = rig.deltas[np.ix_(rows, at)].mean(axis=1) if at.any() else np.zeros((len(rows), 3))
        lifts = (d[:, 1] > LIFTS * d[:, 1].max()) & (np.abs(d[:, 0]) > ASIDE * d[:, 1])
        if side * d[lifts, 0].sum() >= 0:
            return False
    return True


def _largest(rig: Rig, used: tuple[str, ...], part: Bool[np.ndarray, " v"]) -> tuple[str, float, float]:
    """The blendshape that moves a part of the skin most, how far that goes up, and how far it goes, millimetres."""
    moved = np.where(part, rig.displacement[rig.rows(used)], 0)
    n, v = np.unravel_index(int(moved.argmax()), moved.shape)
    return used[n], float(rig.deltas[rig.names.index(used[n]), v, 1]), float(moved[n, v])


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
