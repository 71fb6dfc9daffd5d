"""Tables of text: delimiter, decimal sign, line of names and rows of numbers, found from the whole file.

Delimiter   of comma, semicolon, tab and bar the one that cuts the line of names into as many fields as most of some
            rows taken evenly from the whole file; what "sep=" says counts where two do equally well
            Rows that another one cuts as well are joined anew, and said
Decimal     a comma where more of the cells that are numbers have one than a full stop
Lines       of messages (`messages.py`), cells between spaces (`spaced.py`) and a row for each weight (`long_table.py`)
            are first brought into the form of a table
Side        a table whose names run down is turned first (`turned.py`)
Names       of the first lines the one that fits the rows best and is mostly text; what stands before is left out
Rows        parsed by NumPy in blocks; a block with a cell that is no number, cell by cell. A row too short or too long
            is damaged, unless what is missing are all of its weights: then it holds no face

    Timecode,BlendshapeCount,EyeBlinkLeft,...              Live Link Face
    frame, face_id, timestamp, confidence, success, ..., AU01_r, ..., AU01_c, ...      OpenFace
"""

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float

from capture_plan.curves.around import (
    begins_again,
    in_time,
    refuse_joined,
    stated_rate,
    without_doubles,
    without_sums,
)
from capture_plan.curves.cells import SAMPLE, numeric_columns, parse, per_cent_of_some, without_words
from capture_plan.curves.clock import Timing, agreed, by_numbers, timing_by
from capture_plan.curves.columns import CLOCK_KINDS, kind_of, of_path, plain, unit_of, why_not
from capture_plan.curves.face_cap import as_table, is_face_cap
from capture_plan.curves.frames import evenly
from capture_plan.curves.json_take import read_json
from capture_plan.curves.json_weights import known
from capture_plan.curves.long_table import across_names
from capture_plan.curves.lost_signs import rows_without_face
from capture_plan.curves.messages import message_values
from capture_plan.curves.presence import answer, face_of, other_faces, refuse_takes
from capture_plan.curves.rows import Rows, table_of
from capture_plan.curves.spaced import with_names, without_spaces
from capture_plan.curves.sparse import fill_cells
from capture_plan.curves.streams import in_turn
from capture_plan.curves.text import (
    COMMA,
    NOTHING,
    Lines,
    TextTable,
    lines_of,
    of_one_delimiter,
    split,
    text_of,
)
from capture_plan.curves.turned import upright_table
from capture_plan.curves.units_in_names import stated_in
from capture_plan.curves.weights import WeightTable
from capture_plan.errors import RigError
from capture_plan.input.bounds import MOST_ROWS, check_cells, check_line_sizes, check_names

DELIMITERS = (",", ";", "\t", "|")
FIRST = 12  # lines among which the names are looked for
NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?", re.IGNORECASE)
JSON = re.compile(r"\s*(?:\{\s*\"|\[\s*[\[{\"])")
POWER = re.compile(r"(?<=[\d.,])e[+-]?(?=\d)", re.IGNORECASE)  # 1,2E-05
DIGIT = re.compile(r"\d")
AMOUNT = re.compile(r"[-+\d][-+\d:;.,TZ ]*%?")  # a number, a timecode, a date


def read_csv(path: Path) -> WeightTable:
    """The frames of a table of text. RigError that names the row where it is none."""
    text, notes = text_of(path)
    if JSON.match(text):
        return read_json(path)
    check_line_sizes(text, "", MOST_ROWS)
    lines = lines_of(text, notes)
    del text  # as much memory as the file
    if is_face_cap(lines.texts):
        return weights_of(as_table(lines))
    lines = without_spaces(message_values(lines))
    lines = across_names(with_names(lines, DELIMITERS), DELIMITERS)
    return weights_of(find_table(upright_table(lines, DELIMITERS)))


