"""The rotation that puts a head upright that lies anyhow in its file, not only along signed axes.

Data     n        normal of the mirror plane (`mesh/mirror.py`): exact to 0.01 degrees, as are yaw and roll by it
         L, F, U  which way left, facing and up are, by all signs (`face/votes.py`), in axes whose x lies along n
Rotation R        rows left, up, facing: left = s x with s = 1 or -1, up = (0, c, t), facing = s (0, -t, c), with the
                  largest  U . up + F . facing + L . left  over s and the pitch (c, t)
Nod      pitch of a head that lies along axes but bows or looks up in them: by what moves and looks which way,
         atan2(U_z - F_y, U_y + F_z), and by the line from the mouth to the eyes, each less what it is on upright
         heads; heeded where both exceed NODS, where what goes up (U) and what looks forward (F) tell one pitch, where
         its signs agree on it (Doubt), and where no neck is cut level. A snout tips the line alone, so no other line
         counts as a sign of the way. A head that may bow, but for these, is left as it is, and doubted without such a
         neck
Level    an open edge below the mouth that lies in one plane, within FLAT of its size, whose normal is an axis of the
         file: a head that was tipped with it would have that edge aslant
The pitch is a matter of taste: human rigs that stand upright in their files are told within 10 degrees of it.
Doubt    the standard error of the pitch, by how its signs scatter: e = sqrt(sum w a^2 / sum w) / sqrt(n) with a their
         angles from it, w their weights and n = (sum w)^2 / sum w^2; sure below ERROR from at least SIGNS of them
"""

import dataclasses

import numpy as np
from jaxtyping import Float
from scipy.spatial import KDTree

from capture_plan.face.axes import PAIRS, Vote, axes_matrix, sharpness, together
from capture_plan.face.frame import Frame, head_shape, votes_of
from capture_plan.face.shape import Shape, border_loops
from capture_plan.formats.raw import RawRig
from capture_plan.mesh.mirror import SAMPLE, Plane, find_mirror_plane, mirror_plane
from capture_plan.rig.read_options import AS_FOUND, ReadOptions

SYMMETRIC, BETTER = 0.02, 4.0  # of the size; times as near as about any plane across an axis
RATHER = 1.5  # times as near: a lopsided head may lie turned
PITCH_DEGREES = 10.0  # as well as it is told on human rigs
NODS = 20.0  # degrees; of 22 upright avatars and 100 generated heads all but two lie within 16 by signs, 15 by the line
ONE_PITCH = 30.0  # degrees between that of U and that of F: heads that are tipped 1, upright faces drawn flat 38 to 61
BY_SIGNS, BY_LINE = 10.0, -10.0  # degrees: the middle of these
ERROR_DEGREES, SIGNS = 8.5, 5.0  # 5 heads in 150 subsets of their movements: so 12 degrees off at most, else up to 54
RIGHT_ANGLE = 90.0  # degrees: a sign that points elsewhere altogether counts as so far off
LEAST_OF_EDGE = 8  # vertices: fewer lie in a plane by chance
FLAT, LEVEL_DEGREES = 0.02, 3.0  # of an edge's size, from its plane; between its normal and up: a cut that was meant
TILTED_DEGREES = 5.0  # more than an artist leaves by chance, less than a head that was turned


@dataclasses.dataclass(frozen=True, eq=False)
class _Pose:
    """Rotation from the file's axes to ours, rows left, up and facing, and whether its pitch is sure."""

    R: Float[np.ndarray, "3 3"]
    sure: bool


def upright(raw: RawRig) -> _Pose:
    """How a head lies in its file."""
    turn = _onto_x(np.array(find_mirror_plane(_near_face(head_shape(raw))).normal))
    votes = votes_of(rotated(raw, turn), 0)
    L, F, U = (together(votes, role) for role in ("left", "facing", "up"))
    found = []
    for s in (1.0, -1.0):
        along, across = U[1] + s * F[2], U[2] - s * F[1]
        pitch = np.arctan2(across, along)
        c, t = np.cos(pitch), np.sin(pitch)
        rows = np.array([[s, 0, 0], [0, c, t], [0, -s * t, s * c]])
        found.append((round(float(np.hypot(along, across) + s * L[0]), 9), rows))
    _, rows = max(found, key=lambda one: one[0])
    return _Pose(rows @ turn, pitch_is_sure(votes, rows))


