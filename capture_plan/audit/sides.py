"""What can be wrong between the left and the right of a rig: partners, the midline they share, names, symmetry.

Data     pairs          left and right halves of one movement, from geometry (`blendshape_pairs.py`)
         b[k, v]        vertex v of the skin moves by at least ACTIVE of the largest displacement of blendshape k
Partner  a sided blendshape without a mirror image, or halves that mirror each other poorly
Overlap  |b[i] & b[j]| over the smaller of |b[i]|, |b[j]|: where it is large, one expression shows the sum of both
Name     names that say another side or another partner than the geometry (`symmetry.py`), or another way (`meaning.py`)
"""

import numpy as np

from capture_plan.anatomy.blendshape_pairs import ACTIVE, blendshape_pairs, other_names
from capture_plan.anatomy.delta_relations import Finding
from capture_plan.anatomy.meaning import other_ways
from capture_plan.anatomy.symmetry import SymmetryReport, pair_disagreements
from capture_plan.face.misexported import misexported
from capture_plan.face.reading import face_reading
from capture_plan.face.sense import contradicted
from capture_plan.mesh.mirror import mirror_error
from capture_plan.names.arkit import side_of
from capture_plan.rig.record import Rig

NEARLY_ALL = 0.8  # of the sided blendshapes: some lie so near the middle that they mirror each other
HALF = 6  # sided blendshapes of one side: a character that winks with one eye has two or three
POOR_PERCENT = 25.0  # of the displacement: the left smile moves unlike the right one
SHARED = 0.2  # of the smaller half: beyond it the two are hard to tell apart in one expression
ONE_SIDE = 0.5  # pupil distances that 5 % of the skin is off: lopsided heads have up to 0.25, a half face 0.9
WHOLE_FACE = "Export the whole face with the blendshapes of both sides: markers are planned for both."
CROOKED_MM = 2.0  # a quarter of the usual spacing of markers


def partners(rig: Rig, used: tuple[str, ...], symmetry: SymmetryReport) -> list[Finding]:
    """Used blendshapes without a mirror image in the rig (their own included), and pairs that mirror poorly."""
    image = {one.blendshape: one for one in symmetry.blendshapes}
    pairs, wrong = blendshape_pairs(rig), {one.name for one in misexported(rig)}
    half = one_half([name for name in used if side_of(name) and image[name].partner is None], used)
    findings = [half] if half else []
    for name in () if half else used:
        if image[name].partner is None and wrong.isdisjoint(other_names(name)):
            sided = f"{name} has no partner on the other side"
            what = sided if side_of(name) else f"{name} is lopsided and has no mirror image"
            message = f"{what}: pairs and symmetric poses pass it by"
            advice = "Add its mirror image to the rig, or leave it: it is planned on its own."
            findings.append(Finding("partner", (name,), message, advice, False, "rigger"))
    for left, right in pairs:
        differs = max(image[left].percent, image[right].percent)
        if {left, right} <= set(used) and differs > POOR_PERCENT:
            message = f"{left} and {right} differ by {differs:.0f} % of their movement when mirrored"
            advice = "Mirror the better one if this is not meant; both are planned as they are."
            findings.append(Finding("partner", (left, right), message, advice, False, "rigger"))
    return findings


def one_half(alone: list[str], used: tuple[str, ...]) -> Finding | None:
    """That nearly all sided blendshapes are `alone`, without partners, and of one side; None where they are not."""
    sided, sides = [name for name in used if side_of(name)], {side_of(name) for name in alone}
    if len(alone) < max(HALF, NEARLY_ALL * len(sided)) or len(sides) > 1:
        return None
    message = (
        f"{len(alone)} of {len(sided)} sided blendshapes have no partner, and all of these are of the {sides.pop()} "
        f"({', '.join(alone[:3])}, ...): this is half a face, or half of its blendshapes"
    )
    return Finding("partner", tuple(alone), message, WHOLE_FACE, False, "rigger")