def weights_of(table: TextTable) -> WeightTable:
    """The weights among the columns of a table, in the rows that hold a face."""
    table = without_sums(_one_face(without_doubles(table)))
    timing = in_time(_timing_in(table), table.fps)
    table = table if timing.order is None else table.at(timing.order.tolist())
    numeric = numeric_columns(table)
    reasons = [why_not(name) or ("" if good else "it holds text, not numbers")
               for name, good in zip(table.names, numeric, strict=True)]  # fmt: skip
    chosen = [c for c, reason in enumerate(reasons) if not reason]
    if not chosen:
        raise RigError(f"has no column of numbers besides {', '.join(table.names[:4])}: export the weights")
    faces = np.array([known(table.names[c]) for c in chosen])
    x, faults = without_words(table, chosen, *parse(table, chosen), faces if faces.any() else ~faces)
    lost, other = lost_rows(table, x)
    x, message = fill_cells(
        x,
        ~lost & ~np.isin(np.arange(len(x)), list(faults)),
        faces if faces.any() else ~faces,
        [table.names[c] for c in chosen],
    )
    skipped = [
        (name or f"column {c:,}", reason)
        for c, (name, reason) in enumerate(zip(table.names, reasons, strict=True), 1)
        if reason
    ]
    rows, mixed = Rows(tuple(table.names[c] for c in chosen), x, lost, faults), per_cent_of_some(table, chosen)
    if mixed.any():
        signs = (
            f"only {mixed.sum():,} of its {len(mixed):,} columns of numbers carry a %: these are taken as hundredths"
        )
        table = replace(table, stated=None, notes=(*table.notes, signs))
    return table_of(
        rows,
        timing.fps,
        skipped,
        (*table.notes, *other, *([message] if message else []), *begins_again(table), *timing.notes),
        table.stated,
    )


def find_table(lines: Lines) -> TextTable:
    """The table in these lines. RigError where they are none."""
    if len(lines.texts) < 2:
        raise RigError("has no frames: it needs a line of names and one line for each frame")
    delimiter, first = find_header(lines)
    lines = of_one_delimiter(lines, first, delimiter, DELIMITERS)
    names = [of_path(name.strip().strip('"')) for name in split(lines.texts[first], delimiter)]
    while len(names) > 1 and not names[-1]:
        names.pop()
    check_cells(len(lines.texts), len(names))
    check_names(names, "")
    before = "the line before the line of names is" if first == 1 else f"the {first} lines before the line of names are"
    notes = (*lines.notes, f"{before} left out") if first else lines.notes
    refuse_joined(lines.texts, first, delimiter)
    at, units, messages = frame_lines(lines.texts, first, delimiter)
    rows, numbers = tuple(lines.texts[t] for t in at), tuple(lines.numbers[t] for t in at)
    if not rows:
        raise RigError("has no frames: it needs a line of names and one line for each frame")
    some = [split(rows[t], delimiter) for t in evenly(len(rows), SAMPLE)]
    cells = [cell.strip().removesuffix("%").strip() for fields in some for cell in fields]
    commas = sum(bool(COMMA.fullmatch(cell)) for cell in cells)
    return TextTable(
        names=tuple(names),
        rows=rows,
        numbers=numbers,
        delimiter=delimiter,
        comma=commas > sum("." in cell and bool(NUMBER.fullmatch(cell)) for cell in cells),
        percent=(percent := any(cell.strip().endswith("%") for fields in some for cell in fields)),
        stated=100.0 if percent else stated_in(units),
        notes=(*notes, *messages),
        fps=stated_rate((*lines.comments, *lines.texts[:first])),
    )


def frame_lines(texts: Sequence[str], first: int, delimiter: str) -> tuple[list[int], list[str], tuple[str, ...]]:
    """Which lines are frames, the cells of a line of units below the names, and a sentence about what is no frame.

    A line without any number, and with words that no tracker says of a face, is none: units, a second line of names.
    """
    at = range(first + 1, len(texts))
    none = [t for t in at if texts[t] == texts[first] or is_no_frame(texts[t], delimiter)]
    below = [cell.strip().strip('"') for cell in split(texts[first + 1], delimiter)]
    units = has_words(texts[first + 1], delimiter) and not any(map(AMOUNT.fullmatch, below))
    if units and none[:1] != [first + 1]:
        none.insert(0, first + 1)
    gone = set(none)
    shown = ", ".join(f"'{texts[t][:24].strip()}'" for t in none[:2])
    lines, out = ("line holds", "is") if len(none) == 1 else ("lines hold", "are")
    message = f"{len(none):,} {lines} no frame and {out} left out ({shown})"
    return [t for t in at if t not in gone], below if units else [], (message,) if none else ()


def is_no_frame(text: str, delimiter: str) -> bool:
    """Whether a line has words and no number."""
    return not DIGIT.search(text) and has_words(text, delimiter)


def has_words(text: str, delimiter: str) -> bool:
    """Whether a line holds a word besides those for "nothing" and for a face that is tracked or lost."""
    cells = (cell.strip().strip('"').strip().lower() for cell in split(text, delimiter))
    return any(cell not in NOTHING and answer(cell) is None for cell in cells)


