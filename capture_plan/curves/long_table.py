"""Long tables: a row for each weight of each frame, as databases and data frames keep them.

    time,name,value            a line of names or none; other columns may stand between
    0.000,jawOpen,0.34
    0.000,eyeBlinkLeft,0.07
Name      the column that holds names of a face, each many times
Value     the column called so, else the last one of numbers
Frame     rows of one time, or of one number of the frame, wherever they stand; where each row has a time of its own, up
          to the name that comes again
Codes     every cell but the values is kept as the number of its text among those of its column, so that a million rows
          need little memory
They become the lines of a table with the names across (`delimited.py`); columns about the face stay.
"""

import csv
import re
from array import array
from collections import Counter, defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import count

import numpy as np
from jaxtyping import Int

from capture_plan.curves.clock_cells import is_clock_number
from capture_plan.curves.columns import kind_of, plain
from capture_plan.curves.frames import evenly
from capture_plan.curves.json_weights import known
from capture_plan.curves.messages import DELIMITER, Message, across, message_frames
from capture_plan.curves.text import Lines, split
from capture_plan.input.bounds import check_cells

SAMPLE = 200  # rows that tell the columns
BLOCK = 1 << 12  # rows cut at once
WIDEST = 12  # columns
NAMES = 0.8  # of the cells of a column
FEWEST = 2  # names
AGAIN = 2  # times that each name stands in the file, at least
VALUE = re.compile(
    r"(?:blendshape|shape|morph|expression)?(?:values?|val|weights?|scores?|intensity|coefficients?|amount)"
)
WHOSE = ("face", "take")  # columns that part frames
ASIDE = ("tracked", "lost", "confidence")  # columns of which a frame has what its first row says
TWICE = 0.05  # of the rows may have the time and the name of another
MOST_INT = 1 << 62
FAR = 8  # times as many as there are: numbers up to there are counted without sorting


@dataclass(frozen=True)
class Columns:
    """Where names and values of a long table stand; `titles` of its columns, empty without a line of titles.

    `width`: cells of a row; `names`: how many different ones some rows hold, fewest where the lines are cut right.
    """

    name: int
    value: int
    titles: tuple[str, ...]
    width: int
    names: int


@dataclass(frozen=True, eq=False)
class _Body:
    """The rows of a long table: `codes[c]` number the cells of column c among its `words[c]`, in their order.

    `lines` are the rows' lines among those of the file; `short` lines have too few cells and are left out.
    """

    codes: dict[int, Int[np.ndarray, " r"]]
    words: dict[int, list[str]]
    values: list[str]
    lines: array
    short: int


def across_names(lines: Lines, delimiters: Sequence[str]) -> Lines:
    """The lines of the same table with the names across; the lines themselves where it is no long table."""
    cuts = {delimiter: found for delimiter in delimiters if (found := columns_cut_by(lines.texts, delimiter))}
    if not cuts:
        return lines
    delimiter = min(cuts, key=lambda one: (cuts[one].names, -cuts[one].width))
    body = body_of(lines.texts, delimiter, cuts[delimiter])
    if len(body.words[cuts[delimiter].name]) * AGAIN > len(body.values):
        return lines
    return _turned(lines, body, cuts[delimiter])


def columns_cut_by(texts: Sequence[str], delimiter: str) -> Columns | None:
    """Where names and values stand in lines cut by this delimiter; None where they make no long table."""
    return _columns_of([cells_of(texts[t], delimiter) for t in evenly(len(texts), SAMPLE)])


def cells_of(text: str, delimiter: str) -> list[str]:
    """The cells of a line, without quotes."""
    if '"' not in text and " " not in text:  # half the time for a million lines
        return (text if delimiter == "\t" else text.strip()).split(delimiter)
    return [cell.strip().strip('"').strip() for cell in split(text, delimiter)]


