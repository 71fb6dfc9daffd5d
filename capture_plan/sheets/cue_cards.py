"""Cue cards: an expression on each, held up beside the camera and read from where the actor sits.

One page for each expression in the order of shooting: its number and name, the sentence in letters as large as fit, the
portrait with its arrows, and what comes next, small. Lengths are page millimetres from the top left corner, y down.
"""

import numpy as np
from PIL import Image

from capture_plan.expressions.session import shot_note, shot_title
from capture_plan.plan.carry import as_worn
from capture_plan.plan.inputs import PlanInputs
from capture_plan.plan.record import Plan
from capture_plan.sheets.cues import (
    AS_IN_A_MIRROR,
    Cue,
    Fitted,
    Portrait,
    cues,
    draw_fitted,
    draw_portrait,
    fitted,
    name_sides,
    tell_small,
)
from capture_plan.sheets.page import MARGIN_MM, Booklet, landscape, paper
from capture_plan.sheets.style import ACCENT, SOFT, Number
from capture_plan.sheets.view import pixels

READ_FROM_MM = 1500.0  # the actor's seat to a card beside the camera, at least
PORTRAIT_SHARE, GAP_MM = 0.42, 5.0  # of the page's width
TOP_MM, NEXT_MM = 32.0, 30.0  # above the sentence, from the edge of the paper; height of what comes next
NAME_PT, NOTE_PT, MIRROR_PT, MOST_PT = 40, 20, 15, 110
THUMBNAIL_PX = 240


def draw_cue_cards(plan: Plan, inputs: PlanInputs, *, sheet: str, dpi: int, mirrored: bool) -> Booklet:
    """A card for every expression of the session."""
    book = Booklet(
        landscape(paper(sheet)), f"{inputs.rig.name}: cue cards", inputs.rig.names, draft="; ".join(plan.draft)
    )
    shown, worn = as_worn(plan, inputs)
    items = [item for item in shown.session.items if item.kind == "expression"]
    how = Portrait(pixels(_wide(book), book.paper.height - 2 * MARGIN_MM, dpi), mirrored=mirrored)
    made = list(cues(shown, worn, items, how))
    texts = [_fit(book, cue) for cue in made]
    for number, (cue, text) in enumerate(zip(made, texts, strict=True), start=1):
        book.add_page(f"{shot_title(cue.item)} · {cue.item.name}")
        _card(book, cue, text, shot_note(cue.item, shown.session), mirrored=mirrored)
        if number < len(made):
            _next(book, made[number])
    tell_small(((shot_title(cue.item).lower(), text) for cue, text in zip(made, texts, strict=True)), READ_FROM_MM)
    return book


def _wide(book: Booklet) -> Number:
    """Width of the portrait."""
    return PORTRAIT_SHARE * book.paper.width


def _room(book: Booklet) -> tuple[Number, Number]:
    """Width and height of the sentence."""
    width = book.paper.width - 2 * MARGIN_MM - GAP_MM - _wide(book)
    return width, book.paper.height - TOP_MM - NEXT_MM - MARGIN_MM - GAP_MM


def _fit(book: Booklet, cue: Cue) -> Fitted:
    width, height = _room(book)
    return fitted(book, cue.words, width, height, most_pt=MOST_PT * book.paper.height / 210)


def _card(book: Booklet, cue: Cue, text: Fitted, note: str, *, mirrored: bool) -> None:
    width, height = _room(book)
    name = book.text(MARGIN_MM, 24, shot_title(cue.item), NAME_PT, bold=True)
    book.text(MARGIN_MM + name + 4, 24, note, NOTE_PT, colour=SOFT)
    if mirrored:
        book.text(MARGIN_MM + name + 4, 14.5, AS_IN_A_MIRROR, MIRROR_PT, bold=True, colour=ACCENT, fit=width - name - 4)
    draw_fitted(book, MARGIN_MM, TOP_MM + (height - text.height) / 2, text, width)
    x = book.paper.width - MARGIN_MM - _wide(book)
    draw_portrait(book, cue, x, MARGIN_MM, _wide(book), scale=1.4)
    name_sides(book, cue, x, MARGIN_MM, _wide(book), mirrored=mirrored)


def _next(book: Booklet, cue: Cue) -> None:
    """The next expression in the lower left corner: its portrait and its name."""
    if cue.front is None:
        return
    rows, columns = cue.front.rgb.shape[:2]
    size = (THUMBNAIL_PX * columns // rows, THUMBNAIL_PX)
    small = np.asarray(Image.fromarray(cue.front.rgb).resize(size, Image.Resampling.BOX))
    wide, y = NEXT_MM * columns / rows, book.paper.height - MARGIN_MM
    book.image(small, MARGIN_MM, y - NEXT_MM, wide, NEXT_MM)
    book.text(MARGIN_MM + wide + 3, y - 4, f"next: {shot_title(cue.item).lower()}", NOTE_PT, colour=SOFT)
