"""One marker goes, comes or moves: a `State` brought up to date by rank-one updates.

Data      R, Z, gamma, nu, T, W, B of a state, S = diag(s)
Drop j    q = B_jj, w = W_j, t = T_j, c = B_j / q, rho = c Y_H, a = R'S w:
          G_H += w w' / q,  R += w rho',  W -= w c',  Z += t rho' + w (a + (w'S w) rho)' / q
Add v     g = G_H[:, v], u = G_H S g, d = g_v:
          G_H -= g g' / d,  R -= g R_v' / d,  W = [W - g W_v' / d, g / d],
          Z -= u R_v' / d + g (R'S g - (g'S g) R_v / d)' / d
Swap      both, in one pass over each array
T follows W as Z follows R. Rounding adds up: `State.refresh` after some dozens of them.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.linalg import get_blas_funcs

from capture_plan.shell.state import State


@dataclass(frozen=True, eq=False)
class Loss:
    """What goes with a marker; ww = w'S w."""

    q: float
    c: Float[np.ndarray, " m"]
    w: Float[np.ndarray, " v"]
    t: Float[np.ndarray, " v"]
    rho: Float[np.ndarray, " r"]
    a: Float[np.ndarray, " r"]
    ww: float


def loss(state: State, j: int) -> Loss:
    """What goes with marker number j, which is not the last of a floating piece."""
    q, w, t = float(state.B[j, j]), state.W[:, j].copy(), state.T[:, j].copy()
    c, sw = state.B[j, : len(state.markers)] / q, state.s * w
    return Loss(q, c, w, t, c @ state.motion.rows[state.markers], sw @ state.R, float(sw @ w))


def drop(state: State, j: int) -> None:
    """Marker number j away."""
    left = state.markers[:j] + state.markers[j + 1 :]
    if state.is_last(j):
        state.refresh(left)
        return
    x = loss(state, j)
    _loosen(state, x)
    state.Z += np.outer(x.t, x.rho) + np.outer(x.w, (x.a + x.ww * x.rho) / x.q)
    state.R += np.outer(x.w, x.rho)
    state.T -= np.outer(x.t, x.c) - np.outer(x.w, ((state.s * x.w) @ state.W - x.ww * x.c) / x.q)
    state.W -= np.outer(x.w, x.c)
    state.T, state.W, KC = (np.delete(A, j, axis=1) for A in (state.T, state.W, state.KC))
    state.stand(left, KC)


def add(state: State, v: int) -> None:
    """One more marker, at vertex v."""
    if state.floating[v]:
        state.refresh([*state.markers, v])
        return
    s, m, g = state.s, len(state.markers), state.columns(np.array([v]))[:, 0]
    u = state.shell.solve(s * g) - state.KC @ (state.B @ (state.KC.T @ (s * g)))
    d, gg, r, W_v = g[v], float((s * g) @ g), state.R[v].copy(), state.W[v].copy()
    _bind(state, g, u, d, gg)
    state.Z -= np.outer(u, r / d) + np.outer(g, ((s * g) @ state.R - gg * r / d) / d)
    state.R -= np.outer(g, r / d)
    state.T -= np.outer(u, W_v / d) + np.outer(g, ((s * g) @ state.W - gg * W_v / d) / d)
    state.W -= np.outer(g, W_v / d)
    new = (u - g * gg / d) / d, g / d, state.shell.columns(np.array([v]))[:, 0]
    state.T, state.W, KC = (np.insert(A, m, x, axis=1) for A, x in zip((state.T, state.W, state.KC), new, strict=True))
    state.stand([*state.markers, int(v)], KC)


def swap(state: State, j: int, v: int) -> None:
    """Marker number j moved to vertex v."""
    s, x = state.s, loss(state, j)
    # g = G_H[:, v] and u = G_H S g without marker j, of which b knows nothing
    b, column = state.B - np.outer(state.B[j], state.B[j]) / x.q, state.shell.columns(np.array([v]))[:, 0]
    g = column - state.KC @ (b @ state.KC[v])
    u = state.shell.solve(s * g) - state.KC @ (b @ (state.KC.T @ (s * g)))
    d, gg, gw = g[v], float((s * g) @ g), float((s * g) @ x.w)
    r, W_v = state.R[v] + x.w[v] * x.rho, state.W[v] - x.w[v] * x.c
    to_R = ((s * g) @ state.R + gw * x.rho - gg * r / d) / d
    to_W = ((s * g) @ state.W - gw * x.c - gg * W_v / d) / d
    _loosen(state, x)
    _bind(state, g, u, d, gg)
    four = np.stack([x.t, x.w, u, g], axis=1)
    state.Z += four @ np.stack([x.rho, (x.a + x.ww * x.rho) / x.q, -r / d, -to_R])
    state.R += four[:, [1, 3]] @ np.stack([x.rho, -r / d])
    _add_product(state.T, four, np.stack([-x.c, ((s * x.w) @ state.W - x.ww * x.c) / x.q, -W_v / d, -to_W]))
    _add_product(state.W, four[:, [1, 3]], np.stack([-x.c, -W_v / d]))
    state.T[:, j], state.W[:, j], state.KC[:, j] = (u - g * gg / d) / d, g / d, column
    state.stand([*state.markers[:j], int(v), *state.markers[j + 1 :]], state.KC)


def _loosen(state: State, x: Loss) -> None:
    """gamma and nu, where G_H += w w' / q."""
    q, w, t, ww, p = x.q, x.w, x.t, x.ww, state.partner
    state.gamma += w**2 / q
    state.gamma_beside += w * w[p] / q
    state.nu += 2 * t * w / q + w**2 * ww / q**2
    state.nu_beside += (t * w[p] + t[p] * w) / q + w * w[p] * ww / q**2


def _bind(state: State, g: Float[np.ndarray, " v"], u: Float[np.ndarray, " v"], d: float, gg: float) -> None:
    """gamma and nu, where G_H -= g g' / d; gg = g'S g."""
    p = state.partner
    state.gamma -= g**2 / d
    state.gamma_beside -= g * g[p] / d
    state.nu += -2 * g * u / d + gg * g**2 / d**2
    state.nu_beside += -(g * u[p] + g[p] * u) / d + gg * g * g[p] / d**2


def _add_product(A: Float[np.ndarray, "v m"], U: Float[np.ndarray, "v n"], V: Float[np.ndarray, "n m"]) -> None:
    """A += U V in place; the columns of A lie together."""
    (gemm,) = get_blas_funcs(("gemm",), (A,))
    gemm(1.0, U, V, beta=1.0, c=A, overwrite_c=1)
