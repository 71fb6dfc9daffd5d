"""The shot list on paper: every item of the session in one table, with the clock, boxes to tick and where to stop.

Lengths are page millimetres from the top left corner, y down.
"""

from capture_plan.expressions.session import Item, Session, easy_words, shot_number, spare_words, stop_below
from capture_plan.sheets.furniture import head_line
from capture_plan.sheets.page import MARGIN_MM, Booklet
from capture_plan.sheets.style import ACCENT, FAINT, INK, SOFT, WASH, Number

TOP_MM, BOTTOM_MM = 34.0, 19.0
TALL_MM, FLAT_MM, STOP_MM = 9.3, 6.6, 6.4  # an expression has two lines; the line that says where to stop
# Left edge of each column, millimetres from the margin.
COLUMNS = {"slate": 1.5, "name": 11.0, "words": 23.0, "hard": 123.0, "hold": 140.0, "clock": 149.0, "covered": 161.0}
WORDS_PT, LINE_MM = 7.6, 3.2
WORDS_MM, FAR_MM = (COLUMNS[key] - COLUMNS["words"] - 3 for key in ("hard", "hold"))
TICKS = ("pass", "retake")
CLOCK = "Done: minutes from the start, estimated. Covered: how much of what the full list brings is taken by then. "
CLOCK += "Difficulty 1 to 5. Sides are the actor's own."
TICK_MM = 10.0
LEVELS = 5
ALL = 1 - 1e-6  # what is missing beyond that is rounding


def paged(book: Booklet, of: Session) -> list[list[Item]]:
    """The items of every page."""
    room = book.paper.height - TOP_MM - BOTTOM_MM
    pages: list[list[Item]] = [[]]
    used = 0.0
    for item in of.items:
        if used + height(book, item, of) > room:
            pages.append([])
            used = 0.0
        pages[-1].append(item)
        used += height(book, item, of)
    return pages


def height(book: Booklet, item: Item, of: Session) -> float:
    """Of a row with what is drawn below it."""
    return row_height(book, item) + (STOP_MM if item.name == stop_below(of) else 0.0)


def row_height(book: Booklet, item: Item) -> float:
    """As many lines as its sentence takes."""
    least, lines = (TALL_MM if item.kind == "expression" else FLAT_MM), len(_words(book, item))
    return max(least, LINE_MM * lines + 2.6)


def _words(book: Booklet, item: Item) -> list[str]:
    """The lines of a sentence, which reaches further where no difficulty stands beside it."""
    return book.broken(item.sentence, WORDS_PT, width=WORDS_MM if item.kind == "expression" else FAR_MM)


def draw_shot_list(
    book: Booklet, of: Session, items: list[Item], apart: tuple[tuple[str, str, str], ...] = (), near: str = ""
) -> None:
    """A page of the table; below the last item what is planned apart (its heading, names and what to do), and which
    dots come `near` each other."""
    spare = spare_words(of)
    head_line(book, "SHOT LIST", (_summary(of), spare) if spare else (_summary(of),))
    left, right = MARGIN_MM, book.paper.width - MARGIN_MM
    y = TOP_MM - 4
    heads = {"slate": "shot", "name": "name", "words": "what the actor is told", "hard": "difficulty"}
    for key, text in (heads | {"hold": "hold", "clock": "done, min", "covered": "covered"}).items():
        book.text(left + COLUMNS[key], y, text, 6.8, bold=True)
    ticks = right - TICK_MM * len(TICKS)
    for i, text in enumerate(TICKS):
        book.text(ticks + TICK_MM * (i + 0.5), y, text, 6.4, bold=True, align="centre")
    book.line((left, y + 1.6), (right, y + 1.6), width=0.3)
    y = TOP_MM - 2
    for item in items:
        _row(book, item, y, ticks)
        below = y + row_height(book, item)
        if item.name == stop_below(of):
            _stop(book, of.stop, below)
        y += height(book, item, of)
    note = f"{CLOCK} {easy_words(of)}".rstrip()
    foot = min(y + 1, book.paper.height - BOTTOM_MM + 3)
    foot = book.paragraph(left, foot, note, 7, width=right - left, lines=2, colour=SOFT)
    last = items[-1:] == list(of.items[-1:])
    lines = 2 if foot < book.paper.height - 2 * BOTTOM_MM else 1
    if apart and last:
        message = ". ".join(f"{heading} ({names.count(', ') + 1}): {names}" for heading, names, _ in apart)
        foot = book.paragraph(left, foot, f"Planned apart. {message}", 7, width=right - left, lines=lines, colour=SOFT)
    if near and last:
        book.paragraph(left, foot, near, 7, width=right - left, lines=lines, bold=True)


