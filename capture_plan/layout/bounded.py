"""Many bounded least-squares problems that share their matrix: one for each frame of a take.

Data       H (k k)     positive definite, the same in every frame
           g[t]        right-hand side of frame t
Variables  w[t, k]     weights from 0 to 1
Model      min  1/2 w' H w - g' w   for every t
Optimal    y = H w - g:  y = 0 where 0 < w < 1,  y >= 0 where w = 0,  y <= 0 where w = 1

Block principal pivoting (Judice & Pires 1994; Portugal, Judice & Vicente 1994): guess which weights are free, solve,
move every weight that breaks a condition to where it wants to go. One factorisation of H gives the first guess of all
frames. Where the number of broken conditions stops falling, only the last broken one moves, which always ends.
"""

import numpy as np
from jaxtyping import Float, Int

TOLERANCE = 1e-8  # of a weight, and of y in units of H's diagonal; 1e-8 of a weight moves no skin by a micrometre
PATIENCE = 5  # full exchanges without fewer broken conditions before one moves at a time
MOST_STEPS = 2_000  # real faces need fewer than 30
CHUNK_BYTES = 64e6
LOW, FREE, HIGH = -1, 0, 1


def solve_bounded(H: Float[np.ndarray, "k k"], g: Float[np.ndarray, "t k"]) -> Float[np.ndarray, "t k"]:
    """The minimiser of every frame."""
    start = np.linalg.solve(H, g.T).T
    size = max(1, int(CHUNK_BYTES / (8 * H.size)))
    chunks = [_pivot(H, g[t : t + size], start[t : t + size]) for t in range(0, len(g), size)]
    return np.concatenate(chunks) if chunks else start


def _pivot(
    H: Float[np.ndarray, "k k"], g: Float[np.ndarray, "t k"], start: Float[np.ndarray, "t k"]
) -> Float[np.ndarray, "t k"]:
    """Exchanges until every condition holds in every frame."""
    k = H.shape[0]
    state = np.where(start < 0, LOW, np.where(start > 1, HIGH, FREE))
    w = np.empty_like(start)
    open_, fewest, patience = np.arange(len(g)), np.full(len(g), k + 1), np.full(len(g), PATIENCE)
    for _ in range(MOST_STEPS):
        w[open_] = _solve_free(H, g[open_], state[open_])
        wanted = _wanted(H, g[open_], w[open_], state[open_])
        broken = wanted != state[open_]
        count = broken.sum(axis=1)
        open_, wanted, broken, count = (a[count > 0] for a in (open_, wanted, broken, count))
        if not len(open_):
            return np.clip(w, 0, 1)
        better = count < fewest[open_]
        fewest[open_] = np.minimum(fewest[open_], count)
        patience[open_] = np.where(better, PATIENCE, patience[open_] - 1)
        last = k - 1 - broken[:, ::-1].argmax(axis=1)
        one = np.arange(k) == last[:, None]
        moved = broken & (one | (patience[open_] >= 0)[:, None])
        state[open_] = np.where(moved, wanted, state[open_])
    raise AssertionError("bounded least squares did not settle")


def _solve_free(
    H: Float[np.ndarray, "k k"], g: Float[np.ndarray, "t k"], state: Int[np.ndarray, "t k"]
) -> Float[np.ndarray, "t k"]:
    """H_ff w_f = g_f - H_fh 1 with the weights at a bound held there."""
    free, high = state == FREE, (state == HIGH).astype(float)
    A = np.where(free[:, :, None] & free[:, None, :], H, np.eye(len(H)))
    b = np.where(free, g - high @ H, high)
    return np.linalg.solve(A, b[:, :, None])[:, :, 0]


def _wanted(
    H: Float[np.ndarray, "k k"],
    g: Float[np.ndarray, "t k"],
    w: Float[np.ndarray, "t k"],
    state: Int[np.ndarray, "t k"],
) -> Int[np.ndarray, "t k"]:
    """Where every weight would be, were it to keep its own condition."""
    y = (w @ H - g) / np.diag(H)
    leaves = ((state == LOW) & (y < -TOLERANCE)) | ((state == HIGH) & (y > TOLERANCE))
    wanted = np.where(leaves, FREE, state)
    wanted[(state == FREE) & (w < -TOLERANCE)] = LOW
    wanted[(state == FREE) & (w > 1 + TOLERANCE)] = HIGH
    return wanted
