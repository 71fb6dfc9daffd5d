"""Takes as NumPy arrays: an NPZ archive, or one NPY array of frames.

Meshes   frames (t v 3), also called vertices, verts, ...; without a rig faces (f 3); with or without neutral (v 3),
         fps, units. NPY: frames alone. Axes may stand in other orders (`axes_of.py`)
Weights  weights (t c), names (c), fps; or an array (t) for each name. Arrays (t) of times, and of whether a face was
         tracked, are heeded as columns of a table are
Whole numbers are positions as well as others.
"""

import warnings
import zipfile
from collections.abc import Collection, Iterator, Mapping
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float, Int

from capture_plan.curves.around import in_time
from capture_plan.curves.axes_of import as_frames
from capture_plan.curves.clock import Timing, agreed, timing_by
from capture_plan.curves.columns import CLOCK_KINDS, kind_of, unit_of
from capture_plan.curves.frames import StoredFrames
from capture_plan.curves.json_weights import known
from capture_plan.curves.lost_signs import rows_without_face
from capture_plan.curves.rows import Rows, table_of
from capture_plan.curves.weights import WeightTable, rate_of
from capture_plan.errors import RigError
from capture_plan.formats.raw import UNITS_MM
from capture_plan.input.bounds import check_cells, check_names, check_plain
from capture_plan.sequence.meshes import MeshTake

FRAME_NAMES = ("frames", "vertices", "verts", "v", "vertex", "positions", "points", "meshes")
NEUTRAL_NAMES = ("neutral", "template", "v_template", "vertices", "verts", "v")
FACE_NAMES = ("faces", "triangles", "f", "tris")
COLUMN_NAMES = ("names", "columns", "blendshapes", "blendshape_names")
FEWEST_NAMES = 2  # of a face
MOST_BYTES = 3 << 29  # 1.6 GB: 5,000 frames of 26,719 vertices in float32
DAMAGE = (ValueError, EOFError, OSError, zipfile.BadZipFile, NotImplementedError, RuntimeError, SyntaxError)


def read_archive(path: Path, counts: Collection[int] = ()) -> MeshTake | WeightTable:
    """The take in an NPZ archive: meshes or weights; `counts` may be the vertices. RigError where it is neither."""
    check_plain(path)
    if not zipfile.is_zipfile(path):
        raise RigError("is not an NPZ archive, or it was cut off: save it again with np.savez")
    arrays = {}
    try:
        with zipfile.ZipFile(path) as archive:
            sizes = {name: declared(archive, name) for name in archive.namelist() if name.endswith(".npy")}
            _check_size(sum(sizes.values()))
            for name in sizes:
                with archive.open(name) as file:
                    arrays[name.removesuffix(".npy")] = np.lib.format.read_array(file, allow_pickle=False)
    except DAMAGE as error:
        raise RigError(
            f"holds an array that cannot be read ({str(error)[:80]}): save it again with np.savez"
        ) from error
    if "weights" in arrays:
        return from_arrays(arrays)
    table = _by_name(arrays)
    return from_arrays(table) if table else stored(arrays, counts)


def read_array(path: Path, counts: Collection[int] = ()) -> MeshTake:
    """The meshes in one NPY array, read where they are asked for; `counts` may be the vertices. RigError without."""
    check_plain(path)
    _check_size(path.stat().st_size)
    try:
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", "Reading `.npy`")  # headers of Python 2 are as good
            frames = np.load(path, mmap_mode="r", allow_pickle=False)
    except DAMAGE as error:
        raise RigError(f"is no NumPy array of numbers ({str(error)[:80]}): save it again with np.save") from error
    frames, message = as_frames(frames, counts)
    if not is_frames(frames):
        raise RigError(no_frames(frames, counts))
    return MeshTake(StoredFrames(frames), None, None, notes=message)


