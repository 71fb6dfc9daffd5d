"""How reference expressions stand on paper: one page each, and the overview to hang beside the camera.

Lengths are page millimetres from the top left corner, y down.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from PIL import Image

from capture_plan.expressions.sentences import FROM_REST
from capture_plan.expressions.session import Item, shot_title
from capture_plan.sheets.expression_page import KIND_COLOURS, KIND_NAMES, Shot, heat_colours
from capture_plan.sheets.furniture import tick_boxes
from capture_plan.sheets.page import MARGIN_MM, Align, Booklet
from capture_plan.sheets.shot_list import covered_words, draw_level
from capture_plan.sheets.style import ACCENT, FAINT, INK, SOFT, WASH, Number
from capture_plan.sheets.view import Picture

GAP_MM = 4.0
LARGE_SHARE = 0.6  # of the width, for the front view
FACTS_MM = 84.0  # below the pictures
OVERVIEW_COLUMNS = (4, 5)  # five where that saves a page
THUMBNAIL_PX = 360
LEAST_ARROW_MM, HEAD_MM = 9.0, 3.6  # on the page
MAP_COLUMNS, MAP_MM = 3, (31.0, 40.0)


class Plates(NamedTuple):
    """Where the pictures stand: top, width and height of the large and of the small ones."""

    top: float
    large: float
    tall: float
    small: float
    short: float


def plates(book: Booklet) -> Plates:
    """The large front view on the left; on the right two small ones, one above the other."""
    width = book.paper.width - 2 * MARGIN_MM - GAP_MM
    top = 54.0
    tall = min(book.paper.height - top - FACTS_MM, 180.0)
    large = LARGE_SHARE * width
    small = width - large
    return Plates(top, large, tall, small, (tall - 10.0) / 2)


def draw_expression(book: Booklet, shot: Shot, relaxed: Picture, item: Item, note: str) -> None:
    """The page of one expression, but for its foot; `item` is its line of the shot list, `note` of how many it is one,
    `relaxed` the neutral."""
    e = shot.expression
    left, right = MARGIN_MM, book.paper.width - MARGIN_MM
    wide = book.text(left, 19, shot_title(item), 34, bold=True)
    book.text(left + wide + 2.5, 19, note, 14, colour=SOFT)
    _fields(book, right)
    book.line((left, 23.6), (right, 23.6), width=0.5)
    book.text(left, 29, f"{FROM_REST.strip(' :')}, all at once:", 9.5, colour=SOFT)
    book.paragraph(left, 30, e.sentence, 22, width=right - left, lines=2, bold=True)
    if shot.side:
        _one_side(book, shot.side)
    _pictures(book, shot, relaxed)
    _facts(book, shot, item)


def draw_overview(book: Booklet, shots: list[Shot], items: list[Item], first: int, subtitle: str) -> int:
    """As many thumbnails as fit on the last page, from `first` on, with their `items` of the shot list; returns the
    first that did not fit."""
    total = len(shots)
    left, width = MARGIN_MM, book.paper.width - 2 * MARGIN_MM
    book.text(left, 15, "EXPRESSIONS AT A GLANCE", 19, bold=True)
    book.paragraph(left, 16.2, subtitle, 7.4, width=width - 66, lines=2, colour=SOFT)
    _fields(book, left + width)
    book.line((left, 23.6), (left + width, 23.6), width=0.5)
    rows, columns = overview_grid(book, total)
    cell_w, cell_h = (width + 2.5) / columns, (book.paper.height - 27 - 11) / rows
    last = min(first + rows * columns, total)
    for index in range(first, last):
        row, column = divmod(index - first, columns)
        x, y = left + column * cell_w, 27 + row * cell_h
        _thumbnail(book, shots[index], items[index], x, y, cell_w - 2.5, cell_h - 2.5)
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


def _pictures(book: Booklet, shot: Shot, relaxed: Picture) -> None:
    top, large, tall, small, short = plates(book)
    left, x = MARGIN_MM, MARGIN_MM + large + GAP_MM
    book.image(shot.front.rgb, left, top, large, tall)
    book.text(left + 1, top + tall - 1.5, "actor's right", 8.5, bold=True, colour=SOFT)
    book.text(left + large - 1, top + tall - 1.5, "actor's left", 8.5, bold=True, colour=SOFT, align="right")
    book.image(shot.three_quarter.rgb, x, top, small, short)
    book.text(x, top + short + 2.2, "from the actor's left", 7.4, colour=SOFT)
    below = top + short + 5
    book.image(relaxed.rgb, x, below, small, short)
    book.text(x, below + short + 2.2, "relaxed, to compare", 7.4, colour=SOFT)
    for arrow in shot.arrows:
        start, end = on_page(shot.front, arrow, left, top, large)
        draw_arrow(book, start, end)
    for arrow in shot.side_arrows:
        start, end = on_page(shot.three_quarter, arrow, x, top, small)
        draw_arrow(book, start, end, 0.7)


def on_page(
    shown: Picture, points: Float[np.ndarray, "n 2"], x: Number, y: Number, width: Number
) -> Float[np.ndarray, "n 2"]:
    """Places on the page of points of view space on a picture that stands at (x, y) with this width."""
    frame = shown.frame
    return (points - [frame.left, frame.top]) * [1, -1] * (width / frame.width) + [x, y]


def draw_arrow(book: Booklet, start: Float[np.ndarray, " 2"], end: Float[np.ndarray, " 2"], scale: Number = 1) -> None:
    """An arrow that ends where the skin goes, long enough to be seen, `scale` times as heavy as on an actor's page."""
    away, head_mm = end - start, scale * HEAD_MM
    along = away / max(float(np.hypot(*away)), 1e-9)
    long = max(float(np.hypot(*away)), scale * LEAST_ARROW_MM)
    start, across = end - along * long, np.array([-along[1], along[0]])
    head = np.array([end, end - head_mm * along + head_mm / 2 * across, end - head_mm * along - head_mm / 2 * across])
    book.polygon(head, fill="#ffffff", line="#ffffff", width=1.4 * scale)
    book.line(start, end - head_mm * along, width=2.4 * scale, colour="#ffffff")
    book.line(start, end - head_mm / 2 * along, width=1.1 * scale, colour=ACCENT)
    book.polygon(head, fill=ACCENT, line=ACCENT, width=0.2 * scale)


