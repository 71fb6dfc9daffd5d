"""In which order the markers of a layout can be spared.

Data      of each subject E, B, Y_H, P = W'S R (m r), Q = W'S W (m m)
Drop j    c = B_j / B_jj, rho = c Y_H, a = P_j:  E + 2 a.rho + Q_jj |rho|^2
          P' = P - c a' + (Q_j - c Q_jj) rho',  Q' = Q - c Q_j' - Q_j c' + c c' Q_jj,  B' = B - B_j B_j' / B_jj
Method    the marker whose loss costs least goes, again and again; no vertex of the shell is touched
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from capture_plan.layout.shell.model import Shell
from capture_plan.layout.shell.motion import Motion
from capture_plan.layout.shell.state import State


@dataclass(frozen=True, eq=False)
class Summary:
    """What dropping needs of one subject; `piece` is the floating piece of each marker, -1 where something is fixed."""

    E: float
    B: Float[np.ndarray, "_ _"]
    Y: Float[np.ndarray, "m r"]
    P: Float[np.ndarray, "m r"]
    Q: Float[np.ndarray, "m m"]
    piece: Int[np.ndarray, " m"]

    def without(self, j: int) -> "Summary":
        """Marker number j dropped; its error is infinite for the last of a floating piece."""
        m, keep = len(self.Y), np.arange(len(self.Y)) != j
        if self.piece[j] >= 0 and (self.piece == self.piece[j]).sum() == 1:
            return Summary(np.inf, self.B, self.Y, self.P, self.Q, self.piece)
        b, q, Q_j, Q_jj = self.B[j], self.B[j, j], self.Q[j], self.Q[j, j]
        c, a = b[:m] / q, self.P[j]
        rho = c @ self.Y
        E = float(self.E + 2 * a @ rho + Q_jj * (rho @ rho))
        P = self.P - np.outer(c, a) + np.outer(Q_j - c * Q_jj, rho)
        Q = self.Q - np.outer(c, Q_j) - np.outer(Q_j, c) + np.outer(c, c) * Q_jj
        B = np.delete(np.delete(self.B - np.outer(b, b) / q, j, 0), j, 1)
        return Summary(E, B, self.Y[keep], P[keep], Q[np.ix_(keep, keep)], self.piece[keep])


def summary(state: State) -> Summary:
    """P and Q of a state."""
    SW = state.s[:, None] * state.W
    H = state.markers
    return Summary(state.error, state.B, state.motion.rows[H], SW.T @ state.R, SW.T @ state.W, state.shell.piece[H])


def summary_of(shell: Shell, motion: Motion, markers: Int[np.ndarray, " m"]) -> Summary:
    """The same of markers that no search placed.

    Raises:
        InfeasibleError: a floating piece has no marker, or a marker is fixed or doubled.
    """
    W, Y = shell.weights(markers), motion.rows[markers]
    R, SW = motion.rows - W @ Y, motion.weights[:, None] * W
    E = float(motion.weights @ np.square(R).sum(axis=1))
    return Summary(E, shell.bordered(markers)[1], Y, SW.T @ R, SW.T @ W, shell.piece[markers])


def spare_order(
    states: list[State], pinned: Bool[np.ndarray, " m"]
) -> tuple[Int[np.ndarray, " m"], Float[np.ndarray, " m"]]:
    """`order_of` the states of several subjects."""
    return order_of([summary(state) for state in states], pinned)


def order_of(
    parts: list[Summary], pinned: Bool[np.ndarray, " m"]
) -> tuple[Int[np.ndarray, " m"], Float[np.ndarray, " m"]]:
    """Places of the markers, the first to be spared last and pinned ones first; E of each prefix, infinite for none."""
    left = np.arange(len(pinned))
    order, errors = [], [sum(part.E for part in parts)]
    while len(left) > 1:
        tries = [[part.without(j) for part in parts] for j in range(len(left))]
        costs = np.array([sum(part.E for part in one) for one in tries])
        may = ~pinned[left] if not pinned[left].all() else np.ones(len(left), dtype=bool)
        j = int(np.where(may, costs, np.inf).argmin()) if np.isfinite(costs[may]).any() else int(may.argmax())
        if not np.isfinite(costs[j]):
            break
        parts = tries[j]
        order.append(left[j])
        errors.append(float(costs[j]))
        left = np.delete(left, j)
    lost = [np.inf] * (len(left) - 1)
    return np.concatenate([left, np.array(order[::-1], dtype=int)]), np.array([*lost, *errors[::-1]])
