"""The table behind the marker sheets: every marker with what can be measured on the actor, and boxes to tick.

Distances are straight lines on the neutral, as callipers measure them, in millimetres.

Letters: m landmarks.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from capture_plan.face.anchors import Anchors
from capture_plan.layout.record import Landmark
from capture_plan.sheets.furniture import HeadLine, head_line
from capture_plan.sheets.page import MARGIN_MM, Booklet
from capture_plan.sheets.style import FAINT, INK, SOFT, WASH, Look, Number

TOP_MM, ROW_MM, BOTTOM_MM = 33.0, 5.3, 16.0
TICKS = ("applied", "checked", "after lunch")
# Left edge of each column, millimetres from the margin; the last three hold the boxes.
COLUMNS = {"number": 5.0, "place": 17.0, "nose": 52.0, "chin": 66.0, "middle": 80.0, "next": 96.0, "last": 132.0}
TICK_MM = 11.0


class Column(NamedTuple):
    """What the table says last of each marker, and how large."""

    title: str
    size: Number
    cell: Callable[[Landmark], str]


READS = Column("reads", 5.8, lambda landmark: landmark.stands_for)
VERTEX = Column("vertex of the scan", 7.4, lambda landmark: f"{landmark.source_vertex:,}")


def rows_per_page(book: Booklet) -> int:
    """How many markers of the table fit on one page."""
    return int((book.paper.height - TOP_MM - BOTTOM_MM) // ROW_MM)


def draw_table(
    book: Booklet,
    landmarks: tuple[Landmark, ...],
    every: tuple[Landmark, ...],
    looks: dict[str, Look],
    anchors: Anchors,
    words: HeadLine,
    last: Column,
) -> None:
    """The rows of `landmarks`, measured against `every` landmark, on the last page."""
    head_line(book, "MARKER TABLE", words)
    left, right = MARGIN_MM, book.paper.width - MARGIN_MM
    ticks = right - TICK_MM * len(TICKS)
    y = TOP_MM - 3
    heads = {"number": "marker", "place": "where", "nose": "nose tip", "chin": "chin", "middle": "middle"}
    for key, text in (heads | {"next": "nearest markers", "last": last.title}).items():
        book.text(left + COLUMNS[key], y, text, 7, bold=True)
    for i, text in enumerate(TICKS):
        book.text(ticks + TICK_MM * (i + 0.5), y, text, 6.2, bold=True, align="centre")
    book.line((left, y + 1.6), (right, y + 1.6), width=0.3)
    everywhere = np.array([m.position for m in every])
    for row, landmark in enumerate(landmarks):
        _row(book, landmark, looks[landmark.region], TOP_MM + 2.4 + row * ROW_MM, ticks, row % 2 == 1, last)
        place = np.array(landmark.position)
        cells = _measured(landmark, place, every, everywhere, anchors)
        for key, text in cells.items():
            fit = {"next": COLUMNS["last"] - COLUMNS["next"] - 2, "middle": 15.0}.get(key, 13.0)
            book.text(left + COLUMNS[key], TOP_MM + 2.4 + row * ROW_MM, text, 7.4, fit=fit, colour=INK)
    y = TOP_MM + 2.4 + len(landmarks) * ROW_MM
    note = "Distances in mm, straight as with callipers, on the neutral face. 'middle': sideways from the middle line."
    book.text(left, min(y, book.paper.height - 13), note, 6.6, colour=SOFT, fit=right - left)


def _row(book: Booklet, landmark: Landmark, look: Look, y: Number, ticks: float, shaded: bool, last: Column) -> None:
    left, right = MARGIN_MM, book.paper.width - MARGIN_MM
    if shaded:
        book.box(left, y - 3.7, right - left, ROW_MM, fill=WASH, line=None)
    book.marker(left + 2, y - 1.1, look, radius=1.2, hollow=landmark.role == "backup")
    book.text(left + COLUMNS["number"], y, landmark.name, 8.5, bold=True)
    book.text(left + COLUMNS["place"], y, landmark.label, 7.8, fit=COLUMNS["nose"] - COLUMNS["place"] - 2)
    room = ticks - left - COLUMNS["last"] - 1.5
    book.text(left + COLUMNS["last"], y, last.cell(landmark), last.size, fit=room, colour=SOFT)
    for i in range(len(TICKS)):
        book.box(ticks + TICK_MM * (i + 0.5) - 1.8, y - 2.9, 3.6, 3.6, fill="#ffffff", line=INK, width=0.25)
    book.line((left, y + 1.6), (right, y + 1.6), width=0.1, colour=FAINT)


def _measured(
    landmark: Landmark,
    place: Float[np.ndarray, " 3"],
    every: tuple[Landmark, ...],
    everywhere: Float[np.ndarray, "m 3"],
    anchors: Anchors,
) -> dict[str, str]:
    apart = np.linalg.norm(everywhere - place, axis=1)
    nearest = [i for i in np.argsort(apart, kind="stable").tolist() if every[i].name != landmark.name][:2]
    sideways = place[0] - anchors.midline
    side = "" if abs(sideways) < 0.05 else " left" if sideways > 0 else " right"
    return {
        "nose": f"{np.linalg.norm(place - anchors.nose_tip):.0f}",
        "chin": f"{np.linalg.norm(place - anchors.chin):.0f}",
        "middle": f"{abs(sideways):.0f}{side}",
        "next": "   ".join(f"{every[i].name} {apart[i]:.1f}" for i in nearest),
    }
