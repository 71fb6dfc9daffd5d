"""Rigs as a folder of CSV tables, for programs that export nothing else.

neutral.csv    x,y,z of each vertex, one row each; a first row of titles may stand above
faces.csv      corners of each triangle or quad, counted from 0, one row each
smile.csv ...  one for each blendshape: places of all vertices (not differences), in the neutral's order

Numbers are written with a point and parted by commas, semicolons or tabs; or with a comma and parted by the others.
"""

import io
import re

import numpy as np
from jaxtyping import Float

from capture_plan.errors import RigError
from capture_plan.rig.formats.obj import COMMA, Faces, find_neutral, load, natural
from capture_plan.rig.formats.raw import RawRig
from capture_plan.rig.formats.shapes import rig_of_shapes
from capture_plan.rig.formats.source import Source, folder_name, is_kind

TITLES = re.compile(rb"\A(\xef\xbb\xbf)?[^\n0-9]*[a-df-zA-DF-Z_][^\n]*\n")


def read_csv_folder(folder: Source) -> RawRig:
    """The rig in `folder`; unit and axes are unknown. RigError when the tables do not make one rig."""
    paths = sorted((path for path in folder.iterdir() if is_kind(path, ".csv")), key=natural)
    faces = [path for path in paths if path.stem.lower() in ("faces", "triangles")]
    if len(faces) != 1:
        raise RigError(f"{folder_name(folder)} has no table faces.csv of vertex numbers: add it")
    others = [path for path in paths if path not in faces]
    if not others:
        raise RigError(f"{folder_name(folder)} has no table neutral.csv: add it, and one table for each blendshape")
    neutral = find_neutral(folder, others)
    corners = read_table(faces[0])
    if corners.shape[1] not in (3, 4) or (corners != np.floor(corners)).any() or not np.abs(corners).max() <= 1e9:
        raise RigError(f"{faces[0].name}: expected three or four whole vertex numbers in each row")
    n, sides = corners.shape
    found = Faces(
        corners.astype(np.int32).ravel(), np.full(n, sides, np.int32), np.zeros(n, np.int32), part_names=("mesh",)
    )
    return rig_of_shapes(folder, neutral, [path for path in others if path != neutral], found, read_places)


def read_places(path: Source) -> Float[np.ndarray, "v 3"]:
    """Three numbers of each row."""
    table = read_table(path)
    if table.shape[1] != 3:
        raise RigError(f"{path.name} has {table.shape[1]} columns, expected x, y and z")
    return table


def read_table(path: Source) -> Float[np.ndarray, "rows columns"]:
    """All numbers of a table."""
    text = TITLES.sub(b"", load(path), count=1)
    if b"." not in text and (b";" in text or b"\t" in text):
        text = COMMA.sub(b".", text)
    text = text.replace(b";", b",").replace(b"\t", b",")
    if not text.strip():
        raise RigError(f"{path.name} has no rows: export it again")
    try:
        table = np.loadtxt(io.BytesIO(text.removeprefix(b"\xef\xbb\xbf")), delimiter=",", comments=None, ndmin=2)
    except ValueError as error:
        found = " ".join(str(error).split())[:100]
        raise RigError(f"{path.name} is not a table of numbers ({found}): export it again") from error
    return table
