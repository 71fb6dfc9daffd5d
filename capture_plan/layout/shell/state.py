"""What a layout misses, and what every change of one marker would make of it, at once.

Data      shell G, C; motion Y (v r), s; S = diag(s); markers H with K = G[:, H], B, W of `Shell`
State     G_H = G - [K C] B [K C]'       the shell with H added to its boundary
          R = Y - W Y_H                  E = sum_v s_v |R_v|^2
          Z = G_H S R,  gamma = diag G_H,  nu = diag G_H S G_H,  T = G_H S W
          e_v = |R_v|^2,  z_v = Z_v . R_v
Add v     E(H + v) = E - 2 z_v / gamma_v + nu_v e_v / gamma_v^2
Drop j    q = B_jj, w = W_j, rho = (B_j Y_H) / q, a = R'S w:  E(H - j) = E + 2 a.rho + (w'S w) |rho|^2
Swap      the dropped state's e, z, gamma, nu in the formula of adding, for all j and v
Pair      of v and its partner p: Gamma = G_H[vp, vp], N = (G_H S G_H)[vp, vp]:
          E(H + v + p) = E - 2 tr(Gamma^-1 R_vp Z_vp') + <Gamma^-1 R_vp R_vp' Gamma^-1, N>
          with the entries (v, p) of both matrices kept beside gamma and nu

A floating piece without a marker is one that may still move as a whole: there G_H is C C' times infinity, and the
formulas hold with G_H = C C' until its first marker stands. The last marker of such a piece cannot be dropped.
"""

from collections.abc import Sequence
from copy import copy

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.linalg import get_blas_funcs

from capture_plan.layout.shell.model import Shell
from capture_plan.layout.shell.motion import Motion
from capture_plan.layout.shell.pairs import Two, two_marker_scores

STUCK = 1e-9  # share of gamma without markers: a vertex that the markers hold so fast gains nothing by one of its own


