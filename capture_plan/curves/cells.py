"""The cells of a table of text as numbers, and what is wrong with a row.

Blank     empty, "NaN", "-": a number is missing, which `sparse.py` and `rows.py` judge
Broken    "inf", "err", "1.#QNAN" in a column of numbers: the row is damaged, and never counts as 0
Blocks    parsed by NumPy; a block with a cell that is no number, cell by cell
"""

from collections.abc import Mapping, Sequence

import numpy as np
from jaxtyping import Bool, Float

from capture_plan.curves.frames import evenly
from capture_plan.curves.text import NOTHING, TextTable, split, to_number

BLOCK = 4096  # rows parsed at once
SAMPLE = 200  # rows that tell delimiter, decimal sign and which columns are numbers


def without_words(
    table: TextTable,
    chosen: Sequence[int],
    x: Float[np.ndarray, "t c"],
    faults: Mapping[int, str],
    faces: Bool[np.ndarray, " c"],
) -> tuple[Float[np.ndarray, "t c"], dict[int, str]]:
    """Numbers of the chosen columns, NaN where there is none, and what is wrong with a row.

    A row is damaged where one of its columns `faces` holds something that is no number beside others that hold some.
    """
    broken = np.isinf(x)
    x = np.where(broken, np.nan, x)
    some = broken[:, faces].any(axis=1) & np.isfinite(x[:, faces]).any(axis=1)
    message = {}
    for t in np.flatnonzero(some).tolist():
        c = chosen[int((broken[t] & faces).argmax())]
        message[t] = f"line {table.numbers[t]:,} has '{table.cells(table.rows[t])[c].strip()}' for '{table.names[c]}'"
    return x, {**message, **faults}


def _number_of(cell: str) -> float:
    """The number in a cell, NaN where it says that there is none, infinite where it holds something else."""
    number = to_number(cell)
    nothing = not np.isnan(number) or cell.strip().strip("\"'").strip().lower() in NOTHING
    return number if nothing else np.inf


def numeric_columns(table: TextTable) -> list[bool]:
    """Columns whose cells are mostly numbers, by some rows taken evenly from all."""
    some = [table.cells(table.rows[t]) for t in evenly(len(table.rows), SAMPLE)]
    columns = [
        [fields[c] for fields in some if len(fields) > c and fields[c].strip().lower() not in NOTHING]
        for c in range(len(table.names))
    ]
    return [2 * int(np.isfinite([to_number(cell) for cell in cells]).sum()) >= len(cells) for cells in columns]


def parse(table: TextTable, chosen: Sequence[int]) -> tuple[Float[np.ndarray, "t c"], dict[int, str]]:
    """Numbers of the chosen columns in all rows, and what is wrong with a row.

    NaN where a cell says that there is none, infinite where it holds something else that is no number.
    """
    x, faults = np.full((len(table.rows), len(chosen)), np.nan), {}
    whole = len(table.names) - 1
    for start in range(0, len(table.rows), BLOCK):
        block = table.rows[start : start + BLOCK]
        even = np.array([row.count(table.delimiter) == whole for row in block])
        if even.all():
            x[start : start + len(block)] = _numbers(table, block, chosen)
            continue
        fine = np.flatnonzero(even)
        if len(fine):
            x[start + fine] = _numbers(table, [block[t] for t in fine], chosen)
        for t in np.flatnonzero(~even).tolist():
            x[start + t], fault = _uneven(table, start + t, chosen)
            faults |= {start + t: fault} if fault else {}
    x[:, per_cent_of_some(table, chosen)] /= 100
    return x, faults


def per_cent_of_some(table: TextTable, chosen: Sequence[int]) -> Bool[np.ndarray, " c"]:
    """Columns whose cells carry a %, where others do not: these are hundredths."""
    some = [table.cells(table.rows[t]) for t in evenly(len(table.rows), SAMPLE)] if table.percent else []
    signs = [[fields[c].strip().strip('"').endswith("%") for fields in some if len(fields) > c and fields[c].strip()]
             for c in chosen]  # fmt: skip
    mostly = np.array([2 * sum(column) > len(column) for column in signs], dtype=bool)
    return mostly & ~mostly.all()


def _numbers(table: TextTable, rows: Sequence[str], chosen: Sequence[int]) -> Float[np.ndarray, "t c"]:
    """Numbers of rows with as many fields as there are names."""
    texts = [row.replace(",", ".") for row in rows] if table.comma and table.delimiter != "," else rows
    texts = [row.replace("%", "") for row in texts] if table.percent else texts
    try:
        return np.loadtxt(texts, delimiter=table.delimiter, usecols=chosen, comments=None, quotechar='"', ndmin=2)
    except ValueError:  # a cell without a number
        cells = [split(row, table.delimiter) for row in rows]
        return np.array([[_number_of(fields[c]) if c < len(fields) else np.nan for c in chosen] for fields in cells])


def _uneven(table: TextTable, t: int, chosen: Sequence[int]) -> tuple[Float[np.ndarray, " c"], str]:
    """A row with another number of delimiters: its numbers, and what is wrong where it is neither whole nor empty."""
    fields = table.cells(table.rows[t])
    x = np.array([_number_of(fields[c]) if c < len(fields) else np.nan for c in chosen])
    whole = len(fields) == len(table.names) or not np.isfinite(x).any()
    message = f"line {table.numbers[t]:,} has {len(fields)} values, expected {len(table.names)}"
    commas = table.delimiter == "," and len(fields) > len(table.names)
    return x, "" if whole else message + (", decimal commas between commas?" if commas else "")
