"""What every reader gives: a rig as its file has it, in the file's own unit, axes and vertex order.

Letters: v vertices, f triangles, k blendshapes, p polygons, c corners of polygons.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Int

from capture_plan.errors import RigError
from capture_plan.formats.naming import listed, numbered, one_line, sentences
from capture_plan.input.bounds import LONGEST_NAME, check_size
from capture_plan.rig.record import check_blendshapes

NO_PART = "(no faces)"
FARTHEST = 1e9  # units of a file, whose squares single precision still holds
LONGEST = 1000  # times the size of the neutral: no blendshape moves so far
AS_NEUTRAL = 0.3  # of the spread of the neutral: positions of 19 rigs lie within 0.19 of it, offsets 0.98 off
BROKEN = "NaN or infinite coordinates, or those of another mesh"
UNITS_MM = {"mm": 1.0, "cm": 10.0, "m": 1000.0, "dm": 100.0, "in": 25.4, "ft": 304.8}  # the usual ones first


@dataclass(frozen=True, eq=False)
class RawRig:
    """Arrays as in `Rig`, lengths in the file's unit; `unit_mm`, `up`, `facing` are the format's promise, if any.

    `note` says in a sentence what a person should know of how the file was understood; `left_out` names what of the
    file is not part of the rig. `meshes` tells of which of the file's meshes a vertex is, where it has several.
    """

    name: str
    neutral: Float[np.ndarray, "v 3"]
    triangles: Int[np.ndarray, "f 3"]
    deltas: Float[np.ndarray, "k v 3"]
    names: tuple[str, ...]
    parts: Int[np.ndarray, " v"]
    part_names: tuple[str, ...]
    source_index: Int[np.ndarray, " v"]
    unit_mm: float | None = None
    up: str | None = None
    facing: str | None = None
    note: str = ""
    left_out: tuple[str, ...] = ()
    meshes: Int[np.ndarray, " v"] | None = None

    def __post_init__(self) -> None:
        check_size(self.name, len(self.names), len(self.neutral))
        check_blendshapes(self.name, self.neutral, self.triangles, self.deltas, self.names)
        if not self.deltas.any():
            raise RigError(
                f"{self.name}: every blendshape equals the neutral: export each blendshape with its weight set to 1"
            )


def finite(raw: RawRig) -> RawRig:
    """The rig without blendshapes that hold NaN, infinite coordinates or those of another mesh; its note names them.

    RigError when all of them do, or when the neutral lies farther out than can be reckoned with.
    """
    if not (farthest := np.abs(raw.neutral).max(initial=0)) < FARTHEST:
        raise RigError(f"{raw.name}: a vertex lies {farthest:.0e} units out: clean the mesh and export it again")
    limit = LONGEST * np.ptp(raw.neutral, axis=0).max(initial=0)
    whole = np.array([bool((np.abs(delta) <= limit).all()) for delta in raw.deltas])  # NaN is below nothing
    if whole.all():
        return raw
    broken = listed(name for name, is_whole in zip(raw.names, whole, strict=True) if not is_whole)
    if not whole.any():
        raise RigError(f"{raw.name}: all blendshapes hold {BROKEN}: clean the mesh and export it again")
    message = f"blendshapes that hold {BROKEN} were left out, clean them and export again: {broken}"
    names = tuple(name for name, is_whole in zip(raw.names, whole, strict=True) if is_whole)
    return replace(raw, deltas=raw.deltas[whole], names=names, note=sentences(raw.note, message))


def are_positions(neutral: Float[np.ndarray, "v 3"], delta: Float[np.ndarray, "v 3"]) -> bool:
    """Whether a delta is nearly the neutral itself, which no movement of a face is: it tells where vertices lie."""
    x, d = neutral - neutral.mean(axis=0), delta - delta.mean(axis=0)
    return bool(np.linalg.norm(d - x) < AS_NEUTRAL * np.linalg.norm(x))


def offsets(raw: RawRig) -> RawRig:
    """The rig with offsets from the neutral, where all its deltas are positions; its note says so."""
    if not all(are_positions(raw.neutral, delta) for delta in raw.deltas):
        return raw
    message = "all deltas hold positions, not offsets: the neutral was subtracted from each"
    deltas = (raw.deltas - raw.neutral).astype(np.float32)
    if not deltas.any():
        return raw
    return replace(raw, deltas=deltas, note=sentences(raw.note, message))


def legible(raw: RawRig) -> RawRig:
    """The rig with names and a note that can be shown in one line: without signs that a terminal, a table or a page
    would obey, and no longer than a name is."""
    names, message = numbered([one_line(name)[:LONGEST_NAME] for name in raw.names])
    parts = tuple(one_line(name)[:LONGEST_NAME] for name in raw.part_names)
    strange = [name for name, own in zip(names, raw.names, strict=True) if name != own]
    said = f"names too long or with signs that cannot be shown were changed: {listed(strange)}" if strange else message
    note = sentences(raw.note, said)
    return replace(raw, name=one_line(raw.name), names=names, part_names=parts, note=one_line(note))


def fan(corners: Int[np.ndarray, " c"], sizes: Int[np.ndarray, " p"]) -> Int[np.ndarray, "f 3"]:
    """Triangles of polygons, each a fan around its first corner; `corners` are those of all polygons in a row."""
    count = sizes - 2
    polygon = np.repeat(np.arange(len(sizes)), count)
    first = (np.cumsum(sizes) - sizes)[polygon]
    step = np.arange(len(polygon)) - (np.cumsum(count) - count)[polygon]
    return corners[np.stack([first, first + step + 1, first + step + 2], axis=1)]


def vertex_parts(
    triangles: Int[np.ndarray, "f 3"], labels: Int[np.ndarray, " f"], part_names: tuple[str, ...], v: int
) -> tuple[Int[np.ndarray, " v"], tuple[str, ...]]:
    """The part of each of `v` vertices: the first in the file of those that meet there; `NO_PART` without triangles."""
    parts = np.full(v, len(part_names), dtype=np.int32)
    np.minimum.at(parts, triangles.ravel(), np.repeat(labels.astype(np.int32), 3))
    return parts, part_names + ((NO_PART,) if (parts == len(part_names)).any() else ())
