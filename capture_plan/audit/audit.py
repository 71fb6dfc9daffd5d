"""The audit: what is in a rig, what is wrong with it, and which blendshapes are left out of the plan and why.

A blendshape is left out only where it truly cannot be planned: it moves nothing, no skin, less than a marker's noise,
or exactly what another one moves. Everything else is planned, and what is odd about it is said (`findings*.py`).
`report.py` has the page that a person reads.
"""

import numpy as np
from jaxtyping import Float
from msgspec import Struct

from capture_plan.anatomy.agreement import agreed_meanings, misleading
from capture_plan.anatomy.blendshape_pairs import blendshape_pairs
from capture_plan.anatomy.delta_relations import (
    DEPENDENT,
    Finding,
    correctives,
    dependent,
    duplicates,
    motionless,
    opposites,
)
from capture_plan.anatomy.kinds import Kind, expression_kinds, set_apart
from capture_plan.anatomy.meaning import arkit_by_motion
from capture_plan.anatomy.symmetry import SymmetryReport, symmetry_report
from capture_plan.audit.apart import apart_findings
from capture_plan.audit.bare import bare
from capture_plan.audit.exported import inverted, mirrored, slipped, unread, wrongly_exported
from capture_plan.audit.mesh import fine, flown, holes, open_lips, shut_lids, sizes, untidy, weak, windings
from capture_plan.audit.occluders import covers
from capture_plan.audit.other_order import other_order
from capture_plan.audit.sides import crooked, misnamed, overlaps, partners, two_sides
from capture_plan.face.anchors import face_anchors, interpupillary
from capture_plan.face.facts import ReadingFacts, reading_facts
from capture_plan.names.recognise import Recognised, recognise
from capture_plan.rig.record import Rig

__all__ = ["Audit", "BlendshapeFacts", "Finding", "Symmetry", "audit_rig"]

NOTHING = ("", "", "", 0.0)  # standard, meaning, words and confidence of a name that follows none


class BlendshapeFacts(Struct, frozen=True, forbid_unknown_fields=True):
    """One blendshape: what its name means and by which standard, how far it moves the skin, its mirror image.

    `words` say the side and the way that it moves, whatever the name says. `standard` and `meaning` are empty where the
    name follows none; `mirror` is the blendshape that comes nearest to its mirror image (itself where it moves both
    sides alike, none where nothing comes near) and `off_percent` by how much of their length the two differ.
    """

    name: str
    standard: str
    meaning: str
    words: str
    confidence: float
    skin_mm: float
    mirror: str | None
    off_percent: float


class Symmetry(Struct, frozen=True, forbid_unknown_fields=True):
    """How far the skin is from its mirror image in the neutral, millimetres, and how the mirror plane is turned."""

    median_mm: float
    p95_mm: float
    max_mm: float
    tilt_degrees: float


class Audit(Struct, frozen=True, forbid_unknown_fields=True):
    """`used` are the blendshapes that are planned for, in the rig's order; `rank` of them can be distinguished at all.

    `unit_mm`, `up` and `facing` are those of the artist's file, and `note` says how they were found and what else the
    reader had to say. `details` has every blendshape in the rig's order, `apart` those that are no expression of the
    face. `reading` is how the face was understood; plans of older versions have none.
    """

    vertices: int
    triangles: int
    skin_vertices: int
    blendshapes: int
    used: tuple[str, ...]
    rank: int
    unit_mm: float
    up: str
    facing: str
    interpupillary_mm: float | None
    findings: tuple[Finding, ...]
    note: str = ""
    name: str = ""
    symmetry: Symmetry | None = None
    details: tuple[BlendshapeFacts, ...] = ()
    reading: ReadingFacts | None = None
    apart: tuple[Kind, ...] = ()


