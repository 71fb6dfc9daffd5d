"""The audit as a page that a rigger reads who never saw this program: the verdict, what to change, what is left out.

Order      can it be shot with; how the face was understood, and what of it is in doubt; what goes back to the rigger;
           what the plan leaves out and why; what to know on set; the figures of the rig; every blendshape
Every finding of an audit is on the page. It fits a terminal and a mail: WIDTH characters, no colours.
"""

import re
import textwrap
from collections import Counter
from collections.abc import Sequence

from capture_plan.anatomy.delta_relations import KINDS, Finding, FindingKind
from capture_plan.audit.audit import Audit, BlendshapeFacts
from capture_plan.face.facts import ReadingFacts
from capture_plan.face.unit import apart_words
from capture_plan.face.words import answers, doubts, left_out_words, signs_words, some
from capture_plan.prose import in_series

WIDTH = 100  # characters of a line on the terminal
INDENT = 20
MIXED_UP = 0.25  # of the blendshapes left out: more are no accident
FEW = 5  # blendshapes: fewer are rather a part of a character's than all of them
NOUNS: dict[FindingKind, str] = {
    "size": "the size",
    "export": "what was exported wrongly",
    "winding": "the normals",
    "static": "what does not move",
    "noise": "what is too weak",
    "duplicate": "what is there twice",
    "dependent": "mixes of others",
    "name": "names",
    "partner": "left and right",
    "cover": "what hides the skin",
    "geometry": "the mesh",
}
REASONS: dict[FindingKind, str] = {
    "export": "exported wrongly",
    "static": "moves nothing",
    "noise": "too weak to see",
    "non-face": "moves no skin",
    "duplicate": "there twice",
    "head": "moves the whole head",
    "elsewhere": "not of the face",
    "calls": "only calls others",
}


def verdict(found: Audit) -> str:
    """One line: can this rig be shot with."""
    if found.reading and found.reading.no_face:
        return "No: no face was found, neither eyes nor a mouth; see below what to give."
    if not found.used:
        wrong = {name for finding in found.findings if finding.kind == "export" for name in finding.blendshapes}
        if len(wrong) == found.blendshapes:
            return "No: every blendshape was exported wrongly; see below what to change."
        return "No: no blendshape moves the face skin."
    retained = planned_words(len(found.used), found.blendshapes)
    return _not_yet(found, retained) or _yes(found, retained)


def planned_words(used: int, k: int) -> str:
    """'51 of 52 blendshapes are planned'."""
    if used < k:
        return f"{used} of {k} blendshapes are planned"
    every = {1: "the only blendshape is", 2: "both blendshapes are"}
    return f"{every.get(k, f'all {k} blendshapes are')} planned"


def _not_yet(found: Audit, retained: str) -> str:
    """What has to be looked at before anything is shot; nothing where all is well."""
    stops = [finding for finding in found.findings if finding.urgency == "stop"]
    if any(finding.kind == "winding" for finding in stops):
        return f"Not yet: {retained}, but the faces point inwards; reverse the normals first."
    wrong = some([name for finding in stops for name in finding.blendshapes])
    unsure = unsure_words(found.reading) if found.reading else ""
    if wrong:
        return f"Not yet: {retained}, but {wrong} cannot be right."
    if unsure and (not stops or unsure != "the unit is not certain"):
        return f"Look at how it was understood first: {retained}, but {unsure}."
    if stops:
        pupils = found.interpupillary_mm
        apart = "" if pupils is None else f", with pupils {apart_words(pupils)}"
        return f"Check the size first: {retained}{apart}."
    return ""


def _yes(found: Audit, retained: str) -> str:
    if found.blendshapes - len(found.used) > MIXED_UP * found.blendshapes:
        return f"Look at what is left out first: {retained}."
    if len(found.used) < FEW:
        return f"Yes, but they are few: {retained}. Characters mostly have 20 or more; ask the rigger for the others."
    if found.rank < len(found.used):
        return f"Yes, but only {found.rank} movements can be distinguished: {retained}."
    bare = [name for finding in found.findings if finding.kind == "bare" for name in finding.blendshapes]
    but = f"; no marker can stand for {some(bare)}" if bare else ""
    return f"Yes: {retained}{_left_out_words(found)}{but}."


def unsure_words(read: ReadingFacts) -> str:
    """'the axes and the mouth are not certain'; nothing where all is beyond doubt that decides about the plan."""
    if read.against:
        return "the face itself speaks against how it was read to lie"
    parts = {"the axes": read.axes, "the unit": read.unit, "the eyes": read.eyes, "the mouth": read.mouth}
    unsure = [name for name, answer in parts.items() if not answer.sure]
    agree = sum(sign.weight for sign in read.sides.signs)
    wrong = len(read.sides.disagree)
    if not unsure and wrong and wrong >= agree:  # a few wrong names are the rigger's, half of them the reading's
        return "names and movements disagree about left and right"
    if not unsure:
        return ""
    are = "are" if len(unsure) > 1 or unsure[0] in ("the axes", "the eyes") else "is"
    return f"{in_series(unsure)} {are} not certain"


