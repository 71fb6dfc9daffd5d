"""Long tables: a row for each weight of each frame, as databases and data frames keep them.

    time,name,value            a line of names or none; other columns may stand between
    0.000,jawOpen,0.34
    0.000,eyeBlinkLeft,0.07
Name      the column that holds names of a face, each many times
Value     the column called so, else the last one of numbers
Frame     rows of one time, or of one number of the frame, wherever they stand; where each row has a time of its own, up
          to the name that comes again
They become the lines of a table with the names across (`delimited.py`); columns about the face stay.
"""

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace

from capture_plan.rig.sequence.clock_cells import is_number
from capture_plan.rig.sequence.columns import kind_of, plain
from capture_plan.rig.sequence.frames import evenly
from capture_plan.rig.sequence.json_weights import known
from capture_plan.rig.sequence.messages import DELIMITER, Message, across, frames_of
from capture_plan.rig.sequence.text import Lines, split

SAMPLE = 200  # rows that tell the columns
WIDEST = 12  # columns
NAMES = 0.8  # of the cells of a column
FEWEST = 2  # names
AGAIN = 2  # times that each name stands in the file, at least
VALUE = re.compile(
    r"(?:blendshape|shape|morph|expression)?(?:values?|val|weights?|scores?|intensity|coefficients?|amount)"
)
WHOSE = ("face", "take")  # columns that part frames
BESIDE = ("tracked", "lost", "confidence")  # columns of which a frame has what its first row says
TWICE = 0.05  # of the rows may have the time and the name of another


@dataclass(frozen=True)
class Columns:
    """Where names and values of a long table stand; `titles` of its columns, empty without a line of titles."""

    name: int
    value: int
    titles: tuple[str, ...]


def across_names(lines: Lines, delimiters: Sequence[str]) -> Lines:
    """The lines of the same table with the names across; the lines themselves where it is no long table."""
    for delimiter in delimiters:
        some = [cells_of(lines.texts[t], delimiter) for t in evenly(len(lines.texts), SAMPLE)]
        if not looks_long(some):
            continue
        rows = [cells_of(text, delimiter) for text in lines.texts]
        if found := columns_of(rows):
            return turned(lines, rows, found)
    return lines


def cells_of(text: str, delimiter: str) -> list[str]:
    """The cells of a line, without quotes."""
    if '"' not in text and " " not in text:  # half the time for a million lines
        return text.strip().split(delimiter)
    return [cell.strip().strip('"').strip() for cell in split(text, delimiter)]


def looks_long(some: Sequence[Sequence[str]]) -> bool:
    """Whether most of some rows are equally long, short, and hold one name of a face."""
    widths = Counter(map(len, some))
    width, often = widths.most_common(1)[0]
    return 2 <= width <= WIDEST and often >= NAMES * len(some) and name_column(some, width) is not None


def name_column(rows: Sequence[Sequence[str]], width: int) -> int | None:
    """The column that holds names of a face; None where none does."""
    whole = [row for row in rows if len(row) == width]
    for c in range(width):
        names = [row[c] for row in whole if known(row[c]) and not is_number(row[c])]
        if len(names) >= NAMES * len(whole) and len(set(names)) >= FEWEST:
            return c
    return None


def columns_of(rows: Sequence[Sequence[str]]) -> Columns | None:
    """Where names and values stand; None where names stand once, or no column of numbers beside them."""
    width = Counter(map(len, rows)).most_common(1)[0][0]
    name = name_column([rows[t] for t in evenly(len(rows), SAMPLE)], width)
    if name is None:
        return None
    titled = len(rows[0]) == width and not any(map(is_number, rows[0]))
    body = [row for row in rows[titled:] if len(row) == width]
    if titled and sum(map(known, rows[0])) >= FEWEST:
        return None  # names stand across
    if len({row[name] for row in body}) * AGAIN > len(body):
        return None
    some = [body[t] for t in evenly(len(body), SAMPLE)]
    numeric = [
        c for c in range(width) if c != name and sum(is_number(row[c].rstrip("%")) for row in some) > len(some) / 2
    ]
    titles = tuple(rows[0]) if titled else ()
    called = [c for c in numeric if titled and VALUE.fullmatch(plain(titles[c]))]
    return Columns(name, (called or numeric)[-1], titles) if numeric else None


def turned(lines: Lines, rows: Sequence[Sequence[str]], found: Columns) -> Lines:
    """The table with a line for each frame."""
    width = max(found.name, found.value, len(found.titles) - 1) + 1
    body = [(row, n) for row, n in zip(rows, lines.numbers, strict=True) if len(row) >= width][bool(found.titles) :]
    odd = len(rows) - len(body) - bool(found.titles)
    notes = (*lines.notes, *([f"{odd:,} of its lines hold too few cells and are left out"] if odd else []))
    clock = clock_of([row for row, _ in body], found)
    if clock is not None and 2 * len({row[clock] for row, _ in body}) <= len(body):
        return at_times(replace(lines, notes=notes), [row for row, _ in body], found, clock)
    messages = (
        Message(n, row[clock] if clock is not None else "", row[found.name], row[found.value]) for row, n in body
    )
    return across(frames_of(messages), "hold one weight each", notes)


def at_times(lines: Lines, rows: Sequence[Sequence[str]], found: Columns, clock: int) -> Lines:
    """The table of frames that are rows of one time, and of one face or take where columns tell these."""
    kinds = {c: kind_of(title) for c, title in enumerate(found.titles) if c not in (found.value, clock)}
    key = [clock, *(c for c, kind in kinds.items() if kind in WHOSE)]
    beside = [c for c, kind in kinds.items() if kind in BESIDE]
    frames: dict[tuple[str, ...], dict[str, str]] = {}
    about: dict[tuple[str, ...], list[str]] = {}
    for row in rows:
        at = tuple(row[c] for c in key)
        frames.setdefault(at, {}).setdefault(row[found.name], row[found.value])
        about.setdefault(at, [row[c] for c in beside])
    names = list(dict.fromkeys(name for cells in frames.values() for name in cells))
    head = [found.titles[c] for c in (*key, *beside)] if found.titles else ["time"]
    table = [[*at, *about[at], *(cells.get(name, "") for name in names)] for at, cells in frames.items()]
    texts = tuple(DELIMITER.join(cells) for cells in ([*head, *names], *table))
    told = f"its lines hold one weight each: they make {len(frames):,} frames of {len(names):,} names"
    twice = len(rows) - sum(map(len, frames.values()))
    some = "1 of its lines has" if twice == 1 else f"{twice:,} of its lines have"
    again = [f"{some} the time and the name of one before: left out"] if twice else []
    return Lines(texts, tuple(range(len(texts))), DELIMITER, (*lines.notes, told, *again))


def clock_of(rows: Sequence[Sequence[str]], found: Columns) -> int | None:
    """The column whose cells, with the name, stand once each: times before numbers of frames; None where none does."""
    others = [c for c in range(len(rows[0])) if c not in (found.name, found.value)]
    if found.titles:
        kinds = {c: kind_of(found.titles[c]) for c in others}
        others = [c for kind in ("code", "time", "count") for c in others if kinds[c] == kind]
    faces = [c for c, title in enumerate(found.titles) if kind_of(title) == "face"]
    for c in others:
        once = {tuple(row[i] for i in (c, found.name, *faces)) for row in rows}
        if len(once) >= (1 - TWICE) * len(rows):
            return c
    return None