def pitch_is_sure(votes: list[Vote], R: Float[np.ndarray, "3 3"]) -> bool:
    """Whether enough signs of up and facing tell nearly the pitch of the rotation R."""
    signs = [vote for vote in votes if vote.role != "left"]
    turned = [R @ vote.direction for vote in signs]
    off = [np.arctan2(*(u[[2, 1]] if vote.role == "up" else u[[1, 2]])) for vote, u in zip(signs, turned, strict=True)]
    w = np.array([sharpness(vote) * np.hypot(u[1], u[2]) for vote, u in zip(signs, turned, strict=True)])
    if not w.any():
        return False
    n = w.sum() ** 2 / (w**2).sum()
    scatter = np.sqrt(w @ np.minimum(np.abs(np.degrees(off)), RIGHT_ANGLE) ** 2 / w.sum())
    return bool(n >= SIGNS and scatter < ERROR_DEGREES * np.sqrt(n))


def tilt_degrees(plane: Plane) -> float:
    """How far the plane's normal lies from the nearest axis."""
    return float(np.degrees(np.arccos(min(1.0, max(map(abs, plane.normal))))))


def nearest_axes(R: Float[np.ndarray, "3 3"]) -> tuple[str, str]:
    """The signed axes (up, facing) of the file that lie nearest to ours; the rows of R are our axes in the file."""
    return max(PAIRS, key=lambda pair: float(np.trace(R @ axes_matrix(*pair).T)))


def off_axes_degrees(R: Float[np.ndarray, "3 3"]) -> float:
    """Angle of the rotation from the nearest pose along signed axes."""
    trace = np.trace(R @ axes_matrix(*nearest_axes(R)).T)
    return float(np.degrees(np.arccos(np.clip((trace - 1) / 2, -1, 1))))


@dataclasses.dataclass(frozen=True, eq=False)
class Straight:
    """A rig whose mirror plane lies along an axis, the rotation Q made for it, and what a person stated,
    along its axes now. `doubted`: its plane lies along none, and it is too lopsided to be turned, or its pitch is not
    sure."""

    raw: RawRig
    Q: Float[np.ndarray, "3 3"]
    given: ReadOptions = AS_FOUND
    doubted: bool = False


def straightened(raw: RawRig, shape: Shape, given: ReadOptions = AS_FOUND) -> Straight:
    """The rig itself where its mirror plane lies along an axis, within `TILTED_DEGREES`; else upright, with a note.

    `shape` is the rig's own. What was given are the nearest axes of the file: where signs say otherwise, the pitch is
    left as it is.
    """
    points = _near_face(shape)
    plane = find_mirror_plane(points)
    tilt = tilt_degrees(plane)
    if tilt <= TILTED_DEGREES:
        return Straight(raw, np.eye(3), given)
    mirrors, rather = _mirrors(points, plane)
    if not mirrors and not rather:
        return Straight(raw, np.eye(3), given)
    if not mirrors:
        message = (
            f"the head may lie turned by {tilt:.0f} degrees in its file and is too lopsided to tell: turn it there"
        )
        return Straight(_noted(raw, message), np.eye(3), given, doubted=True)
    Q = _onto_axis(np.array(plane.normal))
    turned = rotated(raw, Q)
    pose = upright(turned)
    R = pose.R
    pitched = off_axes_degrees(R) > PITCH_DEGREES  # not about one axis of the file
    stated = (given.up, given.facing)
    if pitched and all(one in (None, own) for one, own in zip(stated, nearest_axes(R @ Q), strict=True)):
        given = dataclasses.replace(given, up=given.up and "+y", facing=given.facing and "+z")
        turned, Q = dataclasses.replace(rotated(turned, R), up=None, facing=None), R @ Q
    else:
        pitched = False
    message = f"the head lies turned by {off_axes_degrees(Q):.0f} degrees in its file: it was put upright"
    if not pose.sure:
        message += ", but how far it bows is not sure"
    elif pitched:
        message += f", its pitch to about {PITCH_DEGREES:.0f} degrees"
    return Straight(_noted(turned, message), Q, given, doubted=not pose.sure)


@dataclasses.dataclass(frozen=True, eq=False)
class Lifted:
    """A rig upright, with a note, and the rotation Q that was made; `doubted`: it may bow, and was left as it is."""

    raw: RawRig
    Q: Float[np.ndarray, "3 3"]
    doubted: bool = False


