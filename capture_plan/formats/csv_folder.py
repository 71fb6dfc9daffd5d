"""Rigs as a folder of tables of numbers (CSV, TXT, TSV, XYZ), for programs that export nothing else.

neutral.csv    x, y, z of each vertex, one row each; titles may stand above, other columns beside
faces.csv      corners of each polygon, counted from 0 or from 1, one row each; also called triangles, polygons, tris
smile.csv ...  one for each blendshape: places of all vertices (not differences), in the neutral's order

Numbers are parted by commas, semicolons, tabs or spaces, and written with a point; or with a comma and parted by the
others. Lines that begin with # or // are left out.
Number     a first column 0, 1, 2, ... or 1, 2, 3, ... beside three others counts rows and is left out
x, y, z    of more than three columns those with these titles, else the first three, which is said
Length     a first column of faces that tells how many corners follow in its row is left out
From 1     where a corner is the number of vertices; where neither 0 nor that is one, whatever makes the shorter edges
"""

import re
from collections.abc import Sequence

import numpy as np
from jaxtyping import Float, Int

from capture_plan.errors import RigError
from capture_plan.formats.naming import sentences
from capture_plan.formats.neutral_file import find_neutral
from capture_plan.formats.obj import COMMA, load_text, natural
from capture_plan.formats.raw import RawRig
from capture_plan.formats.shapes import Faces, rig_of_shapes
from capture_plan.input.source import Source, folder_name, is_kind

