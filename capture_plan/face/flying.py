"""Blendshapes in which a few vertices fly off, as a slip of an export makes them: they say nothing of skin or face.

Data      d[k, v] deltas, in any unit;  m[k] = max_v |d[k, v]|, M the lower median of m
Far       from 0.3 S to S, S the diagonal of the pieces that move, and 30 M in between: a wide open jaw
          moves a head by 0.15 S
Flies     m[k] is beyond Far, and so few vertices pass a quarter of it that nothing is posed by them
"""

import numpy as np
from jaxtyping import Bool, Float, Int

from capture_plan.face.moving import moving_pieces

LEAST, MOST = 0.3, 1.0  # S: a head of 0.4 m, a whole figure of 1.7 m
USUAL = 30  # M: a jaw moves three times as far as the usual blendshape
BELOW = 0.25  # of Far: the neighbours of what is posed move nearly as far as it does
HANDFUL, SHARE, TINY = 3, 1 / 500, 1 / 20  # vertices; of all vertices, whichever is more; but never so large a share
STRAY = 1.0  # per cent of the vertices at either end of an axis that do not say how large the mesh is


def flying(
    neutral: Float[np.ndarray, "v 3"], triangles: Int[np.ndarray, "f 3"], deltas: Float[np.ndarray, "k v 3"]
) -> Bool[np.ndarray, " k"]:
    """Which blendshapes move a handful of vertices far beyond the size of the head, the others little or not at all."""
    largest = np.sqrt(np.array([np.einsum("vx,vx->v", d, d).max(initial=0) for d in deltas]))
    part = neutral[moving_pieces(triangles, deltas)]
    S = float(np.linalg.norm(np.subtract(*np.percentile(part, [100 - STRAY, STRAY], axis=0))))
    far = np.clip(USUAL * np.sort(largest)[(len(largest) - 1) // 2], LEAST * S, MOST * S)
    v = len(part)
    few = min(max(HANDFUL, int(SHARE * v)), int(TINY * v))
    return np.array([
        m > far and (np.linalg.norm(d, axis=1) > BELOW * far).sum() <= few for m, d in zip(largest, deltas, strict=True)
    ])  # fmt: skip
