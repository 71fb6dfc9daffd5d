"""Tables that lie on their side: each line is a name with its weights in all frames, and the frames run across.

    name, 0, 1, 2, ...            numbers or times of the frames, or names that mean nothing of a face; or no such line
    jawOpen, 0.1, 0.2, ...
Found by where the names stand: down one of the first columns, each once, and hardly any across the top.
"""

from collections.abc import Sequence

from capture_plan.curves.columns import kind_of
from capture_plan.curves.json_weights import known
from capture_plan.curves.text import Lines, split

MOST_LINES = 3000  # more than any face has names
FIRST_COLUMNS = 3  # among which the names are looked for
FIRST_LINES = 12  # that may hold the names of an upright table
NAMED = 0.5  # of the lines
ACROSS = 0.2  # of the cells of a line
FEWEST = 2
DELIMITER = "\t"


def upright_table(lines: Lines, delimiters: Sequence[str]) -> Lines:
    """The lines of the same table with its names across, and a note; the lines themselves where it stands upright."""
    if not FEWEST <= len(lines.texts) <= MOST_LINES:
        return lines
    for delimiter in delimiters:
        rows = [[cell.strip().strip('"').strip() for cell in split(text, delimiter)] for text in lines.texts]
        down = next((c for c in range(FIRST_COLUMNS) if names_down(rows, c)), None)
        if down is not None and not any(names_across(row[down + 1 :]) for row in rows[:FIRST_LINES]):
            return _turned(rows, down, lines.notes)
    return lines


def names_down(rows: Sequence[Sequence[str]], c: int) -> bool:
    """Whether column c holds names of a face, each once, beside several numbers."""
    cells = [row[c] for row in rows if len(row) > c + FEWEST]
    names = [cell for cell in cells if says_something(cell)]
    return len(names) >= max(FEWEST, NAMED * len(cells)) and len(set(names)) == len(names)


def names_across(cells: Sequence[str]) -> bool:
    """Whether some of these cells are names of a face."""
    return sum(map(says_something, cells)) > ACROSS * len(cells)


def says_something(cell: str) -> bool:
    """Whether a cell is a name that says something of a face."""
    return bool(cell) and not (cell[0].isdigit() or cell[0] in "+-.,") and ";" not in cell and known(cell)


def _turned(rows: Sequence[Sequence[str]], down: int, notes: tuple[str, ...]) -> Lines:
    """The table with the names in column `down` across, below a line of the frames' times where it has one."""
    first = next(t for t, row in enumerate(rows) if len(row) > down and says_something(row[down]))
    wide = max(map(len, rows))
    named = [row for row in rows[first:] if len(row) > down + 1]
    above = [_clock_of(row, down, wide) for row in rows[:first] if wide - 1 <= len(row) <= wide]
    columns = [row[down:] + [""] * (wide - len(row)) for row in map(list, (*above[-1:], *named))]
    frames = wide - down - 1
    message = f"names run down and frames run across: it is turned ({len(named):,} names, {frames:,} frames)"
    lost = len(rows) - len(above[-1:]) - len(named)
    some = "1 of its lines holds" if lost == 1 else f"{lost:,} of its lines hold"
    more = (f"{some} neither weights nor times: left out",) if lost else ()
    texts = tuple(DELIMITER.join(cells) for cells in zip(*columns, strict=True))
    return Lines(texts, tuple(range(1, len(texts) + 1)), DELIMITER, (*notes, message, *more))


def _clock_of(row: Sequence[str], down: int, wide: int) -> list[str]:
    """The line above the weights as a clock, under the name that it has or as times."""
    cells = list(row) if len(row) == wide else [""] * (wide - len(row)) + list(row)
    named = kind_of(cells[down]) in ("code", "time", "count")
    return cells if named else [*cells[:down], "time", *cells[down + 1 :]]