def audit_rig(rig: Rig) -> Audit:
    """What a rig holds and every finding; `used` leaves out exactly the blendshapes of findings with `left_out`.

    Example:
        >>> found = audit_rig(sample_rig())
        >>> len(found.used), sorted({finding.kind for finding in found.findings if finding.left_out})
        (51, ['non-face'])
    """
    findings, kinds = motionless(rig) + flown(rig) + unread(rig) + wrongly_exported(rig), expression_kinds(rig)
    findings += apart_findings(kinds, {name for finding in findings for name in finding.blendshapes})
    unseen = {name for finding in findings for name in finding.blendshapes}
    names = tuple(name for name in rig.names if name not in unseen)
    findings += duplicates(names, _gram(rig, names))
    out = {name for finding in findings if finding.left_out for name in finding.blendshapes}
    used = tuple(name for name in rig.names if name not in out)
    gram = _gram(rig, used)
    symmetry = symmetry_report(rig)
    pupils, anchors = interpupillary(rig), face_anchors(rig)
    whole = two_sides(rig, symmetry, anchors.pupils)
    if used:
        findings += dependent(used, gram) + opposites(used, gram, _sideways(rig, symmetry))
        findings += [*(partners(rig, used, symmetry) if whole else ()), *overlaps(rig, used), *correctives(rig, used)]
        findings += bare(rig, used)
    findings += (
        slipped(rig, used)
        + (
            inverted(rig, used, anchors)
            or mirrored(rig, used, anchors)
            or other_order(rig, used)
            or [*(misnamed(rig, symmetry) if whole else ()), *misleading(rig)]
        )
        + sizes(rig, pupils, used, anchors.pupils)
        + (weak(rig, used, anchors.pupils) if "eyes" in anchors.found else [])
        + windings(rig)
        + covers(rig)
    )
    findings += (
        crooked(symmetry, whole=whole)
        + holes(rig, anchors)
        + open_lips(anchors)
        + shut_lids(rig, anchors)
        + untidy(rig)
        + fine(rig)
    )
    return Audit(
        vertices=len(rig.neutral),
        triangles=len(rig.triangles),
        skin_vertices=int(rig.skin.sum()),
        blendshapes=len(rig.names),
        used=used,
        rank=_rank(gram),
        unit_mm=rig.unit_mm,
        up=rig.up,
        facing=rig.facing,
        interpupillary_mm=None if pupils is None else round(pupils, 1),
        findings=tuple(findings),
        note=rig.note,
        name=rig.name,
        symmetry=Symmetry(
            median_mm=round(symmetry.neutral_median_mm, 3),
            p95_mm=round(symmetry.neutral_p95_mm, 3),
            max_mm=round(symmetry.neutral_max_mm, 3),
            tilt_degrees=round(symmetry.tilt_degrees, 2),
        ),
        details=_details(rig, symmetry),
        reading=reading_facts(rig),
        apart=set_apart(kinds),
    )


def _sideways(rig: Rig, symmetry: SymmetryReport) -> list[tuple[str, str]]:
    """Mirror images of each other that are no left and right halves: jawLeft and jawRight."""
    halves = set(blendshape_pairs(rig))
    return [
        (image.blendshape, image.partner)
        for image in symmetry.blendshapes
        if image.partner not in (None, image.blendshape)
        and not {(image.blendshape, image.partner), (image.partner, image.blendshape)} & halves
    ]


def _details(rig: Rig, symmetry: SymmetryReport) -> tuple[BlendshapeFacts, ...]:
    largest = rig.displacement[:, rig.skin].max(axis=1)
    means = agreed_meanings(rig)
    facts = []
    for image, skin_mm in zip(symmetry.blendshapes, largest.tolist(), strict=True):
        known = means[image.blendshape]
        said = (
            (known.standard, known.name, _words(rig, image.blendshape, known), known.confidence) if known else NOTHING
        )
        mirrored = (image.partner, round(image.percent, 1))
        facts.append(BlendshapeFacts(image.blendshape, *said, round(skin_mm, 3), *mirrored))
    return tuple(facts)


def _words(rig: Rig, name: str, known: Recognised) -> str:
    """What a blendshape does in words: by its name, or by the way and the side of its motion where these differ."""
    does = arkit_by_motion(rig, name)
    other = recognise(does) if does and len(known.arkit) == 1 and does != known.arkit[0] else None
    return other.words if other else known.words


def _gram(rig: Rig, names: tuple[str, ...]) -> Float[np.ndarray, "k k"]:
    """D D^T of the named blendshapes' deltas on the skin, square millimetres."""
    at = rig.rows(names)
    d = rig.deltas[at][:, rig.skin].astype(np.float64).reshape(len(at), 3 * rig.skin.sum())
    return d @ d.T


def _rank(gram: Float[np.ndarray, "k k"]) -> int:
    """Singular values above DEPENDENT of the largest, after every blendshape is scaled to length 1."""
    if len(gram) == 0:
        return 0
    length = np.sqrt(np.diag(gram))
    singular = np.sqrt(np.clip(np.linalg.eigvalsh(gram / np.outer(length, length)), 0, None))
    return int((singular > DEPENDENT * singular[-1]).sum())
