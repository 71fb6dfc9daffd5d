"""Reading a take: the reader for its format, then the rig's unit and axes, and the head held still.

Meshes    a folder of numbered OBJ or PLY files (`meshes.py`); `.npz`, `.npy` (`archive.py`); USD (`usd_take.py`);
          Alembic (`alembic_take.py`)
Weights   `.csv`, `.txt`, `.log` (`delimited.py`), `.json` (`json_take.py`), as `.gz` or `.zip` too, `.npz` on a rig;
          `.glb`, `.gltf`, `.vrm` (`animation.py`) and USD with their own. What a full weight is: `scale.py`
Result    millimetres, +y up, facing +z. Meshes are laid onto the rig's neutral; without a rig, unit and axes are found
          from the frames themselves, as those of a rig are from its blendshapes
"""

import os
from collections.abc import Collection
from pathlib import Path

import numpy as np

from capture_plan.curves.delimited import read_csv
from capture_plan.curves.frames import PosedFrames
from capture_plan.curves.json_take import read_json
from capture_plan.curves.mapping import drive, map_weights
from capture_plan.curves.openness import as_blinks
from capture_plan.curves.outliers import without_wild
from capture_plan.curves.scale import Verdict, judge
from capture_plan.curves.unfiltered import without_raw
from capture_plan.curves.units_in_names import without_units
from capture_plan.curves.unsided import unclear_sides
from capture_plan.curves.weights import WeightTable
from capture_plan.errors import RigError
from capture_plan.formats.usd import SUFFIXES as USD
from capture_plan.names.name_map import NameMap
from capture_plan.names.recognise import INTENSITY
from capture_plan.progress import tell
from capture_plan.reader.read import rig_at
from capture_plan.rig.read_options import ReadOptions
from capture_plan.rig.record import Rig
from capture_plan.sequence.alembic_take import read_alembic_take
from capture_plan.sequence.alignment import frame_rate, lay_onto, orient_take
from capture_plan.sequence.animation import read_animation
from capture_plan.sequence.archive import read_archive, read_array
from capture_plan.sequence.meshes import MeshTake, read_folder
from capture_plan.sequence.record import Sequence
from capture_plan.sequence.usd_take import read_usd_take
from capture_plan.sequence.zipped_take import read_zip

TABLES = {
    **dict.fromkeys((".csv", ".tsv", ".tab", ".txt", ".log", ".dat"), read_csv),
    **dict.fromkeys((".json", ".jsonl", ".ndjson"), read_json),
}
ARRAYS = {".npz": read_archive, ".npy": read_array}
GLTF = (".glb", ".gltf", ".vrm")
FORMATS = "a folder of numbered OBJ or PLY files, .npz, .npy, .csv, .txt, .json, .zip, .glb, .gltf, .usd or .abc"
CONVERT = {
    ".fbx": "FBX, whose animation is not read here: export it as .glb with its shape keys' animation",
    ".mcd": "a vertex cache without a mesh: export numbered OBJ files",
    ".pc2": "a vertex cache without a mesh: export numbered OBJ files",
    ".bvh": "a skeleton's motion: export blendshape weights or meshes",
    **dict.fromkeys((".xlsx", ".xls", ".ods", ".numbers"), "a workbook: save its sheet as CSV"),
    ".c3d": "motion of markers, not of a mesh: export blendshape weights or meshes",
}
OWN = 10.0  # shares of a name map that give a column a scale of its own: 0.01 of per cent beside weights of 0 to 1
MOST_WEIGHT = 1e6  # of a full one: what no face does, and what single precision still reckons with


def read_sequence(
    path: str | Path,
    *,
    rig: Rig | None = None,
    neutral: str | Path | None = None,
    fps: float | None = None,
    name_map: NameMap | None = None,
    unit_mm: float | None = None,
    up: str | None = None,
    facing: str | None = None,
) -> Sequence:
    """The take at `path`, in millimetres, +y up, facing +z, the head held still.

    `rig` is what recorded weights drive, or the mesh that the frames are of; `neutral` is the actor's neutral (an OBJ
    file, or a rig of the same mesh), otherwise the rig's or the first frame. `name_map` tells which weight drives what.
    `unit_mm`, `up`, `facing` are as in `read_rig`, for meshes without a rig. RigError in one line when it is unusable.

    Example:
        >>> take = read_sequence("take.csv", rig=sample_rig())
        >>> len(take), take.fps
        (3, 30.0)
    """
    path = Path(path)
    given = ReadOptions(unit_mm, up, facing)
    if fps is not None and not (np.isfinite(fps) and fps > 0):
        raise RigError(f"{fps:g} frames in a second, expected a number above 0, such as 60")
    try:
        take = read_take(path, set() if rig is None else {len(rig.neutral), int(rig.source_index.max()) + 1})
    except RigError as error:
        message = str(error)
        raise RigError(message if message.startswith(path.name) else f"{path.name}: it {message}") from error
    except OSError as error:
        raise RigError(f"{path.name} cannot be read ({error.strerror or error}): check the file") from error
    if isinstance(take, WeightTable):
        if rig is None and path.suffix.lower() in (*GLTF, *USD):
            rig = rig_at(path, given)
        sequence = drive_rig(path, take, rig, fps, name_map)
    elif rig is None:
        sequence = orient_take(path, take, neutral, fps, given)
    else:
        sequence = lay_onto(path, take, rig, neutral, fps, unit_mm)
    tell(sequence.messages())
    return sequence


