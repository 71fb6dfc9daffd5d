"""The motion of the head taken out of a take.

Data      X[t, v]   frames as recorded;  v0 the neutral;  m[v] how far a vertex moves over the head, millimetres
Still     a[v] = 1 / (1 + (m[v] / s)^2)^2, s = max(STILL_MM, lower quartile of m): 1 on the scalp, 0 on the lips
Fit       R, u = argmin sum_v w[v] |R X[t, v] + u - v0[v]|^2                              (Kabsch 1976)
          w[v] = a[v] / (1 + (r[v] / g)^2)^2, r[v] the distance left, g = max(STILL_MM, mean r): anew, ROUNDS times
Nothing is chosen by a threshold: a rigid motion added to any frame moves R and u smoothly, and cancels in R X + u.
Without a rig, m comes from some frames of the take, fitted with all vertices first and then with the still ones.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from capture_plan.curves.frames import Frames, evenly
from capture_plan.errors import RigError
from capture_plan.mesh import rigid_fit

STILL_MM = 0.5  # skin over bone moves that little when a face speaks
QUARTILE = 0.25  # at least so many vertices count as nearly still
ROUNDS = 4
FITTED = 4000  # vertices that place a frame, evenly over their numbers: ten times as fast on 26,719, 3 micrometres off
SAMPLE = 40  # frames that tell which vertices are still


@dataclass(frozen=True, eq=False)
class HeldFrames:
    """`frames`, in a unit of `unit_mm`, moved rigidly onto `neutral` by the vertices that `still` weighs."""

    frames: Frames
    neutral: Float[np.ndarray, "v 3"]
    still: Float[np.ndarray, " v"]
    unit_mm: float = 1.0

    def __len__(self) -> int:
        return len(self.frames)

    def block(self, start: int, stop: int) -> Float[np.ndarray, "t v 3"]:
        """Frames `start` to `stop` - 1, the head held still."""
        return np.stack([hold(x * self.unit_mm, self.neutral, self.still) for x in self.frames.block(start, stop)])


def hold(
    x: Float[np.ndarray, "v 3"], neutral: Float[np.ndarray, "v 3"], still: Float[np.ndarray, " v"]
) -> Float[np.ndarray, "v 3"]:
    """One frame, moved rigidly onto the neutral."""
    some = list(evenly(len(x), FITTED))
    if not still[some].any():
        some = list(range(len(x)))
    p, v0, a = x[some], neutral[some], still[some]
    w = a
    for _ in range(ROUNDS):
        R, u = rigid_fit(p, v0, w)
        r = np.linalg.norm(p @ R.T + u - v0, axis=1)
        w = a / (1 + (r / max(STILL_MM, float(a @ r / a.sum()))) ** 2) ** 2
    R, u = rigid_fit(p, v0, w)
    return x @ R.T + u


def stillness(m: Float[np.ndarray, " v"]) -> Float[np.ndarray, " v"]:
    """Weights a[v] from motions m[v], millimetres."""
    s = max(STILL_MM, float(np.quantile(m, QUARTILE)))
    return 1 / (1 + (m / s) ** 2) ** 2


def still_vertices(frames: Frames, neutral: Float[np.ndarray, "v 3"], unit_mm: float = 1.0) -> Float[np.ndarray, " v"]:
    """Weights a[v] from some frames of a take without a rig; `neutral` in millimetres."""
    if len(neutral) < 3:
        raise RigError(f"a mesh of {len(neutral)} vertices cannot be held still: give at least three")
    sample = [frames.block(t, t + 1)[0] * unit_mm for t in evenly(len(frames), SAMPLE)]
    a = np.ones(len(neutral))
    for _ in range(ROUNDS):
        held = np.stack([hold(x, neutral, a) for x in sample])
        a = stillness(np.sqrt(((held - neutral) ** 2).sum(axis=2).mean(axis=0)))
    return a
