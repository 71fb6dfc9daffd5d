"""Which dots a camera does not read in the neutral and in the expressions of a plan, and why not."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float, Int
from msgspec import Struct

from capture_plan.camera import Camera
from capture_plan.face.blocking import opaque_triangles
from capture_plan.layout.dot_contact import NEUTRAL, Poses
from capture_plan.layout.record import Landmark
from capture_plan.rig import Rig
from capture_plan.visibility import WORDS, Sight, Views, camera_views


class Unread(Struct, frozen=True, forbid_unknown_fields=True):
    """A camera does not read a dot in a pose, and why (`visibility.seen.WORDS`)."""

    pose: str
    camera: str
    dot: str
    why: str


def pose_deltas(rig: Rig, poses: Poses) -> Float[np.ndarray, "e v 3"]:
    """How every pose moves the rig, millimetres."""
    weights = np.array([[pose.get(name, 0.0) for name in rig.names] for pose in poses.values()])
    return np.tensordot(weights.reshape(len(poses), -1).astype(np.float32), rig.deltas, 1)


def pose_views(
    rig: Rig, markers: Sequence[Landmark], poses: Poses, cameras: Sequence[Camera], *, dot_mm: float
) -> Views:
    """What the cameras see of the markers in the neutral and in each pose."""
    return vertex_views(rig, np.array([m.vertex for m in markers], dtype=int), poses, cameras, dot_mm=dot_mm)


def vertex_views(
    rig: Rig, at: Int[np.ndarray, " n"], poses: Poses, cameras: Sequence[Camera], *, dot_mm: float
) -> Views:
    """What the cameras see of dots at vertices in the neutral and in each pose."""
    return camera_views(rig.neutral, pose_deltas(rig, poses), opaque_triangles(rig), at, cameras, dot_mm=dot_mm)


def unread(
    rig: Rig, markers: Sequence[Landmark], poses: Poses, cameras: Sequence[Camera], dot_mm: float
) -> tuple[Unread, ...]:
    """All of the neutral, then of every pose in its order, a camera after the other."""
    if not cameras or not markers:
        return ()
    how = pose_views(rig, markers, poses, cameras, dot_mm=dot_mm).how
    names = (NEUTRAL, *poses)
    return tuple(
        Unread(names[e], cameras[c].name, markers[m].name, WORDS[Sight(int(how[e, c, m]))])
        for e, c, m in np.argwhere(how != Sight.READ).tolist()
    )