def _summary(of: Session) -> str:
    """'18 expressions and 7 other shots in 25 minutes'."""
    shown = sum(item.kind == "expression" and item.fits for item in of.items)
    others = sum(item.kind not in ("expression", "pause") for item in of.items)
    text = f"{shown} expressions and {others} other shots in {of.minutes:.0f} minutes"
    if of.settings.minutes is not None:
        text += f" of the {of.settings.minutes:g} there are"
    return f"{text} · hold {of.settings.hold_s:g} s · {of.settings.retakes:g} retakes per expression"


def draw_level(book: Booklet, x: Number, y: Number, level: int, *, size: Number = 2.2) -> Number:
    """`level` of five boxes filled, the first with its left edge at x, standing on y; returns the x after the last."""
    for number in range(LEVELS):
        fill = INK if number < level else "#ffffff"
        book.box(x + number * (size + 0.7), y - size, size, size, fill=fill, line=INK, width=0.2)
    return x + LEVELS * (size + 0.7)


def _row(book: Booklet, item: Item, y: Number, ticks: Number) -> None:
    left, right = MARGIN_MM, book.paper.width - MARGIN_MM
    expression = item.kind == "expression"
    tall = row_height(book, item)
    ink = INK if item.fits else SOFT
    if not expression:
        book.box(left, y, right - left, tall, fill=WASH, line=None)
    base = y + tall / 2 + 1.2
    book.text(left + COLUMNS["slate"], base, shot_number(item), 9.5, bold=True, colour=ink)
    book.text(left + COLUMNS["name"], base, item.name, 8, colour=SOFT)
    lines = _words(book, item)
    top = y + (tall - LINE_MM * len(lines)) / 2 + 2.4
    for n, line in enumerate(lines):
        book.text(left + COLUMNS["words"], top + LINE_MM * n, line, WORDS_PT, colour=ink)
    if item.difficulty:
        draw_level(book, left + COLUMNS["hard"], base - 0.3, item.difficulty.level)
    hold = f"{item.hold_s:g} s" if item.hold_s else ""
    covered = covered_words(item.covered) if expression else ""
    for key, text in {"hold": hold, "clock": f"{item.minutes:.1f}", "covered": covered}.items():
        book.text(left + COLUMNS[key], base, text, 8, colour=ink)
    for i in range(len(TICKS) if item.kind != "pause" else 0):
        book.box(ticks + TICK_MM * (i + 0.5) - 1.9, y + tall / 2 - 1.9, 3.8, 3.8, fill="#ffffff", width=0.25)
    book.line((left, y + tall), (right, y + tall), width=0.1, colour=FAINT)


def covered_words(share: float) -> str:
    """Whole per cent, 100 only for all."""
    return f"{100 if share > ALL else min(round(100 * share), 99)}%"


def _stop(book: Booklet, words: str, y: Number) -> None:
    left, right = MARGIN_MM, book.paper.width - MARGIN_MM
    book.box(left, y + 0.6, right - left, STOP_MM - 1.2, fill=ACCENT, line=None)
    book.text(left + COLUMNS["slate"], y + 4.3, words, 8.6, bold=True, colour="#ffffff", fit=right - left - 4)
