"""The head of a rig that is a whole figure: avatars and base meshes bring a body that no expression moves.

A body would mislead what is read from the head's shape (axes, size, skin), and stand in every picture. So when a mesh
reaches far beyond what moves, only what lies near that is kept, and the rig's note says so. Busts stay as they are.

Data     m[v] how far the movements of the face move a vertex at most (`face/channels.py` says which are the face's);
         B the box around the vertices with m > MOVES max m, D its diagonal
Crop     when the mesh's own diagonal exceeds WHOLE_FIGURE D: the triangles with a vertex within EXTENT D of B's middle
Few      fewer than WHOLE_RIG blendshapes show too little of a face for that: only still pieces that lie wholly further
         off than WHOLE_FIGURE times the size of the pieces that move are left out, a floor or a sky
"""

import dataclasses

import numpy as np
from jaxtyping import Bool

from capture_plan.face.moving import moving_pieces
from capture_plan.formats.raw import RawRig
from capture_plan.mesh import pieces

MOVES = 0.1  # share of the largest displacement, as where the axes are found
WHOLE_FIGURE = 5.0  # MakeHuman's body 9.1; four heads and busts 1.3 to 1.8; a head of which the lids alone move 4
WHOLE_RIG = 8  # so many blendshapes tell where the face is
EXTENT = 1.0  # from the middle of the face: past the crown, the nape and the throat


def crop_to_head(raw: RawRig, facial: Bool[np.ndarray, " k"]) -> RawRig:
    """The rig without what lies far from the face; vertices keep their numbers in the file (`source_index`)."""
    if facial.sum() < WHOLE_RIG:
        return without_stage(raw, facial)
    m = np.linalg.norm(raw.deltas[facial], axis=2).max(axis=0)
    moving = raw.neutral[m > MOVES * m.max()]
    low, high = moving.min(axis=0), moving.max(axis=0)
    D = float(np.linalg.norm(high - low))
    if np.linalg.norm(np.ptp(raw.neutral, axis=0)) <= WHOLE_FIGURE * D:
        return raw
    near = np.linalg.norm(raw.neutral - (low + high) / 2, axis=1) <= EXTENT * D
    return _keep(raw, near | (m > MOVES * m.max()), "a whole figure")


def without_stage(raw: RawRig, facial: Bool[np.ndarray, " k"]) -> RawRig:
    """The rig without still pieces all of whose vertices lie far from those that move."""
    moves = moving_pieces(raw.triangles, raw.deltas[facial])
    low, high = raw.neutral[moves].min(axis=0), raw.neutral[moves].max(axis=0)
    near = np.linalg.norm(raw.neutral - (low + high) / 2, axis=1) <= WHOLE_FIGURE * np.linalg.norm(high - low)
    piece = pieces(raw.triangles, len(raw.neutral))
    retained = (np.bincount(piece, near | moves) > 0)[piece]
    return raw if retained[raw.triangles].all() else _keep(raw, retained, "a stage")


def _keep(raw: RawRig, near: Bool[np.ndarray, " v"], what: str) -> RawRig:
    """The triangles that have one of these vertices, and no other vertices; `what` the rest makes of the file."""
    triangles = raw.triangles[near[raw.triangles].any(axis=1)]
    if len(triangles) == 0:
        return raw
    retained = np.unique(triangles)
    left_out = len(raw.neutral) - len(retained)
    message = f"{what}: {left_out:,} vertices far from all that moves were left out"
    return dataclasses.replace(
        raw,
        neutral=raw.neutral[retained],
        triangles=np.searchsorted(retained, triangles).astype(np.int32),
        deltas=np.ascontiguousarray(raw.deltas[:, retained]),
        parts=raw.parts[retained],
        source_index=raw.source_index[retained],
        note="; ".join(filter(None, (raw.note, message))),
    )