def name_column(rows: Sequence[Sequence[str]], width: int) -> int | None:
    """The column that holds names of a face; None where none does."""
    whole = [row for row in rows if len(row) == width]
    for c in range(width):
        names = [row[c] for row in whole if known(row[c]) and not is_clock_number(row[c])]
        if len(names) >= NAMES * len(whole) and len(set(names)) >= FEWEST:
            return c
    return None


def _columns_of(some: Sequence[Sequence[str]]) -> Columns | None:
    """Where names and values stand, by the first row and some others; None where most are not equally long, short, and
    hold one name of a face and a number."""
    first, (width, often) = some[0], Counter(map(len, some)).most_common(1)[0]
    name = name_column(some, width) if 2 <= width <= WIDEST and often >= NAMES * len(some) else None
    if name is None:
        return None
    titled = len(first) == width and not any(map(is_clock_number, first))
    if titled and sum(map(known, first)) >= FEWEST:
        return None  # names stand across
    body = [row for row in some[titled:] if len(row) == width]
    numeric = [
        c
        for c in range(width)
        if c != name and sum(is_clock_number(row[c].rstrip("%")) for row in body) > len(body) / 2
    ]
    titles = tuple(first) if titled else ()
    called = [c for c in numeric if titled and VALUE.fullmatch(plain(titles[c]))]
    names = len({row[name] for row in body})
    return Columns(name, (called or numeric)[-1], titles, width, names) if numeric else None


def body_of(texts: Sequence[str], delimiter: str, found: Columns) -> _Body:
    """The rows below the line of titles."""
    coded = [c for c in range(found.width) if c != found.value]
    numbers = {c: defaultdict[str, int](count().__next__) for c in coded}
    codes = {c: array("i") for c in coded}
    values, lines = [], array("i")
    for start in range(bool(found.titles), len(texts), BLOCK):
        columns, whole = columns_in(texts[start : start + BLOCK], delimiter, found.width)
        for c in coded:
            codes[c].extend(map(numbers[c].__getitem__, columns[c]))
        values.extend(columns[found.value])
        lines.extend(start + t for t in whole)
    short = len(texts) - bool(found.titles) - len(lines)
    arrays = {c: np.frombuffer(codes[c], dtype=np.int32) for c in coded}
    return _Body(arrays, {c: list(numbers[c]) for c in coded}, values, lines, short)


def columns_in(block: Sequence[str], delimiter: str, width: int) -> tuple[Sequence[Sequence[str]], Sequence[int]]:
    """The first `width` columns of the lines that have as many cells or more, and which lines these are."""
    text = delimiter.join(block)
    if not any(sign in text for sign in {*'" \t'} - {delimiter}) and {line.count(delimiter) for line in block} == {
        width - 1
    }:
        cells = text.split(delimiter)  # a third of the time of cutting every line
        return [cells[c::width] for c in range(width)], range(len(block))
    rows = _rows_of(block, delimiter)
    whole = [t for t, row in enumerate(rows) if len(row) >= width]
    return [[rows[t][c] for t in whole] for c in range(width)], whole


def _rows_of(block: Sequence[str], delimiter: str) -> list[list[str]]:
    """The cells of each line, without quotes."""
    try:
        rows = list(csv.reader(block, delimiter=delimiter, skipinitialspace=True))
    except csv.Error:
        rows = []
    if len(rows) != len(block):  # a quote that is not closed
        return [cells_of(line, delimiter) for line in block]
    return [[cell.strip().strip('"').strip() for cell in row] for row in rows]


def _turned(lines: Lines, body: _Body, found: Columns) -> Lines:
    """The table with a line for each frame."""
    some = "1 of its lines holds" if body.short == 1 else f"{body.short:,} of its lines hold"
    short = [f"{some} too few cells, left out"] if body.short else []
    notes = (*lines.notes, *short)
    clock = _clock_of(body, found)
    if clock is not None and 2 * len(body.words[clock]) <= len(body.values):
        return at_times(notes, body, found, clock)
    return across(message_frames(messages_in(lines, body, found, clock)), "hold one weight each", notes)


