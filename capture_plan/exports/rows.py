"""Rows as a CSV file that no spreadsheet takes for formulas."""

import csv
import io
import re
import unicodedata
from collections.abc import Iterable, Mapping
from pathlib import Path

from capture_plan.output import write_whole

Columns = Mapping[str, str]  # of one value each, by name

FORMULA = re.compile(r"[\t\r\n]|\s*[=+\-@]")


def write_rows(path: Path, rows: Iterable[list]) -> Path:
    """A CSV file, whole or not at all."""
    text = io.StringIO(newline="")
    csv.writer(text).writerows([[_plain(cell) for cell in row] for row in rows])
    write_whole(path, text.getvalue().encode("utf-8"))
    return path


def _plain(cell: object) -> object:
    """A name that a spreadsheet would take for a formula, marked as text, also behind blanks or in full width."""
    return f"'{cell}" if isinstance(cell, str) and FORMULA.match(unicodedata.normalize("NFKC", cell)) else cell
