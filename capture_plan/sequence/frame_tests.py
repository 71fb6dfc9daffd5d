"""Frames of a mesh take that do not show its mesh: every frame is tested, and what fails is left out and counted.

Data     X[t, v]   frames, millimetres; v0[v] the neutral; n(v) a neighbour of v in a triangle
         l[t, v] = |X[t, v] - X[t, n(v)]|, l0[v] of the neutral: the motion of the head changes neither
Lost     a coordinate is no number, or all vertices lie in one place: no face
Size     median_v l[t, v] / l0[v] lies between 1 / SIZE and SIZE: else another unit or another vertex order
Place    the mean distance from the neutral where the face is still, after a rigid fit, is at most NO_FIT_MM
Wild     l[t, v] - l0[v] is at most WILD_MM, with a rig more by twice what any blendshape makes of it
Files    one that cannot be read, or has another number of vertices, is a frame that fails
A take is refused where more than MOST_FAULTY of its frames fail. Frames are read one after the other.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from capture_plan.curves.frames import ChosenFrames, Frames, SelectedFrames, evenly
from capture_plan.curves.rows import have, some_of, were
from capture_plan.curves.silence import runs
from capture_plan.errors import RigError
from capture_plan.formats.raw import FARTHEST
from capture_plan.progress import track
from capture_plan.prose import in_series
from capture_plan.sequence.head_stabilisation import hold

SIZE = 4 / 3  # usual units differ by 2.5 and more, heads and expressions by less
NO_FIT_MM = 25.0  # a person's head on another person's mesh is within 10; a mesh of another vertex order is beyond
WILD_MM = 40.0  # neighbours in a mesh of a face come less far apart than the lips
WILD_ALONE_MM = 100.0  # without blendshapes: an open mouth may stretch what spans it
LONE_MM = 10_000.0  # of a vertex in no triangle, from any other: a body is not as tall
MOST_FAULTY = 0.2  # of the frames, as of the rows of a table
FITTED = 400  # still vertices that tell the place of a frame
SIZED = 4000  # links that tell the size of a frame
FEW = 3  # places in a sentence
LOST, OFF, WILD, UNREADABLE = "lost", "off", "wild", "unreadable"


@dataclass(frozen=True, eq=False)
class Mesh:
    """What frames are tested against, millimetres: the neutral, a neighbour of each vertex, its distance in the neutral
    and the longest that is believed. `still` weighs the vertices that tell the place; None leaves it untested."""

    neutral: Float[np.ndarray, "v 3"]
    neighbour: Int[np.ndarray, " v"]
    lengths: Float[np.ndarray, " v"]
    most: Float[np.ndarray, " v"]
    still: Float[np.ndarray, " v"] | None


def take_mesh(
    neutral: Float[np.ndarray, "v 3"],
    triangles: Int[np.ndarray, "f 3"],
    deltas: Float[np.ndarray, "k v 3"] | None = None,
    still: Float[np.ndarray, " v"] | None = None,
) -> Mesh:
    """The mesh of a take; `deltas` are those of its rig."""
    neighbour = np.full(len(neutral), int(triangles[0, 0]))
    lone = np.ones(len(neutral), dtype=bool)
    for here, there in ((0, 1), (1, 2), (2, 0)):
        neighbour[triangles[:, here]], lone[triangles[:, here]] = triangles[:, there], False
    apart = neutral - neutral[neighbour]
    lengths = np.linalg.norm(apart, axis=1)
    most = lengths + (WILD_ALONE_MM if deltas is None else WILD_MM)
    for d in () if deltas is None else deltas:
        stretched = np.linalg.norm(apart + d - d[neighbour], axis=1) - lengths
        np.maximum(most, lengths + WILD_MM + 2 * stretched, out=most)
    most[lone] += LONE_MM
    return Mesh(neutral, neighbour, lengths, most, still)


@dataclass(frozen=True)
class FrameFault:
    """What is wrong with a frame: one of `LOST`, `OFF`, `WILD`, `UNREADABLE`, and the words for it."""

    kind: str
    message: str = ""


def has_face(x: Float[np.ndarray, "v 3"]) -> bool:
    """Whether a frame is finite and not all in one place."""
    return bool((np.abs(x) < FARTHEST).all() and (x != x[:1]).any())


def face_at(frames: Frames, t: int) -> Float[np.ndarray, "v 3"] | FrameFault:
    """Frame t, in the file's unit; a fault where it cannot be read or has no face."""
    try:
        x = frames.block(t, t + 1)[0]
    except RigError as error:
        return FrameFault(UNREADABLE, str(error))
    return x if has_face(x) else FrameFault(LOST)


def first_face(name: str, frames: Frames) -> Float[np.ndarray, "v 3"]:
    """The first frame of the take `name` with a face. RigError where none has one, or too many cannot be read."""
    unreadable: list[str] = []
    for t in range(len(frames)):
        x = face_at(frames, t)
        if not isinstance(x, FrameFault):
            return x
        unreadable += [x.message] if x.kind == UNREADABLE else []
        if len(unreadable) > MOST_FAULTY * len(frames):
            raise RigError(unreadable[0])
    raise RigError(f"{name} has no frame of finite vertices: save it again")


