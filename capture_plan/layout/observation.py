"""What landmarks tell about the blendshape weights, beside how many they are.

A landmark at vertex n answers the weights w (k) with D_n w, D_n = (3 k) being its deltas; all landmarks together with
B w (3m rows). Measured with noise of standard deviation sigma per coordinate, and weights that vary with standard
deviation tau before anything is measured, the weights are known up to the covariance

    C = (B^T B / sigma^2 + I / tau^2)^-1,

and the skin up to a root mean square error of sqrt(trace(G C)), where G = mean_n D_n^T D_n over the moving skin.
Cameras that are known tell a place with the information L_n = R_n^T R_n instead (`camera.precision`): a landmark counts
with the rows sigma R_n D_n, whose noise has the deviation sigma again, and everything else stays as it is. One camera
has no row for the depth.
This is for weights of any size and sign, as search, budgets and bounds need it: an upper estimate of what a solve
between 0 and 1 gives of sparse performances, which `predict` simulates.
Coverage is not identifiability: 10 landmarks have 30 coordinates and cannot tell 55 blendshapes apart.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float, Int

from capture_plan.layout.record import Information

PRIOR_SD = 0.2  # 3 to 8 of 55 weights active and uniform in 0..1, as in recorded mixes: root mean square 0.18
RANK_TOLERANCE = 1e-4  # a mix that answers 10,000 times weaker than the strongest cannot be told from rounding


@dataclass(frozen=True, eq=False)
class Observation:
    """The face as a measuring problem: deltas of the planned blendshapes (mm), the skin that moves, the noise (mm).

    `root`: R of every vertex, per millimetre, where cameras are known.
    """

    deltas: Float[np.ndarray, "k v 3"]
    skin: Bool[np.ndarray, " v"]
    noise_mm: float
    root: Float[np.ndarray, "v 3 3"] | None = None

    @cached_property
    def measured(self) -> Float[np.ndarray, "k v 3"]:
        """The deltas as they are measured, in units in which every coordinate has the noise: sigma R_n d."""
        if self.root is None:
            return self.deltas
        return np.einsum("vij,kvj->kvi", (self.noise_mm * self.root).astype(np.float32), self.deltas)

    def as_measured(self, vertices: Int[np.ndarray, " m"], moved: Float[np.ndarray, "m 3 j"]) -> np.ndarray:
        """Movements of vertices, millimetres, in the units of `measured`. (m 3 j)"""
        return moved if self.root is None else self.noise_mm * self.root[vertices] @ moved

    @cached_property
    def gram(self) -> Float[np.ndarray, "k k"]:
        """G, square millimetres per unit weight squared."""
        rows = self.deltas[:, self.skin].astype(np.float64).reshape(len(self.deltas), -1)
        return rows @ rows.T / self.skin.sum()

    @cached_property
    def full_rank(self) -> int:
        """Blendshape mixes that the whole skin distinguishes."""
        return numerical_rank(np.sqrt(np.clip(np.linalg.eigvalsh(self.gram)[::-1], 0, None)))

    def response(self, vertices: Int[np.ndarray, " m"]) -> Float[np.ndarray, "r k"]:
        """B: three rows a landmark."""
        return self.measured[:, vertices].astype(np.float64).reshape(len(self.deltas), -1).T

    def covariance(self, vertices: Int[np.ndarray, " m"]) -> Float[np.ndarray, "k k"]:
        """C for landmarks at `vertices`."""
        B = self.response(vertices)
        return np.linalg.inv(B.T @ B / self.noise_mm**2 + np.eye(B.shape[1]) / PRIOR_SD**2)

    def error(self, covariance: Float[np.ndarray, "k k"]) -> float:
        """The upper estimate sqrt(trace(G C)), millimetres."""
        return float(np.sqrt(np.sum(self.gram * covariance)))

    def information(self, vertices: Int[np.ndarray, " m"]) -> Information:
        """Number, rank, condition and upper estimate of the error of landmarks at `vertices`."""
        sigma = np.linalg.svd(self.response(vertices), compute_uv=False)
        rank = numerical_rank(sigma)
        return Information(
            landmarks=len(vertices),
            rank=rank,
            full_rank=self.full_rank,
            condition=round(float(sigma[0] / sigma[rank - 1]), 1),
            noise_mm=self.noise_mm,
            error_mm=round(self.error(self.covariance(vertices)), 4),
            by_cameras=self.root is not None,
        )


def error_against_budget(observation: Observation, vertices: Int[np.ndarray, " m"]) -> Float[np.ndarray, " m"]:
    """Upper estimate of the error (mm) with the first 1, 2, ... of landmarks at `vertices`; it never grows."""
    return np.array(
        [observation.error(observation.covariance(vertices[:m])) for m in range(1, len(vertices) + 1)], dtype=float
    )


def numerical_rank(sigma: Float[np.ndarray, " n"]) -> int:
    """Singular values (largest first) above `RANK_TOLERANCE` of the first; at least 1."""
    return max(1, int((sigma > RANK_TOLERANCE * sigma[0]).sum()))
