"""How exactly cameras measure a point: what each of its pixels tells, added up.

Data       J_c (2 3)  how the pixel of a point in camera c moves with the point, pixels a millimetre, lens included
           s_c        standard deviation of a dot's middle in its picture, pixels, in each direction
           r_c        share of the expressions in which camera c reads the dot, 0 to 1
           b_c        how many times its own smaller diameter the dot is blurred
Told       L = sum_c r_c J_c' J_c / (s_c² (1 + b_c²))   (3 3), per square millimetre: the information about the place
Covariance L^-1 where two cameras read the dot: that of triangulation by least squares on the pixels
One camera L has rank 2: the place across the line of sight is told, the depth along it is not
"""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from capture_plan.camera.camera import Camera

UNKNOWN = 1e-9  # of the largest eigenvalue of L: a direction in which a point is told less is not told


def told(
    cameras: Sequence[Camera],
    points: Float[np.ndarray, "p 3"],
    share: Float[np.ndarray, "c p"],
    blur: Float[np.ndarray, "c p"] | float = 0.0,
) -> Float[np.ndarray, "p 3 3"]:
    """L of points (millimetres) that each camera reads in a share of the expressions; 0 where none does."""
    L = np.zeros((len(points), 3, 3))
    weight = share / (1 + np.square(blur))
    for camera, counts in zip(cameras, weight, strict=True):
        at = np.flatnonzero(counts)
        J = np.nan_to_num(camera.jacobian(points[at]))  # NaN where the lens model ends
        L[at] += (counts[at] / camera.noise_px**2)[:, None, None] * (J.transpose(0, 2, 1) @ J)
    return L


def root(L: Float[np.ndarray, "p 3 3"]) -> Float[np.ndarray, "p 3 3"]:
    """R with R'R = L."""
    values, vectors = np.linalg.eigh(L)
    return np.sqrt(np.maximum(values, 0))[:, :, None] * vectors.transpose(0, 2, 1)


def deviations(L: Float[np.ndarray, "p 3 3"]) -> Float[np.ndarray, "p 3"]:
    """Standard deviation (mm) of a measured point along its three principal axes, the most exact first; infinite where
    it is not told."""
    values = np.linalg.eigvalsh(L)[:, ::-1]
    known = values > UNKNOWN * np.maximum(values[:, :1], np.finfo(float).tiny)
    return np.where(known, 1 / np.sqrt(np.where(known, values, 1)), np.inf)
