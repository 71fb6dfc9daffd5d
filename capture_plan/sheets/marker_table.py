"""The table behind the marker sheets: every marker with what is measured on the actor, and boxes to tick.

Distances are straight lines on the neutral, as callipers measure them, in millimetres; beside each stands its share of
the distance between the pupils, for a face of another size.

Letters: m landmarks.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from capture_plan.evaluation.rings import PROMISED
from capture_plan.evaluation.robustness import GROWTH
from capture_plan.layout.record import Landmark
from capture_plan.sheets.furniture import HeadLine, head_line
from capture_plan.sheets.markers import MarkedFace, point_words
from capture_plan.sheets.page import MARGIN_MM, Booklet
from capture_plan.sheets.style import FAINT, INK, SOFT, WASH, Number

TOP_MM, ROW_MM, BOTTOM_MM = 36.0, 5.3, 26.0
TICKS = ("applied", "checked", "after lunch")
# Left edge of each column, millimetres from the margin; the last three hold the boxes.
COLUMNS = {"number": 5.0, "place": 17.0, "first": 50.0, "second": 75.0, "error": 100.0, "next": 117.0, "last": 135.0}
TICK_MM = 12.5
CALLIPERS_MM = 0.5  # to which a distance on soft skin is measured: an assumption of ours
FINER = "use a mask"


class Column(NamedTuple):
    """What the table says last of each marker, and how large."""

    title: str
    size: Number
    cell: Callable[[Landmark], str]
    unit: str = ""


VERTEX = Column("vertex of the scan", 7.4, lambda landmark: f"{landmark.source_vertex:,}")


def ring_column(face: MarkedFace) -> Column:
    """The ring of each marker, and where callipers cannot place it that exactly, what can."""

    def cell(landmark: Landmark) -> str:
        ring = face.rings.get(landmark.name)
        if ring is None:
            return ""
        return f"{ring:.1f}" + (f" · {FINER}" if too_fine(landmark, face) else "")

    return Column("ring", 7.4, cell, "mm, all dots at once")


def too_fine(landmark: Landmark, face: MarkedFace) -> bool:
    """Whether the ring of a marker asks for distances that callipers do not give."""
    measure, ring = face.measure(landmark), face.rings.get(landmark.name)
    return measure is not None and ring is not None and ring < CALLIPERS_MM * measure.error_mm


def rows_per_page(book: Booklet) -> int:
    """How many markers of the table fit on one page."""
    return int((book.paper.height - TOP_MM - BOTTOM_MM) // ROW_MM)


def draw_table(book: Booklet, landmarks: tuple[Landmark, ...], face: MarkedFace, words: HeadLine, last: Column) -> None:
    """The rows of `landmarks`, measured on the whole face, on the last page."""
    head_line(book, "MARKER TABLE", words)
    left, right = MARGIN_MM, book.paper.width - MARGIN_MM
    ticks = right - TICK_MM * len(TICKS)
    y = TOP_MM - 3
    heads = {"number": "dot", "place": "where", "first": "first distance", "second": "second distance"}
    heads |= {"error": "if 1 mm off", "next": "nearest dot", "last": last.title}
    for key, text in heads.items():
        book.text(left + COLUMNS[key], y, text, 7, bold=True)
    units = {"first": "mm (of pupils)", "second": "mm (of pupils)", "error": "dot off, mm", "next": "mm"}
    units |= {"last": last.unit}
    for key, text in units.items():
        book.text(left + COLUMNS[key], y - 3.2, text, 7, colour=SOFT)
    for i, text in enumerate(TICKS):
        book.text(ticks + TICK_MM * (i + 0.5), y, text, 7, bold=True, align="centre")
    book.line((left, y + 1.6), (right, y + 1.6), width=0.3)
    for row, landmark in enumerate(landmarks):
        _row(book, landmark, face, TOP_MM + 2.4 + row * ROW_MM, ticks, row % 2 == 1, last)
    _foot(book, face, min(TOP_MM + 3.4 + len(landmarks) * ROW_MM, book.paper.height - BOTTOM_MM + 3))


def begin_row(book: Booklet, landmark: Landmark, face: MarkedFace, y: Number, end: Number, *, shaded: bool) -> None:
    """Sign, number and place of a marker with the baseline at y, up to `end`, from the margin."""
    left, right = MARGIN_MM, book.paper.width - MARGIN_MM
    if shaded:
        book.box(left, y - 3.7, right - left, ROW_MM, fill=WASH, line=None)
    book.marker(left + 2, y - 1.1, face.looks[landmark.region], radius=1.2, hollow=landmark.role == "backup")
    book.text(left + COLUMNS["number"], y, landmark.name, 8.5, bold=True)
    book.text(left + COLUMNS["place"], y, landmark.label, 7.8, fit=end - COLUMNS["place"] - 2)
    book.line((left, y + 1.6), (right, y + 1.6), width=0.1, colour=FAINT)


def _row(
    book: Booklet, landmark: Landmark, face: MarkedFace, y: Number, ticks: float, shaded: bool, last: Column
) -> None:
    left = MARGIN_MM
    begin_row(book, landmark, face, y, COLUMNS["first"], shaded=shaded)
    for key, text in _measured(landmark, face).items():
        book.text(left + COLUMNS[key], y, text, 7.6, fit=23.5 if key in ("first", "second") else 17.0)
    room = ticks - left - COLUMNS["last"] - 1.5
    book.text(left + COLUMNS["last"], y, last.cell(landmark), last.size, fit=room)
    for i in range(len(TICKS)):
        book.box(ticks + TICK_MM * (i + 0.5) - 1.8, y - 2.9, 3.6, 3.6, fill="#ffffff", line=INK, width=0.25)


def _measured(landmark: Landmark, face: MarkedFace) -> dict[str, str]:
    """The cells of a marker that hold distances."""
    apart = np.linalg.norm(face.positions - landmark.position, axis=1)
    others = [i for i in np.argsort(apart, kind="stable").tolist() if face.landmarks[i].name != landmark.name]
    cells = {"next": f"{face.landmarks[others[0]].name} {apart[others[0]]:.1f}"} if others else {}
    measure = face.measure(landmark)
    if measure is None:
        return cells
    shares = [mm / face.anchors.pupils for mm in measure.mm]
    said = [
        f"{point_words(p, measure)} {mm:.1f} ({share:.2f})"
        for p, mm, share in zip(measure.points, measure.mm, shares, strict=True)
    ]
    return cells | {"first": said[0], "second": said[1], "error": f"{measure.error_mm:.1f}"}


def ring_words(face: MarkedFace) -> str:
    """What the ring of a marker is, and what is done where callipers are too coarse for it; empty without rings."""
    if not face.rings:
        return ""
    promised = f"{min(face.kept, PROMISED):.0%} of crews stay under {GROWTH - 1:+.0%} of error"
    words = (
        "Ring: how far the middle of a dot may stand from its place, in any direction. It holds for all dots at once: "
    )
    words += f"where every dot stands somewhere within its ring, {promised}."
    if any(too_fine(one, face) for one in face.landmarks):
        words += f" '{FINER.capitalize()}': callipers, good to about {CALLIPERS_MM:g} mm on skin, do not place the dot "
        words += "that exactly; take the printed mask (capture-plan mask) or a stencil."
    return words


def _foot(book: Booklet, face: MarkedFace, y: Number) -> None:
    """What the columns mean, and the box for a face of another size."""
    left, wide = MARGIN_MM, book.paper.width - 2 * MARGIN_MM
    letters = ", ".join(dict.fromkeys(f"{p.letter} {p.name}" for p in face.tape))
    note = "Straight distances on the relaxed face, as callipers measure them"
    note += (
        f", from {letters}. 'If 1 mm off': how far the dot goes if each distance is off by 1 mm." if letters else "."
    )
    y = book.paragraph(left, y, note, 7, width=wide, lines=2, colour=SOFT)
    if words := ring_words(face):
        y = book.paragraph(left, y + 0.8, words, 7, width=wide, lines=3, colour=SOFT)
    if not face.tape or face.own:
        return
    pupils = face.anchors.pupils
    words = f"Actor's pupils, looking far ahead: ________ mm ÷ {pupils:.1f} mm = factor ________"
    book.text(left, y + 5.2, words, 9, bold=True)
    rest = "Multiply every distance by the factor, or the actor's own pupil distance by the shares in brackets."
    book.text(left, y + 9.4, rest, 7, colour=SOFT, fit=wide)