def sound_frames(name: str, frames: Frames, mesh: Mesh, unit_mm: float, on: str) -> tuple[Frames, tuple[str, ...]]:
    """The frames of the take `name` that show the mesh, and sentences about the others; `on` names the mesh.

    RigError where none shows it, or too many do not.
    """
    faults: dict[int, FrameFault] = {}
    sample = samples(mesh)
    for t in track(range(len(frames)), "Testing each frame"):
        if (fault := fault_of(frames, t, mesh, unit_mm, sample)) is not None:
            faults[t] = fault
    if not faults:
        return frames, ()
    retained = np.array([t for t in range(len(frames)) if t not in faults], dtype=np.int64)
    notes = tuple(_sentences(faults, len(frames), on))
    bad = sum(fault.kind != LOST for fault in faults.values())
    if bad > MOST_FAULTY * len(frames):
        message = "; ".join(notes).replace(": left out", "")
        raise RigError(
            f"{name} has {bad:,} of {len(frames):,} frames that do not show the mesh ({message}): "
            "export all frames of one mesh in one unit with its vertex order kept, and takes as files of their own"
        )
    if len(retained) == 0:
        raise RigError(f"{name} has no frame of finite vertices: save it again")
    return SelectedFrames(frames, retained), notes


def samples(mesh: Mesh) -> tuple[Int[np.ndarray, " s"], Int[np.ndarray, " n"]]:
    """Vertices that tell the size, and those that tell the place: the stillest half of what is still."""
    long = np.flatnonzero(mesh.lengths > 0)
    sized = long[list(evenly(len(long), SIZED))]
    if mesh.still is None:
        return sized, sized[:0]
    still = np.flatnonzero(mesh.still >= 0.5 * mesh.still.max())
    return sized, still[list(evenly(len(still), FITTED))]


def fault_of(
    frames: Frames,
    t: int,
    mesh: Mesh,
    unit_mm: float,
    sample: tuple[Int[np.ndarray, " s"], Int[np.ndarray, " n"]],
) -> FrameFault | None:
    """What is wrong with frame t; None where it shows the mesh."""
    x = face_at(frames, t)
    if isinstance(x, FrameFault):
        return x
    x, (sized, fitted) = x * unit_mm, sample
    lengths = np.linalg.norm(x - x[mesh.neighbour], axis=1)
    size = float(np.median(lengths[sized] / mesh.lengths[sized])) if len(sized) else 1.0
    if not 1 / SIZE < size < SIZE:
        return FrameFault(OFF)
    if (over := lengths - mesh.most).max() > 0:
        return wild(frames, x, mesh, over)
    if mesh.still is not None and _misplaced(x[fitted], mesh.neutral[fitted], mesh.still[fitted]) > NO_FIT_MM:
        return FrameFault(OFF)
    return None


def _misplaced(x: Float[np.ndarray, "n 3"], v0: Float[np.ndarray, "n 3"], a: Float[np.ndarray, " n"]) -> float:
    """Mean distance a of a frame from the neutral after a rigid fit, weighed by a."""
    return float(a @ np.linalg.norm(hold(x, v0, a) - v0, axis=1) / a.sum())


def wild(frames: Frames, x: Float[np.ndarray, "v 3"], mesh: Mesh, over: Float[np.ndarray, " v"]) -> FrameFault:
    """The words for the vertex that lies furthest from its place, of those too far from their neighbours."""
    far = np.flatnonzero(over > 0)
    ends = np.unique(np.concatenate([far, mesh.neighbour[far]]))
    middle = np.median(x - mesh.neutral, axis=0)  # as if the head had not turned: it is far all the same
    apart = np.linalg.norm(x[ends] - mesh.neutral[ends] - middle, axis=1)
    v = int(ends[apart.argmax()])
    number = int(frames.chosen[v]) if isinstance(frames, ChosenFrames) else v
    more = f" and {len(far) - 1:,} more" if len(far) > 2 else ""
    return FrameFault(WILD, f"vertex {number:,}{more} in frame {{t}}, {apart.max():,.0f} mm off")


def _sentences(faults: dict[int, FrameFault], count: int, on: str) -> list[str]:
    """What has to be said of frames that fail, by what is wrong."""
    by_kind: dict[str, Bool[np.ndarray, " t"]] = {}
    for t, fault in faults.items():
        by_kind.setdefault(fault.kind, np.zeros(count, dtype=bool))[t] = True
    messages = []
    if (lost := by_kind.get(LOST)) is not None:
        messages.append(f"{some_of(lost, 'frames')} {have(lost)} no face and {were(lost)} left out")
    if (off := by_kind.get(OFF)) is not None:
        one = off.sum() == 1
        messages.append(
            f"{places(off)} ({off.sum():,} of {count:,}) {'does' if one else 'do'} not lie on {on}: "
            f"{'its' if one else 'their'} vertex order or unit was lost: left out"
        )
    if (far := by_kind.get(WILD)) is not None:
        t = int(far.argmax())
        first = faults[t].message.format(t=f"{t:,}")
        messages.append(
            f"{some_of(far, 'frames')} {have(far)} vertices torn off the mesh (the first: {first}): left out"
        )
    if (bad := by_kind.get(UNREADABLE)) is not None:
        messages.append(
            f"{some_of(bad, 'frames')} cannot be read (the first: {faults[int(bad.argmax())].message}): left out"
        )
    return messages


def places(some: Bool[np.ndarray, " t"]) -> str:
    """'frame 4', 'frames 15 to 29', 'frames 3, 7 to 9 and 12'."""
    ranges = [f"{a:,}" if b - a == 1 else f"{a:,} to {b - 1:,}" for a, b in runs(some)]
    shown, more = ranges[:FEW], len(ranges) - FEW
    listed = in_series([*shown, f"{more:,} more places"] if more > 0 else shown)
    return f"frame{'' if some.sum() == 1 else 's'} {listed}"
