"""Chosen entries of the inverse of a sparse matrix without solving for its columns.

Data      A   sparse, symmetric, positive definite; s weights; pairs (u, v)
Answer    G[u, v] and (G S G)[u, v] with G = A^-1, S = diag(s)
Parts     halves of halves along the longest side; of each half the vertices that A ties to the other half go to the
          separator c, so that A is block diagonal on the parts i once c is taken out
Model     D_i = A_ii^-1,  P_i = -D_i A_ic,  P_c = I,  G_cc = (A_cc + sum_i A_ci P_i)^-1
          G     = blkdiag(D) + P G_cc P'
          G S G = blkdiag(D S D) + (D S P)(P G_cc)' + (P G_cc)(D S P)' + P M P',  M = G_cc F,  F = P'S P G_cc
P_i has columns only where A ties part i to c. Of M only the blocks are made that a pair asks for.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Int
from scipy.linalg import get_lapack_funcs
from scipy.sparse import csc_array, csr_array

from capture_plan.errors import RigError

PART = 900  # vertices of a part: of a face of 25,000 the parts and the separator then cost about the same


@dataclass(frozen=True, eq=False)
class Part:
    """Rows `at` of A; `tied` are places in the separator."""

    at: Int[np.ndarray, " n"]
    tied: Int[np.ndarray, " b"]
    D: Float[np.ndarray, "n n"]
    P: Float[np.ndarray, "n b"]


@dataclass(frozen=True, eq=False)
class Centre:
    """A symmetric matrix on the separator, by blocks and by single entries."""

    block: Callable[[np.ndarray, np.ndarray], np.ndarray]
    single: Callable[[np.ndarray, np.ndarray], np.ndarray]


def inverse_entries(
    A: csc_array,
    points: Float[np.ndarray, "n 3"],
    s: Float[np.ndarray, " n"],
    pairs: Int[np.ndarray, "p 2"],
    *,
    part: int = PART,
) -> tuple[Float[np.ndarray, " p"], Float[np.ndarray, " p"]]:
    """G[u, v] and (G S G)[u, v] of each pair."""
    rows = csr_array(A)
    groups, c = dissect(rows, points, part)
    parts = [_eliminate(rows, at, c) for at in groups]
    G, F = _separator(rows, c, parts, s)
    centres = (
        Centre(lambda i, j: G[np.ix_(i, j)], lambda i, j: G[i, j]),
        Centre(lambda i, j: G[i] @ F[:, j], lambda i, j: _entries_of_product(G, F, i, j)),
    )
    part_of, place = np.full(len(s), -1), np.empty(len(s), dtype=int)
    place[c] = np.arange(len(c))
    for number, one in enumerate(parts):
        part_of[one.at], place[one.at] = number, np.arange(len(one.at))
    g, gsg = np.empty(len(pairs)), np.empty(len(pairs))
    for (i, j), at in _grouped(np.sort(part_of[pairs], axis=1)):
        first = np.argsort(part_of[pairs[at]], axis=1, kind="stable")
        u, v = np.take_along_axis(place[pairs[at]], first, axis=1).T
        a, b = (None if k < 0 else parts[k] for k in (i, j))
        g[at], gsg[at] = _between(a, b, u, v, centres, s)
    return g, gsg


def dissect(
    A: csr_array, points: Float[np.ndarray, "n 3"], part: int
) -> tuple[list[Int[np.ndarray, " _"]], Int[np.ndarray, " c"]]:
    """The parts, none larger than `part`, and the separator between them."""
    groups, done, separator = [np.arange(len(points))], [], [np.empty(0, dtype=int)]
    while groups:
        at = groups.pop()
        if len(at) <= part:
            done.append(at)
            continue
        axis = np.ptp(points[at], axis=0).argmax()
        at = at[np.argsort(points[at, axis], kind="stable")]
        near, far = at[: len(at) // 2], at[len(at) // 2 :]
        across = np.diff(A[near][:, far].indptr) > 0
        separator.append(near[across])
        groups += [near[~across], far]
    return [at for at in done if len(at)], np.sort(np.concatenate(separator))


def inverted(A: Float[np.ndarray, "n n"]) -> Float[np.ndarray, "n n"]:
    """A^-1 of a positive definite matrix by Cholesky, in a third of the time of solving; A is used up.

    Raises:
        RigError: A is not positive definite, as happens where angles of triangles are lost in rounding.
    """
    if not len(A):
        return A
    potrf, potri = get_lapack_funcs(("potrf", "potri"), (A,))
    factor, failed = potrf(A.T, lower=1, overwrite_a=1)
    half, failed_too = potri(factor, lower=1, overwrite_c=1)
    if failed or failed_too:
        raise RigError("the stiffness of the shell is singular: clean the mesh of needle-thin triangles")
    for i in range(1, len(half)):
        half[:i, i] = half[i, :i]
    return half


def _eliminate(A: csr_array, at: Int[np.ndarray, " n"], c: Int[np.ndarray, " c"]) -> Part:
    to_c = csc_array(A[at][:, c])
    tied = np.flatnonzero(np.diff(to_c.indptr))
    D = inverted(A[at][:, at].toarray())
    return Part(at, tied, D, -D @ to_c[:, tied].toarray())


def _separator(
    A: csr_array, c: Int[np.ndarray, " c"], parts: list[Part], s: Float[np.ndarray, " n"]
) -> tuple[Float[np.ndarray, "c c"], Float[np.ndarray, "c c"]]:
    """G_cc and F."""
    schur = A[c][:, c].toarray()
    for one in parts:
        schur[np.ix_(one.tied, one.tied)] += A[c[one.tied]][:, one.at] @ one.P
    G = inverted(schur)
    F = s[c, None] * G
    for one in parts:
        F[one.tied] += (one.P.T @ (s[one.at, None] * one.P)) @ G[one.tied]
    return G, F


def _entries_of_product(
    G: Float[np.ndarray, "c c"], F: Float[np.ndarray, "c c"], i: Int[np.ndarray, " p"], j: Int[np.ndarray, " p"]
) -> Float[np.ndarray, " p"]:
    """(G F)[i, j], some at a time: the rows and columns of all pairs would be two more matrices."""
    some = np.array_split(np.arange(len(i)), 1 + len(i) // PART)
    return np.concatenate([np.einsum("pc,cp->p", G[i[at]], F[:, j[at]]) for at in some])


def _grouped(keys: Int[np.ndarray, "p 2"]) -> Iterator[tuple[tuple[int, int], Int[np.ndarray, " _"]]]:
    unique, group = np.unique(keys, axis=0, return_inverse=True)
    order = np.argsort(group.ravel(), kind="stable")
    for (i, j), at in zip(unique, np.split(order, np.cumsum(np.bincount(group.ravel()))[:-1]), strict=True):
        yield (int(i), int(j)), at


def _between(
    a: Part | None,
    b: Part | None,
    u: Int[np.ndarray, " p"],
    v: Int[np.ndarray, " p"],
    centres: tuple[Centre, Centre],
    s: Float[np.ndarray, " n"],
) -> tuple[Float[np.ndarray, " p"], Float[np.ndarray, " p"]]:
    """The entries of pairs whose first vertex is in part a and the second in part b; no part is the separator."""
    # (P G_cc P')[u, v] and (P M P')[u, v]
    g, gsg = (_bilinear(a, b, u, v, X) for X in centres)
    if a is not None:  # (D S P)_u (P G_cc)'_v
        gsg = gsg + _bilinear(replace(a, P=a.D @ (s[a.at, None] * a.P)), b, u, v, centres[0])
    if b is not None:
        gsg = gsg + _bilinear(a, replace(b, P=b.D @ (s[b.at, None] * b.P)), u, v, centres[0])
    if a is not None and a is b:
        g = g + a.D[u, v]
        gsg = gsg + np.einsum("pn,pn,n->p", a.D[u], a.D[v], s[a.at])
    return g, gsg


def _bilinear(a: Part | None, b: Part | None, u: np.ndarray, v: np.ndarray, X: Centre) -> Float[np.ndarray, " p"]:
    """P_u X P'_v; the separator's P is the unit matrix, and it is never second to a part."""
    if b is None:
        return X.single(u, v)
    rows = X.block(u, b.tied) if a is None else a.P[u] @ X.block(a.tied, b.tied)
    return np.einsum("pb,pb->p", rows, b.P[v])