def no_frames(array: np.ndarray, counts: Collection[int]) -> str:
    """What has to be said of one array that holds no frames of a mesh of `counts` vertices."""
    found = f"holds an array {array.shape} of {array.dtype}, expected frames (t, v, 3)"
    mesh = f" of {max(counts):,} vertices" if counts else ""
    if array.ndim != 2 or array.dtype.kind not in "fiu":
        return f"{found}{mesh}: save meshes"
    return f"{found}{mesh}: weights without names cannot be distinguished, save NPZ with weights (t, k) and names"


def _check_size(count: int) -> None:
    """RigError where arrays of so many bytes are too large."""
    if count > MOST_BYTES:
        message = f"{count / 1e9:.1f} GB of arrays, more than {MOST_BYTES / 1e9:.1f} GB"
        raise RigError(f"holds {message}: save the frames as float32, or cut the take into parts")


def _by_name(arrays: Mapping[str, np.ndarray]) -> dict[str, np.ndarray] | None:
    """The arrays with one table `weights` (t, c) of those that stand, (t) each, under names of a face; None where these
    are few or meshes are held."""
    if any(arrays[name].ndim > 1 for name in FRAME_NAMES if name in arrays):
        return None
    rows = {name: x for name, x in arrays.items() if x.ndim == 1 and x.dtype.kind in "fiu" and not kind_of(name)}
    lengths = [len(x) for name, x in rows.items() if known(name)]
    if len(lengths) < FEWEST_NAMES or len(set(lengths)) > 1:
        return None
    named = {name: x for name, x in rows.items() if len(x) == lengths[0]}
    return {**arrays, "weights": np.column_stack([*named.values()]), "names": np.array([*named])}


def mesh_counts(arrays: Mapping[str, np.ndarray]) -> set[int]:
    """How many vertices the mesh may have, by faces and neutral in the archive."""
    held = arrays.get
    faces = [x for name in FACE_NAMES if (x := held(name)) is not None and x.dtype.kind in "iu" and x.size]
    neutrals = [x for name in NEUTRAL_NAMES if (x := held(name)) is not None and x.ndim == 2 and x.shape[1] == 3]
    return {int(x.max()) + 1 for x in faces} | {len(x) for x in neutrals}


def stored(arrays: Mapping[str, np.ndarray], counts: Collection[int] = ()) -> MeshTake:
    """The meshes in an archive's arrays; `counts` may be the vertices."""
    turned = {name: as_frames(x, {*counts, *mesh_counts(arrays)}) for name, x in arrays.items() if name in FRAME_NAMES
              and not (x.ndim == 2 and x.shape[1] == 3)}  # fmt: skip
    arrays = {**arrays, **{name: frames for name, (frames, _) in turned.items()}}
    name = _frames_in(arrays)
    if name is None:
        found = ", ".join(f"{name} {array.shape}" for name, array in arrays.items())[:160] or "nothing"
        raise RigError(f"has {found}, expected one 'frames' (t, v, 3), or 'weights' (t, k) and 'names'")
    frames = arrays[name]
    neutral = next((arrays[key] for key in NEUTRAL_NAMES if key in arrays and key != name), None)
    if neutral is not None and neutral.shape != frames.shape[1:]:
        raise RigError(f"has a neutral of the shape {neutral.shape} for frames {frames.shape}: save both of one mesh")
    return MeshTake(
        StoredFrames(frames),
        triangles=triangles_in(arrays, frames.shape[1]),
        neutral=None if neutral is None else neutral.astype(np.float64),
        fps=rate_of(arrays) or _timing_in(arrays, len(frames)).fps,
        unit_mm=UNITS_MM.get(str(arrays.get("units", "")).strip("[]'\" ").partition(" ")[0].lower()),
        notes=turned[name][1] if name in turned else (),
    )


def triangles_in(arrays: Mapping[str, np.ndarray], v: int) -> Int[np.ndarray, "f 3"] | None:
    """The triangles of a mesh of `v` vertices. RigError where they are of another."""
    faces = next((arrays[key] for key in FACE_NAMES if key in arrays), None)
    if faces is None:
        return None
    if faces.ndim != 2 or faces.shape[1] != 3 or faces.dtype.kind not in "iu":
        raise RigError(f"has 'faces' of the shape {faces.shape}, expected (f, 3) of integers: split polygons")
    if faces.size and not 0 <= faces.min() <= faces.max() < v:
        raise RigError(f"has a face that uses vertex {faces.max():,} of {v:,}: count from 0")
    return faces.astype(np.int32)


