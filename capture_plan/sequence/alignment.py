"""Meshes in many frames laid onto a rig, or without one turned upright: unit, axes, neutral, and the head held still.

Unit       what is given, what the file says, else the usual one that makes the head as large as the rig's
Neutral    the actor's where it is given or stands beside the frames, else the first frame that lies on the rig
Frames     each tested (`frame_tests.py`), those that do not show the mesh left out and said
"""

from pathlib import Path

import numpy as np
from jaxtyping import Float

from capture_plan.curves.frames import ChosenFrames, Frames, evenly
from capture_plan.errors import RigError
from capture_plan.face.axes import axes_matrix
from capture_plan.face.frame import find_frame
from capture_plan.formats.raw import UNITS_MM, RawRig
from capture_plan.reader.neutral import read_neutral
from capture_plan.rig.read_options import ReadOptions
from capture_plan.rig.record import Rig
from capture_plan.sequence.frame_tests import (
    MOST_FAULTY,
    NO_FIT_MM,
    FrameFault,
    face_at,
    first_face,
    sound_frames,
    take_mesh,
)
from capture_plan.sequence.head_stabilisation import HeldFrames, hold, still_vertices, stillness
from capture_plan.sequence.meshes import MeshTake
from capture_plan.sequence.record import Sequence

USUAL_FPS = 30.0
SAME_HEAD_MM = 0.5  # so near the rig's own neutral, a take shows the same head
SAME_UNIT = 4 / 3  # heads and expressions differ by less
UNIT_SAMPLE = 5  # frames of which most have the take's unit
ORIENT_SAMPLE = 12  # frames that stand for blendshapes when unit and axes are looked for


def lay_onto(
    path: Path, take: MeshTake, rig: Rig, neutral: str | Path | None, fps: float | None, unit_mm: float | None
) -> Sequence:
    """Frames of the rig's mesh, laid onto its neutral."""
    notes = [*take.notes]
    frames, shape = on_rig(path, take, rig)
    still = stillness(rig.displacement.max(axis=0)) * rig.skin
    if neutral is not None:
        shape = read_neutral(Path(neutral), rig)
    unit = unit_mm or take.unit_mm
    start = first_on_rig(path, frames, unit, rig, still) if shape is None else shape
    unit = unit or find_scale(path, start, rig, still)
    placed = hold(start * unit, rig.neutral, still)
    apart = distance(placed, rig, still)
    if apart > NO_FIT_MM:
        raise RigError(
            f"{path.name} lies {apart:.0f} mm off the rig {rig.name} where the face is still: "
            "it is another mesh, its vertex order was lost, or it holds displacements: export positions of the rig's "
            "own mesh, with its vertex order kept"
        )
    if shape is None and apart < SAME_HEAD_MM:
        placed = rig.neutral
    elif shape is None:
        notes.append("the first frame stands for the neutral: give the actor's neutral where it is none")
    mesh = take_mesh(placed, rig.triangles, rig.deltas, still)
    frames, message = sound_frames(path.name, frames, mesh, unit, f"the rig {rig.name}")
    notes += message
    held = HeldFrames(frames, placed, still, unit)
    rate = frame_rate(fps, take.fps, notes)
    return Sequence(path.stem, placed, rig.triangles, held, rate, rig, None, tuple(notes))


def first_on_rig(
    path: Path, frames: Frames, unit_mm: float | None, rig: Rig, still: Float[np.ndarray, " v"]
) -> Float[np.ndarray, "v 3"]:
    """The first frame that lies on the rig in the unit of most frames, in the take's unit; if none does, the first."""
    first = first_face(path.name, frames)
    some = [x for t in evenly(len(frames), UNIT_SAMPLE) if not isinstance(x := face_at(frames, t), FrameFault)]
    usual = unit_mm or float(np.median([find_scale(path, x, rig, still) for x in some or [first]]))
    for t in range(1 + int(MOST_FAULTY * len(frames))):
        start = face_at(frames, t)
        if isinstance(start, FrameFault):
            continue
        unit = unit_mm or find_scale(path, start, rig, still)
        near = distance(hold(start * unit, rig.neutral, still), rig, still) <= NO_FIT_MM
        if near and abs(np.log(unit / usual)) < np.log(SAME_UNIT):
            return start
    return first


