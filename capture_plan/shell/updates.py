"""One marker goes, comes or moves: a `State` brought up to date by rank-one changes.

Data      R, Z, gamma, nu, T, W, B of a state, S = diag(s)
Change    G_H += sigma x x',  R += x h',  W += x k';  with y = G_H S x from before it
          Z += y h' + sigma x (R'S x + (x'S x) h)',  T += y k' + sigma x (W'S x + (x'S x) k)'
Drop j    q = B_jj, c = B_j / q:               sigma = 1 / q,   x = W_j, y = T_j,       h = c Y_H,      k = -c
Add v     g = G_H[:, v], u = G_H S g, d = g_v: sigma = -1 / d,  x = g,   y = u,         h = -R_v / d,   k = -W_v / d
          and the new columns  g / d  of W,  (u - g (g'S g) / d) / d  of T
Swap      drop j, which leaves its columns empty, and add v in its place
Rounding adds up: `State.refresh` after some dozens of them.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.linalg import get_blas_funcs

from capture_plan.shell.state import State


@dataclass(frozen=True, eq=False)
class _Loss:
    """What goes with a marker; ww = w'S w."""

    q: float
    c: Float[np.ndarray, " m"]
    w: Float[np.ndarray, " v"]
    t: Float[np.ndarray, " v"]
    rho: Float[np.ndarray, " r"]
    a: Float[np.ndarray, " r"]
    ww: float


def loss(state: State, j: int) -> _Loss:
    """What goes with marker number j, which is not the last of a floating piece."""
    q, w, t = float(state.B[j, j]), state.W[:, j].copy(), state.T[:, j].copy()
    c, sw = state.B[j, : len(state.markers)] / q, state.s * w
    return _Loss(q, c, w, t, c @ state.motion.rows[state.markers], sw @ state.R, float(sw @ w))


@dataclass(frozen=True, eq=False)
class Change:
    """A rank-one change of a state: its letters are those above."""

    sigma: float
    x: Float[np.ndarray, " v"]
    y: Float[np.ndarray, " v"]
    h: Float[np.ndarray, " r"]
    k: Float[np.ndarray, " m"]


def drop(state: State, j: int) -> None:
    """Take marker number j away."""
    left = state.markers[:j] + state.markers[j + 1 :]
    if state.is_last(j):
        state.refresh(left)
        return
    _change(state, _dropped(loss(state, j)))
    state.T, state.W, KC = (np.delete(A, j, axis=1) for A in (state.T, state.W, state.KC))
    state.stand(left, KC)


def add(state: State, v: int) -> None:
    """One more marker, at vertex v."""
    if state.floating[v]:
        state.refresh([*state.markers, v])
        return
    new = _added(state, v, state.B)
    state.T, state.W, KC = (
        np.insert(A, len(state.markers), x, axis=1) for A, x in zip((state.T, state.W, state.KC), new, strict=True)
    )
    state.stand([*state.markers, int(v)], KC)


def swap(state: State, j: int, v: int) -> None:
    """Marker number j moved to vertex v."""
    x = loss(state, j)
    _change(state, _dropped(x))
    # B without marker j
    new = _added(state, v, state.B - np.outer(state.B[j], state.B[j]) / x.q)
    state.T[:, j], state.W[:, j], state.KC[:, j] = new
    state.stand([*state.markers[:j], int(v), *state.markers[j + 1 :]], state.KC)


def _dropped(x: _Loss) -> Change:
    return Change(1 / x.q, x.w, x.t, x.rho, -x.c)


def _added(
    state: State, v: int, B: Float[np.ndarray, "n n"]
) -> tuple[Float[np.ndarray, " v"], Float[np.ndarray, " v"], Float[np.ndarray, " v"]]:
    """Vertex v added to the markers of which B knows; the marker's columns of T, W and KC."""
    s, column = state.s, state.shell.columns(np.array([v]))[:, 0]
    g = column - state.KC @ (B @ state.KC[v])
    u = state.shell.solve(s * g) - state.KC @ (B @ (state.KC.T @ (s * g)))
    d = g[v]
    _change(state, Change(-1 / d, g, u, -state.R[v] / d, -state.W[v] / d))
    return (u - g * float((s * g) @ g) / d) / d, g / d, column


def _change(state: State, change: Change) -> None:
    """gamma, nu, Z, R, T and W after the change."""
    sigma, x, y, h, k = change.sigma, change.x, change.y, change.h, change.k
    sx, p, xy = state.s * x, state.partner, np.stack([y, x], axis=1)
    xx = float(sx @ x)
    state.gamma += sigma * x**2
    state.gamma_partner += sigma * x * x[p]
    state.nu += sigma * (2 * x * y + sigma * xx * x**2)
    state.nu_partner += sigma * (x * y[p] + y * x[p] + sigma * xx * x * x[p])
    state.Z += xy @ np.stack([h, sigma * (sx @ state.R + xx * h)])
    state.R += np.outer(x, h)
    _add_product(state.T, xy, np.stack([k, sigma * (sx @ state.W + xx * k)]))
    _add_product(state.W, x[:, None], k[None])


def _add_product(A: Float[np.ndarray, "v m"], U: Float[np.ndarray, "v n"], V: Float[np.ndarray, "n m"]) -> None:
    """A += U V in place; the columns of A lie together."""
    if A.size == 0:  # of a state without markers
        return
    (gemm,) = get_blas_funcs(("gemm",), (A,))
    gemm(1.0, U, V, beta=1.0, c=A, overwrite_c=1)
