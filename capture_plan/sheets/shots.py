"""How reference expressions stand on paper: one page each, and the overview to hang beside the camera.

Lengths are page millimetres from the top left corner, y down.
"""

from typing import NamedTuple

import numpy as np
from PIL import Image

from capture_plan.sheets.expression_page import HOLD_SECONDS, Shot, heat_colours
from capture_plan.sheets.furniture import tick_boxes
from capture_plan.sheets.page import MARGIN_MM, Align, Booklet
from capture_plan.sheets.style import ACCENT, FAINT, INK, SOFT, WASH, Number

GAP_MM = 4.0
LARGE_SHARE = 0.6  # of the width, for the front view
OVERVIEW_COLUMNS = (4, 5)  # five where that saves a page
THUMBNAIL_PX = 360


def number(index: int) -> str:
    """E01, E02, ...: the name on the slate, from 0."""
    return f"E{index + 1:02}"


class Plates(NamedTuple):
    """Where the pictures stand: top, width and height of the large one, width and height of the small ones."""

    top: float
    large: float
    tall: float
    small: float
    short: float


def plates(book: Booklet) -> Plates:
    """The large front view on the left, the two small ones above each other on the right."""
    width = book.paper.width - 2 * MARGIN_MM - GAP_MM
    top = 54.0
    tall = min(book.paper.height - top - 68, 166.0)
    large = LARGE_SHARE * width
    return Plates(top, large, tall, width - large, (tall - 12.0) / 2)


def draw_expression(book: Booklet, shot: Shot, index: int, total: int) -> None:
    """The page of one expression, but for its foot."""
    e = shot.expression
    left, right = MARGIN_MM, book.paper.width - MARGIN_MM
    book.text(left, 19, number(index), 34, bold=True)
    wide = book.width(number(index), 34, bold=True)
    book.text(left + wide + 2.5, 19, f"of {total}", 12, colour=SOFT)
    _fields(book, right)
    book.line((left, 23.6), (right, 23.6), width=0.5)
    book.paragraph(left, 26.5, e.sentence, 25, width=right - left, lines=2, bold=True)
    if shot.side:
        _one_side(book, shot.side)
    _pictures(book, shot)
    _facts(book, shot)


def draw_overview(book: Booklet, shots: list[Shot], first: int, total: int, subtitle: str) -> int:
    """As many thumbnails as fit on the last page, from `first` on; returns the first that did not fit."""
    left, width = MARGIN_MM, book.paper.width - 2 * MARGIN_MM
    book.text(left, 15, "EXPRESSIONS AT A GLANCE", 19, bold=True)
    book.text(left, 20.6, subtitle, 8.2, colour=SOFT, fit=width - 66)
    _fields(book, left + width)
    book.line((left, 23.6), (left + width, 23.6), width=0.5)
    rows, columns = overview_grid(book, total)
    cell_w, cell_h = (width + 2.5) / columns, (book.paper.height - 27 - 11) / rows
    last = min(first + rows * columns, total)
    for index in range(first, last):
        row, column = divmod(index - first, columns)
        _thumbnail(book, shots[index], index, left + column * cell_w, 27 + row * cell_h, cell_w - 2.5, cell_h - 2.5)
    return last