def draw_maps(book: Booklet, shots: list[Shot], items: list[Item], first: int) -> int:
    """How far every place of the face moves, and which skin is active, for as many expressions as fit on the last page
    from `first` on, with their `items` of the shot list; returns the first that did not fit."""
    left, width = MARGIN_MM, book.paper.width - 2 * MARGIN_MM
    book.text(left, 15, "WHERE THE FACE MOVES", 19, bold=True)
    words = (
        "for technicians: how far the skin moves, and which skin is active, which only smooth, which still. 'Brings': "
    )
    words += "the share of the rebuilt rig's expected squared error that the full list of scans takes away"
    book.paragraph(left, 16.6, words, 7.6, colour=SOFT, width=width, lines=2)
    book.line((left, 23.6), (left + width, 23.6), width=0.5)
    rows, last = map_rows(book), min(first + map_rows(book) * MAP_COLUMNS, len(shots))
    cell_w, cell_h = width / MAP_COLUMNS, (book.paper.height - 27 - 11) / rows
    for index in range(first, last):
        row, column = divmod(index - first, MAP_COLUMNS)
        x, y, shot = left + column * cell_w, 27 + row * cell_h, shots[index]
        e, narrow, short = shot.expression, MAP_MM[0], MAP_MM[1]
        wide = book.text(x, y + 4, shot_title(items[index]), 11, bold=True)
        share = f"{e.name} · brings {e.gain:.1%}, {covered_words(e.covered)} so far"
        book.text(x + wide + 1.5, y + 4, share, 7, colour=SOFT, fit=cell_w - wide - 3)
        book.image(shot.heat.rgb, x, y + 5.5, narrow, short)
        _heat_bar(book, x, y + 6.5 + short, narrow, shot.scale_mm)
        book.image(shot.kinds.rgb, x + narrow + 1, y + 5.5, narrow, short)
        _kinds_key(book, x + narrow + 1, y + 6.5 + short, narrow)
    return last