def can_be_planned(found: Audit) -> bool:
    """Whether a plan can be made of the rig: a face was found, and something moves its skin."""
    return bool(found.used) and not (found.reading and found.reading.no_face)


def audit_text(found: Audit) -> str:
    """The whole audit as a page of text."""
    asked = asked_of(found)
    known = [finding for finding in found.findings if finding.urgency == "know" and not finding.left_out]
    out = [finding for finding in found.findings if finding.left_out]
    title = f"Audit of {found.name}" if found.name else "Audit"
    lines = [title, "", *_paragraph("Shoot with it?", verdict(found), indent=0)]
    lines += _paragraph("Send back", asked_words(asked), indent=0)
    lines += _understood(found.reading) if found.reading else []
    lines += _section("SEND BACK TO THE RIGGER", asked)
    lines += _section("LEFT OUT OF THE PLAN", [finding for finding in out if finding not in asked])
    again = [finding for finding in out if finding in asked]
    if again:
        also = f"{some([name for finding in again for name in finding.blendshapes], len(found.details))}, as said above"
        lines += ([""] if len(out) > len(again) else ["", "LEFT OUT OF THE PLAN"]) + _paragraph("", f"{also}.")
    lines += _section("PLANNED, AND WORTH KNOWING ON SET", known)
    lines += ["", "THE RIG", *(row for label, text in facts(found) for row in _paragraph(label, text))]
    lines += ["", *_table(found)]
    return "\n".join(lines) + "\n"


def _understood(read: ReadingFacts) -> list[str]:
    """How the face was understood: every answer with what it rests on, what was left out, what is in doubt."""
    lines = ["", "WHAT WAS UNDERSTOOD"]
    for one in answers(read):
        label = f"{one.label} (not sure)" if one.status == "not sure" else one.label
        lines += _paragraph(label, "; ".join(filter(None, (one.text, signs_words(one.signs)))))
    for label, text in left_out_words(read):
        lines += _paragraph(label, text)
    for place, doubt in enumerate(doubts(read)):
        lines += _paragraph("" if place else "In doubt", doubt)
    return lines


def facts(found: Audit) -> list[tuple[str, str]]:
    """Label and text of every figure of the rig, each with its unit."""
    pupils = "not found" if found.interpupillary_mm is None else apart_words(found.interpupillary_mm)
    skin = found.skin_vertices / found.vertices
    rows = [
        ("Mesh", f"{found.vertices:,} vertices, {found.triangles:,} triangles"),
        ("Face skin", f"{found.skin_vertices:,} vertices ({100 * skin:.0f} %): markers may go there"),
        ("Size", f"1 unit of the file = {found.unit_mm:g} mm; pupils {pupils}"),
        ("Axes of the file", f"up {found.up}, facing {found.facing}"),
        ("Distinguished", f"{found.rank} of {len(found.used)} planned movements, by their shape on the skin"),
        ("Names", names_words(found)),
    ]
    if found.symmetry:
        rows.append(("Symmetry", symmetry_words(found)))
    if found.note:
        rows.append(("How it was read", found.note))
    return rows


def names_words(found: Audit) -> str:
    """How many names follow which standard, and which follow none."""
    count = Counter(one.standard for one in found.details if one.standard)
    messages = [f"{number} of {found.blendshapes} by {standard}" for standard, number in sorted(count.items())]
    unknown = [one.name for one in found.details if not one.standard]
    if unknown:
        own = (
            f"{len(unknown)} by no known standard: {some(unknown, 12)}" if messages else "none follows a known standard"
        )
        messages.append(f"{own} (paired by shape; for recorded weights say in a --names file what they are)")
    return "; ".join(messages) if messages else "none"


