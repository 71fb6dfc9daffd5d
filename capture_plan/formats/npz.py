"""Rigs as one NumPy archive, the quickest way to bring a rig from any program that has Python:

    np.savez_compressed("rig.npz", vertices=..., faces=..., deltas=..., names=..., units="cm")

Needed     vertices (v 3), faces (f 3) counted from 0, deltas (k v 3), names (k) as text
Optional   units            "mm", "cm", "dm", "m", "in" or "ft"
           part             (f) or (v) as text: the part or material of every triangle or vertex
           source_index     (v): the vertex number in the artist's file, when vertices were left out
Pickled objects are refused: loading them would run what they hold.
"""

import math
import tokenize
import zipfile

import numpy as np

from capture_plan.errors import RigError
from capture_plan.formats.naming import numbered
from capture_plan.formats.raw import UNITS_MM, RawRig, vertex_parts
from capture_plan.input.bounds import check_plain
from capture_plan.input.source import Source
from capture_plan.input.zipped import DAMAGE, LARGE_BYTES, MOST_BYTES, MOST_RATIO

NEEDED = {"vertices": 2, "faces": 2, "deltas": 3, "names": 1}  # dimensions
KINDS = (
    ("vertices", "fiu", "numbers"),
    ("faces", "iu", "integers"),
    ("deltas", "fiu", "numbers"),
    ("names", "US", "text"),
)
HEADER_DAMAGE = (ValueError, KeyError, TypeError, SyntaxError, RecursionError, tokenize.TokenError)
PART_KEYS = ("part", "parts", "material", "group")


def read_npz(path: Source) -> RawRig:
    """The rig in the archive at `path`; its axes are unknown. RigError when an array is missing or misshapen."""
    arrays = load_npz(path)
    for key, dimensions in NEEDED.items():
        if key not in arrays:
            raise RigError(f"{path.name} has no array '{key}', only {', '.join(arrays) or 'nothing'}: add it")
        if arrays[key].ndim != dimensions or (dimensions > 1 and arrays[key].shape[-1] != 3):
            wanted = {1: "(k)", 2: "(n, 3)", 3: "(k, v, 3)"}[dimensions]
            advice = "split polygons into triangles" if key == "faces" else "reshape it"
            raise RigError(f"{path.name}: '{key}' has the shape {arrays[key].shape}, expected {wanted}: {advice}")
    for key, kinds, what in KINDS:
        if arrays[key].dtype.kind not in kinds:
            raise RigError(f"{path.name}: '{key}' holds {arrays[key].dtype}, expected {what}: convert it before saving")
    triangles, v = arrays["faces"].astype(np.int64), len(arrays["vertices"])
    if arrays["deltas"].shape[1] != v:
        found = arrays["deltas"].shape[1]
        raise RigError(f"{path.name}: 'deltas' has {found:,} vertices, 'vertices' has {v:,}: save both of one mesh")
    check_range(path, triangles, v)
    parts, part_names = read_parts(path, arrays, triangles, v)
    source_index = arrays.get("source_index", np.arange(v))
    if source_index.shape != (v,) or source_index.dtype.kind not in "iu":
        raise RigError(f"{path.name}: 'source_index' is not one integer for each of {v:,} vertices: leave it out")
    names, message = numbered([str(name) for name in arrays["names"].astype(str)])
    return RawRig(
        name=path.stem,
        neutral=arrays["vertices"].astype(np.float64),
        triangles=triangles.astype(np.int32),
        deltas=arrays["deltas"].astype(np.float32),
        names=names,
        parts=parts,
        part_names=part_names,
        source_index=source_index.astype(np.int32),
        unit_mm=UNITS_MM.get(str(arrays.get("units", "")).partition(" ")[0].strip().lower()),
        note=message,
    )


def load_npz(path: Source) -> dict[str, np.ndarray]:
    """Every array of the archive. RigError when it is none, was cut off, or holds pickled objects."""
    check_plain(path)
    try:
        with path.open("rb") as file, zipfile.ZipFile(file) as archive:
            total, packed = (
                sum(getattr(e, size) for e in archive.infolist()) for size in ("file_size", "compress_size")
            )
            if total > MOST_BYTES or (total > LARGE_BYTES and total > MOST_RATIO * packed):
                raise RigError(f"{path.name} would unpack to {total / 1e6:,.0f} MB, which no rig does: save it again")
            return {e.filename.removesuffix(".npy"): _read_array(path, archive, e) for e in archive.infolist()}
    except (*DAMAGE, ValueError, OverflowError) as error:
        raise RigError(f"{path.name} is not an NPZ archive, or it was cut off: save it again with np.savez") from error


def _read_array(path: Source, archive: zipfile.ZipFile, entry: zipfile.ZipInfo) -> np.ndarray:
    """One array, when it holds as many numbers as it declares."""
    try:
        with archive.open(entry) as file:
            version = np.lib.format.read_magic(file)
            read_header = {1: np.lib.format.read_array_header_1_0, 2: np.lib.format.read_array_header_2_0}[version[0]]
            shape, _, dtype = read_header(file)
        if math.prod(shape) * max(dtype.itemsize, 1) > entry.file_size:
            raise ValueError("it declares more than it holds")
        with archive.open(entry) as file:
            return np.lib.format.read_array(file, allow_pickle=False)
    except (*DAMAGE, *HEADER_DAMAGE, OverflowError, MemoryError) as error:
        raise RigError(
            f"{path.name}: '{entry.filename[:80]}' is not a readable array of numbers or text: "
            "save it again with np.savez"
        ) from error


def check_range(path: Source, triangles: np.ndarray, v: int) -> None:
    """RigError when a triangle uses a vertex that there is not."""
    if triangles.size and not 0 <= triangles.min() <= triangles.max() < v:
        worst = triangles.max() if triangles.max() >= v else triangles.min()
        raise RigError(f"{path.name}: a face uses vertex {worst:,} of {v:,}: count vertices from 0")


def read_parts(
    path: Source, arrays: dict[str, np.ndarray], triangles: np.ndarray, v: int
) -> tuple[np.ndarray, tuple[str, ...]]:
    """Part of every vertex and the parts' names, in the order in which the archive first names them."""
    telling = [key for key in PART_KEYS if key in arrays and arrays[key].dtype.kind in "US"]
    key = max(telling, key=lambda key: len(np.unique(arrays[key])), default=None)
    if key is None:
        return vertex_parts(triangles, np.zeros(len(triangles), dtype=np.int32), ("mesh",), v)
    unique, first, number = np.unique(arrays[key].astype(str), return_index=True, return_inverse=True)
    order = np.argsort(first)
    labels, part_names = np.argsort(order)[number], tuple(str(name) for name in unique[order])
    if len(labels) == len(triangles):
        return vertex_parts(triangles, labels, part_names, v)
    if len(labels) == v:
        return labels.astype(np.int32), part_names
    raise RigError(
        f"{path.name}: '{key}' has {len(labels):,} entries, expected one for each of {len(triangles):,} faces "
        f"or {v:,} vertices: leave it out or mend it"
    )
