"""Which pieces of a mesh some blendshape moves: a floor, a sky or a stage says nothing of the size of a head.

Data      f triangles, d[k, v] deltas in any unit
Moves     a vertex that some blendshape moves by more than MOVES of the most that this one moves
Piece     vertices joined by triangles: a body that goes on from the head's skin is one with it
"""

import numpy as np
from jaxtyping import Bool, Float, Int

from capture_plan.mesh import pieces

NOISE_MM = 0.1  # half the 0.2 mm with which a marker is found; ICT-FaceKit's PupilDilate_R moves the skin by 0.05
MOVES = 1e-3  # of a blendshape's largest displacement: less is rounding


def moving_pieces(triangles: Int[np.ndarray, "f 3"], deltas: Float[np.ndarray, "k v 3"]) -> Bool[np.ndarray, " v"]:
    """Vertices of the pieces that move; all of them where nothing moves."""
    v = deltas.shape[1]
    moving = np.zeros(v, dtype=bool)
    for d in deltas:
        squared = np.einsum("vx,vx->v", d, d)
        moving |= squared > MOVES**2 * squared.max(initial=0)
    if not moving.any():
        return np.ones(v, dtype=bool)
    piece = pieces(triangles, v)
    return (np.bincount(piece, moving) > 0)[piece]