def lifted(raw: RawRig, frame: Frame) -> Lifted:
    """The rig with its head upright; itself where its head neither bows nor looks up, or may not."""
    same = Lifted(raw, np.eye(3))
    eyes, mouth = frame.points.eyes, frame.points.mouth
    if not (eyes.sure and mouth.sure) or eyes.places is None or mouth.places is None:
        return same
    R = axes_matrix(frame.up, frame.facing)
    line = eyes.places.mean(axis=0) - mouth.places[0]
    ways = [vote for vote in frame.votes if not vote.line]
    U, F = (R @ together(ways, role) for role in ("up", "facing"))
    by_signs = np.degrees(np.arctan2(U[2] - F[1], U[1] + F[2])) - BY_SIGNS
    by_line = np.degrees(np.arctan2(line[2], line[1])) - BY_LINE
    apart = abs(np.degrees(np.arctan2(U[2] * F[2] + U[1] * F[1], U[1] * F[2] - U[2] * F[1])))
    if min(abs(by_signs), abs(by_line)) < NODS or by_signs * by_line < 0 or apart > ONE_PITCH:
        return same
    nod = (by_signs + by_line) / 2
    c, t = np.cos(np.radians(nod)), np.sin(np.radians(nod))
    raised = np.array([[1, 0, 0], [0, c, t], [0, -t, c]]) @ R
    sure, level = pitch_is_sure(ways, raised), neck_is_level(raw, R, mouth.places[0])
    message = f"the head is tipped by about {abs(nod):.0f} degrees from the axes of its file"
    if not sure and level:
        return same
    if level or not sure:
        why = "its neck is cut level" if level else "its signs do not agree on how far"
        message = message.replace("is tipped", "may be tipped") + f"; {why}, so it was left as it is"
        return Lifted(_noted(raw, message), np.eye(3), doubted=True)
    message += f": it was put upright, to about {PITCH_DEGREES:.0f}"
    Q = R.T @ raised
    return Lifted(_noted(dataclasses.replace(rotated(raw, Q), up=None, facing=None), message), Q)


def neck_is_level(raw: RawRig, R: Float[np.ndarray, "3 3"], mouth: Float[np.ndarray, " 3"]) -> bool:
    """Whether the longest open edge below the mouth lies in a plane across up; R turns the file into our axes, in which
    the mouth is."""
    loops = (raw.neutral[loop] @ R.T for loop in border_loops(raw.triangles))
    neck = next((loop for loop in loops if len(loop) >= LEAST_OF_EDGE and loop[:, 1].max() < mouth[1]), None)
    if neck is None:
        return False
    _, spread, axes = np.linalg.svd(neck - neck.mean(axis=0), full_matrices=False)
    return bool(spread[2] < FLAT * spread[0] and abs(axes[2, 1]) > np.cos(np.radians(LEVEL_DEGREES)))


def _noted(raw: RawRig, message: str) -> RawRig:
    return dataclasses.replace(raw, note="; ".join(filter(None, (raw.note, message))))


def rotated(raw: RawRig, R: Float[np.ndarray, "3 3"]) -> RawRig:
    """A rig in turned axes."""
    deltas = (raw.deltas @ R.T).astype(np.float32)
    return dataclasses.replace(raw, neutral=raw.neutral @ R.T, deltas=deltas)


def _near_face(shape: Shape) -> Float[np.ndarray, "n 3"]:
    """Vertices of a head without what hangs on it; all of them where that leaves too few."""
    near = shape.near
    return shape.neutral[near] if near.sum() > 3 else shape.neutral


def _mirrors(v: Float[np.ndarray, "v 3"], plane: Plane) -> tuple[bool, bool]:
    """Whether points are symmetric about `plane`, and about no plane across an axis nearly as well; and whether they
    are at least more so about it than about these."""
    size = float(np.linalg.norm(np.std(v, axis=0)))
    across = [mirror_plane(np.roll(v, -axis, axis=1)) for axis in range(3)]
    axes = [Plane((float(axis == 0), float(axis == 1), float(axis == 2)), c) for axis, c in enumerate(across)]
    off, *others = (_apart(v, one) for one in (plane, *axes))
    return off < SYMMETRIC * size and off * BETTER < min(others), off * RATHER < min(others)


def _apart(v: Float[np.ndarray, "v 3"], plane: Plane) -> float:
    """Median distance from a reflected point to the nearest point."""
    some = v[np.unique(np.linspace(0, len(v) - 1, SAMPLE).astype(int))]
    return float(np.median(KDTree(v).query(plane.reflect(some))[0]))


def _onto_axis(n: Float[np.ndarray, " 3"]) -> Float[np.ndarray, "3 3"]:
    """The smallest rotation that turns n onto the nearest axis e: I + K + K^2 / (1 + n . e), K = [n x e]."""
    e = np.where(np.arange(3) == np.argmax(np.abs(n)), np.sign(n), 0.0)
    x, y, z = np.cross(n, e)
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + K + K @ K / (1 + n @ e)


def _onto_x(n: Float[np.ndarray, " 3"]) -> Float[np.ndarray, "3 3"]:
    """A rotation that turns n onto +x: its first row is n."""
    other = np.eye(3)[int(np.argmin(np.abs(n)))]
    up = np.cross(n, other)
    up /= np.linalg.norm(up)
    return np.stack([n, up, np.cross(n, up)])
