"""Recorded weights as tables: what Live Link Face, ARKit apps, OpenFace and others write as CSV or JSON, and NPZ.

CSV     a header and one row for each frame; Live Link Face: Timecode,BlendshapeCount,EyeBlinkLeft,...;
        OpenFace: frame, face_id, timestamp, confidence, success, ..., AU01_r, ..., AU01_c, ...
JSON    [{"timestamp": s, "blendShapes": {name: weight}}, ...], also below "frames";
        {"names": [...], "weights": [[...], ...]}, as Audio2Face writes it; or {name: [weight, ...], ...}
NPZ     weights (t c), names (c), fps
Frames in which the tracker says that it failed, and those of other people, are left out and counted.
"""

import csv
import io
import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from capture_plan.errors import RigError

MOST_BYTES = 1 << 29  # half an hour at 60 frames a second is 90 MB
RATES = (24.0, 25.0, 30.0, 48.0, 50.0, 60.0, 90.0, 100.0, 120.0, 240.0)
TIMECODE = re.compile(r"(\d+):(\d+):(\d+)[:;](\d+(?:\.\d+)?)")
ABOUT = ("timecode", "blendshapecount", "frame", "face_id", "timestamp", "time", "confidence", "success", "index")
NAME_KEYS = ("names", "facsNames", "blendshapeNames", "blendShapeNames", "columns")
TABLE_KEYS = ("weights", "weightMat", "frames", "data", "values")
SHAPE_KEYS = ("blendShapes", "blendshapes", "weights", "shapes", "values")
RATE_KEYS = ("fps", "exportFps", "frameRate", "frame_rate")
TIME_KEYS = ("timestamp", "time", "t", "timeCode")


@dataclass(frozen=True, eq=False)
class WeightTable:
    """`weights` of `columns` in every frame, as recorded; `fps` is None where the file does not say it."""

    columns: tuple[str, ...]
    weights: Float[np.ndarray, "t c"]
    fps: float | None
    skipped: tuple[tuple[str, str], ...] = ()
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if len(set(self.columns)) < len(self.columns):
            twice = next(column for column in self.columns if self.columns.count(column) > 1)
            raise RigError(f"has two columns '{twice}': give each its own name")
        if self.weights.shape != (len(self.weights), len(self.columns)) or self.weights.size == 0:
            raise RigError(f"has {self.weights.shape} weights for {len(self.columns)} names: export the take again")
        if not np.isfinite(self.weights).all():
            t, c = np.argwhere(~np.isfinite(self.weights))[0]
            raise RigError(f"has no number for '{self.columns[c]}' in frame {t:,}: export the take again")


def read_csv(path: Path) -> WeightTable:
    """The table in a CSV file. RigError that names the row where it is none."""
    try:
        rows = list(csv.reader(io.StringIO(text_of(path)), skipinitialspace=True))
    except csv.Error as error:
        raise RigError(f"is no table ({error}): export the take again as CSV") from error
    rows = [row for row in rows if row]
    if len(rows) < 2:
        raise RigError("has no frames: it needs a line of names and one line for each frame")
    header = [name.strip() for name in rows[0]]
    for number, row in enumerate(rows[1:], start=2):
        if len(row) != len(header):
            raise RigError(f"was cut off: line {number:,} has {len(row)} values, expected {len(header)}: delete it")
    cells = dict(zip(header, zip(*rows[1:], strict=True), strict=True))
    if len(cells) < len(header):
        twice = next(name for name in header if header.count(name) > 1)
        raise RigError(f"has two columns '{twice}': give each its own name")
    about = {name.lower(): values for name, values in cells.items() if name.lower() in ABOUT}
    columns, numbers, skipped = [], [], []
    for name, values in cells.items():
        column = to_numbers(values)
        if name.lower() in about or not name:
            skipped.append((name or "a column without a name", "it is no weight"))
        elif column is None:
            skipped.append((name, "it holds text, not numbers"))
        elif re.match(r"(gaze|eye_lmk|pose|p)_|[xyzXYZ]_\d", name):
            skipped.append((name, "it is a place or a direction of OpenFace, no weight"))
        else:
            columns.append(name)
            numbers.append(column)
    if not columns:
        raise RigError(f"has no column of numbers besides {', '.join(header[:4])}: export the weights")
    keep, notes = good_frames(about, len(rows) - 1)
    if not keep.any():
        raise RigError("has no frame in which the face was tracked: record it again")
    return WeightTable(tuple(columns), np.stack(numbers, axis=1)[keep], rate(about), tuple(skipped), notes)