def find_header(lines: Lines) -> tuple[str, int]:
    """The delimiter, and which line holds the names."""
    best, found = (-1.0, 0), ("\t", 0)
    for first in range(min(FIRST, len(lines.texts) - 1)):
        for delimiter in DELIMITERS:
            fields = split(lines.texts[first], delimiter)
            words = sum(any(map(str.isalpha, POWER.sub("", field))) for field in fields)
            named = [field for field in fields if field.strip()]
            if len(fields) < 2 or 2 * words < len(fields) or 2 * len(set(named)) < len(named):  # groups of columns
                continue
            rows = lines.texts[first + 1 :]
            counts = [len(split(rows[t], delimiter)) for t in evenly(len(rows), SAMPLE)]
            share = np.mean([abs(count - len(fields)) <= (count > len(fields)) for count in counts])
            score = (float(share) + 0.1 * (delimiter == lines.delimiter), len(fields))
            if score > best:
                best, found = score, (delimiter, first)
    if best[0] < 0 and any(map(mostly_numbers, (split(lines.texts[0], delimiter) for delimiter in DELIMITERS))):
        raise RigError("has no line of names above its numbers: export the take with names")
    return found


def mostly_numbers(fields: Sequence[str]) -> bool:
    """Whether half of these or more are numbers."""
    return 2 * sum(bool(NUMBER.fullmatch(field.strip())) for field in fields) >= len(fields)


def _one_face(table: TextTable) -> TextTable:
    """The rows of one face, where columns tell of several or of devices in turn. RigError where they tell of several
    takes."""
    times = times_in(table)
    doubled = 2 * len(set(times)) <= len(times) + 1
    for c, name in enumerate(table.names):
        kind, what = kind_of(name), "faces"
        if kind == "take":
            refuse_takes(name, table.column(c))
        if kind == "source" or (doubled and kind is None and not known(name) and in_turn(table.column(c), times)):
            what = "devices"
        elif kind != "face" or is_flag(table, c):
            continue
        other, message = other_faces(name, table.column(c), times, what=what)
        if message:
            table = replace(table.at(np.flatnonzero(~other).tolist()), notes=(*table.notes, message))
            times = times_in(table)
    return table


def times_in(table: TextTable) -> list[str]:
    """The cells of the first column of timecodes or times; none where there is none."""
    c = next((c for c, name in enumerate(table.names) if kind_of(name) in ("code", "time")), None)
    return [] if c is None else table.column(c)


def is_flag(table: TextTable, c: int) -> bool:
    """Whether a column `face` of 0 and 1 says if there is a face, and not which: no time then stands twice."""
    faces = {face_of(cell) for cell in table.column(c)} if plain(table.names[c]) == "face" else set()
    if len(faces) < 2 or faces - {"0", "1", ""}:  # of one face alone, a column says no more
        return False
    clock = next((i for i, name in enumerate(table.names) if kind_of(name) in ("code", "time", "count")), None)
    times = () if clock is None else table.column(clock)
    return clock is not None and len(set(times)) == len(times)


def lost_rows(table: TextTable, x: Float[np.ndarray, "t c"]) -> tuple[Bool[np.ndarray, " t"], tuple[str, ...]]:
    """Rows in which the tracker says that it failed or that it has no weights, and what has to be said of its words."""
    lost, notes = np.zeros(len(x), dtype=bool), []
    for c, name in enumerate(table.names):
        kind = "tracked" if kind_of(name) == "face" and is_flag(table, c) else kind_of(name)
        if kind in ("tracked", "lost", "confidence", "weights"):
            failed, message = rows_without_face(name, table.column(c), x, kind)
            if kind == "weights":
                failed &= ~np.nan_to_num(x).any(axis=1)
            lost |= failed
            notes += [message] if message and kind != "weights" else []
    return lost, tuple(notes)


def _timing_in(table: TextTable) -> Timing:
    """The timing that the columns tell: timecodes first, then times, steps, a rate, numbers of frames."""
    timings = [
        (name, timing_by(kind, table.column(c), unit_of(name)))
        for kind in CLOCK_KINDS
        for c, name in enumerate(table.names)
        if kind_of(name) == kind
    ]
    if timings:
        return agreed(timings)
    numbers = (by_numbers(name, table.column(c)) for c, name in enumerate(table.names) if kind_of(name) == "count")
    return next(numbers, Timing(None))
