"""Chosen entries of the inverse of a sparse matrix without solving for its columns.

Data      A   sparse, symmetric, positive definite; s weights; pairs (u, v)
Answer    G[u, v] and (G S G)[u, v] with G = A^-1, S = diag(s)
Parts     halves of halves along the longest side; of each half the vertices that A ties to the other half go to the
          separator c, so that A is block diagonal on the parts i once c is taken out
Model     D_i = A_ii^-1,  P_i = -D_i A_ic,  P_c = I,  G_cc = (A_cc + sum_i A_ci P_i)^-1
          G     = blkdiag(D) + P G_cc P'
          G S G = blkdiag(D S D) + (D S P)(P G_cc)' + (P G_cc)(D S P)' + P (G_cc P'S P G_cc) P'
P_i has columns only where A ties part i to c.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from scipy.linalg import cho_factor, cho_solve
from scipy.sparse import csc_array, csr_array

PARTS = 32  # 25,000 vertices: the parts and the separator then cost about the same


@dataclass(frozen=True, eq=False)
class Part:
    """Rows `at` of A; `tied` are places in the separator. For the separator itself D and DSP are zero, P is I."""

    at: Int[np.ndarray, " n"]
    tied: Int[np.ndarray, " b"]
    D: Float[np.ndarray, "n n"] | None
    P: Float[np.ndarray, "n _"]


def inverse_entries(
    A: csc_array,
    points: Float[np.ndarray, "n 3"],
    s: Float[np.ndarray, " n"],
    pairs: Int[np.ndarray, "p 2"],
    *,
    parts: int = PARTS,
) -> tuple[Float[np.ndarray, " p"], Float[np.ndarray, " p"]]:
    """G[u, v] and (G S G)[u, v] of each pair."""
    rows = csr_array(A)
    groups, c = dissect(rows, points, parts)
    some = [_eliminate(rows, at, c) for at in groups]
    G, Q = _separator(rows, c, some, s)
    M = G @ Q @ G
    if len(c):
        some.append(Part(c, np.arange(len(c)), None, np.empty((len(c), 0))))
    return _entries(some, G, M, s, pairs)


def dissect(
    A: csr_array, points: Float[np.ndarray, "n 3"], parts: int
) -> tuple[list[Int[np.ndarray, " _"]], Int[np.ndarray, " c"]]:
    """The parts, and the separator between them."""
    groups, separator = [np.arange(len(points))], []
    while len(groups) < parts and len(groups[0]) > 1:
        halves = []
        for at in groups:
            axis = np.ptp(points[at], axis=0).argmax()
            at = at[np.argsort(points[at, axis], kind="stable")]
            near, far = at[: len(at) // 2], at[len(at) // 2 :]
            across = np.diff(A[near][:, far].indptr) > 0
            separator.append(near[across])
            halves += [half for half in (near[~across], far) if len(half)]
        groups = halves
    return groups, np.sort(np.concatenate([np.empty(0, dtype=int), *separator]))


def _eliminate(A: csr_array, at: Int[np.ndarray, " n"], c: Int[np.ndarray, " c"]) -> Part:
    to_c = csc_array(A[at][:, c])
    tied = np.flatnonzero(np.diff(to_c.indptr))
    D = cho_solve(cho_factor(A[at][:, at].toarray(), lower=True), np.eye(len(at)))
    return Part(at, tied, D, -D @ to_c[:, tied].toarray())


def _separator(
    A: csr_array, c: Int[np.ndarray, " c"], parts: list[Part], s: Float[np.ndarray, " n"]
) -> tuple[Float[np.ndarray, "c c"], Float[np.ndarray, "c c"]]:
    """G_cc and P' S P."""
    schur, Q = A[c][:, c].toarray(), np.diag(s[c])
    for part in parts:
        among = np.ix_(part.tied, part.tied)
        schur[among] += A[c[part.tied]][:, part.at] @ part.P
        Q[among] += part.P.T @ (s[part.at, None] * part.P)
    return cho_solve(cho_factor(schur, lower=True), np.eye(len(c))), Q


def _entries(
    parts: list[Part],
    G: Float[np.ndarray, "c c"],
    M: Float[np.ndarray, "c c"],
    s: Float[np.ndarray, " n"],
    pairs: Int[np.ndarray, "p 2"],
) -> tuple[Float[np.ndarray, " p"], Float[np.ndarray, " p"]]:
    """Pairs are looked up together where they join the same two parts."""
    part_of, place = np.empty(len(s), dtype=int), np.empty(len(s), dtype=int)
    for number, part in enumerate(parts):
        part_of[part.at], place[part.at] = number, np.arange(len(part.at))
    g, gsg = np.empty(len(pairs)), np.empty(len(pairs))
    for (i, j), at in _grouped(part_of[pairs]):
        g[at], gsg[at] = _between(parts[i], parts[j], i == j, place[pairs[at]], (G, M), s)
    return g, gsg


def _grouped(keys: Int[np.ndarray, "p 2"]) -> Iterator[tuple[tuple[int, int], Int[np.ndarray, " _"]]]:
    unique, group = np.unique(keys, axis=0, return_inverse=True)
    order = np.argsort(group.ravel(), kind="stable")
    for (i, j), at in zip(unique, np.split(order, np.cumsum(np.bincount(group.ravel()))[:-1]), strict=True):
        yield (int(i), int(j)), at


def _between(
    a: Part,
    b: Part,
    same: bool,
    at: Int[np.ndarray, "p 2"],
    centre: tuple[Float[np.ndarray, "c c"], Float[np.ndarray, "c c"]],
    s: Float[np.ndarray, " n"],
) -> tuple[Float[np.ndarray, " p"], Float[np.ndarray, " p"]]:
    """The entries of pairs whose first vertex is in part a and the second in part b, at these places of the parts."""
    u, v = at.T
    G, M = (X[np.ix_(a.tied, b.tied)] for X in centre)
    # (P G P')[u, v] and (P M P')[u, v]
    g, gsg = (_bilinear(a, X, b, u, v) for X in (G, M))
    if a.D is not None:  # (D S P)_u (P G_cc)'_v
        gsg += _bilinear_rows((a.D[u] * s[a.at]) @ a.P, G, b, v)
    if b.D is not None:
        gsg += _bilinear_rows((b.D[v] * s[b.at]) @ b.P, G.T, a, u)
    if same and a.D is not None:
        g += a.D[u, v]
        gsg += np.einsum("pn,pn,n->p", a.D[u], a.D[v], s[a.at])
    return g, gsg


def _bilinear(a: Part, X: Float[np.ndarray, "a b"], b: Part, u: np.ndarray, v: np.ndarray) -> Float[np.ndarray, " p"]:
    """P_u X P'_v; the separator's P is the unit matrix."""
    if a.D is None and b.D is None:
        return X[u, v]
    return _bilinear_rows(a.P[u], X, b, v) if a.D is not None else _bilinear_rows(b.P[v], X.T, a, u)


def _bilinear_rows(
    rows: Float[np.ndarray, "p a"], X: Float[np.ndarray, "a b"], b: Part, v: np.ndarray
) -> Float[np.ndarray, " p"]:
    right = rows @ X
    return right[np.arange(len(v)), v] if b.D is None else np.einsum("pb,pb->p", right, b.P[v])
