"""What a file may ask of its reader: the limits of every format in one place, held against what a file declares.

Bytes      MOST_BYTES of any file, MOST_TEXT_BYTES of a mesh, MOST_TAKE_BYTES of a table, LONGEST_LINE
Things     MOST_LINES of a mesh, MOST_ROWS of a take, MOST_VALUES of a JSON document,
           MOST_NODES of a tree, MOST_FACES, MOST_SIDES of one, MOST_BLENDSHAPES, MOST_DISPLACEMENTS (1 + k) v
Names      LONGEST_NAME signs: recognising a name takes time as the square of its length
Only plain files are read: a device never ends, and a pipe waits for whoever writes into it.
"""

import stat
from collections.abc import Iterable
from pathlib import Path

from capture_plan.errors import RigError
from capture_plan.input.source import Source

MOST_BYTES = 1 << 30
MOST_TEXT_BYTES = 1 << 26  # of one mesh: an OBJ of 400,000 vertices
MOST_TAKE_BYTES = 1 << 28  # half an hour of 52 weights at 60 frames a second has 150 MB as JSON
LONGEST_LINE = 1 << 17  # 4,000 columns of 30 signs
MOST_LINES = 1_500_000  # positions, normals, texture coordinates and faces of 300,000 vertices
MOST_ROWS = 4_000_000  # of a take, where each weight may have a row of its own
MOST_VALUES = 4_000_000  # of JSON decoded at once, 60 to 100 bytes each
MOST_TAKE_VALUES = 10_000_000  # of a take, whose frames are decoded one at a time: 40 minutes of 60 weights
MOST_COLUMNS = 4_000  # of a take; trackers write up to 700
MOST_CELLS = 32_000_000  # frames times columns, 8 bytes each: two hours of 70 weights at 60 frames a second
MOST_NODES = 2_000_000  # of an FBX file and their values; one with hours of curves has half a million
MOST_FACES = 1_000_000  # of a PLY file that mixes triangles with larger faces: these are read one by one
MOST_SIDES = 10_000  # of one polygon; the cap of a cylinder may have hundreds
MOST_BLENDSHAPES = 4_000  # film rigs with all their correctives have about 2,000
MOST_DISPLACEMENTS = 64_000_000  # (1 + k) v, 12 bytes each: 800 blendshapes of 80,000 vertices
LONGEST_NAME = 400  # signs; paths of scene files have about 200


def content(source: Source, most: int = MOST_BYTES) -> bytes:
    """The bytes of a file. RigError that begins with its name where it is a device or a pipe, or has more than `most`.

    OSError where the system cannot read it.
    """
    check_plain(source)
    size = source.stat().st_size if isinstance(source, Path) else source.root.getinfo(source.at).file_size
    if size > most:
        found, expected = f"{size / 1e6:,.0f} MB", f"{most / 1e6:,.0f} MB"
        raise RigError(f"{source.name} has {found}, expected at most {expected}: export the face alone, or in parts")
    return source.read_bytes()


def check_plain(source: Source) -> None:
    """RigError where this is a device, a pipe or a socket; OSError where it is not there."""
    if isinstance(source, Path) and not (stat.S_ISREG(mode := source.stat().st_mode) or stat.S_ISDIR(mode)):
        raise RigError(f"{source.name} is a device or a pipe, expected a file: copy what it holds into a file")


def check_line_sizes(data: bytes | str, what: str, most: int = MOST_LINES) -> None:
    """RigError that begins with `what` where a text has too many lines, or one that is too long."""
    end = "\n" if isinstance(data, str) else b"\n"
    if (count := data.count(end)) > most:  # pyright: ignore[reportArgumentType]
        raise RigError(f"{what} has {count:,} lines, expected at most {most:,}: export the face alone".lstrip())
    at = 0
    while len(data) - at > LONGEST_LINE:
        at = data.rfind(end, at, at + LONGEST_LINE) + 1 or len(data) + 1  # pyright: ignore
    if at > len(data):
        raise RigError(
            f"{what} has a line of more than {LONGEST_LINE:,} signs: it is damaged, export it again".lstrip()
        )


def check_values(document: bytes | str, most: int = MOST_VALUES) -> None:
    """RigError where a JSON document holds more values than are decoded."""
    signs = ",[{" if isinstance(document, str) else (b",", b"[", b"{")
    if (count := sum(document.count(sign) for sign in signs)) > most:  # pyright: ignore[reportArgumentType]
        raise RigError(f"has {count:,} values, expected at most {most:,}: export the face alone, or in parts")


def check_cells(frames: int, columns: int) -> None:
    """RigError where a take has more columns than any tracker writes, or more weights than fit."""
    if columns > MOST_COLUMNS or frames * columns > MOST_CELLS:
        most = f"at most {MOST_COLUMNS:,} columns and {MOST_CELLS:,} numbers fit"
        raise RigError(f"has {columns:,} columns in {frames:,} frames, {most}: cut the take, or export the face alone")


def check_size(name: str, k: int, v: int) -> None:
    """RigError when the deltas would not fit into memory: for formats whose files are smaller than what they hold."""
    if (1 + k) * v > MOST_DISPLACEMENTS or k > MOST_BLENDSHAPES:
        raise RigError(f"{name}: {k:,} blendshapes of {v:,} vertices are more than fit: export the head alone")


def check_sides(what: str, sides: int) -> None:
    """RigError that begins with `what` where a polygon has too many sides."""
    if sides > MOST_SIDES:
        raise RigError(
            f"{what} has a face of {sides:,} corners, expected at most {MOST_SIDES:,}: triangulate it".lstrip()
        )


def check_names(names: Iterable[str], what: str) -> None:
    """RigError that begins with `what` where a name is longer than anybody gives one."""
    if long := next((name for name in names if len(name) > LONGEST_NAME), None):
        message = f"{long[:20]!r}... of {len(long):,} signs, expected at most {LONGEST_NAME}"
        raise RigError(f"{what} has the name {message}: rename it".lstrip())
