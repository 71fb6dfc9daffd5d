"""Which blendshapes only call others: plain sums of them, with weights from 0 to 1.

Data    d[k]  deltas, in any unit;  C  their cosines
Sum     d[k] = sum_j w[j] d[j], two parts or more that are each longer than what is left over, 0 < w <= 1, none of which
        another one takes back: a corrective is no part. One pair of halves is no sum, since an actor does both sides at
        once and halves are cut from that scan
Way     those that the others explain with any weights (1 / (C^-1)_kk is what they leave over) are explained again with
        none below 0, the longest first, each by those that are not yet sums themselves; parts that turn out to be sums
        are told by their own
"""

import numpy as np
from jaxtyping import Float, Int
from scipy.optimize import nnls

UNEXPLAINED = 3e-3  # share of a blendshape's length that others leave over; real ones leave over 0.04
FULL = 1.05  # weights end at 1
PART = 0.02  # a smaller weight is rounding
SHOWS = 0.1  # <w d_j, d_k> / |w d_j|^2: 1 where the sum shows part j as it is, below 0 for what takes back another part
ROUNDING = 1e-9  # least eigenvalue of C
Halves = tuple[tuple[int, int], ...]


def calls(
    deltas: Float[np.ndarray, "k v 3"], subset: Int[np.ndarray, " n"], halves: Halves = ()
) -> Float[np.ndarray, "k k"]:
    """Weights of those blendshapes of `subset` that are plain sums of others of it, a row each; 0 for the rest."""
    shares = np.zeros((len(deltas), len(deltas)))
    d = deltas[subset].reshape(len(subset), deltas[0].size).astype(float)
    moving = d.any(axis=1)
    subset, d = subset[moving], d[moving]
    gram = d @ d.T
    length = np.sqrt(np.diag(gram))
    cosine = gram / np.outer(length, length)
    retained, found = np.ones(len(subset), dtype=bool), []
    for k in sorted(_dependent(cosine).tolist(), key=lambda k: -length[k]):
        retained[k] = False
        w = sum_of(cosine, k, np.flatnonzero(retained)) * length[k] / length
        at = np.flatnonzero((w > PART) & (w * length > UNEXPLAINED * length[k]))  # what is shorter explains nothing
        shows = cosine[k, at] * length[k] / (w[at] * length[at])
        parts = subset[at].tolist()
        plain = len(at) > 1 and w.max() <= FULL and shows.min() >= SHOWS and set(parts) not in [set(p) for p in halves]
        retained[k] = not plain
        if plain:
            shares[subset[k], parts] = w[at]
            found.append(int(subset[k]))
    return _of_planned(shares, found)


def _of_planned(shares: Float[np.ndarray, "k k"], found: list[int]) -> Float[np.ndarray, "k k"]:
    """The weights with every part that was `found` to be a sum later replaced by its own parts; a row whose weights
    then pass 1 is no sum."""
    for k in reversed(found):
        for part in [j for j in found if shares[k, j] > 0]:
            if shares[part].any():
                shares[k] += shares[k, part] * shares[part]
                shares[k, part] = 0
        if shares[k].max() > FULL:
            shares[k] = 0
    return shares


def _dependent(cosine: Float[np.ndarray, "n n"]) -> Int[np.ndarray, " _"]:
    """Blendshapes that the others explain, with whatever signs."""
    values, vectors = np.linalg.eigh(cosine)
    # (C^-1)_kk = sum_i V_ki^2 / l_i
    inverse = (vectors**2) @ (1 / np.maximum(values, ROUNDING))
    return np.flatnonzero(1 / inverse <= 2 * UNEXPLAINED**2)


def sum_of(cosine: Float[np.ndarray, "n n"], k: int, retained: Int[np.ndarray, " m"]) -> Float[np.ndarray, " n"]:
    """Weights, none negative, of the `retained` ones that give k, all of length 1; 0 where they do not."""
    weights = np.zeros(len(cosine))
    C, c = cosine[np.ix_(retained, retained)], cosine[retained, k]
    # |d_k - D w|^2 = 1 - 2 c w + w C w with C = V L V^T: least squares in L^1/2 V^T w - L^-1/2 V^T c
    values, vectors = np.linalg.eigh(C)
    some = values > ROUNDING
    root = np.sqrt(values[some])
    w, _ = nnls(root[:, None] * vectors[:, some].T, vectors[:, some].T @ c / root)
    if 1 - 2 * c @ w + w @ C @ w <= UNEXPLAINED**2:
        weights[retained] = w
    return weights
