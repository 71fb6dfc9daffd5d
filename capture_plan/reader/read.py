"""Reading a rig: the reader for its format, then one unit, one pose of the axes, and the face skin.

Formats    a folder of OBJ (`formats/obj.py`), PLY (`ply.py`), CSV or TXT files (`csv_folder.py`), or of one OBJ and
           MakeHuman's `.target` files (`target.py`); `.npz` (`npz.py`); `.glb`, `.gltf`, `.vrm` (`gltf.py`, `vrm.py`);
           `.fbx` (`fbx.py`); a `.zip` of any of these (`zipped.py`); `.usd`, `.usda`, `.usdc`, `.usdz` (`usd.py`)
Result     millimetres, +y up, facing +z, the subject's left +x; the origin and the vertex order stay the file's
"""

import os
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float, Int
from msgspec.structs import replace as replace_struct

from capture_plan.errors import RigError
from capture_plan.face.axes import axes_matrix
from capture_plan.face.face_skin import FacePlace, upper_neck
from capture_plan.face.frame import Frame, find_frame, head_shape
from capture_plan.face.place import face_place
from capture_plan.face.skin import find_skin
from capture_plan.formats.csv_folder import holds_tables, read_csv_folder
from capture_plan.formats.fbx import read_fbx
from capture_plan.formats.gltf import read_gltf
from capture_plan.formats.npz import read_npz
from capture_plan.formats.obj import read_obj_folder
from capture_plan.formats.ply import read_ply_folder
from capture_plan.formats.raw import RawRig, finite, legible, offsets
from capture_plan.formats.target import holds_targets, read_target_folder
from capture_plan.formats.usd import SUFFIXES, read_usd
from capture_plan.input.bounds import check_plain
from capture_plan.input.documents import meant, read_plain
from capture_plan.input.source import Source, folder_name, is_kind
from capture_plan.input.zipped import find_rig, open_zip
from capture_plan.mesh import pieces
from capture_plan.names.name_map import read_name_map
from capture_plan.reader.belongs import what_belongs
from capture_plan.reader.crop import crop_to_head
from capture_plan.reader.read_cache import remembered_rig
from capture_plan.reader.twins import one_of_each
from capture_plan.reader.upright import lifted, nearest_axes, off_axes_degrees, straightened
from capture_plan.reader.winding import outwards
from capture_plan.rig.read_options import AS_FOUND, ReadOptions
from capture_plan.rig.record import Rig
from capture_plan.rig.understood import Understood

READERS = {".npz": read_npz, ".glb": read_gltf, ".gltf": read_gltf, ".vrm": read_gltf, ".fbx": read_fbx}
READERS |= dict.fromkeys(SUFFIXES, read_usd)
FOLDER_READERS = {".obj": read_obj_folder, ".ply": read_ply_folder, ".csv": read_csv_folder}
IN_ARCHIVES = (".npz", ".glb", ".gltf", ".vrm", ".fbx")  # whose readers need no file of the disk
FORMATS = "a folder of OBJ, PLY, CSV, TXT or .target files, .npz, .glb, .gltf, .vrm, .fbx, a .zip of these, or USD"


def read_rig(
    path: str | Path,
    *,
    unit_mm: float | None = None,
    up: str | None = None,
    facing: str | None = None,
    skin: str | None = None,
    names: str | None = None,
) -> Rig:
    """The rig at `path`, in millimetres, +y up, facing +z.

    `unit_mm` is how long one unit of the file is; `up` and `facing` are signed axes of the file ("+y", "-z"); what is
    not given is taken from the format or found from the shape. `skin` says where markers may go: the names of parts,
    separated by commas ("M_Face,M_BackHead"), or a text file of vertex numbers of the artist's file, counted from 0,
    with ranges ("0-6705 7002"). `names` is a TOML file that says what blendshapes are (`name_map.py`). RigError in one
    line when there is no usable rig.

    Example:
        >>> rig = read_rig("hero.npz", unit_mm=1, up="+y", facing="+z")
        >>> len(rig.names), len(rig.neutral)
        (52, 4939)
    """
    return rig_at(Path(path), ReadOptions(unit_mm, up, facing, skin, names))


def rig_at(path: Path, given: ReadOptions = AS_FOUND) -> Rig:
    """`read_rig` where what a person states is a record.

    Raises:
        RigError: there is no usable rig.
    """
    deciding = (given.unit_mm, given.up, given.facing, given.skin)
    rig = remembered_rig(lambda: rig_from_raw(read_raw(path), given), path, deciding)
    return replace(rig, meanings=_own_names(given.names, rig)) if given.names else rig


