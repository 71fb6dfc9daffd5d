"""The audit: what is in a rig, what is wrong with it, and which blendshapes are left out of the plan and why.

A blendshape is left out only where it truly cannot be planned: it moves nothing, no skin, less than a marker's noise,
or exactly what another one moves. Everything else is planned, and what is odd about it is said.
"""

import textwrap

import numpy as np
from jaxtyping import Float
from msgspec import Struct

from capture_plan.rig.anchors import interpupillary
from capture_plan.rig.findings import (
    DEPENDENT,
    Finding,
    correctives,
    dependent,
    duplicates,
    mesh_faults,
    motionless,
    partners,
)
from capture_plan.rig.names import arkit_name
from capture_plan.rig.record import Rig

__all__ = ["Audit", "Finding", "audit", "audit_text"]

HEADINGS = {
    "static": "Moves nothing",
    "noise": "Too weak to see",
    "non-face": "Moves no skin",
    "duplicate": "There twice",
    "dependent": "Sums of others",
    "partner": "Left and right",
    "corrective": "Correctives",
    "geometry": "Mesh",
}
WIDTH = 100  # characters of a line on the terminal


class Audit(Struct, frozen=True, forbid_unknown_fields=True):
    """`used` are the blendshapes that are planned for, in the rig's order; `rank` of them can be told apart at all.

    `unit_mm`, `up` and `facing` are those of the artist's file, and `note` says how they were found.
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


def audit(rig: Rig) -> Audit:
    """What a rig holds and every finding; `used` leaves out exactly the blendshapes of findings with `left_out`."""
    findings = motionless(rig)
    unseen = {name for finding in findings for name in finding.blendshapes}
    names = tuple(name for name in rig.names if name not in unseen)
    findings += duplicates(names, _gram(rig, names))
    out = {name for finding in findings if finding.left_out for name in finding.blendshapes}
    used = tuple(name for name in rig.names if name not in out)
    gram = _gram(rig, used)
    pupils = interpupillary(rig)
    if used:
        findings += dependent(used, gram) + partners(rig, used) + correctives(rig, used)
    findings += mesh_faults(rig, pupils)
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
    )


def verdict(found: Audit) -> str:
    """One line: can this rig be shot with."""
    out, k = found.blendshapes - len(found.used), found.blendshapes
    if not found.used:
        return "No: no blendshape moves the face skin."
    kept = f"all {k} blendshapes are planned" if out == 0 else f"{len(found.used)} of {k} blendshapes are planned"
    if any("wound inwards" in finding.message for finding in found.findings):
        return f"Not yet: {kept}, but the faces point inwards; reverse the normals first."
    if found.interpupillary_mm is not None and any("pupils are" in finding.message for finding in found.findings):
        return f"Check the size first: {kept}, with pupils {found.interpupillary_mm:.0f} mm apart."
    if out > k / 4:
        return f"Look at what is left out first: {kept}."
    if found.rank < len(found.used):
        return f"Yes, but only {found.rank} movements can be told apart: {kept}."
    return f"Yes: {kept}."


def audit_text(found: Audit) -> str:
    """The audit as a page for the terminal, findings grouped by kind, the worst first."""
    pupils = "not found" if found.interpupillary_mm is None else f"{found.interpupillary_mm:.1f} mm apart"
    known = sum(arkit_name(name) is not None for name in found.used)
    skin = found.skin_vertices / found.vertices
    facts = (
        ("Shoot with it?", verdict(found)),
        ("Mesh", f"{found.vertices:,} vertices, {found.triangles:,} triangles"),
        ("Face skin", f"{found.skin_vertices:,} vertices ({100 * skin:.0f} %)"),
        ("Size", f"1 unit of the file = {found.unit_mm:g} mm; pupils {pupils}"),
        ("Axes of the file", f"up {found.up}, facing {found.facing}"),
        ("Blendshapes", f"{len(found.used)} of {found.blendshapes} planned, {known} with an ARKit name"),
        ("Told apart", f"{found.rank} of {len(found.used)} movements by their shape on the skin"),
    )
    lines = [f"{label:<18}{text}" for label, text in facts]
    lines += [" " * 18 + row for row in textwrap.wrap(found.note, WIDTH - 18)]
    for left_out, title in ((True, "LEFT OUT OF THE PLAN"), (False, "PLANNED, BUT WORTH A LOOK")):
        some = [finding for finding in found.findings if finding.left_out == left_out]
        if some:
            lines += ["", title]
        for kind, heading in HEADINGS.items():
            of_kind = [finding for finding in some if finding.kind == kind]
            advice = ""
            for place, finding in enumerate(of_kind):
                if place and finding.advice != advice:
                    lines += _paragraph("", f"-> {advice}")
                lines += _paragraph("" if place else heading, _sentence(finding.message))
                advice = finding.advice
            if of_kind:
                lines += _paragraph("", f"-> {advice}")
    if not found.findings:
        lines += ["", "Nothing is wrong with this rig."]
    return "\n".join(lines) + "\n"


def _gram(rig: Rig, names: tuple[str, ...]) -> Float[np.ndarray, "k k"]:
    """D D^T of the named blendshapes' deltas on the skin, square millimetres."""
    at = [rig.names.index(name) for name in names]
    d = rig.deltas[at][:, rig.skin].astype(np.float64).reshape(len(at), 3 * rig.skin.sum())
    return d @ d.T


def _rank(gram: Float[np.ndarray, "k k"]) -> int:
    """Singular values above DEPENDENT of the largest, after every blendshape is scaled to length 1."""
    if len(gram) == 0:
        return 0
    length = np.sqrt(np.diag(gram))
    singular = np.sqrt(np.clip(np.linalg.eigvalsh(gram / np.outer(length, length)), 0, None))
    return int((singular > DEPENDENT * singular[-1]).sum())


def _sentence(message: str) -> str:
    """Closed with a full stop, and opened with a capital unless it opens with a blendshape's name."""
    opened = message[0].upper() + message[1:] if message.split(" ")[0] == "the" else message
    return opened + "."


def _paragraph(label: str, text: str) -> list[str]:
    indent = " " * 18
    rows = textwrap.wrap(text, WIDTH - 18, subsequent_indent="   " if text.startswith("->") else "")
    return [f"  {label:<16}{rows[0]}", *(indent + row for row in rows[1:])]