def read_json(path: Path) -> WeightTable:
    """The table in a JSON file. RigError where it holds no weights that can be told."""
    try:
        document = json.loads(text_of(path))
    except (ValueError, RecursionError) as error:
        raise RigError(f"is no JSON ({str(error)[:80]}): export the take again") from error
    head: Mapping[str, Any] = document if isinstance(document, dict) else {}
    fps = next((float(head[key]) for key in RATE_KEYS if isinstance(head.get(key), int | float)), None)
    names = next((head[key] for key in NAME_KEYS if _is_list_of(head.get(key), str)), None)
    rows = document if isinstance(document, list) else next(
        (head[key] for key in TABLE_KEYS if isinstance(head.get(key), list)), None
    )  # fmt: skip
    if names and rows and _is_list_of(rows, list):
        return WeightTable(tuple(names), matrix(rows, len(names)), fps)
    if rows and _is_list_of(rows, dict):
        shapes = [next((row[key] for key in SHAPE_KEYS if isinstance(row.get(key), dict | list)), row) for row in rows]
        times = [next((row[key] for key in TIME_KEYS if isinstance(row.get(key), int | float)), None) for row in rows]
        fps = fps or (clock(np.array(times, dtype=float)) if None not in times else None)
        if names and _is_list_of(shapes, list):
            return WeightTable(tuple(names), matrix(shapes, len(names)), fps)
        columns = tuple(name for name, value in shapes[0].items() if _is_number(value) and name not in TIME_KEYS)
        table = [[shape.get(name, 0) for name in columns] for shape in shapes if isinstance(shape, dict)]
        return WeightTable(columns, matrix(table, len(columns)), fps)
    lists = {name: value for name, value in head.items() if _is_list_of(value, (int, float))}
    if lists and len({len(value) for value in lists.values()}) == 1:
        columns = tuple(name for name in lists if name.lower() not in ABOUT)
        return WeightTable(columns, matrix([list(row) for row in zip(*(lists[c] for c in columns), strict=True)],
                                           len(columns)), fps)  # fmt: skip
    raise RigError('holds no weights: expected frames such as {"blendShapes": {"jawOpen": 0.5}}')


def from_arrays(arrays: Mapping[str, np.ndarray]) -> WeightTable:
    """The table in an archive's arrays `weights`, `names` and `fps`."""
    weights, names = arrays["weights"], arrays.get("names")
    if names is None or names.ndim != 1 or names.dtype.kind not in "US":
        raise RigError("has 'weights' but no list of text 'names': save both")
    if weights.ndim != 2 or weights.dtype.kind not in "fiu" or weights.shape[1] != len(names):
        raise RigError(f"has 'weights' of the shape {weights.shape} for {len(names)} names: save them as (t, c)")
    return WeightTable(tuple(str(name) for name in names), weights.astype(np.float64), rate_of(arrays))


def rate_of(arrays: Mapping[str, np.ndarray]) -> float | None:
    """The archive's `fps`, when it has one."""
    fps = arrays.get("fps")
    return round(float(fps.ravel()[0]), 6) if fps is not None and fps.size == 1 and fps.dtype.kind in "fiu" else None


def text_of(path: Path) -> str:
    """The file's text, at most `MOST_BYTES` of it."""
    if path.stat().st_size > MOST_BYTES:
        raise RigError(f"has {path.stat().st_size / 1e6:,.0f} MB, more than {MOST_BYTES / 1e6:,.0f} MB: cut the take")
    try:
        return path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise RigError("is not text: export the take again") from error


def to_numbers(values: Sequence[str]) -> Float[np.ndarray, " t"] | None:
    """A column of numbers; None where one cell holds text. An empty cell is no number and is refused later."""
    try:
        return np.array([float(value) if value.strip() else np.nan for value in values])
    except ValueError:
        return None


def matrix(rows: Sequence[Any], width: int) -> Float[np.ndarray, "t c"]:
    """Rows of equal length as numbers."""
    for t, row in enumerate(rows):
        if len(row) != width or not all(map(_is_number, row)):
            raise RigError(f"has no {width} numbers in frame {t:,}: export the take again")
    return np.array(rows, dtype=np.float64).reshape(len(rows), width)


def good_frames(about: Mapping[str, Sequence[str]], count: int) -> tuple[np.ndarray, tuple[str, ...]]:
    """Which of `count` frames hold the face, by OpenFace's `success` and `face_id`, and a note on those that do not."""
    success = to_numbers(about.get("success", ["1"] * count))
    faces = to_numbers(about.get("face_id", ["0"] * count))
    tracked = np.ones(count, dtype=bool) if success is None else success > 0
    notes = [f"{(~tracked).sum():,} frames in which the tracker failed are left out"] if not tracked.all() else []
    if faces is not None and len(np.unique(faces)) > 1:
        ids, counts = np.unique(faces, return_counts=True)
        other = faces != ids[counts.argmax()]
        notes.append(f"{other.sum():,} rows of other faces than number {ids[counts.argmax()]:g} are left out")
        tracked &= ~other
    return tracked, tuple(notes)


def rate(about: Mapping[str, Sequence[str]]) -> float | None:
    """Frames in a second, from timecodes h:m:s:frame or from times."""
    if codes := [match for code in about.get("timecode", ()) if (match := TIMECODE.fullmatch(code.strip()))]:
        highest = max(int(float(match[4])) for match in codes)
        return next((fps for fps in RATES if fps > highest), None)
    for key in ("timestamp", "time"):
        times = to_numbers(about[key]) if key in about else None
        if times is not None and len(times) > 1:
            return clock(times)
    return None


def clock(times: Float[np.ndarray, " t"]) -> float | None:
    """Frames in a second from their times: seconds or, where they are a second apart or more, milliseconds."""
    step = np.diff(times)
    step = float(np.median(step[step > 0])) if (step > 0).any() else 0.0
    if step == 0:
        return None
    fps = 1000 / step if step >= 1 else 1 / step
    return next((usual for usual in RATES if abs(fps - usual) < 0.02 * usual), round(fps, 3))


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _is_list_of(value: Any, kind: type | tuple[type, ...]) -> bool:
    return isinstance(value, list) and len(value) > 0 and all(isinstance(item, kind) for item in value)
