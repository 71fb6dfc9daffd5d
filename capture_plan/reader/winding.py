"""Faces that a mirrored export left wound inwards are turned over.

Data    the triangles with a corner that moves: c[f] their middles, n[f] normals times twice the area, m the mean of c
Round   sum n . (c - m) / sum |n| |c - m|    below 0 where they look to the middle of the face
Front   sum n_z / sum |n|                    below 0 where they look back, the face looking along +z
The first has to say so clearly and the second not to gainsay it; a mirror turns all triangles, so all are turned back.
"""

import numpy as np
from jaxtyping import Float, Int

from capture_plan.mesh.geometry import triangle_cross

ROUND, FRONT = -0.2, 0.05  # of 25 heads of the field, wound outwards: 0.01 (a drawn face) to 0.9, and -0.02 to 0.7


def looks(
    neutral: Float[np.ndarray, "v 3"], triangles: Int[np.ndarray, "f 3"], deltas: Float[np.ndarray, "k v 3"]
) -> tuple[float, float]:
    """How far the triangles that move look away from their middle, and forward: 1 wholly, -1 not at all."""
    moves = (deltas != 0).any(axis=(0, 2))
    face = triangles[moves[triangles].any(axis=1)]
    n, c = triangle_cross(neutral, face), neutral[face].mean(axis=1)
    area = np.linalg.norm(n, axis=1)
    if not area.sum() > 0:
        return 0.0, 0.0
    away = c - area @ c / area.sum()
    size = max(float(area @ np.linalg.norm(away, axis=1)), 1e-12)
    return float(np.einsum("fx,fx->", n, away) / size), float(n[:, 2].sum() / area.sum())


def outwards(
    neutral: Float[np.ndarray, "v 3"], triangles: Int[np.ndarray, "f 3"], deltas: Float[np.ndarray, "k v 3"]
) -> tuple[Int[np.ndarray, "f 3"], str]:
    """The triangles with their front outside, and what has to be said where they were turned over for it."""
    away, forward = looks(neutral, triangles, deltas)
    if away >= ROUND or forward >= FRONT:
        return triangles, ""
    message = "its faces are wound inwards, as a mirrored export leaves them: they are turned over"
    return triangles[:, ::-1].copy(), message