def overview_grid(book: Booklet, total: int) -> tuple[int, int]:
    """Rows and columns of thumbnails, so that `total` take the fewest pages."""
    rows = int((book.paper.height - 38) // 47)
    return rows, min(OVERVIEW_COLUMNS, key=lambda columns: -(-total // (rows * columns)))


def _fields(book: Booklet, right: float) -> None:
    for row, name in enumerate(("Production", "Actor", "Date")):
        y = 10.6 + 5.2 * row
        book.text(right - 62, y, name, 7, colour=SOFT)
        book.line((right - 47, y + 0.8), (right, y + 0.8), width=0.2, colour=SOFT)


def _one_side(book: Booklet, side: str) -> None:
    """A banner that names the actor's side, with an arrow to where it is on the front picture."""
    top, large, *_ = plates(book)
    text = f"ACTOR'S {side.upper()} SIDE ONLY"
    on_right = side == "left"  # seen from the front the actor's left is on the picture's right
    x = MARGIN_MM + large if on_right else MARGIN_MM
    wide = book.width(text, 11, bold=True) + 14
    x0 = x - wide if on_right else x
    book.box(x0, top - 8.4, wide, 7.2, fill=ACCENT, line=None)
    tip, direction = (x0 + wide - 2.5, -1) if on_right else (x0 + 2.5, 1)
    arrow = np.array([(0, 0), (4.5 * direction, -2.4), (4.5 * direction, 2.4)]) + np.array([tip, top - 4.8])
    book.polygon(arrow, fill="#ffffff", line=None)
    middle = x0 + wide / 2 + 2.5 * direction
    book.text(middle, top - 3.4, text, 11, bold=True, align="centre", colour="#ffffff")


def _pictures(book: Booklet, shot: Shot) -> None:
    top, large, tall, small, short = plates(book)
    left, x = MARGIN_MM, MARGIN_MM + large + GAP_MM
    book.image(shot.front.rgb, left, top, large, tall)
    book.text(left + 1, top + tall - 1.5, "actor's right", 8.5, bold=True, colour=SOFT)
    book.text(left + large - 1, top + tall - 1.5, "actor's left", 8.5, bold=True, colour=SOFT, align="right")
    book.image(shot.three_quarter.rgb, x, top, small, short)
    book.text(x, top + short + 2.2, "from the actor's left", 7.4, colour=SOFT)
    below = top + short + 5
    book.image(shot.heat.rgb, x, below, small, short)
    _heat_bar(book, x, below + short + 1.2, small, shot.scale_mm)


def _heat_bar(book: Booklet, x: Number, y: Number, width: Number, scale_mm: Number) -> None:
    strip = (heat_colours(np.linspace(0, 1, 400)) * 255).round().astype(np.uint8)[None].repeat(12, axis=0)
    book.image(strip, x, y, width, 2.6)
    book.box(x, y, width, 2.6, width=0.15)
    places: tuple[tuple[float, Align], ...] = ((0.0, "left"), (0.5, "centre"), (1.0, "right"))
    for share, align in places:
        unit = " mm moved" if share == 1 else ""
        book.text(x + share * width, y + 6, f"{scale_mm * share:g}{unit}", 7.4, align=align, colour=INK)


def _facts(book: Booklet, shot: Shot) -> None:
    """Importance, blendshapes, and what is ticked and written at the shoot."""
    e, left, right = shot.expression, MARGIN_MM, book.paper.width - MARGIN_MM
    plate = plates(book)
    y, width = plate.top + plate.tall + 9, right - left
    book.text(left, y, f"shows {e.gain:.1%} of all movement", 10.5, bold=True)
    book.text(right, y, f"{e.covered:.0%} covered after this one", 10.5, bold=True, align="right")
    start, end = max(e.covered - e.gain, 0), min(e.covered, 1)
    book.box(left, y + 2, width, 3.6, fill=WASH, line=None)
    book.box(left, y + 2, width * start, 3.6, fill="#9db8e8", line=None)
    book.box(left + width * start, y + 2, max(width * (end - start), 0.3), 3.6, fill=ACCENT, line=None)
    names = "Blendshapes at full: " + ", ".join(e.blendshapes)
    if e.drivers:
        names += f"; held besides: {', '.join(e.drivers)}"
    book.paragraph(left, y + 7.4, names, 8, width=width, lines=3, colour=SOFT)
    y = book.paper.height - 29
    book.line((left, y - 7), (right, y - 7), width=0.15, colour=FAINT)
    x = tick_boxes(book, left, y, ("pass", "retake"), size=5.5, pt=12.5)
    book.text(x + 2, y, f"hold {HOLD_SECONDS} s (our assumption)", 9.5, colour=SOFT)
    y = book.paper.height - 17
    for x, end, word in ((left, left + 62, "takes"), (left + 68, right, "notes")):
        book.text(x, y, word, 8, colour=SOFT)
        book.line((x + 10, y + 0.8), (end, y + 0.8), width=0.2, colour=SOFT)


def _thumbnail(book: Booklet, shot: Shot, index: int, x: Number, y: Number, w: Number, h: Number) -> None:
    e = shot.expression
    book.box(x, y, w, h, line=FAINT, width=0.2)
    text_h = 15.0
    picture_h = h - text_h
    rows, columns = shot.front.rgb.shape[:2]
    picture_w = min(w - 1, picture_h * columns / rows)
    size = (THUMBNAIL_PX, round(THUMBNAIL_PX * rows / columns))
    small = np.asarray(Image.fromarray(shot.front.rgb).resize(size, Image.Resampling.BOX))
    book.image(small, x + (w - picture_w) / 2, y + 0.5, picture_w, picture_w * rows / columns)
    book.text(x + 1.5, y + 5, number(index), 13, bold=True)
    book.box(x + w - 6, y + 1.6, 4.2, 4.2, fill="#ffffff", width=0.3)
    book.text(x + w - 1.5, y + h - text_h + 0.5, f"{e.covered:.0%}", 7.5, bold=True, align="right", colour=ACCENT)
    if shot.side:
        book.text(x + 1.5, y + h - text_h + 0.5, f"actor's {shot.side}", 6.6, bold=True, colour=ACCENT)
    book.paragraph(x + 1.5, y + h - text_h + 1.4, e.sentence, 7.6, width=w - 3, lines=3)
    book.box(x, y + h - 1, w, 1, fill=WASH, line=None)
    book.box(x, y + h - 1, w * min(e.covered, 1), 1, fill=ACCENT, line=None)
