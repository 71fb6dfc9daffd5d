"""What is known of a target before its scans: deformation transfer, and how far a person may differ from it.

Data       P[k, t]   gradient of blendshape k in cell t by deformation transfer: a triangle's (3 2) as 6 numbers
           d[k, t]   mean displacement of the triangle's corners, millimetres
Freedom    u[k, t] = |P|^2 + |d|^2 / EXTENT^2 + STIR^2     variance of the gradient, without unit

What changes a movement d by a smooth share g of it has gradient g P + d grad g: that is the variance of a habit. Li et
al. (2010) weigh by |P| alone and less steeply: a cheek that is carried along without being stretched then counts as
still, and its correction goes to whatever else is in the scan.
A loose piece is a cell of its own, with its mean displacement against its size as 3 numbers.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float, Int

from capture_plan.transfer.deformation import STILL_MM, target_surface, transfer_onto
from capture_plan.transfer.surface import Surface

EXTENT_MM = 20.0  # over which a habit changes: 10 and 40 give the same rig within 1 %
STIR = 0.01  # strain that is allowed where nothing moves


@dataclass(frozen=True, eq=False)
class Prior:
    """What deformation transfer knows of the target: its surface and `deltas` (mm); `still` as in the source."""

    surface: Surface
    deltas: Float[np.ndarray, "k v 3"]
    still: Bool[np.ndarray, "k v"]

    @cached_property
    def cells(self) -> Float[np.ndarray, "k n"]:
        """P: the numbers of all cells in a row."""
        return cells(self.surface, self.deltas)

    @cached_property
    def hard_surfaces(self) -> tuple[Surface, ...]:
        """The target's surface held where each blendshape of the source leaves it still."""
        s = self.surface
        return tuple(Surface(s.neutral, s.triangles, s.held | still) for still in self.still)

    def freedom(self, *, hard: bool) -> Float[np.ndarray, "k t"]:
        """u[k, t]; with `hard` 0 in cells of which no vertex moves."""
        u = per_cell(self.surface, np.square(self.cells)) + STIR**2
        f = len(self.surface.triangles)
        d = np.linalg.norm(self.deltas, axis=2)[:, self.surface.triangles].mean(axis=2)
        u[:, :f] += np.square(d / EXTENT_MM)
        if hard:
            moves = ~self.still
            loose = self.surface.loose_means(moves.T.astype(float)).T > 0
            u *= np.concatenate([moves[:, self.surface.triangles].any(axis=2), loose], axis=1)
        return u


def transfer_prior(
    neutral: Float[np.ndarray, "v 3"],
    triangles: Int[np.ndarray, "f 3"],
    deltas: Float[np.ndarray, "k v 3"],
    target: Float[np.ndarray, "n 3"],
) -> Prior:
    """Deformation transfer onto `target`, ready to be corrected by scans."""
    surface = target_surface(neutral, triangles, deltas, target)
    still = np.linalg.norm(deltas, axis=2) <= STILL_MM
    return Prior(surface, transfer_onto(surface, neutral, deltas), still)


def cells(surface: Surface, x: Float[np.ndarray, "k v 3"]) -> Float[np.ndarray, "k n"]:
    """Gradients on all triangles and mean displacements of loose pieces against their size, in a row."""
    means = np.stack([surface.loose_means(one) for one in x]) / surface.sizes[:, None]
    return np.concatenate([surface.gradient(x).reshape(len(x), -1), means.reshape(len(x), -1)], axis=1)


def per_cell(surface: Surface, x: Float[np.ndarray, "k n"]) -> Float[np.ndarray, "k t"]:
    """Sums over the numbers of each cell."""
    return np.add.reduceat(x, np.cumsum(surface.cell_sizes) - surface.cell_sizes, axis=1)