def _frames_in(arrays: Mapping[str, np.ndarray]) -> str | None:
    """The name of the array of frames: a usual one, else the only one of that shape."""
    likely = [name for name, array in arrays.items() if is_frames(array)]
    usual = [name for name in FRAME_NAMES if name in likely]
    return usual[0] if usual else likely[0] if len(likely) == 1 else None


def is_frames(array: np.ndarray) -> bool:
    """Whether an array has the shape of frames."""
    return array.ndim == 3 and array.shape[2] == 3 and array.shape[0] > 0 and array.dtype.kind in "fiu"


def from_arrays(arrays: Mapping[str, np.ndarray]) -> WeightTable:
    """The table in an archive's arrays `weights`, `names` and `fps`."""
    weights, names = arrays["weights"], next((arrays[name] for name in COLUMN_NAMES if name in arrays), None)
    if names is None or names.ndim != 1 or names.dtype.kind not in "US":
        raise RigError("has 'weights' but no list of text 'names': save both")
    if weights.ndim != 2 or weights.dtype.kind not in "fiu" or weights.shape[1] != len(names) or not weights.size:
        raise RigError(f"has 'weights' of the shape {weights.shape} for {len(names)} names: save them as (t, c)")
    check_cells(*weights.shape)
    check_names(map(str, names), "")
    x = weights.astype(np.float64)
    x[~np.isfinite(x)] = np.nan
    timing = in_time(_timing_in(arrays, len(x)), rate_of(arrays))
    order = np.arange(len(x)) if timing.order is None else timing.order
    lost, messages = lost_in(arrays, x)
    rows = Rows(tuple(str(name) for name in names), x[order], lost[order], {})
    return table_of(rows, timing.fps, (), (*messages, *timing.notes))


def _timing_in(arrays: Mapping[str, np.ndarray], frames: int) -> Timing:
    """The timing that an array of times tells, one for each frame."""
    clocks = [
        (name, timing_by(kind, cells, unit_of(name)))
        for kind in CLOCK_KINDS
        for name, cells in frame_arrays(arrays, frames, kind)
    ]
    return agreed(clocks)


def lost_in(
    arrays: Mapping[str, np.ndarray], x: Float[np.ndarray, "t c"]
) -> tuple[Bool[np.ndarray, " t"], tuple[str, ...]]:
    """Frames of which arrays beside the weights x say that no face was tracked, and what has to be said of these."""
    lost, notes = np.zeros(len(x), dtype=bool), []
    for name, cells in frame_arrays(arrays, len(x), "tracked", "lost", "confidence"):
        failed, message = rows_without_face(name, cells, x, kind_of(name))
        lost |= failed
        notes += [message] if message else []
    return lost, tuple(notes)


def frame_arrays(arrays: Mapping[str, np.ndarray], frames: int, *kinds: str) -> Iterator[tuple[str, list[str]]]:
    """Arrays of these kinds by their names (`columns.py`) that hold one cell for each frame, as text."""
    for name, array in arrays.items():
        if kind_of(name) in kinds and array.shape == (frames,) and array.dtype.kind in "bfiuUS":
            yield name, [cell.decode("latin-1") if isinstance(cell, bytes) else str(cell) for cell in array.tolist()]


def declared(archive: zipfile.ZipFile, name: str) -> int:
    """How many bytes an array of the archive says that it has, before any of it is read."""
    with archive.open(name) as file:
        version = np.lib.format.read_magic(file)
        header = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
        shape, _, dtype = header(file)
    if dtype.hasobject:
        raise RigError(f"holds pickled objects in '{name.removesuffix('.npy')}', which are never loaded: save numbers")
    return int(np.prod([float(n) for n in shape])) * dtype.itemsize
