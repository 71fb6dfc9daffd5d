"""Takes that are meshes in a folder of numbered OBJ or PLY files.

Folder  neutral.obj (where there is one), head.0001.obj, head.0002.obj, ...: numbers in the names give the order
The vertex order is the files' own. A frame has as many vertices as most of some files; each is read when it is needed.
"""

import re
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float, Int

from capture_plan.curves.frames import FileFrames, Frames, evenly
from capture_plan.errors import RigError
from capture_plan.formats.obj import load_text, natural, parse_faces, parse_vertices
from capture_plan.formats.ply import read_faces, read_vertices
from capture_plan.formats.raw import FARTHEST, fan

NEUTRAL = re.compile(r"neutral|base|basis|rest", re.IGNORECASE)
COUNTED = 3  # files that tell how many vertices a frame has: one of them may be cut off
NUMBER = re.compile(r"^(.*?)(\d+)(\D*)$")


@dataclass(frozen=True, eq=False)
class MeshTake:
    """Frames in the file's unit and axes, and what else the file says."""

    frames: Frames
    triangles: Int[np.ndarray, "f 3"] | None
    neutral: Float[np.ndarray, "v 3"] | None
    fps: float | None = None
    unit_mm: float | None = None
    up: str | None = None
    facing: str | None = None
    notes: tuple[str, ...] = ()


def read_folder(folder: Path) -> MeshTake:
    """The take in a folder. RigError where its files are no numbered frames of one mesh."""
    files, read = mesh_files(folder)
    paths, still = frames_and_neutral(files)
    first, count = first_and_count(paths, read)
    return MeshTake(
        FileFrames(paths, read, count, first),
        triangles_of(still or first),
        read(still) if still else None,
        notes=missing_numbers(paths),
    )


def mesh_files(folder: Path) -> tuple[list[Path], Callable[[Path], Float[np.ndarray, "v 3"]]]:
    """The meshes in a folder in order, and what reads them. RigError unless all are of one kind."""
    kinds = {".obj": obj_vertices, ".ply": ply_vertices}
    files = [p for p in folder.iterdir() if p.suffix.lower() in kinds and not p.name.startswith(".") and p.is_file()]
    suffixes = sorted({path.suffix.lower() for path in files})
    if len(suffixes) != 1:
        found = " and ".join(suffixes) or "no .obj or .ply files"
        raise RigError(f"holds {found}: give a folder with one numbered file for each frame, all of one kind")
    return sorted(files, key=natural), kinds[suffixes[0]]


def frames_and_neutral(files: Sequence[Path]) -> tuple[tuple[Path, ...], Path | None]:
    """The files that differ by a number alone, and one that is called neutral. RigError where there are others."""
    series: dict[str, list[Path]] = {}
    for path in files:
        match = NUMBER.match(path.stem)
        series.setdefault(f"{match[1]}#{match[3]}" if match else path.stem, []).append(path)
    takes = [paths for paths in series.values() if len(paths) > 1]
    single = [paths[0] for paths in series.values() if len(paths) == 1]
    neutrals = [path for path in single if NEUTRAL.search(path.stem)]
    odd = [path for path in single if path not in neutrals]
    if len(takes) != 1 or len(neutrals) > 1 or odd:
        message = ", ".join([path.name for path in (*(paths[0] for paths in takes), *odd, *neutrals)][:4])
        raise RigError(f"holds more or less than one take ({message}): number the frames of one take, head.0001.obj")
    return tuple(takes[0]), neutrals[0] if neutrals else None


def missing_numbers(paths: Sequence[Path]) -> tuple[str, ...]:
    """The sentence about frames that the numbers of the files pass over."""
    numbers = [int(match[2]) for path in paths if (match := NUMBER.match(path.stem))]
    missing = numbers[-1] - numbers[0] + 1 - len(numbers)
    return (f"{missing:,} of the numbers {numbers[0]} to {numbers[-1]} are missing",) if missing else ()


def first_and_count(paths: Sequence[Path], read: Callable[[Path], Float[np.ndarray, "v 3"]]) -> tuple[Path, int]:
    """How many vertices most of some files have, and the first file of that count. RigError where none can be read."""
    counts: dict[Path, int] = {}
    for t in evenly(len(paths), COUNTED):
        try:
            counts[paths[t]] = len(read(paths[t]))
        except RigError:
            if t == len(paths) - 1 and not counts:
                raise
    usual = Counter(counts.values()).most_common(1)[0][0]
    return next(path for path, count in counts.items() if count == usual), usual


def obj_vertices(path: Path) -> Float[np.ndarray, "v 3"]:
    """Vertices of an OBJ file in its own order."""
    return _finite(parse_vertices(load_text(path), path), path)


def ply_vertices(path: Path) -> Float[np.ndarray, "v 3"]:
    """Vertices of a PLY file in its own order."""
    return _finite(read_vertices(path), path)


def _finite(vertices: Float[np.ndarray, "v 3"], path: Path) -> Float[np.ndarray, "v 3"]:
    """The vertices of a frame. RigError where one is nowhere."""
    if not (np.abs(vertices) < FARTHEST).all():
        raise RigError(
            f"{path.name} holds NaN, infinite or coordinates beyond {FARTHEST:.0e}: clean the mesh and export it"
        )
    return vertices


def triangles_of(path: Path) -> Int[np.ndarray, "f 3"]:
    """Triangles of an OBJ or PLY file, none where it is a cloud of points."""
    faces = read_faces(path) if path.suffix.lower() == ".ply" else parse_faces(load_text(path), path)
    return fan(faces.corners, faces.sizes) if len(faces.sizes) else np.zeros((0, 3), dtype=np.int32)