class State:
    """R, Z, gamma, nu, T of some markers on one shell; `partner` is each vertex's mirror image, or itself."""

    def __init__(
        self, shell: Shell, motion: Motion, markers: Sequence[int] = (), *, partner: Int[np.ndarray, " v"] | None = None
    ) -> None:
        self.shell, self.motion, self.s = shell, motion, motion.weights
        self.partner = np.arange(len(self.s)) if partner is None else partner
        self._first()
        self.refresh(markers)

    def _first(self) -> None:
        """gamma and nu without markers, on the diagonal and between partners."""
        v = np.arange(len(self.s))
        paired = np.flatnonzero(self.partner != v)
        pairs = np.concatenate([np.stack([v, v], axis=1), np.stack([paired, self.partner[paired]], axis=1)])
        g, n = self.shell.entries(self.s, pairs)
        self._gamma, self._nu = ([x[: len(v)], x[: len(v)].copy()] for x in (g, n))
        self._gamma[1][paired], self._nu[1][paired] = g[len(v) :], n[len(v) :]

    def refresh(self, markers: Sequence[int] | None = None) -> None:
        """Everything from scratch, of these markers or of those that stand."""
        self.markers = [int(h) for h in (self.markers if markers is None else markers)]
        H, s, p = np.array(self.markers, dtype=int), self.s, self.partner
        KC, self.B = self.shell.bordered(H)
        self.KC = np.asfortranarray(KC)
        # W = KC B, R = Y - W Y_H
        KB = self.KC @ self.B
        self.W = KB[:, : len(H)].copy(order="F")
        self.R = self.motion.rows - self.W @ self.motion.rows[H]
        # T = G_H S W, Z = G_H S R with G_H = G - KC B KC'
        GSK = self._solve(s[:, None] * self.KC) @ self.B
        Q = self.KC.T @ (s[:, None] * KB)
        KBQ = KB @ Q
        self.T = np.asfortranarray((GSK - KBQ)[:, : len(H)])
        self.Z = self._solve(s[:, None] * self.R) - KB @ (self.KC.T @ (s[:, None] * self.R))
        self.gamma = self._gamma[0] - _rows(KB, self.KC)
        self.gamma_beside = self._gamma[1] - _rows(KB, self.KC[p])
        half = GSK - KBQ / 2
        self.nu = self._nu[0] - 2 * _rows(half, self.KC)
        self.nu_beside = self._nu[1] - _rows(half, self.KC[p]) - _rows(half[p], self.KC)
        self._let_pieces_float()

    def _let_pieces_float(self) -> None:
        """G_H = C C' on the floating pieces without a marker."""
        piece, s, floating = self.shell.piece, self.s, self.floating
        for c in np.unique(piece[floating]):
            inside = piece == c
            beside = inside & inside[self.partner]
            self.Z[inside] = s[inside] @ self.R[inside]
            self.gamma[inside], self.nu[inside] = 1, s[inside].sum()
            self.gamma_beside[inside], self.nu_beside[inside] = 0, 0
            self.gamma_beside[beside], self.nu_beside[beside] = 1, s[inside].sum()

    def _solve(self, b: Float[np.ndarray, "v n"]) -> Float[np.ndarray, "v n"]:
        solved = np.empty(b.shape)
        for i in range(b.shape[1]):
            solved[:, i] = self.shell.solve(b[:, i])
        return solved

    @property
    def floating(self) -> Bool[np.ndarray, " v"]:
        """Vertices of floating pieces without a marker."""
        piece = self.shell.piece
        return (piece >= 0) & ~np.isin(piece, piece[self.markers])

    @property
    def error(self) -> float:
        """E."""
        return float(np.einsum("vr,vr,v->", self.R, self.R, self.s))

    @property
    def open(self) -> Bool[np.ndarray, " v"]:
        """Where one more marker can stand."""
        floor = STUCK * self._gamma[0].max()
        can = ~self.shell.fixed & (self.gamma > floor)
        can[self.markers] = False
        return can

    def add_scores(self) -> Float[np.ndarray, " v"]:
        """E(H + v); infinite where none can stand."""
        e, z, can = _rows(self.R, self.R), _rows(self.Z, self.R), self.open
        gamma = np.where(can, self.gamma, 1)
        return np.where(can, self.error - 2 * z / gamma + self.nu * e / gamma**2, np.inf)

    def add_pair_scores(self) -> Float[np.ndarray, " v"]:
        """E(H + v + its partner); infinite where v is its own partner or one of the two cannot stand."""
        p, v = self.partner, np.arange(len(self.s))
        own, between = _rows(self.R, self.Z), _rows(self.R, self.Z[p])
        e = _rows(self.R, self.R)
        G = Two(self.gamma, self.gamma_beside, self.gamma[p])
        N = Two(self.nu, self.nu_beside, self.nu[p])
        RR, RZ = Two(e, _rows(self.R, self.R[p]), e[p]), Two(own, between + between[p], own[p])
        can = self.open & self.open[p] & (p != v) & (p[p] == v)
        return np.where(can, two_marker_scores(self.error, G, N, RR, RZ), np.inf)

    def _without(self, j: int) -> tuple[float, Float[np.ndarray, " m"], Float[np.ndarray, " r"]]:
        """q, c = B_j / q and rho = c Y_H; q is 0 for the last marker of a floating piece."""
        q = float(self.B[j, j])
        if self._last(j):
            return 0.0, np.zeros(len(self.markers)), np.zeros(self.R.shape[1])
        c = self.B[j, : len(self.markers)] / q
        return q, c, c @ self.motion.rows[self.markers]

    def _last(self, j: int) -> bool:
        piece = self.shell.piece[self.markers]
        return bool(piece[j] >= 0) and int((piece == piece[j]).sum()) == 1

    def drop_score(self, j: int) -> float:
        """E(H - j); infinite for the last marker of a floating piece."""
        q, _, rho = self._without(j)
        w = self.W[:, j]
        a = (self.s * w) @ self.R
        return float(self.error + 2 * a @ rho + (self.s * w) @ w * (rho @ rho)) if q else np.inf

    def swap_scores(self, j: int, at: Int[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
        """E(H - j + v) of the vertices `at`; infinite where none can stand, and for the last of a floating piece."""
        q, _, rho = self._without(j)
        if not q:
            return np.full(len(at), np.inf)
        w, s = self.W[:, j], self.s
        a, ww, rr = (s * w) @ self.R, float((s * w) @ w), float(rho @ rho)
        without = self.error + 2 * a @ rho + ww * rr
        w, t, Z_rho = w[at], self.T[at, j], (self.Z @ rho)[at]
        R_rho, R_b = (self.R @ np.stack([rho, (a + ww * rho) / q], axis=1))[at].T
        # e, z, gamma, nu as `drop` would leave them
        e = _rows(self.R, self.R)[at] + 2 * w * R_rho + w**2 * rr
        z = _rows(self.Z, self.R)[at] + w * (Z_rho + R_b) + t * (R_rho + w * rr) + w**2 * (a @ rho + ww * rr) / q
        gamma = self.gamma[at] + w**2 / q
        nu = self.nu[at] + 2 * t * w / q + w**2 * ww / q**2
        can = ~self.shell.fixed[at] & (gamma > STUCK * self._gamma[0].max()) & ~np.isin(at, self.markers)
        gamma = np.where(can, gamma, 1)
        return np.where(can, without - 2 * z / gamma + nu * e / gamma**2, np.inf)

    def drop(self, j: int) -> None:
        """Marker number j away."""
        if self._last(j):
            self.refresh(self.markers[:j] + self.markers[j + 1 :])
            return
        q, c, rho = self._without(j)
        w, t, s, p = self.W[:, j].copy(), self.T[:, j].copy(), self.s, self.partner
        a, ww = (s * w) @ self.R, float((s * w) @ w)
        self.gamma += w**2 / q
        self.gamma_beside += w * w[p] / q
        self.nu += 2 * t * w / q + w**2 * ww / q**2
        self.nu_beside += (t * w[p] + t[p] * w) / q + w * w[p] * ww / q**2
        self.Z += np.outer(t, rho) + np.outer(w, (a + ww * rho) / q)
        self.R += np.outer(w, rho)
        self.T -= np.outer(t, c) - np.outer(w, ((s * w) @ self.W - ww * c) / q)
        self.W -= np.outer(w, c)
        keep = np.arange(len(self.markers)) != j
        self.W, self.T = self.W[:, keep].copy(order="F"), self.T[:, keep].copy(order="F")
        self._stand(self.markers[:j] + self.markers[j + 1 :], np.delete(self.KC, j, axis=1))

    def add(self, v: int) -> None:
        """One more marker, at vertex v."""
        if self.shell.piece[v] >= 0 and self.shell.piece[v] not in self.shell.piece[self.markers]:
            self.refresh([*self.markers, v])
            return
        s, p, m, column = self.s, self.partner, len(self.markers), self.shell.columns(np.array([v]))
        # g = G_H[:, v], u = G_H S g
        g = column[:, 0] - self.KC @ (self.B @ self.KC[v])
        u = self.shell.solve(s * g) - self.KC @ (self.B @ (self.KC.T @ (s * g)))
        d, gg, r, W_v = g[v], float((s * g) @ g), self.R[v].copy(), self.W[v].copy()
        self.gamma -= g**2 / d
        self.gamma_beside -= g * g[p] / d
        self.nu += -2 * g * u / d + gg * g**2 / d**2
        self.nu_beside += -(g * u[p] + g[p] * u) / d + gg * g * g[p] / d**2
        self.Z -= np.outer(u, r / d) + np.outer(g, ((s * g) @ self.R - gg * r / d) / d)
        self.R -= np.outer(g, r / d)
        self.T -= np.outer(u, W_v / d) + np.outer(g, ((s * g) @ self.W - gg * W_v / d) / d)
        self.T = np.asfortranarray(np.column_stack([self.T, (u - g * gg / d) / d]))
        self.W = np.asfortranarray(np.column_stack([self.W - np.outer(g, W_v / d), g / d]))
        self._stand([*self.markers, int(v)], np.hstack([self.KC[:, :m], column, self.KC[:, m:]]))

    def _stand(self, markers: list[int], KC: Float[np.ndarray, "v _"]) -> None:
        self.markers, self.KC = markers, np.asfortranarray(KC)
        self.B = self.shell.inverted(np.array(markers, dtype=int), KC)

    def copy(self) -> "State":
        """One that can be changed without this one."""
        twin = copy(self)
        for name in ("R", "Z", "W", "T", "KC", "gamma", "nu", "gamma_beside", "nu_beside"):
            setattr(twin, name, getattr(self, name).copy(order="K"))
        return twin

    def two_scores(self, a: Int[np.ndarray, " p"], b: Int[np.ndarray, " q"]) -> Float[np.ndarray, "p q"]:
        """E(H + u + v) for every u of a and v of b; infinite where one cannot stand, or u = v."""
        # G_H[:, a], of which the entries between a and b and N = G_H S G_H
        G_a, G_b = (self.shell.columns(at) - self.KC @ (self.B @ self.KC[at].T) for at in (a, b))
        G = Two(self.gamma[a, None], G_a[b].T, self.gamma[None, b])
        N = Two(self.nu[a, None], G_a.T @ (self.s[:, None] * G_b), self.nu[None, b])
        e, own = _rows(self.R, self.R), _rows(self.R, self.Z)
        RR = Two(e[a, None], self.R[a] @ self.R[b].T, e[None, b])
        RZ = Two(own[a, None], self.R[a] @ self.Z[b].T + self.Z[a] @ self.R[b].T, own[None, b])
        can = self.open[a, None] & self.open[None, b] & (a[:, None] != b)
        return np.where(can, two_marker_scores(self.error, G, N, RR, RZ), np.inf)

    def swap(self, j: int, v: int) -> None:
        """Marker number j moved to vertex v: `drop` and `add` in one pass over each array."""
        s, p = self.s, self.partner
        q, c, rho = self._without(j)
        w, t, b = self.W[:, j].copy(), self.T[:, j].copy(), self.B - np.outer(self.B[j], self.B[j]) / q
        a, ww = (s * w) @ self.R, float((s * w) @ w)
        # g = G_H[:, v] and u = G_H S g without marker j, of which b knows nothing
        column = self.shell.columns(np.array([v]))[:, 0]
        g = column - self.KC @ (b @ self.KC[v])
        u = self.shell.solve(s * g) - self.KC @ (b @ (self.KC.T @ (s * g)))
        d, gg, gw = g[v], float((s * g) @ g), float((s * g) @ w)
        r, W_v = self.R[v] + w[v] * rho, self.W[v] - w[v] * c
        to_R = ((s * g) @ self.R + gw * rho - gg * r / d) / d
        to_W = ((s * g) @ self.W - gw * c - gg * W_v / d) / d
        self.gamma += w**2 / q - g**2 / d
        self.gamma_beside += w * w[p] / q - g * g[p] / d
        self.nu += 2 * t * w / q + w**2 * ww / q**2 - 2 * g * u / d + gg * g**2 / d**2
        self.nu_beside += (t * w[p] + t[p] * w) / q + w * w[p] * ww / q**2
        self.nu_beside += -(g * u[p] + g[p] * u) / d + gg * g * g[p] / d**2
        four = np.stack([t, w, u, g], axis=1)
        self.Z += four @ np.stack([rho, (a + ww * rho) / q, -r / d, -to_R])
        self.R += four[:, [1, 3]] @ np.stack([rho, -r / d])
        _add_product(self.T, four, np.stack([-c, ((s * w) @ self.W - ww * c) / q, -W_v / d, -to_W]))
        _add_product(self.W, four[:, [1, 3]], np.stack([-c, -W_v / d]))
        self.T[:, j], self.W[:, j], self.KC[:, j] = (u - g * gg / d) / d, g / d, column
        self.markers = [*self.markers[:j], int(v), *self.markers[j + 1 :]]
        self.B = self.shell.inverted(np.array(self.markers), self.KC)


def _add_product(A: Float[np.ndarray, "v m"], U: Float[np.ndarray, "v n"], V: Float[np.ndarray, "n m"]) -> None:
    """A += U V in place; the columns of A lie together."""
    (gemm,) = get_blas_funcs(("gemm",), (A,))
    gemm(1.0, U, V, beta=1.0, c=A, overwrite_c=1)


def _rows(A: Float[np.ndarray, "v n"], B: Float[np.ndarray, "v n"]) -> Float[np.ndarray, " v"]:
    """A_v . B_v."""
    return np.einsum("vn,vn->v", A, B)
