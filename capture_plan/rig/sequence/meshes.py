"""Takes that are meshes: a folder of numbered OBJ or PLY files, or one NPZ archive.

Folder  neutral.obj (where there is one), head.0001.obj, head.0002.obj, ...: numbers in the names give the order
NPZ     frames (t v 3), and where there is no rig: faces (f 3); with or without neutral (v 3), fps, units
The vertex order is the files' own. Every frame has as many vertices as the first; a file is read when it is needed.
"""

import re
import zipfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float, Int

from capture_plan.errors import RigError
from capture_plan.rig.formats.obj import load, natural, parse_faces, parse_vertices
from capture_plan.rig.formats.ply import read_faces, read_vertices
from capture_plan.rig.formats.raw import UNITS_MM, fan
from capture_plan.rig.sequence.frames import FileFrames, Frames, StoredFrames
from capture_plan.rig.sequence.weights import WeightTable, from_arrays, rate_of

NEUTRAL = re.compile(r"neutral|base|basis|rest", re.IGNORECASE)
NUMBER = re.compile(r"^(.*?)(\d+)(\D*)$")
MOST_BYTES = 3 << 29  # 1.6 GB: 5,000 frames of 26,719 vertices in float32


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
    kinds = {".obj": obj_vertices, ".ply": read_vertices}
    files = [p for p in folder.iterdir() if p.suffix.lower() in kinds and not p.name.startswith(".") and p.is_file()]
    suffixes = sorted({path.suffix.lower() for path in files})
    if len(suffixes) != 1:
        found = " and ".join(suffixes) or "no .obj or .ply files"
        raise RigError(f"holds {found}: give a folder with one numbered file for each frame, all of one kind")
    read = kinds[suffixes[0]]
    numbered: dict[str, list[Path]] = {}
    for path in sorted(files, key=natural):
        match = NUMBER.match(path.stem)
        numbered.setdefault(f"{match[1]}#{match[3]}" if match else path.stem, []).append(path)
    takes = [name for name, paths in numbered.items() if len(paths) > 1]
    neutrals = [paths[0] for paths in numbered.values() if len(paths) == 1 and NEUTRAL.search(paths[0].stem)]
    odd = [paths[0].name for paths in numbered.values() if len(paths) == 1 and paths[0] not in neutrals]
    if len(takes) != 1 or len(neutrals) > 1 or odd:
        told = ", ".join([*(numbered[name][0].name for name in takes), *odd, *(p.name for p in neutrals)][:4])
        raise RigError(f"holds more or less than one take ({told}): number the frames of one take, head.0001.obj")
    paths = tuple(numbered[takes[0]])
    first = read(paths[0])
    neutral = read(neutrals[0]) if neutrals else None
    numbers = [int(match[2]) for path in paths if (match := NUMBER.match(path.stem))]
    missing = numbers[-1] - numbers[0] + 1 - len(numbers)
    notes = (f"{missing:,} of the numbers {numbers[0]} to {numbers[-1]} are missing",) if missing else ()
    frames = FileFrames(paths, read, len(first))
    return MeshTake(frames, triangles_of(neutrals[0] if neutrals else paths[0]), neutral, notes=notes)


def obj_vertices(path: Path) -> Float[np.ndarray, "v 3"]:
    """Vertices of an OBJ file in its own order."""
    return parse_vertices(load(path), path)


def triangles_of(path: Path) -> Int[np.ndarray, "f 3"]:
    """Triangles of an OBJ or PLY file, none where it is a cloud of points."""
    faces = read_faces(path) if path.suffix.lower() == ".ply" else parse_faces(load(path), path)
    return fan(faces.corners, faces.sizes) if len(faces.sizes) else np.zeros((0, 3), dtype=np.int32)


def read_archive(path: Path) -> MeshTake | WeightTable:
    """The take in an NPZ archive: meshes or weights. RigError where it is neither."""
    if not zipfile.is_zipfile(path):
        raise RigError("is not an NPZ archive, or it was cut off: save it again with np.savez")
    arrays = {}
    try:
        with zipfile.ZipFile(path) as archive:
            sizes = {name: declared(archive, name) for name in archive.namelist() if name.endswith(".npy")}
            if sum(sizes.values()) > MOST_BYTES:
                told = f"{sum(sizes.values()) / 1e9:.1f} GB of arrays, more than {MOST_BYTES / 1e9:.1f} GB"
                raise RigError(f"holds {told}: save the frames as float32, or cut the take into parts")
            for name in sizes:
                with archive.open(name) as file:
                    arrays[name.removesuffix(".npy")] = np.lib.format.read_array(file, allow_pickle=False)
    except (ValueError, EOFError, OSError, zipfile.BadZipFile, NotImplementedError, RuntimeError, SyntaxError) as error:
        raise RigError(
            f"holds an array that cannot be read ({str(error)[:80]}): save it again with np.savez"
        ) from error
    if "weights" in arrays:
        return from_arrays(arrays)
    return stored(arrays)


def stored(arrays: dict[str, np.ndarray]) -> MeshTake:
    """The take in an archive's arrays."""
    frames, faces = arrays.get("frames"), arrays.get("faces", arrays.get("triangles"))
    if frames is None or frames.ndim != 3 or frames.shape[2] != 3 or frames.dtype.kind != "f":
        found = ", ".join(f"{name} {array.shape}" for name, array in arrays.items())[:160] or "nothing"
        raise RigError(f"has {found}, expected 'frames' (t, v, 3), or 'weights' (t, k) and 'names'")
    neutral = arrays.get("neutral", arrays.get("vertices"))
    if neutral is not None and neutral.shape != frames.shape[1:]:
        raise RigError(f"has a neutral of the shape {neutral.shape} for frames {frames.shape}: save both of one mesh")
    if faces is not None and (faces.ndim != 2 or faces.shape[1] != 3 or faces.dtype.kind not in "iu"):
        raise RigError(f"has 'faces' of the shape {faces.shape}, expected (f, 3) of integers: split polygons")
    if faces is not None and faces.size and not 0 <= faces.min() <= faces.max() < frames.shape[1]:
        raise RigError(f"has a face that uses vertex {faces.max():,} of {frames.shape[1]:,}: count from 0")
    return MeshTake(
        frames=StoredFrames(frames),
        triangles=None if faces is None else faces.astype(np.int32),
        neutral=None if neutral is None else neutral.astype(np.float64),
        fps=rate_of(arrays),
        unit_mm=UNITS_MM.get(str(arrays.get("units", "")).strip("[]'\" ").partition(" ")[0].lower()),
    )


def declared(archive: zipfile.ZipFile, name: str) -> int:
    """How many bytes an array of the archive says that it has, before any of it is read."""
    with archive.open(name) as file:
        version = np.lib.format.read_magic(file)
        header = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
        shape, _, dtype = header(file)
    if dtype.hasobject:
        raise RigError(f"holds pickled objects in '{name.removesuffix('.npy')}', which are never loaded: save numbers")
    return int(np.prod([float(n) for n in shape])) * dtype.itemsize
