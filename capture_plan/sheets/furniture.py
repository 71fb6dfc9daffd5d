"""What every page carries: its title, the fields to write on, whose left is left, the check bar, and where it is from.

Lengths are page millimetres from the top left corner, y down.
"""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from capture_plan.sheets.page import MARGIN_MM, Booklet
from capture_plan.sheets.qr import draw_code
from capture_plan.sheets.style import FAINT, INK, SOFT, Look, Number

CHECK_BAR_MM, CODE_MM = 50.0, 16.0
FIELDS = ("Production", "Actor", "Date")


HeadLine = tuple[str] | tuple[str, str]  # under a title


class SheetSource(NamedTuple):
    """What the pages were drawn from, for the foot of each: 'plan 0123456789abcdef' of a rig, for one."""

    rig: str
    document: str
    pages: int


def head_line(book: Booklet, title: str, words: HeadLine, *, fields: bool = True, code: str = "") -> None:
    """Title on the left, lines for production, actor and date on the right, and a rule below; with a `code` that a
    telephone reads."""
    right = book.paper.width - MARGIN_MM
    fields_x = right - 62 if fields else right
    if code:
        fields_x -= CODE_MM + 2
        draw_code(book, code, fields_x, 22.4 - CODE_MM, CODE_MM)
    room = fields_x - MARGIN_MM - 4
    if len(words) == 1:
        book.text(MARGIN_MM, 15, title, 19, bold=True, fit=room)
        book.text(MARGIN_MM, 20.6, words[0], 8.2, colour=SOFT, fit=room)
    else:
        book.text(MARGIN_MM, 13.2, title, 17, bold=True, fit=room)
        book.text(MARGIN_MM, 17.9, words[0], 7.8, colour=SOFT, fit=room)
        book.text(MARGIN_MM, 21.7, words[1], 7.8, colour=SOFT, fit=room)
    if fields:
        for row, name in enumerate(FIELDS):
            y = 10.6 + 5.2 * row
            book.text(right - 62, y, name, 7, colour=SOFT)
            book.line((right - 47, y + 0.8), (right, y + 0.8), width=0.2, colour=SOFT)
    book.line((MARGIN_MM, 23.6), (right, 23.6), width=0.5, colour=INK)


def foot_line(book: Booklet, source: SheetSource) -> None:
    """Rig, plan and page number."""
    y, right = book.paper.height - 6.5, book.paper.width - MARGIN_MM
    book.line((MARGIN_MM, y - 3.6), (right, y - 3.6), width=0.15, colour=FAINT)
    page = f"page {len(book.titles)} of {source.pages}"
    wide = book.text(right, y, page, 7, bold=True, align="right")
    text = f"{source.rig}  ·  {source.document}  ·  drawn by capture-plan"
    book.text(MARGIN_MM, y, text, 7, colour=SOFT, fit=right - MARGIN_MM - wide - 4)


def sides(book: Booklet, y: Number, *, left_on_right: bool) -> None:
    """ACTOR'S LEFT and ACTOR'S RIGHT, large, each on its own side of the picture, with an arrow pointing outwards."""
    words = ("ACTOR'S RIGHT", "ACTOR'S LEFT") if left_on_right else ("ACTOR'S LEFT", "ACTOR'S RIGHT")
    left, right = MARGIN_MM, book.paper.width - MARGIN_MM
    for text, x, direction in ((words[0], left, 1), (words[1], right, -1)):
        tip = np.array([x, y - 2.05])
        book.polygon(tip + np.array([(0, 0), (3.4 * direction, -2), (3.4 * direction, 2)]), fill=INK, line=None)
        book.text(x + 5 * direction, y, text, 16, bold=True, align="left" if direction > 0 else "right")


def check_bar(book: Booklet, x: Number, y: Number) -> None:
    """50 mm with a stroke every 10: a ruler laid beside it tells whether the printer kept the size."""
    for step in range(5):
        fill = INK if step % 2 == 0 else "#ffffff"
        book.box(x + 10 * step, y, 10, 1.7, fill=fill, line=None)
    book.line((x, y), (x + CHECK_BAR_MM, y), width=0.15)
    book.line((x, y + 1.7), (x + CHECK_BAR_MM, y + 1.7), width=0.15)
    for end in (x, x + CHECK_BAR_MM):
        book.line((end, y - 1.2), (end, y + 2.9), width=0.15)
    book.text(x, y + 5.6, "50 mm: measure it with a ruler, print at 100 %", 6.4, colour=SOFT)


def legend(book: Booklet, x: Number, y: Number, width: Number, looks: dict[str, Look], counts: dict[str, int]) -> None:
    """Shape, region and how many, in rows."""
    column, row = x, y
    for region, look in looks.items():
        text = f"{counts[region]} \N{MULTIPLICATION SIGN} {region}"
        wide = 5 + book.width(text, 7.4) + 3.5
        if column + wide > x + width and column > x:
            column, row = x, row + 4.9
        book.marker(column + 1.5, row - 1, look, radius=1.2)
        book.text(column + 4, row, text, 7.4)
        column += wide


def tick_boxes(
    book: Booklet, x: Number, y: Number, words: Iterable[str], *, size: Number = 4.0, pt: Number = 9
) -> Number:
    """Boxes with their words to the right; returns the x after the last."""
    for word in words:
        book.box(x, y - size * 0.82, size, size, fill="#ffffff", width=0.35)
        x += size + 1.6
        x += book.text(x, y, word, pt) + 6
    return x
