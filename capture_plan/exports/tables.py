"""Tables that a spreadsheet, a slate operator or a script reads: `landmarks.csv`, `expressions.csv`."""

import csv
import io
import re
import unicodedata
from collections.abc import Iterable
from pathlib import Path

from capture_plan.layout.record import Layout
from capture_plan.output import write_whole
from capture_plan.plan.files import plan_schema
from capture_plan.plan.record import Plan

FORMULA = re.compile(r"[\t\r\n]|\s*[=+\-@]")


def write_tables(plan: Plan, folder: Path) -> list[Path]:
    """One row a landmark (millimetres), one row an expression in the order of shooting.

    Programs take a first line for the heads of columns: that a plan is a draft stands in the files' names.
    """
    draft = "-DRAFT" if plan.draft else ""
    expressions = [
        [e.name, e.sentence, " ".join(e.blendshapes), round(100 * e.gain, 2), round(100 * e.covered, 2)]
        for e in plan.packing.expressions
    ]
    shots = ["slate", "actor", "blendshapes", "gain_percent", "covered_percent"]
    return [
        write_landmarks(plan.layout, folder / f"landmarks{draft}.csv"),
        write_rows(folder / f"expressions{draft}.csv", [shots, *expressions]),
    ]


def write_landmarks(layout: Layout, path: Path, *, moved_by: str = "blendshapes") -> Path:
    """One row a marker, millimetres; the last column is headed by what moves it."""
    header = ["name", "place", "side", "role", "x_mm", "y_mm", "z_mm", "vertex", "source_vertex", moved_by]
    rows = [
        [m.name, m.label, m.side, m.role, *m.position, m.vertex, m.source_vertex, " ".join(m.blendshapes)]
        for m in layout.markers
    ]
    return write_rows(path, [header, *rows])


def write_schema(path: Path) -> Path:
    """The JSON schema of `plan.json`."""
    write_whole(path, plan_schema())
    return path


def write_rows(path: Path, rows: Iterable[list]) -> Path:
    """A CSV file, whole or not at all."""
    text = io.StringIO(newline="")
    csv.writer(text).writerows([[_plain(cell) for cell in row] for row in rows])
    write_whole(path, text.getvalue().encode("utf-8"))
    return path


def _plain(cell: object) -> object:
    """A name that a spreadsheet would take for a formula, marked as text, also behind blanks or in full width."""
    return f"'{cell}" if isinstance(cell, str) and FORMULA.match(unicodedata.normalize("NFKC", cell)) else cell