KINDS = (".csv", ".txt", ".tsv", ".tab", ".xyz", ".asc", ".pts", ".dat")
FACES = re.compile(
    r"(?:.*[_\-. ])?(?:faces?|tri(?:angle)?s?|polygons?|polys|topology|connectivity|indices|cells|elements)"
    r"(?:[_\-. ]?(?:list|table|index|indices|idx))?",
    re.IGNORECASE,
)
REMARK = re.compile(rb"^[ \t]*(?:#|//|%)[^\n]*$", re.MULTILINE)
NUMBER = re.compile(rb"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
NOT_A_NUMBER = re.compile(rb"[-+]?(?:nan|inf(?:inity)?)", re.IGNORECASE)
AXIS = re.compile(r"(?:.*[^a-z])?([xyz])(?:\W*(?:mm|cm|m|coord(?:inate)?|pos(?:ition)?))?\W*|pos([xyz])")
LEAST_COUNTED = 4  # rows, or 0, 1, 2 may be a place


def read_csv_folder(folder: Source) -> RawRig:
    """The rig in `folder`; unit and axes are unknown. RigError when the tables do not make one rig."""
    tables = [path for path in folder.iterdir() if any(is_kind(path, kind) for kind in KINDS)]
    faces = face_tables(tables)
    kinds = [path.suffix.lower() for path in tables if path not in faces]
    kind = max(dict.fromkeys(kinds), key=kinds.count, default=".csv")
    if len(faces) != 1:
        found = " and ".join(path.name for path in faces) or "no table"
        name = folder_name(folder)
        raise RigError(
            f"{name} has {found} for the faces, expected one: leave one"
            if faces
            else f"{name} has no table faces{kind} of vertex numbers: add it"
        )
    others = sorted((path for path in tables if is_kind(path, kind) and path not in faces), key=natural)
    if not others:
        raise RigError(f"{folder_name(folder)} has no table neutral.csv: add it, and one table for each blendshape")
    neutral, message = find_neutral(folder, others, read_places)
    vertices, columns = _places_of(neutral)
    found, counted = _read_faces(faces[0], vertices)
    shapes = [path for path in others if path != neutral]
    return rig_of_shapes(folder, neutral, shapes, found, read_places, message=sentences(message, columns, counted))


def holds_tables(folder: Source) -> bool:
    """Whether a folder holds a table of faces, so that its texts may be a rig."""
    return bool(face_tables([path for path in folder.iterdir() if any(is_kind(path, kind) for kind in KINDS)]))


def face_tables(tables: Sequence[Source]) -> list[Source]:
    """The tables called after faces: exactly so, or else with words before it."""
    named = [path for path in tables if FACES.fullmatch(path.stem)]
    exact = [path for path in named if path.stem.lower() in ("faces", "triangles")]
    return exact or named if len(named) < len(tables) else []


def read_places(path: Source) -> Float[np.ndarray, "v 3"]:
    """x, y and z of each row."""
    return _places_of(path)[0]


def _places_of(path: Source) -> tuple[Float[np.ndarray, "v 3"], str]:
    """x, y and z of each row, and a sentence where they are some of more columns."""
    titles, rows = read_rows(path)
    table = even(rows, path)
    width = table.shape[1]
    chosen = axes_in(titles, width)
    if chosen is None:
        number = width > 3 and _counts(table[:, 0])
        chosen = [1, 2, 3] if number else [0, 1, 2]
    if width < 3:
        raise RigError(f"{path.name} has {width} columns, expected x, y and z")
    rest = width - 3 - (0 not in chosen and _counts(table[:, 0]))
    said = ", ".join(str(c + 1) for c in chosen)
    return table[:, chosen], f"of {width} columns of the tables, {said} are read as x, y and z" if rest > 0 else ""


def axes_in(titles: Sequence[str], width: int) -> list[int] | None:
    """The columns whose titles say x, y and z; None where they don't."""
    if len(titles) != width:
        return None
    axis = [(match[1] or match[2]) if (match := AXIS.fullmatch(title)) else "" for title in titles]
    return [axis.index(letter) for letter in "xyz"] if all(axis.count(letter) == 1 for letter in "xyz") else None


def _counts(column: Float[np.ndarray, " n"]) -> bool:
    """Whether a column counts its rows, from 0 or from 1."""
    start = column[0]
    return len(column) >= LEAST_COUNTED and start in (0, 1) and bool((column == start + np.arange(len(column))).all())


def _read_faces(path: Source, vertices: Float[np.ndarray, "v 3"]) -> tuple[Faces, str]:
    """The polygons of a table, and a sentence where their vertices are counted from 1."""
    rows = [row[~np.isnan(row) & (row != -1)] for row in read_rows(path)[1]]
    sizes = np.array([len(row) for row in rows])
    numbers = np.concatenate(rows)
    if not np.abs(numbers).max(initial=0) <= 1e9 or (numbers != np.floor(numbers)).any():
        raise RigError(f"{path.name}: expected three or four whole vertex numbers in each row")
    first = np.array([row[0] for row in rows if len(row)])
    if len(first) == len(rows) and ((sizes > 3).all() and (_counts(first) or (first == sizes - 1).all())):
        rows, sizes = [row[1:] for row in rows], sizes - 1
    if sizes.min() < 3:
        raise RigError(f"{path.name}: expected three or four whole vertex numbers in each row")
    corners = np.concatenate(rows).astype(np.int64)
    start, message = counted_from(corners, sizes, vertices, path.name)
    n = len(sizes)
    return Faces((corners - start).astype(np.int32), sizes.astype(np.int32), np.zeros(n, np.int32), ("mesh",)), message


def counted_from(
    corners: Int[np.ndarray, " c"], sizes: Int[np.ndarray, " p"], vertices: Float[np.ndarray, "v 3"], name: str
) -> tuple[int, str]:
    """Whether vertices are counted from 0 or from 1, and a sentence in the second case."""
    least, most = int(corners.min()), int(corners.max())
    if least < 1 or most > len(vertices):
        return 0, ""  # out of range is refused by whoever makes the rig
    message = f"{name} counts vertices from 1"
    if most == len(vertices):
        return 1, message
    inside = np.delete(np.arange(len(corners) - 1), np.cumsum(sizes)[:-1] - 1)  # sides of polygons, not between two
    length = [np.linalg.norm(vertices[corners - s][inside] - vertices[corners - s][inside + 1], axis=1).sum()
              for s in (0, 1)]  # fmt: skip
    return (1, f"{message}, by the lengths of edges") if length[1] < length[0] else (0, "")


def even(rows: Sequence[Float[np.ndarray, " n"]], path: Source) -> Float[np.ndarray, "rows columns"]:
    """Rows as one table. RigError where they are of several lengths."""
    width = len(rows[0])
    odd = next((i for i, row in enumerate(rows) if len(row) != width), None)
    if odd is not None:
        found = f"row {odd + 1:,} has {len(rows[odd])} numbers, the first {width}"
        raise RigError(f"{path.name} is not a table of numbers ({found}): export it again")
    return np.stack(rows)


def read_rows(path: Source) -> tuple[list[str], list[Float[np.ndarray, " n"]]]:
    """Titles in small letters, none where there are none, and the numbers of each row."""
    text = REMARK.sub(b"", load_text(path).removeprefix(b"\xef\xbb\xbf"))
    lines = [line.strip().rstrip(b",;").rstrip() for line in text.split(b"\n")]
    lines = [line for line in lines if line]
    titles: list[str] = []
    if lines and not is_row(lines[0]):
        cut = rb"[,;\t]" if re.search(rb"[,;\t]", lines[0]) else rb"\s+"
        titles = [word.decode(errors="replace").strip(' "').lower() for word in re.split(cut, lines.pop(0))]
    if lines and len(lines[0]) < 12 and lines[0].isdigit() and int(lines[0]) == len(lines) - 1:
        lines.pop(0)  # how many rows follow
    if not lines:
        raise RigError(f"{path.name} has no rows: export it again")
    try:
        return titles, [np.array(line.split(), dtype=np.float64) for line in _plain(lines)]
    except ValueError as error:
        found = " ".join(str(error).split())[:100]
        raise RigError(f"{path.name} is not a table of numbers ({found}): export it again") from error


def is_row(line: bytes) -> bool:
    """Whether every field of a line is a number."""
    fields = re.split(rb"[,;\t ]+", line.replace(b'"', b""))
    return all(NUMBER.fullmatch(field) or NOT_A_NUMBER.fullmatch(field) for field in fields if field)


def _plain(lines: list[bytes]) -> list[bytes]:
    """Rows of numbers with points, parted by spaces."""
    text = b"\n".join(lines).replace(b'"', b"")
    spaced = bool(re.search(rb"\d,\d+[ ]+[-+]?\d", text))  # 1,5 2,5 and not 1, 2
    if b"," in text and b"." not in text and (b";" in text or b"\t" in text or spaced):
        text = COMMA.sub(b".", text)
    return [line.strip() for line in re.sub(rb"[,;\t]", b" ", text).split(b"\n")]
