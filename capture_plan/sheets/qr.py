"""A square code that a telephone reads, as vectors: which plan a page is of."""

import numpy as np
import segno
from jaxtyping import Bool

from capture_plan.sheets.page import Booklet
from capture_plan.sheets.style import Number

QUIET = 2  # white modules around it on our white paper; ISO 18004 asks for 4 on any


def draw_code(book: Booklet, text: str, x: Number, y: Number, side: Number) -> None:
    """Draw the code of a text into a square of this side, its top left corner at x, y; millimetres."""
    dark = modules(text)
    module = side / (len(dark) + 2 * QUIET)
    book.box(x, y, side, side, fill="#ffffff", line=None)
    for row, line in enumerate(dark):
        edges = np.flatnonzero(np.diff(np.r_[False, line, False]))
        for start, end in edges.reshape(-1, 2).tolist():
            left, top = x + (QUIET + start) * module, y + (QUIET + row) * module
            book.box(left, top, (end - start) * module, module, fill="#000000", line=None)


def modules(text: str) -> Bool[np.ndarray, "s s"]:
    """Which modules of a text's code are dark; a quarter of them may be lost."""
    return np.array([[bool(module) for module in row] for row in segno.make_qr(text, error="q").matrix])