def map_rows(book: Booklet) -> int:
    """Rows of maps on a page."""
    return int((book.paper.height - 38) // (MAP_MM[1] + 15))


def _kinds_key(book: Booklet, x: Number, y: Number, width: Number) -> None:
    """The three colours of what is still, smoothing and active, with their names."""
    third = width / len(KIND_NAMES)
    for i, (name, colour) in enumerate(zip(KIND_NAMES, KIND_COLOURS, strict=True)):
        fill = "#" + "".join(f"{round(255 * channel):02x}" for channel in colour)
        book.box(x + i * third, y, third, 2.6, fill=fill, width=0.15)
        book.text(x + (i + 0.5) * third, y + 6, name, 6.6, align="centre")


def _heat_bar(book: Booklet, x: Number, y: Number, width: Number, scale_mm: Number) -> None:
    strip = (heat_colours(np.linspace(0, 1, 400)) * 255).round().astype(np.uint8)[None].repeat(12, axis=0)
    book.image(strip, x, y, width, 2.6)
    book.box(x, y, width, 2.6, width=0.15)
    places: tuple[tuple[float, Align], ...] = ((0.0, "left"), (0.5, "centre"), (1.0, "right"))
    for share, align in places:
        unit = " mm" if share == 1 else ""
        book.text(x + share * width, y + 6, f"{scale_mm * share:g}{unit}", 7.4, align=align, colour=INK)


def _facts(book: Booklet, shot: Shot, item: Item) -> None:
    """Difficulty, what to avoid, what to do instead, and what is ticked and written at the shoot."""
    e, left, right = shot.expression, MARGIN_MM, book.paper.width - MARGIN_MM
    plate = plates(book)
    y, width = plate.top + plate.tall + 9, right - left
    half = (width - 6) / 2
    _hard(book, item, left, y, half)
    _instead(book, item, left + half + 6, y, half)
    names = "Blendshapes at full: " + ", ".join(e.blendshapes)
    if e.drivers:
        names += f"; held besides: {', '.join(e.drivers)}"
    y = book.paper.height - 36
    book.paragraph(left, y - 8.6, names, 7.4, width=width, lines=2, colour=SOFT)
    book.line((left, y), (right, y), width=0.15, colour=FAINT)
    y = book.paper.height - 28
    ticks = ("pass", "retake", "fallback") if item.fallback else ("pass", "retake")
    x = tick_boxes(book, left, y, ticks, size=5.5, pt=12.5)
    book.text(x + 2, y, f"hold {item.hold_s:g} s", 12.5, bold=True)
    clock = f"done about {item.minutes:.0f} min after the start (an estimate)"
    book.text(right, y, clock, 8, colour=SOFT, align="right")
    y = book.paper.height - 17
    for x, end, word in ((left, left + 62, "takes"), (left + 68, right, "notes")):
        book.text(x, y, word, 8, colour=SOFT)
        book.line((x + 10, y + 0.8), (end, y + 0.8), width=0.2, colour=SOFT)


def _hard(book: Booklet, item: Item, x: Number, y: Number, width: Number) -> None:
    """How hard it is and why, and what people do wrong."""
    if item.difficulty is None:
        return
    after = x + book.text(x, y, "Difficulty", 9.5, bold=True) + 3
    after = draw_level(book, after, y, item.difficulty.level, size=2.8)
    book.text(after + 1.5, y, f"{item.difficulty.level} of 5", 8, colour=SOFT)
    why = "; ".join(item.difficulty.reasons) or "most people can do it at once"
    y = book.paragraph(x, y + 1.4, why, 8.2, width=width, lines=3)
    if item.mistakes:
        text = "; ".join(item.mistakes)
        y = book.paragraph(x, y + 1.6, f"Watch out: {text}.", 8.6, width=width, lines=2, bold=True)


def _instead(book: Booklet, item: Item, x: Number, y: Number, width: Number) -> None:
    """The two simpler expressions of one that an actor cannot do."""
    if not item.fallback:
        book.text(x, y, "One movement: nothing simpler to fall back to", 8.6, colour=SOFT, fit=width)
        return
    book.text(x, y, f"If it does not work, shoot instead: + {len(item.fallback)} shots", 9.5, bold=True)
    y += 1.4
    for part in item.fallback:
        book.box(x, y + 1.0, 3.2, 3.2, fill="#ffffff", width=0.3)
        wide = book.text(x + 5, y + 3.7, part.name, 8.6, bold=True)
        y = max(book.paragraph(x + 6.5 + wide, y, part.sentence, 8.6, width=width - 6.5 - wide, lines=2), y + 5) + 1.2


def _thumbnail(book: Booklet, shot: Shot, item: Item, x: Number, y: Number, w: Number, h: Number) -> None:
    e = shot.expression
    book.box(x, y, w, h, line=FAINT, width=0.2)
    text_h = 17.0
    picture_h = h - text_h
    rows, columns = shot.front.rgb.shape[:2]
    picture_w = min(w - 1, picture_h * columns / rows)
    size = (THUMBNAIL_PX, round(THUMBNAIL_PX * rows / columns))
    small = np.asarray(Image.fromarray(shot.front.rgb).resize(size, Image.Resampling.BOX))
    book.image(small, x + (w - picture_w) / 2, y + 0.5, picture_w, picture_w * rows / columns)
    wide = book.text(x + 1.5, y + 5, shot_title(item), 11, bold=True, halo="#ffffff")
    book.text(x + 3 + wide, y + 5, item.name, 8, colour=SOFT, halo="#ffffff")
    book.box(x + w - 6, y + 1.6, 4.2, 4.2, fill="#ffffff", width=0.3)
    book.text(x + w - 1.5, y + h - text_h + 0.5, covered_words(e.covered), 7.5, bold=True, align="right", colour=ACCENT)
    if shot.side:
        book.text(x + 1.5, y + h - text_h + 0.5, f"actor's {shot.side}", 6.6, bold=True, colour=ACCENT)
    book.paragraph(x + 1.5, y + h - text_h + 1.4, e.sentence, 7.6, width=w - 3, lines=4)
    book.box(x, y + h - 1, w, 1, fill=WASH, line=None)
    book.box(x, y + h - 1, w * min(e.covered, 1), 1, fill=ACCENT, line=None)
