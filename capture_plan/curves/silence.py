"""Lost faces that no column tells of: trackers write zeros, or the last frame again and again.

Zeros     frames in which every weight is exactly 0, though hardly a weight of other frames is, and which the face
          enters or leaves by a jump: no face goes to rest like that. They are left out and counted
Marked    frames in which every weight is one and the same number below 0, such as -1 or -999. They are left out too
Frozen    many frames in a row that are exactly alike, in a take whose frames else differ: said, and left in
"""

import numpy as np
from jaxtyping import Bool, Float

LIVELY = 0.5  # of the columns are not 0 in a usual frame
JUMP = 5.0  # usual steps from one frame to the next
FROZEN = 10  # frames in a row
SEVERAL = 3  # columns
SELDOM = 0.2  # share of frames that are like the one before, in a take whose frames else differ


def zeroed(x: Float[np.ndarray, "t c"]) -> Bool[np.ndarray, " t"]:
    """Frames of zeros that stand for a lost face."""
    still = np.asarray(x[:, 0] == 0)
    still[still] = ~x[still].any(axis=1)
    none = np.zeros(len(x), dtype=bool)
    if not still.any() or still.all() or np.median((x[~still] != 0).mean(axis=1)) < LIVELY:
        return none
    step = np.abs(np.diff(x, axis=0)).max(axis=1)
    inside = step[~still[1:] & ~still[:-1]]
    if len(inside) == 0:
        return none
    jumps = step > JUMP * np.median(inside)
    for start, stop in runs(np.asarray(still)):
        edges = [jumps[t] for t in (start - 1, stop - 1) if 0 <= t < len(jumps)]
        none[start:stop] = all(edges)
    return none


def marks_no_face(x: Float[np.ndarray, "t c"]) -> Bool[np.ndarray, " t"]:
    """Frames whose weights are all the same number below 0."""
    if x.shape[1] < SEVERAL:
        return np.zeros(len(x), dtype=bool)
    marked = np.asarray((x[:, 0] < 0) & (x[:, 0] == x[:, 1]))
    marked[marked] = (x[marked] == x[marked, :1]).all(axis=1)
    return marked if not marked.all() else ~marked


def frozen(x: Float[np.ndarray, "t c"]) -> str:
    """A sentence about frames that are exactly alike; nothing where there are few, or many takes of it are still."""
    same = np.concatenate([[False], x[1:, 0] == x[:-1, 0]])
    at = np.flatnonzero(same)
    same[at] = (x[at] == x[at - 1]).all(axis=1) & x[at].any(axis=1)
    held = [(start, stop) for start, stop in runs(same) if stop - start >= FROZEN]
    if not held or same.mean() > LIVELY or same.sum() - sum(b - a for a, b in held) > SELDOM * len(x):
        return ""
    frames = sum(stop - start for start, stop in held)
    start, stop = held[0]
    where = f"frames {start:,} to {stop - 1:,} repeat the one before" if len(held) == 1 else (
        f"{frames:,} frames in {len(held):,} places repeat the one before, the first of them {start:,} to {stop - 1:,}"
    )  # fmt: skip
    return f"{where} exactly: the face may have been lost there, but no column says so, and they stay in"


def runs(some: Bool[np.ndarray, " t"]) -> list[tuple[int, int]]:
    """First and one past the last of each run of True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], some, [False]]).astype(int)))
    return list(zip(edges[0::2].tolist(), edges[1::2].tolist(), strict=True))
