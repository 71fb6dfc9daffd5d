"""What a layout misses on one shell, kept while markers come, go and move.

Data      shell G, C; motion Y (v r), s; S = diag(s); markers H with K = G[:, H], B, W of `Shell`
State     G_H = G - [K C] B [K C]'       the shell with H added to its boundary
          R = Y - W Y_H                  E = sum_v s_v |R_v|^2
          Z = G_H S R,  gamma = diag G_H,  nu = diag G_H S G_H,  T = G_H S W
          and of G_H and G_H S G_H the entries (v, partner of v) beside gamma and nu
          e_v = |R_v|^2,  z_v = Z_v . R_v
Changes   one marker less, more or elsewhere: `updates`; what each of them would make of E: `scores`

A floating piece without a marker is one that may still move as a whole: there G_H is C C' times infinity, and the
formulas hold with G_H = C C' until its first marker stands. The last marker of such a piece cannot be dropped.
"""

from collections.abc import Sequence
from copy import copy
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float, Int

from capture_plan.shell.model import Shell
from capture_plan.shell.motion import Motion

IN_PLACE = ("R", "Z", "W", "T", "KC", "gamma", "nu", "gamma_partner", "nu_partner")


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
        both = self.shell.entries(self.s, pairs)
        self.gamma_bare, self.nu_bare = (x[: len(v)] for x in both)
        self.gamma_partner_bare, self.nu_partner_bare = self.gamma_bare.copy(), self.nu_bare.copy()
        self.gamma_partner_bare[paired], self.nu_partner_bare[paired] = (x[len(v) :] for x in both)

    def refresh(self, markers: Sequence[int]) -> None:
        """Compute everything from scratch for these markers."""
        self.markers = [int(h) for h in markers]
        H, s, p = np.array(self.markers, dtype=int), self.s, self.partner
        KC, self.B = self.shell.bordered(H)
        self.KC = np.asfortranarray(KC)
        # W = KC B, R = Y - W Y_H
        KB = self.KC @ self.B
        self.W = KB[:, : len(H)].copy(order="F")
        self.R = self.motion.rows - self.W @ self.motion.rows[H]
        # T = G_H S W, Z = G_H S R with G_H = G - KC B KC'
        GSK = self.shell.solve_all(s[:, None] * self.KC) @ self.B
        KBQ = KB @ (self.KC.T @ (s[:, None] * KB))
        self.T = np.asfortranarray((GSK - KBQ)[:, : len(H)])
        self.Z = self.shell.solve_all(s[:, None] * self.R) - KB @ (self.KC.T @ (s[:, None] * self.R))
        self.gamma = self.gamma_bare - row_products(KB, self.KC)
        self.gamma_partner = self.gamma_partner_bare - row_products(KB, self.KC[p])
        half = GSK - KBQ / 2
        self.nu = self.nu_bare - 2 * row_products(half, self.KC)
        self.nu_partner = self.nu_partner_bare - row_products(half, self.KC[p]) - row_products(half[p], self.KC)
        self._let_pieces_float()
        self._forget()

    def _let_pieces_float(self) -> None:
        """G_H = C C' on the floating pieces without a marker."""
        piece, s, floating = self.shell.piece, self.s, self.floating
        for c in np.unique(piece[floating]):
            inside = piece == c
            paired = inside & inside[self.partner]
            self.Z[inside] = s[inside] @ self.R[inside]
            self.gamma[inside], self.nu[inside] = 1, s[inside].sum()
            self.gamma_partner[inside], self.nu_partner[inside] = 0, 0
            self.gamma_partner[paired], self.nu_partner[paired] = 1, s[inside].sum()

    @property
    def floating(self) -> Bool[np.ndarray, " v"]:
        """Vertices of floating pieces without a marker."""
        piece = self.shell.piece
        return (piece >= 0) & ~np.isin(piece, piece[self.markers])

    @cached_property
    def e(self) -> Float[np.ndarray, " v"]:
        """The squared residual |R_v|^2 of every vertex."""
        return row_products(self.R, self.R)

    @cached_property
    def z(self) -> Float[np.ndarray, " v"]:
        """The products Z_v . R_v of every vertex."""
        return row_products(self.Z, self.R)

    @property
    def error(self) -> float:
        """The squared error E of the layout, mm^2."""
        return float(self.s @ self.e)

    def _forget(self) -> None:
        """e and z of the layout before."""
        self.__dict__.pop("e", None)
        self.__dict__.pop("z", None)

    def columns(self, at: Int[np.ndarray, " n"]) -> Float[np.ndarray, "v n"]:
        """The columns G_H[:, at] of the compliance with markers held."""
        return self.shell.columns(at) - self.KC @ (self.B @ self.KC[at].T)

    def is_last(self, j: int) -> bool:
        """Whether marker number j is all that holds a floating piece."""
        piece = self.shell.piece[self.markers]
        return bool(piece[j] >= 0) and int((piece == piece[j]).sum()) == 1

    def copy(self) -> "State":
        """One that can be changed without this one."""
        twin = copy(self)
        for name in IN_PLACE:
            setattr(twin, name, getattr(self, name).copy(order="K"))
        return twin

    def stand(self, markers: list[int], KC: Float[np.ndarray, "v _"]) -> None:
        """B of markers whose R, Z, W, T, gamma and nu are up to date."""
        self.markers = markers
        self.W, self.T, self.KC = np.asfortranarray(self.W), np.asfortranarray(self.T), np.asfortranarray(KC)
        self.B = self.shell.inverted(np.array(markers, dtype=int), self.KC)
        self._forget()


def row_products(A: Float[np.ndarray, "v n"], B: Float[np.ndarray, "v n"]) -> Float[np.ndarray, " v"]:
    """The products A_v . B_v, row by row."""
    return np.einsum("vn,vn->v", A, B)
