"""In which order the markers of a layout can be spared.

Data      of each subject E, B, Y_H, P = W'S R (m r), Q = W'S W (m m), over all of its motion
Drop j    c = B_j / B_jj, rho = c Y_H, a = P_j:  E + 2 a.rho + Q_jj |rho|^2
          P' = P - c a' + (Q_j - c Q_jj) rho',  Q' = Q - c Q_j' - Q_j c' + c c' Q_jj,  B' = B - B_j B_j' / B_jj
Method    the marker whose loss costs least goes, again and again; no vertex of the shell is touched
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from capture_plan.shell.model import Shell
from capture_plan.shell.motion import Motion


@dataclass(frozen=True, eq=False)
class Summary:
    """What dropping needs of one subject; `piece` is the floating piece of each marker, -1 where something is fixed."""

    E: float
    B: Float[np.ndarray, "_ _"]
    Y: Float[np.ndarray, "m r"]
    P: Float[np.ndarray, "m r"]
    Q: Float[np.ndarray, "m m"]
    piece: Int[np.ndarray, " m"]

    def costs(self) -> Float[np.ndarray, " m"]:
        """E without each marker; infinite for the last of a floating piece."""
        m, alone = len(self.Y), (self.piece[:, None] == self.piece).sum(axis=1) == 1
        last = alone & (self.piece >= 0)
        rho = (self.B[:m, :m] / np.where(last, 1, np.diag(self.B)[:m])[:, None]) @ self.Y
        E = self.E + 2 * (self.P * rho).sum(axis=1) + np.diag(self.Q) * np.square(rho).sum(axis=1)
        return np.where(last, np.inf, E)

    def without(self, j: int) -> "Summary":
        """Marker number j dropped, which is not the last of a floating piece."""
        m, keep = len(self.Y), np.arange(len(self.Y)) != j
        b, q, Q_j, Q_jj = self.B[j], self.B[j, j], self.Q[j], self.Q[j, j]
        c, a = b[:m] / q, self.P[j]
        rho = c @ self.Y
        E = float(self.E + 2 * a @ rho + Q_jj * (rho @ rho))
        P = self.P - np.outer(c, a) + np.outer(Q_j - c * Q_jj, rho)
        Q = self.Q - np.outer(c, Q_j) - np.outer(Q_j, c) + np.outer(c, c) * Q_jj
        B = np.delete(np.delete(self.B - np.outer(b, b) / q, j, 0), j, 1)
        return Summary(E, B, self.Y[keep], P[keep], Q[np.ix_(keep, keep)], self.piece[keep])


def summary_of(shell: Shell, motion: Motion, markers: Int[np.ndarray, " m"]) -> Summary:
    """E, B, P and Q of a layout.

    Raises:
        InfeasibleError: a floating piece has no marker, or a marker is fixed or doubled.
    """
    W, Y_H = shell.weights(markers), motion.rows[markers]
    E, P, Q = 0.0, np.zeros(Y_H.shape), np.zeros((len(markers),) * 2)
    for some in motion.blocks():
        R, SW = motion.rows[some] - W[some] @ Y_H, motion.weights[some, None] * W[some]
        E += float(np.einsum("vr,vr,v->", R, R, motion.weights[some]))
        P += SW.T @ R
        Q += SW.T @ W[some]
    return Summary(E, shell.bordered(markers)[1], Y_H, P, Q, shell.piece[markers])


def order_of(
    parts: Sequence[Summary], pinned: Bool[np.ndarray, " m"]
) -> tuple[Int[np.ndarray, " m"], Float[np.ndarray, " m"]]:
    """Places of the markers, the first to be spared last and pinned ones first; E of each prefix, infinite for none."""
    left = np.arange(len(pinned))
    order, errors = [], [sum(part.E for part in parts)]
    while len(left) > 1:
        may = ~pinned[left] if not pinned[left].all() else np.ones(len(left), dtype=bool)
        costs = np.where(may, np.sum([part.costs() for part in parts], axis=0), np.inf)
        j = int(costs.argmin())
        if not np.isfinite(costs[j]):
            break
        parts = [part.without(j) for part in parts]
        order.append(left[j])
        errors.append(float(costs[j]))
        left = np.delete(left, j)
    lost = [np.inf] * (len(left) - 1)
    return np.concatenate([left, np.array(order[::-1], dtype=int)]), np.array([*lost, *errors[::-1]])
