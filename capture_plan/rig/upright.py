"""The rotation that puts a head upright that lies anyhow in its file, not only along signed axes.

Data     n        normal of the mirror plane (`mesh/mirror.py`): exact to 0.01 degrees, as are yaw and roll by it
         F, U     which way the face looks and where up is, by shape and motion (`orient.py`), seen across n
Rotation R        rows left, up, facing: left = n or -n, and the pitch with the largest F . facing + UP U . up,
                  tan(pitch) = (UP U_z - F_y) / (F_z + UP U_y)
The pitch is a matter of taste: eight human rigs that stand upright in their files are told 8 degrees down to 9 up.
"""

import dataclasses

import numpy as np
from jaxtyping import Float
from scipy.spatial import KDTree

from capture_plan.mesh.mirror import SAMPLE, Plane, find_mirror_plane, mirror_plane
from capture_plan.rig.formats.raw import RawRig
from capture_plan.rig.orient import UP, evidence

SYMMETRIC, BETTER = 0.02, 4.0  # of the size; times as near as about any plane across an axis
PITCH_DEGREES = 10.0  # as well as it is told on human rigs
TILTED_DEGREES = 5.0  # more than an artist leaves by chance, less than a head that was turned


def upright(raw: RawRig) -> Float[np.ndarray, "3 3"]:
    """Rotation from the file's axes to ours; its rows are the subject's left, up and facing in the file."""
    n = np.array(find_mirror_plane(raw.neutral).normal)
    found = []
    for left in (n, -n):
        R = _onto_x(left)
        F, U = evidence(rotated(raw, R), 0)
        along, across = F[2] + UP * U[1], UP * U[2] - F[1]
        pitch = np.arctan2(across, along)
        c, s = np.cos(pitch), np.sin(pitch)
        turn = np.array([[1.0, 0, 0], [0, c, s], [0, -s, c]])  # rows: up = (0, c, s), facing = (0, -s, c)
        found.append((round(float(np.hypot(along, across)), 9), turn @ R))
    return max(found, key=lambda one: one[0])[1]


def tilt_degrees(plane: Plane) -> float:
    """How far the plane's normal lies from the nearest axis."""
    return float(np.degrees(np.arccos(min(1.0, max(map(abs, plane.normal))))))


def straightened(raw: RawRig) -> RawRig:
    """The rig itself where its mirror plane lies along an axis, within `TILTED_DEGREES`; else upright, with a note."""
    plane = find_mirror_plane(raw.neutral)
    tilt = tilt_degrees(plane)
    if tilt <= TILTED_DEGREES or not _mirrors(raw, plane):
        return raw
    told = f"the head lies turned by {tilt:.0f} degrees in its file: it was put upright"
    turned = rotated(raw, _onto_axis(np.array(plane.normal)))
    R = upright(turned)
    if np.degrees(np.arccos((np.trace(R @ np.round(R).T) - 1) / 2)) > PITCH_DEGREES:  # not about one axis of the file
        told += f", its pitch to about {PITCH_DEGREES:.0f} degrees"
        turned = dataclasses.replace(rotated(turned, R), up=None, facing=None)
    return dataclasses.replace(turned, note="; ".join(filter(None, (raw.note, told))))


def rotated(raw: RawRig, R: Float[np.ndarray, "3 3"]) -> RawRig:
    """The same rig in turned axes."""
    deltas = (raw.deltas @ R.T).astype(np.float32)
    return dataclasses.replace(raw, neutral=raw.neutral @ R.T, deltas=deltas)


def _mirrors(raw: RawRig, plane: Plane) -> bool:
    """Whether the neutral is symmetric about `plane`, and about no plane across an axis nearly as well."""
    v = raw.neutral
    size = float(np.linalg.norm(np.std(v, axis=0)))
    across = [mirror_plane(np.roll(v, -axis, axis=1)) for axis in range(3)]
    axes = [Plane((float(axis == 0), float(axis == 1), float(axis == 2)), c) for axis, c in enumerate(across)]
    off, *others = (_apart(v, one) for one in (plane, *axes))
    return off < SYMMETRIC * size and off * BETTER < min(others)


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