def _own_names(path: str, rig: Rig) -> tuple[tuple[str, str], ...]:
    """What the user's name map says of the rig's blendshapes. RigError when it speaks of none of them."""
    meant = read_name_map(path).names
    known = tuple((name, meant[name]) for name in rig.names if name in meant)
    if not known:
        raise RigError(
            f"{Path(path).name} names no blendshape of {rig.name}, which has {', '.join(rig.names[:3])}, ..."
        )
    return known


def rig_from_raw(raw: RawRig, given: ReadOptions = AS_FOUND) -> Rig:
    """The rig of what a reader gave, in millimetres, +y up, facing +z; what is given here is not searched for."""
    raw, turned, frame = _framed(one_of_each(what_belongs(offsets(finite(legible(raw))))), given)
    facial = frame.channels.facial
    raw = crop_to_head(raw, facial)
    turn = axes_matrix(frame.up, frame.facing)
    up, facing = nearest_axes(turn @ turned)
    R = frame.unit_mm * turn
    neutral, deltas = raw.neutral @ R.T, (raw.deltas @ R.T).astype(np.float32)
    triangles, turned_over = outwards(neutral, raw.triangles, deltas[facial])
    raw = replace(raw, triangles=triangles)
    if given.skin is None:
        place = face_place(frame.points, frame.channels, frame.unit_mm) if frame.axes.sure else None
        skin_vertices = find_skin(neutral, raw.triangles, deltas[facial], raw.parts, raw.part_names, place)
        body_note = left_to_body(raw, neutral, skin_vertices, place)
    else:
        skin_vertices, body_note = given_skin(given.skin, raw), ""
    return Rig(
        name=raw.name,
        neutral=neutral,
        triangles=raw.triangles,
        deltas=deltas,
        names=raw.names,
        skin=skin_vertices,
        parts=raw.parts,
        part_names=raw.part_names,
        source_index=raw.source_index,
        unit_mm=frame.unit_mm,
        up=up,
        facing=facing,
        unit_found=frame.unit_found,
        up_found=frame.up_found,
        facing_found=frame.facing_found,
        note="; ".join(filter(None, (raw.note, frame.note, turned_over, body_note))),
        turn=tuple(map(float, (turn @ turned).ravel())),
        understood=Understood(
            axes=replace_struct(
                frame.axes, up=up, facing=facing, turned_degrees=round(off_axes_degrees(turn @ turned), 1)
            ),
            unit=frame.unit,
            left_out=raw.left_out,
            set_aside=tuple(name for name, own in zip(raw.names, facial, strict=True) if not own),
        ),
    )


def _framed(raw: RawRig, given: ReadOptions) -> tuple[RawRig, Float[np.ndarray, "3 3"], Frame]:
    """The rig along signed axes, the rotation that this took, and how it lies in them."""
    shape = head_shape(raw)
    found = straightened(raw, shape, given)
    straight = found.raw
    shape = shape if straight.neutral is raw.neutral else head_shape(straight)
    frame = find_frame(straight, found.given, shape=shape)
    if found.doubted and not (given.up and given.facing):
        frame = replace(frame, axes=replace_struct(frame.axes, sure=False))
    if given.up or given.facing:
        return straight, found.Q, frame
    raised = lifted(straight, frame)
    if raised.doubted:
        frame = replace(frame, axes=replace_struct(frame.axes, sure=False))
    elif raised.raw is not straight:
        frame = find_frame(raised.raw, given)
    return raised.raw, raised.Q @ found.Q, frame


def left_to_body(
    raw: RawRig, neutral: Float[np.ndarray, "v 3"], skin: Bool[np.ndarray, " v"], face: FacePlace | None
) -> str:
    """What a person should know of the skin that goes on into a body; nothing where none does."""
    if face is None or not skin.any():
        return ""
    goes_on = ~skin & (neutral[:, 1] < upper_neck(face, face.chin_y(neutral[skin])))
    cut = raw.triangles[skin[raw.triangles].any(axis=1) & goes_on[raw.triangles].any(axis=1)]
    if len(cut) == 0:
        return ""
    piece = pieces(raw.triangles, len(neutral))
    left = int((goes_on & (piece == piece[cut[0, 0]])).sum())
    return f"markers go on the head and the upper neck: {left:,} vertices below the upper neck are no place for them"


def read_raw(path: Path) -> RawRig:
    """The rig at `path` as its file has it."""
    try:
        if not os.path.exists(path):
            raise RigError(f"{path} does not exist{meant(path)}: give {FORMATS}")
        check_plain(path)
        if not path.is_dir() and path.stat().st_size == 0:
            raise RigError(f"{path.name} is empty: export it again")
        with np.errstate(all="ignore"):  # what becomes infinite is refused when the rig is whole
            if path.suffix.lower() == ".zip" and not path.is_dir():
                with open_zip(path) as root:
                    return read_source(find_rig(root, is_rig))
            return read_source(path)
    except OSError as error:
        raise RigError(
            f"{path.name} cannot be read ({error.strerror or error}): check the file and its permissions"
        ) from error