def overlaps(rig: Rig, used: tuple[str, ...]) -> list[Finding]:
    """Left and right halves that move the same skin around the midline (Carrigan et al. 2020 allow it in a pair)."""
    lengths = {name: rig.displacement[k, rig.skin] for k, name in enumerate(rig.names) if name in used}
    active = {name: length >= ACTIVE * length.max() for name, length in lengths.items()}
    messages, involved = [], []
    for left, right in blendshape_pairs(rig):
        if {left, right} <= set(used):
            both = (active[left] & active[right]).sum() / min(active[left].sum(), active[right].sum())
            if both > SHARED:
                messages.append(f"{left} and {right} ({100 * both:.0f} %)")
                involved += [left, right]
    if not messages:
        return []
    message = f"these halves share much of the skin that they move, as a part of the smaller: {', '.join(messages)}"
    advice = "In an expression that shows both, the scan holds their sum. Shoot them one at a time too, if both matter."
    return [Finding("overlap", tuple(involved), message, advice, False)]


def misnamed(rig: Rig, symmetry: SymmetryReport) -> list[Finding]:
    """Names that say another side, or another partner, than what moves."""
    silent = {one.name for one in misexported(rig)} | {name for name, _ in rig.meanings}
    found = [
        one
        for one in pair_disagreements(rig, symmetry.blendshapes)
        if silent.isdisjoint((one.blendshape, *other_names(one.blendshape)))
    ]
    turned = {one.blendshape for one in found if f"is called {side_of(one.blendshape)} and moves" in one.words}
    alone = set(face_reading(rig).sides.disagree) - set(other_ways(rig)) - silent  # those without a partner too
    names = tuple(name for name in rig.names if name in turned or (name in alone and side_of(name)))
    others = [one for one in found if one.blendshape not in turned]
    findings = []
    if names:
        halves = {name for pair in blendshape_pairs(rig) for name in pair}
        sided = [name for name in rig.names if side_of(name) and (name in halves or name in names)]
        every = f"{'all' if len(names) == len(sided) else f'{len(names)} of {len(sided)}'} sided blendshapes"
        message = f"{every} move the other side than their names say: {', '.join(names)}"
        advice = "Exchange left and right in these names (the subject's own sides). The plan goes by what moves."
        findings.append(_to_exchange(rig, names, message, advice))
    findings += _turned(rig)
    if others:
        listing = "; ".join(one.words for one in others)
        advice = "Rename them if the shapes are right. The plan pairs them by what moves."
        findings.append(Finding("name", tuple(one.blendshape for one in others), listing, advice, False))
    return findings


def _turned(rig: Rig) -> list[Finding]:
    """Eyes, jaws and mouths that go the other way than their names say."""
    ways = {name: " and ".join(sorted(pair)).lower() for name, pair in other_ways(rig).items()}
    findings = []
    for both in dict.fromkeys(ways.values()):
        two = "up and down" if both == "down and up" else both
        names = tuple(name for name, found in ways.items() if found == both)
        go = "goes the other way than its name says" if len(names) == 1 else "go the other way than their names say"
        message = f"{', '.join(names)} {go}: {two} are exchanged"
        advice = f"Exchange {two} in these names (the subject's own sides). The plan goes by what moves."
        findings.append(_to_exchange(rig, names, message, advice))
    return findings


def _to_exchange(rig: Rig, names: tuple[str, ...], message: str, advice: str) -> Finding:
    """Names to exchange; nobody has to where it is not certain how the head lies."""
    lies = face_reading(rig).axes.sure and not contradicted(rig)
    if not lies:
        advice = "Settle first how the head lies: where it was read wrong, the names may be right."
    return Finding("name", names, message, advice, False, "rigger" if lies else "know")


def two_sides(rig: Rig, symmetry: SymmetryReport, pupils_mm: float) -> bool:
    """Whether the skin, or the mesh that it is a part of, has two sides that answer each other at all: without them
    there are no partners to speak of."""
    most = ONE_SIDE * pupils_mm
    return symmetry.neutral_p95_mm <= most or bool(np.percentile(mirror_error(rig.neutral), 95) <= most)


def crooked(symmetry: SymmetryReport, *, whole: bool) -> list[Finding]:
    """A neutral whose sides differ, or that has but one of them where it is not `whole`."""
    if symmetry.neutral_p95_mm <= CROOKED_MM:
        return []
    message = (
        f"the neutral is not symmetric: 5 % of the skin is more than {symmetry.neutral_p95_mm:.1f} mm "
        "from its mirror image"
    )
    if not whole:
        return [Finding("geometry", (), f"{message}: this may be half a face", WHOLE_FACE, False, "rigger")]
    return [Finding("geometry", (), message, "Plan with symmetric markers switched off, or symmetrise it.", False)]
