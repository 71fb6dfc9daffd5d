"""What each change of a layout would make of its error: the closed forms over a `State`, exact and for all at once.

Data      R, Z, gamma, nu, T, W, B of a state; E = sum_v s_v e_v with e_v = |R_v|^2; z_v = Z_v . R_v
Add v     E(H + v) = E - 2 z_v / gamma_v + nu_v e_v / gamma_v^2
Drop j    q = B_jj, w = W_j, rho = (B_j Y_H) / q, a = R'S w:  E(H - j) = E + 2 a.rho + (w'S w) |rho|^2
Swap      the E, e, z, gamma, nu that dropping j leaves, in the formula of adding v
Two       v and its partner, or any two: `two_marker_scores`

A score is infinite where no marker can stand, and where the last marker of a floating piece would go.
"""

import numpy as np
from jaxtyping import Bool, Float, Int

from capture_plan.shell.pair_moves import Two, two_marker_scores
from capture_plan.shell.state import State, row_products
from capture_plan.shell.updates import loss

STUCK = 1e-9  # share of gamma without markers: a vertex that the markers hold so fast gains nothing by one of its own


def can_stand(state: State, gamma: Float[np.ndarray, " n"], at: Int[np.ndarray, " n"]) -> Bool[np.ndarray, " n"]:
    """Where there is room for a marker among the vertices `at`, of which gamma tells how far they give way."""
    moves = ~state.shell.fixed[at] & (gamma > STUCK * state.gamma_bare.max())
    return moves & ~np.isin(at, state.markers)


def open_vertices(state: State) -> Bool[np.ndarray, " v"]:
    """Where one more marker can stand."""
    return can_stand(state, state.gamma, np.arange(len(state.gamma)))


def add_scores(state: State) -> Float[np.ndarray, " v"]:
    """The error E(H + v) with each further marker v, (v)."""
    can = open_vertices(state)
    gamma = np.where(can, state.gamma, 1)
    return np.where(can, state.error - 2 * state.z / gamma + state.nu * state.e / gamma**2, np.inf)


def add_pair_scores(state: State) -> Float[np.ndarray, " v"]:
    """E(H + v + its partner); infinite where v is its own partner."""
    p, v, R = state.partner, np.arange(len(state.s)), state.R
    between = row_products(R, state.Z[p])
    G = Two(state.gamma, state.gamma_partner, state.gamma[p])
    N = Two(state.nu, state.nu_partner, state.nu[p])
    RR = Two(state.e, row_products(R, R[p]), state.e[p])
    RZ = Two(state.z, between + between[p], state.z[p])
    can = open_vertices(state)
    return np.where(can & can[p] & (p != v) & (p[p] == v), two_marker_scores(state.error, G, N, RR, RZ), np.inf)


def drop_score(state: State, j: int) -> float:
    """The error E(H - j) without marker number j."""
    if state.is_last(j):
        return np.inf
    x = loss(state, j)
    return float(state.error + 2 * x.a @ x.rho + x.ww * (x.rho @ x.rho))


def swap_scores(state: State, j: int, at: Int[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
    """E(H - j + v) of the vertices `at`."""
    if state.is_last(j):
        return np.full(len(at), np.inf)
    x = loss(state, j)
    q, rho, a, ww, rr = x.q, x.rho, x.a, x.ww, float(x.rho @ x.rho)
    w, t, Z_rho = x.w[at], x.t[at], (state.Z @ rho)[at]
    R_rho, R_b = (state.R @ np.stack([rho, (a + ww * rho) / q], axis=1))[at].T
    # E, e, z, gamma, nu as `drop` would leave them
    E = state.error + 2 * a @ rho + ww * rr
    e = state.e[at] + 2 * w * R_rho + w**2 * rr
    z = state.z[at] + w * (Z_rho + R_b) + t * (R_rho + w * rr) + w**2 * (a @ rho + ww * rr) / q
    gamma = state.gamma[at] + w**2 / q
    nu = state.nu[at] + 2 * t * w / q + w**2 * ww / q**2
    can = can_stand(state, gamma, at)
    gamma = np.where(can, gamma, 1)
    return np.where(can, E - 2 * z / gamma + nu * e / gamma**2, np.inf)


def two_scores(state: State, a: Int[np.ndarray, " p"], b: Int[np.ndarray, " q"]) -> Float[np.ndarray, "p q"]:
    """E(H + u + v) for every u of a and v of b; infinite where u = v."""
    G_a, G_b, R, Z, e, z = state.columns(a), state.columns(b), state.R, state.Z, state.e, state.z
    G = Two(state.gamma[a, None], G_a[b].T, state.gamma[None, b])
    N = Two(state.nu[a, None], G_a.T @ (state.s[:, None] * G_b), state.nu[None, b])
    RR = Two(e[a, None], R[a] @ R[b].T, e[None, b])
    RZ = Two(z[a, None], R[a] @ Z[b].T + Z[a] @ R[b].T, z[None, b])
    can = open_vertices(state)
    may = can[a, None] & can[None, b] & (a[:, None] != b)
    return np.where(may, two_marker_scores(state.error, G, N, RR, RZ), np.inf)