def read_source(source: Source) -> RawRig:
    """The rig in a folder or file, on the disk or in an archive."""
    if source.is_dir():
        return _read_folder(source)
    kind = source.suffix.lower()
    if kind in (".obj", ".ply", ".csv"):
        raise RigError(
            f"{source.name} is a single mesh: give the folder that holds the neutral and one "
            f"{kind[1:].upper()} file per blendshape"
        )
    if kind not in READERS:
        raise RigError(f"{source.name} is not a format that is read here: give {FORMATS}")
    return READERS[kind](source)


def _read_folder(folder: Source) -> RawRig:
    """The rig in a folder. RigError that says where the rig may be when none of its files are of a kind read here."""
    inside = sorted(folder.iterdir(), key=lambda source: source.name)
    if holds_targets(folder):
        return read_target_folder(folder)
    for kind, reader in FOLDER_READERS.items():
        if any(is_kind(source, kind) for source in inside):
            return reader(folder)
    if holds_tables(folder):
        return read_csv_folder(folder)
    name = folder_name(folder)
    if not inside:
        raise RigError(f"the folder {name} is empty: give {FORMATS}")
    better = [source for source in inside if source.suffix.lower() in READERS or (source.is_dir() and is_rig(source))]
    advice = f"give {' or '.join(source.name for source in better[:3])} inside it" if better else f"give {FORMATS}"
    raise RigError(f"the folder {name} holds no OBJ files: {advice}")


def is_rig(source: Source) -> bool:
    """Whether this is a folder with meshes in it, or a file that can be read where it is."""
    if source.is_dir():
        return any(is_kind(inner, kind) for inner in source.iterdir() for kind in FOLDER_READERS) or holds_tables(
            source
        )
    return any(is_kind(source, kind) for kind in (READERS if isinstance(source, Path) else IN_ARCHIVES))


def given_skin(skin: str, raw: RawRig) -> Bool[np.ndarray, " v"]:
    """The skin that a person named: a text file of the artist's vertex numbers, or parts separated by commas."""
    if os.path.isfile(skin):
        return listed_skin(Path(skin), raw.source_index, raw.name)
    names = [name.strip() for name in skin.split(",")]
    for name in names:
        if name not in raw.part_names:
            raise RigError(
                f"'{name}' is neither a file nor a part of {raw.name}: its parts are {', '.join(raw.part_names)}"
            )
    return np.isin(raw.parts, [raw.part_names.index(name) for name in names])


def listed_skin(path: Path, source_index: Int[np.ndarray, " v"], name: str) -> Bool[np.ndarray, " v"]:
    """The vertices of the rig or take `name` whose numbers in the artist's file a text file lists."""
    ranges = vertex_ranges(path)
    chosen = in_ranges(source_index, ranges)
    if not chosen.any():
        raise RigError(f"{path.name} names no vertex of {name}: give vertex numbers counted from 0")
    return chosen


def in_ranges(numbers: Int[np.ndarray, " v"], ranges: list[tuple[int, int]]) -> Bool[np.ndarray, " v"]:
    """Which numbers lie in one of the ranges, both ends counted."""
    low, high = np.array(ranges, dtype=np.int64).reshape(-1, 2).T
    order = np.argsort(low, kind="stable")
    reached = np.maximum.accumulate(high[order])  # the last number of all ranges that begin no later
    before = np.searchsorted(low[order], numbers, side="right")
    return (before > 0) & (np.append(reached, -1)[before - 1] >= numbers)


def vertex_ranges(path: Path) -> list[tuple[int, int]]:
    """First and last number of every range in a text file; spaces, commas or line ends part them, # comments."""
    try:
        text = read_plain(path, RigError, "give vertex numbers such as 0-6705 7002").decode("utf-8")
    except UnicodeDecodeError as error:
        raise RigError(f"{path.name} is not text: give vertex numbers such as 0-6705 7002") from error
    ranges: list[tuple[int, int]] = []
    for word in re.split(r"[\s,;\[\]]+", re.sub(r"#[^\n]*", "", text)):
        if not word:
            continue
        match = re.fullmatch(r"(\d{1,18})(?:-(\d{1,18}))?", word)
        if not match:
            raise RigError(f"{path.name}: '{word[:40]}' is no vertex number: give numbers such as 0-6705 7002")
        ranges.append((int(match[1]), int(match[2] or match[1])))
    return ranges