def read_take(path: Path, counts: Collection[int] = ()) -> WeightTable | MeshTake:
    """The take as its file has it; `counts` may be the vertices of its mesh."""
    suffix = (Path(path.stem) if path.suffix.lower() == ".gz" else path).suffix.lower()
    if not os.path.exists(path):
        raise RigError(f"{path.name} does not exist: give {FORMATS}")
    if path.is_dir():
        return read_folder(path)
    if suffix in CONVERT:
        raise RigError(f"{path.name} is {CONVERT[suffix]}")
    if suffix in (".obj", ".ply"):
        raise RigError(f"{path.name} is a single frame: give the folder that holds all of them")
    if suffix in TABLES:
        return TABLES[suffix](path)
    if suffix in ARRAYS:
        return ARRAYS[suffix](path, counts)
    if suffix == ".zip":
        return read_zip(path, TABLES)
    if suffix in GLTF:
        return read_animation(path)
    if suffix in USD:
        return read_usd_take(path)
    if suffix == ".abc":
        return read_alembic_take(path)
    raise RigError(f"{path.name} is not a format that is read here: give {FORMATS}")


def drive_rig(path: Path, take: WeightTable, rig: Rig | None, fps: float | None, mine: NameMap | None) -> Sequence:
    """A rig driven by recorded weights."""
    if rig is None:
        raise RigError(f"{path.name} holds weights, not meshes: give the rig that they drive")
    spelled = [*mine.weights, *mine.names] if mine else []
    take = without_units(without_raw(take, spelled), spelled)
    still = still_columns(take)
    mapping = map_weights(take.columns, rig.names, mine=mine, skipped=take.skipped, still=still)
    take = without_wild(take, mapping.columns)
    columns, messages = take.columns, take.notes
    notes = [*messages]
    driving = [
        c for c, column in enumerate(take.columns) if column in mapping.columns and not INTENSITY.fullmatch(column)
    ]
    verdict = judge_take(path, take, driving, mine)
    notes += [verdict.note] if verdict.note else []
    take, read_as = as_blinks(take, verdict.full, rig.names, mine)
    notes += take.notes[len(messages) :]
    if verdict.full != 1 or take.columns != columns or read_as:
        scale = 1 / verdict.full
        mapping = map_weights(
            take.columns, rig.names, mine=mine, skipped=take.skipped, scale=scale, read_as=read_as, still=still
        )
    notes += unclear_sides(mapping, take.columns, take.weights, mine)
    with np.errstate(all="ignore"):
        weights = drive(mapping, take.columns, rig.names, take.weights)
    if not (usual := np.abs(weights) < MOST_WEIGHT).all():
        t, k = np.argwhere(~usual)[0]
        messages = f"lets {rig.names[k]} stand at {weights[t, k]:.0e} in frame {t:,}, expected 1 for a full weight"
        raise RigError(f"{path.name}: it {messages}: export the take again, or say what is full in a name map")
    rate = frame_rate(fps, take.fps, notes)
    return Sequence(path.stem, rig.neutral, rig.triangles, PosedFrames(rig, weights), rate, rig, mapping, tuple(notes))


def still_columns(take: WeightTable) -> frozenset[str]:
    """Columns that hold one value all through the take."""
    if len(take.weights) < 2:
        return frozenset()
    return frozenset(name for name, one in zip(take.columns, np.ptp(take.weights, axis=0), strict=True) if one == 0)


def judge_take(path: Path, take: WeightTable, driving: list[int], mine: NameMap | None) -> Verdict:
    """What a full weight is in these columns of a take. RigError where no scale is known for them."""
    given, shares = (mine.full, mine.weights) if mine else (None, {})
    own = {c for c in driving if (s := shares.get(take.columns[c])) and not 1 / OWN < max(s.values()) < OWN}
    driving = [c for c in driving if c not in own] or driving
    columns = [take.columns[c] for c in driving]
    try:
        return judge(columns, take.weights[:, driving], stated=take.stated, given=given)
    except RigError as error:
        raise RigError(f"{path.name}: it {error}") from error
