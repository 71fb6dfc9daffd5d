"""Points of a head that a person found in another program, by name: a small file of them.

File     JSON {"chin": [x, y, z]}, TOML chin = [x, y, z], or CSV with rows chin,x,y,z; in that program's coordinates
"""

import csv
import io
import math
from pathlib import Path

import msgspec

from capture_plan.errors import CapturePlanError
from capture_plan.input.documents import read_plain, read_toml

Point = tuple[float, float, float]
GIVE = 'give JSON {"chin": [x, y, z]}, TOML chin = [x, y, z], or CSV with rows chin,x,y,z'
MOST_POINTS = 500


def read_points(path: Path, error: type[CapturePlanError]) -> dict[str, Point]:
    """The points in a file, by name.

    Raises:
        error: missing, of another kind, or a row that is no name with three numbers.
    """
    kind = path.suffix.lower()
    if kind not in (".json", ".toml", ".csv"):
        raise error(f"{path} is no file of points: {GIVE}")
    document = read_toml(path, error, GIVE) if kind == ".toml" else None
    try:
        if document is None:
            text = read_plain(path, error, GIVE).decode("utf-8-sig")
            document = msgspec.json.decode(text) if kind == ".json" else _rows(text)
        found = msgspec.convert(document, dict[str, Point], strict=kind != ".csv")
    except (msgspec.DecodeError, msgspec.ValidationError, UnicodeDecodeError, RecursionError) as wrong:
        raise error(f"{path} holds no points ({wrong}): {GIVE}") from None
    if not found:
        raise error(f"{path} holds no points: {GIVE}")
    if len(found) > MOST_POINTS or not all(math.isfinite(x) for point in found.values() for x in point):
        raise error(f"{path} holds {len(found)} points, expected at most {MOST_POINTS}, all of finite numbers")
    return found


def _rows(text: str) -> dict[str, list[str]]:
    """Rows of a CSV file that have numbers; a first row of column names is none."""
    rows = [[cell.strip() for cell in row] for row in csv.reader(io.StringIO(text)) if any(map(str.strip, row))]
    if rows and not any(_is_number(cell) for cell in rows[0][1:]):
        rows = rows[1:]
    return {row[0]: row[1:] for row in rows}


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
