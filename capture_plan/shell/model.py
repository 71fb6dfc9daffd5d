"""The thin shell that markers bend: what one marker moves, and the weights of many (Le et al. 2013, section 4.2.1).

Data      x_v in R^3, millimetres; triangles; fixed vertices, which never move (may be none); A the stiffness
Columns   G = A_ff^-1 on the free vertices f, 0 elsewhere: G[:, h] is the shape of the shell pushed at vertex h
Weights   W (v m): d = W d_H is the shell of least energy whose markers H are displaced by d_H
          K = G[:, H],  B = K_HH^-1,  W = K B          "H added to the boundary": G_H = G - K B K'
Floating  a piece without a fixed vertex has A singular: one of its vertices is grounded, and its constant is a
          permanent column of C: B = [[K_HH, C_H], [C_H', 0]]^-1, W = the first m columns of [K C] B, whichever vertex
          was grounded. Such a piece needs a marker.

    shell = Shell(vertices, triangles, fixed, stretching=1.0, bending=10.0)
    shell.columns(at) -> (v n)         shell.solve(b) -> G b          shell.weights(markers) -> W (v m)
    shell.gamma -> diag G (v)          shell.nu -> diag G^2 (v)       shell.entries(s, pairs) -> G, G S G at pairs
"""

from collections import OrderedDict
from dataclasses import dataclass
from functools import cached_property
from weakref import WeakValueDictionary

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.sparse import csc_array
from scipy.sparse.linalg import SuperLU, splu

from capture_plan.cache import digest
from capture_plan.errors import InfeasibleError, RigError
from capture_plan.mesh import pieces, with_area
from capture_plan.shell.selected_inverse import inverse_entries
from capture_plan.shell.stiffness import shell_stiffness

STRETCHING, BENDING = 1.0, 10.0  # kS and kB of Le et al. 2013, section 5, in millimetres
CACHE_BYTES = 2**28  # columns of G that are remembered: 1,300 of a face of 25,000 vertices
AT_ONCE = 4  # right sides: twice as fast as one by one; from 8 on threads of the library begin to wait for each other
ANSWERS = 4  # sets of entries that are remembered: 0.9 MB each