def messages_in(lines: Lines, body: _Body, found: Columns, clock: int | None) -> Iterator[Message]:
    """A message of each row, where each has a time of its own or none has one."""
    names, times = body.words[found.name], [] if clock is None else body.words[clock]
    at = body.codes[found.name].tolist() if clock is None else body.codes[clock].tolist()
    for line, name, time, value in zip(body.lines, body.codes[found.name].tolist(), at, body.values, strict=True):
        yield Message(lines.numbers[line], times[time] if times else "", names[name], value)


def at_times(notes: tuple[str, ...], body: _Body, found: Columns, clock: int) -> Lines:
    """The table of frames that are rows of one time, and of one face or take where columns tell these."""
    kinds = {c: kind_of(title) for c, title in enumerate(found.titles) if c not in (found.value, clock)}
    key = [clock, *(c for c, kind in kinds.items() if kind in WHOSE)]
    shown = [*key, *(c for c, kind in kinds.items() if kind in ASIDE)]
    frame, first = _in_order(joint([body.codes[c] for c in key]))
    names = body.words[found.name]
    place = frame * len(names) + body.codes[found.name]
    check_cells(len(first), len(names))
    cells = np.full(len(first) * len(names), "", dtype=object)
    cells[place[::-1]] = np.array(body.values, dtype=object)[::-1]  # of several in one place the first stays
    about = [[body.words[c][body.codes[c][t]] for c in shown] for t in first.tolist()]
    head = [found.titles[c] for c in shown] if found.titles else ["time"]
    table = zip(about, cells.reshape(len(first), len(names)).tolist(), strict=True)
    texts = [DELIMITER.join([*head, *names]), *(DELIMITER.join([*left, *weights]) for left, weights in table)]
    message = f"its lines hold one weight each: they make {len(first):,} frames of {len(names):,} names"
    twice = len(place) - _distinct(place)
    some = "1 of its lines has" if twice == 1 else f"{twice:,} of its lines have"
    again = [f"{some} the time and the name of one before: left out"] if twice else []
    return Lines(tuple(texts), range(len(texts)), DELIMITER, (*notes, message, *again))


def joint(columns: Sequence[Int[np.ndarray, " r"]]) -> Int[np.ndarray, " r"]:
    """A number for each row, equal where the rows are equal in all these columns."""
    numbers = columns[0].astype(np.int64)
    for column in columns[1:]:
        more = int(column.max(initial=0)) + 1
        if int(numbers.max(initial=0)) >= MOST_INT // more:
            numbers = np.unique(numbers, return_inverse=True)[1]
        numbers = numbers * more + column
    return numbers


def _distinct(numbers: Int[np.ndarray, " r"]) -> int:
    """How many different ones there are among numbers of 0 or more."""
    if int(numbers.max(initial=0)) > FAR * len(numbers):
        return len(np.unique(numbers))
    return int(np.count_nonzero(np.bincount(numbers)))  # a tenth of the time of sorting them


def _in_order(numbers: Int[np.ndarray, " r"]) -> tuple[Int[np.ndarray, " r"], Int[np.ndarray, " n"]]:
    """Distinct numbers counted in the order in which they come, for every row; and the first row of each."""
    _, first, at = np.unique(numbers, return_index=True, return_inverse=True)
    order = first.argsort()
    return order.argsort()[at], first[order]


def _clock_of(body: _Body, found: Columns) -> int | None:
    """The column whose cells, with the name, stand once each: times before numbers of frames; None where none does."""
    others = [c for c in body.codes if c != found.name]
    if found.titles:
        kinds = {c: kind_of(found.titles[c]) for c in others}
        others = [c for kind in ("code", "time", "count") for c in others if kinds[c] == kind]
    faces = [c for c, title in enumerate(found.titles) if kind_of(title) == "face" and c in body.codes]
    for c in others:
        once = _distinct(joint([body.codes[i] for i in (c, found.name, *faces)]))
        if once >= (1 - TWICE) * len(body.values):
            return c
    return None
