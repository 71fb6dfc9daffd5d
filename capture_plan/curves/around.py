"""What stands around the frames of a table of text: a rate above the names, sums below the frames, a second take.

Rate     "fps,60" or "# frame rate: 60" above the names, where the times of the frames tell none or the same
Sums     rows that have a word where the clock of nearly all others has a number: mean, total
Takes    one below the other: refused where the names stand again and the clock goes back; where a counter of frames
         alone begins again it is said
Tables   one below the other with other names are refused: their numbers would drive what the first line names
"""

import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from capture_plan.curves.clock import Timing
from capture_plan.curves.columns import kind_of
from capture_plan.curves.json_weights import known
from capture_plan.curves.stated_rate import rates_in_line
from capture_plan.curves.text import NOTHING, TextTable, split, to_number
from capture_plan.errors import RigError

WORDS = re.compile(r"[^\W\d]{2,}[^\d]*")  # in the column of a clock: mean, total
FEWEST = 2  # names of a face in a line of names
FEW_SUMS = 0.1  # of the rows
MOST_TAIL = 10  # rows: in shorter tables a last row without a time is taken as a frame
SAME_RATE = 0.02


def stated_rate(lines: Sequence[str]) -> float | None:
    """The frame rate that lines above the names tell; None where they tell none, or several."""
    rates = {rate for line in lines for rate in rates_in_line(line)}
    return rates.pop() if len(rates) == 1 else None


def in_time(timing: Timing, fps: float | None) -> Timing:
    """The timing of a table whose lines above the names tell a rate: its times are followed where they tell another."""
    if timing.fps is None or fps is None or abs(timing.fps - fps) < SAME_RATE * fps:
        return replace(timing, fps=fps or timing.fps)
    message = f"it says {fps:g} frames in a second, but its times make it {timing.fps:g}: the times are followed"
    return replace(timing, notes=(*timing.notes, message))


def without_doubles(table: TextTable) -> TextTable:
    """The table with columns of one name read once. RigError where two of weights hold other numbers."""
    names, messages = list(table.names), []
    for c, name in enumerate(table.names):
        first = table.names.index(name)
        if not name or first == c:
            continue
        if not kind_of(name) and table.column(c) != table.column(first):
            raise RigError(f"has two columns '{name}' with other numbers: give each its own name")
        names[c] = ""
        messages.append(f"'{name}' stands twice: its first column is read")
    return replace(table, names=tuple(names), notes=(*table.notes, *dict.fromkeys(messages))) if messages else table


def without_sums(table: TextTable) -> TextTable:
    """The rows but those that have a word where the clock of nearly all others has a number: mean, total.

    A last row that has nothing there, under rows that all have a number, is a sum too.
    """
    c = clock_in(table.names)
    starts = (" ", '"', table.delimiter)
    if c is None or (c == 0 and not any(row[:1].isalpha() or row.startswith(starts) for row in table.rows)):
        return table
    cells = [cell.strip().strip('"').strip() for cell in table.column(c)]
    words = [t for t, cell in enumerate(cells) if WORDS.fullmatch(cell) and cell.lower() not in NOTHING]
    if not cells[-1] and all(cells[:-1]) and len(cells) > MOST_TAIL:
        words.append(len(cells) - 1)
    if not words or len(words) > FEW_SUMS * len(cells):
        return table
    gone, shown = set(words), ", ".join(f"'{cells[t]}'" for t in words[:2])
    some = "1 row has" if len(words) == 1 else f"{len(words):,} rows have"
    rows = f"{some} {'nothing' if not cells[words[0]] else 'a word' if len(words) == 1 else 'words'}"
    message = f"{rows} in place of '{table.names[c]}' and {'is' if len(words) == 1 else 'are'} left out ({shown})"
    return replace(table.at([t for t in range(len(cells)) if t not in gone]), notes=(*table.notes, message))


def begins_again(table: TextTable) -> tuple[str, ...]:
    """A sentence where a counter of frames goes back to its first number: takes may have been joined."""
    if any(kind_of(name) in ("code", "time") for name in table.names):
        return ()  # the clock tells it
    c = next((c for c, name in enumerate(table.names) if kind_of(name) == "count"), None)
    n = np.array([to_number(cell) for cell in table.column(c)] if c is not None else [])
    at = np.flatnonzero((n[1:] < n[:-1]) & (n[1:] <= n[0])) + 1 if len(n) else n
    if not len(at) or c is None:
        return ()
    where = f"in row {at[0]:,}" if len(at) == 1 else f"in {len(at):,} rows, the first of them {at[0]:,}"
    return (f"'{table.names[c]}' begins again {where}: takes may have been joined there, and all are read as one",)


def refuse_joined(texts: Sequence[str], first: int, delimiter: str) -> None:
    """RigError where the names stand again and the clock begins again there: two takes, one below the other.

    So too where other names stand there; the line below the names may hold them in another spelling.
    """
    lead = texts[first].partition(delimiter)[0]
    for t in range(first + 2, len(texts)):
        if texts[t] != texts[first] and texts[t].partition(delimiter)[0] == lead and is_names(texts[t], delimiter):
            message = f"other names stand in front of frame {t - first - 1:,}: '{texts[t][:40].strip()}'"
            raise RigError(f"holds several tables, one below the other ({message}): save each as a file of its own")
    again = [t for t in range(first + 2, len(texts) - 1) if texts[t] == texts[first]]
    names = [name.strip().strip('"') for name in split(texts[first], delimiter)]
    clock = clock_in(names)
    if clock is None:
        return
    for t in again:
        before, after = ([*split(texts[at], delimiter), *names][clock].strip() for at in (t - 1, t + 1))
        numbers = to_number(before), to_number(after)
        if numbers[1] < numbers[0] or (not np.isfinite(numbers).any() and after < before):
            message = f"the names stand again in front of frame {t - first - 1:,}, and '{names[clock]}' goes back there"
            raise RigError(f"holds several takes, one below the other ({message}): save each as a file of its own")


def is_names(text: str, delimiter: str) -> bool:
    """Whether a line holds names of a face."""
    return sum(known(cell.strip().strip('"')) for cell in split(text, delimiter)) >= FEWEST


def clock_in(names: Sequence[str]) -> int | None:
    """The first column of times or frame numbers; None where there is none."""
    return next((c for c, name in enumerate(names) if kind_of(name) in ("code", "time", "count")), None)
