"""Many bounded least-squares problems that share their matrix: one for each frame of a take.

Data       H (k k)     positive definite, the same in every frame
           g[t]        right-hand side of frame t
Variables  w[t, k]     weights from 0 to 1
Model      min  1/2 w' H w - g' w   for every t
Optimal    y = H w - g:  y = 0 where 0 < w < 1,  y >= 0 where w = 0,  y <= 0 where w = 1

Projected Newton (Bertsekas 1982): weights at a bound that y presses against it stay there, the others go towards their
own minimum and stop at the bounds; where that does not lower the objective, half as far, and so on. The objective falls
in every step, so that no frame can go round in circles. One factorisation of H gives the start of all frames. The few
that creep, where few landmarks leave many mixes in doubt, are solved one by one (bounded variables: Stark and
Parker 1995).
"""

import numpy as np
from jaxtyping import Bool, Float
from scipy.optimize import lsq_linear

TOLERANCE = 1e-9  # of y in units of H's diagonal: of a weight, were it alone
MOST_STEPS = 60  # nearly all frames need fewer than 30
UNCHANGED, MOST_ALONE = 1e-15, 1000  # of the objective in a step: at 1e-9 one frame in some hundreds stopped early
HALVINGS = 40
CHUNK_BYTES = 64e6


def solve_bounded(H: Float[np.ndarray, "k k"], g: Float[np.ndarray, "t k"]) -> Float[np.ndarray, "t k"]:
    """The minimiser of every frame."""
    w = np.clip(np.linalg.solve(H, g.T).T, 0, 1)
    size = max(1, int(CHUNK_BYTES / (8 * H.size)))
    for t in range(0, len(g), size):
        _descend(H, g[t : t + size], w[t : t + size])
    return w


def _descend(H: Float[np.ndarray, "k k"], g: Float[np.ndarray, "t k"], w: Float[np.ndarray, "t k"]) -> None:
    """Newton steps of all frames that are not optimal yet, and the creeping ones alone; `w` is changed in place."""
    open_ = np.arange(len(g))
    for _ in range(MOST_STEPS):
        y = w[open_] @ H - g[open_]
        held = ((w[open_] <= 0) & (y > 0)) | ((w[open_] >= 1) & (y < 0))
        wrong = np.abs(np.where(held, 0, y) / np.diag(H)).max(axis=1) > TOLERANCE
        open_, y, held = open_[wrong], y[wrong], held[wrong]
        if not len(open_):
            return
        d = _lower(H, w[open_], y, _newton(H, y, held))
        w[open_] += d
        open_ = open_[d.any(axis=1)]  # what no step lowers is as good as numbers of this length can say
    # |L' w - L^-1 g|^2 differs from the objective by a constant
    L = np.linalg.cholesky(H)
    for t in open_.tolist():
        alone = lsq_linear(L.T, np.linalg.solve(L, g[t]), (0, 1), method="bvls", tol=UNCHANGED, max_iter=MOST_ALONE)
        w[t] = np.clip(alone.x, 0, 1)


def _newton(
    H: Float[np.ndarray, "k k"], y: Float[np.ndarray, "t k"], held: Bool[np.ndarray, "t k"]
) -> Float[np.ndarray, "t k"]:
    """H_ff p_f = -y_f; 0 for the held weights. Frames with as many free weights are solved together."""
    p, count = np.zeros_like(y), (~held).sum(axis=1)
    first = np.argsort(held, axis=1, kind="stable")  # the free weights come first
    for n in np.unique(count[count > 0]):
        t = np.flatnonzero(count == n)
        f = first[t, :n]
        p_f = np.linalg.solve(H[f[:, :, None], f[:, None, :]], -np.take_along_axis(y[t], f, axis=1)[:, :, None])
        p[t[:, None], f] = p_f[:, :, 0]
    return p


def _lower(
    H: Float[np.ndarray, "k k"], w: Float[np.ndarray, "t k"], y: Float[np.ndarray, "t k"], p: Float[np.ndarray, "t k"]
) -> Float[np.ndarray, "t k"]:
    """The longest step d along p, held inside the bounds, that lowers the objective; 0 where none does."""
    d = np.zeros_like(w)
    left = np.arange(len(w))
    for halving in range(HALVINGS):
        step = np.clip(w[left] + p[left] / 2**halving, 0, 1) - w[left]
        # f(w + d) - f(w) = d' y + 1/2 d' H d
        falls = np.sum(step * (y[left] + step @ H / 2), axis=1) < 0
        d[left[falls]] = step[falls]
        left = left[~falls]
        if not len(left):
            break
    return d