def symmetry_words(found: Audit) -> str:
    """The neutral in millimetres, the blendshapes in per cent."""
    of = found.symmetry
    if of is None:
        return ""
    words = (
        f"neutral {of.median_mm:.2f} mm from its mirror image (median), 95 % of the skin within {of.p95_mm:.2f} mm"
        + (f", mirror plane turned by {of.tilt_degrees:.1f} degrees" if of.tilt_degrees >= 0.1 else "")
    )
    mirrored = sorted((one.off_percent, one.name) for one in found.details if one.mirror and one.skin_mm > 0)
    if mirrored:
        median, (most, worst) = mirrored[len(mirrored) // 2][0], mirrored[-1]
        words += f"; movements {median:.0f} % off their mirror image (median), {worst} most with {most:.0f} %"
    return words


def _table(found: Audit) -> list[str]:
    """One line a blendshape: its name, what it means, how far it moves the skin, its mirror image, of a pair once."""
    if not found.details:
        return []
    used, place = set(found.used), {one.name: (i, one.mirror) for i, one in enumerate(found.details)}
    rows = [
        (
            one.name,
            one.words or "?",
            f"{one.skin_mm:.1f}",
            _mirror_words(one, place),
            f"{one.off_percent:.0f}" if one.mirror and not _said_above(one, place) else "",
            "" if one.name in used else "no",
        )
        for one in found.details
    ]
    header = ("EVERY BLENDSHAPE", "in words", "mm", "mirror image", "off %", "planned")
    widths = [min(most, max(len(row[i]) for row in (header, *rows))) for i, most in enumerate((30, 50, 6, 24, 5, 7))]
    widths[1] = min(widths[1], WIDTH + widths[1] - sum(widths) - len(widths) + 1)
    return [
        " ".join(
            cell.rjust(width) if i in (2, 4) else _cut(cell, width).ljust(width)
            for i, (cell, width) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in (header, *rows)
    ]


def _said_above(one: BlendshapeFacts, place: dict[str, tuple[int, str | None]]) -> bool:
    """Whether the line of its mirror image, further up, says that the two are a pair; `place` has each one's line and
    mirror image."""
    if one.mirror is None or one.mirror == one.name or one.mirror not in place:
        return False
    line, back = place[one.mirror]
    return back == one.name and line < place[one.name][0]


def _mirror_words(one: BlendshapeFacts, place: dict[str, tuple[int, str | None]]) -> str:
    if one.mirror == one.name:
        return "itself"
    return "as said above" if _said_above(one, place) else one.mirror or "none"


def asked_of(found: Audit) -> list[Finding]:
    """What goes back to the rigger."""
    return [finding for finding in found.findings if finding.urgency != "know"]


def asked_lines(found: Audit) -> list[str]:
    """What the rigger has to correct, one sentence and its advice for each kind, for where there is little room."""
    lines = []
    for kind, heading in KINDS.items():
        of_kind = [finding for finding in asked_of(found) if finding.kind == kind]
        if of_kind:
            more = f" and {len(of_kind) - 1} more" if len(of_kind) > 1 else ""
            names = some([name for finding in of_kind for name in finding.blendshapes])
            said = f"{names}: {of_kind[0].advice}" if more and names else _sentence(of_kind[0].message + more)
            lines.append(f"{heading}: {said}" + ("" if more and names else f" {of_kind[0].advice}"))
    return lines


def asked_words(asked: Sequence[Finding]) -> str:
    """How many things the rigger has to change, by their kinds."""
    if not asked:
        return "Nothing: the rigger has nothing to change."
    count = Counter(finding.kind for finding in asked)
    message = ", ".join(
        noun + (f" ({count[kind]})" if count[kind] > 1 else "") for kind, noun in NOUNS.items() if count[kind]
    )
    return f"{len(asked)} thing{'s' * (len(asked) > 1)} to change, listed below: {message}."


def _left_out_words(found: Audit) -> str:
    """', without tongueOut (moves no skin)', by reason."""
    parts = []
    for kind, reason in REASONS.items():
        of_kind = [finding for finding in found.findings if finding.left_out and finding.kind == kind]
        names = [name for finding in of_kind for name in finding.blendshapes]
        if names:
            parts.append(f"{some(names)} ({reason})")
    return f", without {', '.join(parts)}" if parts else ""


def _section(title: str, findings: Sequence[Finding]) -> list[str]:
    """Findings grouped by kind, an advice once for those that share it."""
    lines = ["", title] if findings else []
    for kind, heading in KINDS.items():
        of_kind = [finding for finding in findings if finding.kind == kind]
        advice = ""
        for place, finding in enumerate(of_kind):
            if place and finding.advice != advice:
                lines += _paragraph("", f"-> {advice}")
            lines += _paragraph("" if place else heading, _sentence(finding.message))
            advice = finding.advice
        if of_kind:
            lines += _paragraph("", f"-> {advice}")
    return lines


def _sentence(message: str) -> str:
    """Closed with a full stop, and opened with a capital unless it opens with a blendshape's name."""
    opens = message.split(" ")[0] in ("the", "these", "no", "further", "all")
    return (message[0].upper() + message[1:] if opens else message) + "."


def _paragraph(label: str, text: str, *, indent: int = 2) -> list[str]:
    text = re.sub(r"(\d) (%|mm|cm²)", "\\1\N{NO-BREAK SPACE}\\2", text)
    rows = textwrap.wrap(text, WIDTH - INDENT, subsequent_indent="   " if text.startswith("->") else "")
    rows = [row.replace("\N{NO-BREAK SPACE}", " ") for row in rows]
    return [f"{' ' * indent}{label}".ljust(INDENT) + rows[0], *(" " * INDENT + row for row in rows[1:])]


def _cut(text: str, width: int) -> str:
    return text if len(text) <= width else text[: width - 1] + "…"
