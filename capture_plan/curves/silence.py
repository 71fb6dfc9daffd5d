"""Lost faces that no column tells of: trackers write zeros, or the last frame again and again.

Zeros     frames in which every weight is exactly 0, though in nearly all others `FEWEST` or more are not and change
          from frame to frame, and which a face far from rest enters and leaves by a jump: no face rests like that. They
          are left out and counted; where it only enters or only leaves so, that is said and they stay in
          Half of ARKit's weights are 0 in any frame; a pause of speech is zeros in all columns of a mouth alone
Marked    frames in which every weight is one and the same number below 0, such as -1 or -999. They are left out too
Frozen    many frames in a row that are exactly alike, in a take whose frames else differ: said, and left in
"""

import numpy as np
from jaxtyping import Bool, Float

FEWEST, TAIL = 3, 0.02  # columns that are not 0, in all frames but the lowest of these
OFTEN = 0.25  # of the frames change; animated by hand they stand for long
LEVEL = 0.3  # of the usual sum of weights
LIVELY = 0.5  # of the frames are like the one before: then many takes of it are still
JUMP = 5.0  # usual steps from one frame to the next
FROZEN = 10  # frames in a row
SEVERAL = 3  # columns
SELDOM = 0.2  # share of frames that are like the one before, in a take whose frames else differ


def zeroed(x: Float[np.ndarray, "t c"]) -> tuple[Bool[np.ndarray, " t"], Bool[np.ndarray, " t"]]:
    """Frames of zeros that stand for a lost face, and those that may: the face only enters or only leaves by a jump."""
    still = np.asarray(x[:, 0] == 0)
    still[still] = ~x[still].any(axis=1)
    lost, may = np.zeros(len(x), dtype=bool), np.zeros(len(x), dtype=bool)
    if x.shape[1] <= FEWEST or not still.any() or still.all() or not is_alive(x, still):
        return lost, may
    step, level = np.abs(np.diff(x, axis=0)).max(axis=1), np.abs(x).sum(axis=1)
    inside = step[~still[1:] & ~still[:-1]]
    jumps = step > JUMP * np.median(inside[inside > 0])
    low = LEVEL * np.median(level[~still])
    for start, stop in runs(still):
        beside = [(start - 1, start - 1), (stop - 1, stop)]  # the step, and the frame of the face
        edges = [bool(jumps[t] and level[face] > low) for t, face in beside if 0 <= t < len(jumps)]
        lost[start:stop], may[start:stop] = all(edges), any(edges) and not all(edges)
    return lost, may


def is_alive(x: Float[np.ndarray, "t c"], still: Bool[np.ndarray, " t"]) -> bool:
    """Whether all frames but those of zeros show a face as a camera does: no few columns, and none that stand."""
    moving = (x[~still] != 0).sum(axis=1)
    both = ~still[1:] & ~still[:-1]
    changed = ((x[1:] != x[:-1]) & (x[1:] != 0))[both].sum(axis=1)
    alive = 2 * changed >= (x[1:] != 0)[both].sum(axis=1)
    return float(np.quantile(moving, TAIL)) >= FEWEST and bool(both.any()) and float(alive.mean()) >= OFTEN


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