def distance(placed: Float[np.ndarray, "v 3"], rig: Rig, still: Float[np.ndarray, " v"]) -> float:
    """Mean distance from the rig's neutral where the face is still, millimetres."""
    return float(still @ np.linalg.norm(placed - rig.neutral, axis=1) / still.sum())


def on_rig(path: Path, take: MeshTake, rig: Rig) -> tuple[Frames, Float[np.ndarray, "v 3"] | None]:
    """Frames and neutral of the rig's vertices, where the take has those of the artist's whole file."""
    count = len(first_face(path.name, take.frames))
    if count == len(rig.neutral):
        return take.frames, take.neutral
    if count <= rig.source_index.max():
        raise RigError(
            f"{path.name} has {count:,} vertices, the rig {rig.name} has {len(rig.neutral):,}: "
            "bring the take onto the rig's mesh first"
        )
    shape = None if take.neutral is None else take.neutral[rig.source_index]
    return ChosenFrames(take.frames, rig.source_index), shape


def find_scale(path: Path, start: Float[np.ndarray, "v 3"], rig: Rig, still: Float[np.ndarray, " v"]) -> float:
    """Millimetres in the take's unit: the usual one that makes its head as large as the rig's, within a third."""
    a = still / still.sum()
    spread = [float(np.sqrt(a @ ((x - a @ x) ** 2).sum(axis=1))) for x in (rig.neutral, start)]
    if spread[1] == 0:
        raise RigError(f"{path.name}: all vertices of its first frame lie in one place: export it again")
    scale = spread[0] / spread[1]
    near = min((rig.unit_mm, *UNITS_MM.values()), key=lambda unit: abs(np.log(scale / unit)))
    return near if abs(np.log(scale / near)) < np.log(SAME_UNIT) else scale


def orient_take(
    path: Path,
    take: MeshTake,
    neutral: str | Path | None,
    fps: float | None,
    given: ReadOptions,
) -> Sequence:
    """Frames of a mesh that no rig describes: unit and axes as found from the neutral and some frames."""
    if take.triangles is None or len(take.triangles) == 0:
        raise RigError(f"{path.name} has frames without faces: add 'faces', or give the rig of the same mesh")
    notes = [*take.notes]
    start = first_face(path.name, take.frames) if take.neutral is None else take.neutral
    if neutral is not None:
        raise RigError(f"{path.name}: a neutral of its own needs a rig: put it beside the frames as neutral.obj")
    if take.neutral is None:
        notes.append("the first frame stands for the neutral")
    size = float(np.ptp(start, axis=0).max())
    rough = 250 / size if size > 0 else 1.0  # a head is about that tall: enough to tell still from moving
    frames, message = sound_frames(
        path.name, take.frames, take_mesh(start * rough, take.triangles), rough, "the mesh of the first frame"
    )
    notes += message
    still = still_vertices(frames, start * rough, rough)
    some = evenly(len(frames), ORIENT_SAMPLE)
    held = np.stack([hold(frames.block(t, t + 1)[0] * rough, start * rough, still) for t in some]) / rough
    moving = [t for t, x in zip(some, held, strict=True) if np.abs(x - start).max() > 1e-6 * size]
    if not moving:
        raise RigError(f"{path.name} moves in none of its frames: give a take of a face that moves")
    v = len(start)
    raw = RawRig(
        name=path.stem,
        neutral=start,
        triangles=take.triangles,
        deltas=np.stack([x - start for t, x in zip(some, held, strict=True) if t in moving]).astype(np.float32),
        names=tuple(f"frame {t}" for t in moving),
        parts=np.zeros(v, dtype=np.int32),
        part_names=("mesh",),
        source_index=np.arange(v, dtype=np.int32),
        unit_mm=take.unit_mm,
        up=take.up,
        facing=take.facing,
    )
    frame = find_frame(raw, given)
    notes += [frame.note] if frame.note else []
    placed = start @ (frame.unit_mm * axes_matrix(frame.up, frame.facing)).T
    held_still = HeldFrames(frames, placed, still, frame.unit_mm)
    rate = frame_rate(fps, take.fps, notes)
    return Sequence(path.stem, placed, take.triangles, held_still, rate, None, None, tuple(notes))


def frame_rate(given: float | None, message: float | None, notes: list[str]) -> float:
    """What is given, else what the file says, else the usual one with a note."""
    if given is None and message is None:
        notes.append(
            f"neither the file nor its times tell a frame rate that a take has: {USUAL_FPS:g} in a second is assumed"
        )
    return given or message or USUAL_FPS
