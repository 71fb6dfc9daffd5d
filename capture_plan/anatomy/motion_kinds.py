"""What kind of thing each blendshape is, from what moves: on raw arrays, in any unit and any axes.

Data       x[v]  neutral;  d[k, v]  deltas;  a[v]  areas, of the skin where it is known;  e[k, v] = a[v] |d[k, v]|^2
Nothing    d[k] = 0
Head       a motion of the whole head as one (`whole_head.py`)
Elsewhere  nearly none of e[k] lies within reach of the face; or less than half, where its name says so too. Without a
           place of the face: less than half of it where blendshapes move that are not called so, and a name that is
Calls      a plain sum of others (`sums.py`)
Face       everything else, and whatever is in doubt
Wrong      what was exported wrongly (`misexported.py`) comes from a rig's file and is asked before any of these
"""

from typing import Literal, NamedTuple, get_args

import numpy as np
from jaxtyping import Bool, Float, Int

from capture_plan.anatomy.sums import Halves, calls
from capture_plan.anatomy.whole_head import MOST, MOVES, Sphere, head_movements, within_sphere
from capture_plan.mesh import vertex_areas

MotionKind = Literal["moves nothing", "head movement", "not of the face", "calls others", "face", "exported wrongly"]
KINDS: tuple[MotionKind, ...] = get_args(MotionKind)
STILL = 1e-6  # of the largest extent: no file is finer
INSIDE = 0.1  # of e within reach of the face: a breath that pulls at the neck has less
FACE_EXTENT = 2.6  # pupil distances around the middle between eyes and mouth: brow, chin and ears, no chest


class Motions(NamedTuple):
    """`kinds[k]` is what blendshape k is; `shares[k, j]` the weight of j in a k that calls others, else 0."""

    kinds: tuple[MotionKind, ...]
    shares: Float[np.ndarray, "k k"]


def motion_kinds(
    neutral: Float[np.ndarray, "v 3"],
    triangles: Int[np.ndarray, "f 3"],
    deltas: Float[np.ndarray, "k v 3"],
    *,
    face: Sphere | None = None,
    halves: Halves = (),
    called: tuple[MotionKind | None, ...] | None = None,
    planned: Bool[np.ndarray, " k"] | None = None,
) -> Motions:
    """What each blendshape is. `triangles` are those of the skin where it is known, else all of them; `face` says where
    the face is where that is known; `halves` are left and right of one movement; `called` is what its name says it is:
    a sign beside the others, which never decides alone; only what is `planned` where that is given is part of a sum.
    """
    says = {kind: np.array([said == kind for said in called or [None] * len(deltas)]) for kind in KINDS}
    a = vertex_areas(neutral, triangles)
    length = np.linalg.norm(deltas, axis=2).astype(float)
    nothing = length.max(axis=1) <= STILL * np.ptp(neutral, axis=0).max()
    head = head_movements(neutral, a, deltas, face=face, called=says["head movement"])
    e = np.where((head | nothing)[:, None], 0, a * length**2)
    away = elsewhere(neutral, e, face=face, called=says["not of the face"])
    parts = ~nothing & ~head & ~away & (True if planned is None else planned)
    shares = calls(deltas[:, a > 0], np.flatnonzero(parts), halves)
    which = np.select([nothing, head, away, shares.any(axis=1)], range(4), 4)
    return Motions(tuple(KINDS[i] for i in which), shares)


def elsewhere(
    neutral: Float[np.ndarray, "v 3"],
    e: Float[np.ndarray, "k v"],
    *,
    face: Sphere | None,
    called: Bool[np.ndarray, " k"],
) -> Bool[np.ndarray, " k"]:
    """Whether nearly all that a blendshape moves lies off the face; False for what moves nothing."""
    total = e.sum(axis=1)
    others = ~called & (total > 0)
    if face is not None:
        near, least = within_sphere(neutral, face), np.where(called, MOST, INSIDE)
    else:
        near = (e[others] >= MOVES**2 * e[others].max(axis=1, keepdims=True)).any(axis=0)
        least = np.where(called & others.any(), MOST, 0)
    return (total > 0) & (e[:, near].sum(axis=1) < least * total)
