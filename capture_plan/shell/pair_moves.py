"""What two markers at once would make of a layout: the closed form of two rows.

Data      E the error before; of vertices u and v: e = |R|^2 and R_u . R_v; R . Z; entries of G_H and of N = G_H S G_H
Gamma     [[G_uu, G_uv], [G_uv, G_vv]]
Score     E - 2 tr(Gamma^-1 R_uv Z_uv') + <Gamma^-1 R_uv R_uv' Gamma^-1, N_uv>
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

PARALLEL = 1e-10  # share of G_uu G_vv: two vertices that move as one have no two trajectories


@dataclass(frozen=True, eq=False)
class Two:
    """The entries uu, uv and vv of a symmetric matrix of each pair; any shape."""

    uu: Float[np.ndarray, "..."]
    uv: Float[np.ndarray, "..."]
    vv: Float[np.ndarray, "..."]


def two_marker_scores(E: float, G: Two, N: Two, RR: Two, RZ: Two) -> Float[np.ndarray, "..."]:
    """Error with both markers added; infinite where they cannot stand together. `RZ.uv` is R_u . Z_v + R_v . Z_u."""
    det = G.uu * G.vv - G.uv**2
    safe = (det > PARALLEL * G.uu * G.vv) & (G.uu > 0) & (G.vv > 0)
    det = np.where(safe, det, 1)
    # a = Gamma^-1 [1 0]', b = Gamma^-1 [0 1]'
    uu, uv, vv = G.vv / det, -G.uv / det, G.uu / det
    gained = uu * RZ.uu + uv * RZ.uv + vv * RZ.vv
    # Gamma^-1 RR' Gamma^-1
    A_uu = uu**2 * RR.uu + 2 * uu * uv * RR.uv + uv**2 * RR.vv
    A_uv = uu * uv * RR.uu + (uu * vv + uv**2) * RR.uv + uv * vv * RR.vv
    A_vv = uv**2 * RR.uu + 2 * uv * vv * RR.uv + vv**2 * RR.vv
    return np.where(safe, E - 2 * gained + A_uu * N.uu + 2 * A_uv * N.uv + A_vv * N.vv, np.inf)