@dataclass(frozen=True, eq=False)
class Shell:
    """A mesh that bends like a thin shell; lengths in millimetres, seams welded."""

    vertices: Float[np.ndarray, "v 3"]
    triangles: Int[np.ndarray, "f 3"]
    fixed: Bool[np.ndarray, " v"]
    stretching: float = STRETCHING
    bending: float = BENDING

    def __post_init__(self) -> None:
        if len(self.fixed) != len(self.vertices):
            raise RigError(f"{len(self.fixed)} marks of fixed vertices for {len(self.vertices)} vertices: give as many")
        if self.stretching < 0 or self.bending <= 0:
            raise RigError(f"stretching {self.stretching}, bending {self.bending}: give 0 or more, and more than 0")
        if not np.isfinite(self.vertices).all():
            raise RigError("a vertex of the shell is not finite: repair the mesh")

    @cached_property
    def stiffness(self) -> csc_array:
        """The stiffness A of the shell, (v v)."""
        return shell_stiffness(
            self.vertices.astype(float), self.triangles, stretching=self.stretching, bending=self.bending
        )

    @cached_property
    def piece(self) -> Int[np.ndarray, " v"]:
        """The floating piece of each vertex; -1 in pieces that a fixed vertex holds."""
        number = pieces(with_area(self.vertices, self.triangles), len(self.vertices))
        floating = np.setdiff1d(number, number[self.fixed])
        return np.where(np.isin(number, floating), np.searchsorted(floating, number), -1)

    @cached_property
    def constants(self) -> Float[np.ndarray, "v c"]:
        """C: 1 on each floating piece."""
        return (self.piece[:, None] == np.arange(self.piece.max() + 1)).astype(float)

    @cached_property
    def free(self) -> Int[np.ndarray, " n"]:
        """Vertices that are neither fixed nor grounded."""
        grounded = self.constants.argmax(axis=0)
        return np.setdiff1d(np.flatnonzero(~self.fixed), grounded)

    @cached_property
    def solver(self) -> SuperLU:
        """The stiffness A_ff of what is free, factorised."""
        A = csc_array(self.stiffness[self.free][:, self.free])
        return splu(A, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0, options={"SymmetricMode": True})

    def solve(self, b: Float[np.ndarray, " v"]) -> Float[np.ndarray, " v"]:
        """The shape G b of the shell under nodal loads b."""
        return self.solve_all(b[:, None])[:, 0]

    def solve_all(self, b: Float[np.ndarray, "v n"]) -> Float[np.ndarray, "v n"]:
        """The shapes G b of the shell under several loads, a column each."""
        solved = np.zeros(b.shape, order="F")
        for i in range(0, b.shape[1], AT_ONCE):
            some = slice(i, i + AT_ONCE)
            solved[self.free, some] = self.solver.solve(np.asfortranarray(b[self.free, some]))
        return solved

    def columns(self, at: Int[np.ndarray, " n"]) -> Float[np.ndarray, "v n"]:
        """G[:, at]; columns asked for again are remembered within `CACHE_BYTES`."""
        return np.stack([self._column(int(h)) for h in at], axis=1) if len(at) else np.empty((len(self.vertices), 0))

    @cached_property
    def _remembered(self) -> "OrderedDict[int, np.ndarray]":
        return OrderedDict()

    def _column(self, h: int) -> Float[np.ndarray, " v"]:
        known = self._remembered
        if h not in known:
            known[h] = self.solve((np.arange(len(self.vertices)) == h).astype(float))
        known.move_to_end(h)
        if len(known) * 8 * len(self.vertices) > CACHE_BYTES:
            known.popitem(last=False)
        return known[h] if h in known else self.solve((np.arange(len(self.vertices)) == h).astype(float))

    def entries(
        self, s: Float[np.ndarray, " v"], pairs: Int[np.ndarray, "p 2"]
    ) -> tuple[Float[np.ndarray, " p"], Float[np.ndarray, " p"]]:
        """G[u, v] and sum_n s_n G[u, n] G[n, v] of each pair; 0 where a vertex does not move.

        The last few answers are remembered: searches on one shell ask for the same.
        """
        known, key = self._answered, (s.tobytes(), pairs.tobytes())
        if key not in known:
            known[key] = self._entries(s, pairs)
        known.move_to_end(key)
        if len(known) > ANSWERS:
            known.popitem(last=False)
        return known[key]

    @cached_property
    def _answered(self) -> "OrderedDict[tuple[bytes, bytes], tuple[np.ndarray, np.ndarray]]":
        return OrderedDict()

    def _entries(
        self, s: Float[np.ndarray, " v"], pairs: Int[np.ndarray, "p 2"]
    ) -> tuple[Float[np.ndarray, " p"], Float[np.ndarray, " p"]]:
        place = np.full(len(self.vertices), -1)
        place[self.free] = np.arange(len(self.free))
        inside = (place[pairs] >= 0).all(axis=1)
        g, gsg = np.zeros(len(pairs)), np.zeros(len(pairs))
        A = csc_array(self.stiffness[self.free][:, self.free])
        g[inside], gsg[inside] = inverse_entries(A, self.vertices[self.free], s[self.free], place[pairs[inside]])
        g.flags.writeable = gsg.flags.writeable = False
        return g, gsg

    @cached_property
    def _diagonals(self) -> tuple[Float[np.ndarray, " v"], Float[np.ndarray, " v"]]:
        v = np.arange(len(self.vertices))
        return self.entries(np.ones(len(v)), np.stack([v, v], axis=1))

    @property
    def gamma(self) -> Float[np.ndarray, " v"]:
        """The diagonal of the compliance G, (v)."""
        return self._diagonals[0]

    @property
    def nu(self) -> Float[np.ndarray, " v"]:
        """The diagonal of G^2, (v)."""
        return self._diagonals[1]

    def bordered(self, markers: Int[np.ndarray, " m"]) -> tuple[Float[np.ndarray, "v _"], Float[np.ndarray, "_ _"]]:
        """[K C] and B, with the constants of the floating pieces that have a marker.

        Raises:
            InfeasibleError: a marker is fixed or doubled.
        """
        if self.fixed[markers].any() or len(set(markers.tolist())) < len(markers):
            raise InfeasibleError("a marker stands on a fixed vertex or on another marker: choose free vertices")
        C = self.constants[:, np.setdiff1d(self.piece[markers], -1)]
        KC = np.hstack([self.columns(markers), C])
        return KC, self.inverted(markers, KC)

    def inverted(self, markers: Int[np.ndarray, " m"], KC: Float[np.ndarray, "v _"]) -> Float[np.ndarray, "_ _"]:
        """The inverse B of [K C] at the markers."""
        K_H, C_H = np.split(KC[markers], [len(markers)], axis=1)
        return np.linalg.inv(np.block([[K_H, C_H], [C_H.T, np.zeros((C_H.shape[1], C_H.shape[1]))]]))

    def weights(self, markers: Int[np.ndarray, " m"]) -> Float[np.ndarray, "v m"]:
        """W.

        Raises:
            InfeasibleError: a floating piece has no marker, or a marker is fixed or doubled.
        """
        lone = np.setdiff1d(self.piece, [-1, *self.piece[markers]])
        if len(lone):
            size = int((self.piece == lone[0]).sum())
            raise InfeasibleError(f"a loose piece of {size} vertices has no marker: fix it, leave it out or add one")
        KC, B = self.bordered(markers)
        return KC @ B[:, : len(markers)]


_held: "WeakValueDictionary[str, Shell]" = WeakValueDictionary()


def held_shell(
    vertices: Float[np.ndarray, "v 3"], triangles: Int[np.ndarray, "f 3"], fixed: Bool[np.ndarray, " v"]
) -> Shell:
    """The shell of these; while somebody holds it the very same, with everything that it has found out already."""
    name = digest([vertices, triangles, fixed])
    known = _held.get(name)
    if known is None:
        known = _held[name] = Shell(vertices, triangles, fixed)
    return known
