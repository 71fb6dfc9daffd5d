"""Deformation transfer: the blendshapes of one face on another of the same mesh (Sumner & Popovic 2004).

Data       S[k, t] (3 3)  deformation gradient of source triangle t under blendshape k: [e1' e2' n'] [e1 e2 n]^-1 with
                          edges e and n = e1 x e2 / sqrt |e1 x e2|
           R, s           the rotation and scale that lay the source's neutral onto the target's
Variables  x[k] (v 3)     delta of blendshape k on the target, millimetres
Model      min sum_t a_t |(I + grad x) - R S R'|^2 over the plane of each target triangle

The fourth vertex of a triangle, which gives its gradient a normal, is free of all others: the optimal one makes the
normal's column right, so that only the columns in the plane remain, and the model is the Poisson problem of
`surface.py` (Botsch et al. 2006). Without R a turned head would be moved along the source's axes.
Held vertices, which no blendshape of the source moves, and the means of loose pieces move by s R d.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from capture_plan.errors import RigError
from capture_plan.mesh import similarity_fit
from capture_plan.mesh.geometry import triangle_cross
from capture_plan.progress import track
from capture_plan.transfer.surface import LEAST_AREA, Surface

STILL_MM = 1e-3  # below what any file format keeps


def deformation_transfer(
    neutral: Float[np.ndarray, "v 3"],
    triangles: Int[np.ndarray, "f 3"],
    deltas: Float[np.ndarray, "k v 3"],
    target: Float[np.ndarray, "n 3"],
) -> Float[np.ndarray, "k v 3"]:
    """The deltas on `target`, another neutral of the same mesh, millimetres.

    Raises:
        RigError: the target has another number of vertices.
    """
    return transfer_onto(target_surface(neutral, triangles, deltas, target), neutral, deltas)


def target_surface(
    neutral: Float[np.ndarray, "v 3"],
    triangles: Int[np.ndarray, "f 3"],
    deltas: Float[np.ndarray, "k v 3"],
    target: Float[np.ndarray, "n 3"],
) -> Surface:
    """The target's surface, held where no blendshape of the source moves it."""
    if target.shape != neutral.shape:
        raise RigError(
            f"the target neutral has {len(target):,} vertices, the rig has {len(neutral):,}: "
            "bring the target onto the rig's mesh first"
        )
    return Surface(target, triangles, np.linalg.norm(deltas, axis=2).max(axis=0) <= STILL_MM)


def transfer_onto(
    surface: Surface, neutral: Float[np.ndarray, "v 3"], deltas: Float[np.ndarray, "k v 3"]
) -> Float[np.ndarray, "k v 3"]:
    """The deltas carried onto a surface that is factorised already."""
    sR, _ = similarity_fit(neutral, surface.neutral)
    R = sR / np.cbrt(np.linalg.det(sR))
    source = SourceFrames.of(neutral, surface.triangles)
    tangents = np.einsum("yx,fya->fxa", R, surface.tangents)  # R' T
    x = np.empty(deltas.shape)
    for k, d in enumerate(track(deltas, "Transferring blendshapes")):
        moved = d.astype(float)
        g = (R @ source.gradients(neutral + moved) @ tangents).swapaxes(1, 2)
        mapped = moved @ sR.T
        x[k] = surface.integrate(g.reshape(len(g), 6), mapped, surface.loose_means(mapped))
    return x


@dataclass(frozen=True, eq=False)
class SourceFrames:
    """[e1 e2 n]^-1 of every triangle of the source's neutral; 0 where a triangle is a line, which tells nothing."""

    triangles: Int[np.ndarray, "f 3"]
    inverse: Float[np.ndarray, "f 3 3"]
    solid: Bool[np.ndarray, " f"]

    @staticmethod
    def of(neutral: Float[np.ndarray, "v 3"], triangles: Int[np.ndarray, "f 3"]) -> "SourceFrames":
        """The frames of a neutral."""
        area = np.linalg.norm(triangle_cross(neutral, triangles), axis=1)
        solid = area > LEAST_AREA * area.mean()
        inverse = np.zeros((len(triangles), 3, 3))
        inverse[solid] = np.linalg.inv(frames(neutral, triangles)[solid])
        return SourceFrames(triangles, inverse, solid)

    def gradients(self, posed: Float[np.ndarray, "v 3"]) -> Float[np.ndarray, "f 3 3"]:
        """The deformation gradients less the identity, S - I, of every triangle."""
        S = frames(posed, self.triangles) @ self.inverse
        return S - np.where(self.solid[:, None, None], np.eye(3), 0)


def frames(vertices: Float[np.ndarray, "v 3"], triangles: Int[np.ndarray, "f 3"]) -> Float[np.ndarray, "f 3 3"]:
    """The columns e1, e2, n of every triangle, millimetres."""
    a, b, c = (vertices[triangles[:, corner]] for corner in range(3))
    n = np.cross(b - a, c - a)
    length = np.linalg.norm(n, axis=1, keepdims=True)
    return np.stack([b - a, c - a, n / np.sqrt(np.where(length > 0, length, 1))], axis=2)
