"""How well a site suits a blendshape (Zell & McDonnell 2022, eq. 1): 0 best, 2 worst."""

import numpy as np
from jaxtyping import Bool, Float


def importance_weights(
    relative: Float[np.ndarray, "k s"], visibility: Float[np.ndarray, " s"], alpha: float
) -> Float[np.ndarray, "k s"]:
    """w[k, s] = 2 - (1 - alpha) r[k, s] - alpha l[s]; with 1 in place of 2 a perfect site would be free."""
    return 2 - alpha * visibility - (1 - alpha) * relative


def total_quality(covers: Bool[np.ndarray, "k s"], w: Float[np.ndarray, "k s"]) -> Float[np.ndarray, " s"]:
    """sum_k c w: the cost of a site in eq. 5a. It pays once for each blendshape, so sharing gains nothing."""
    return np.where(covers, w, 0).sum(axis=0)


def mean_quality(covers: Bool[np.ndarray, "k s"], w: Float[np.ndarray, "k s"]) -> Float[np.ndarray, " s"]:
    """Mean of w over the blendshapes that a site covers; 2 where it covers none."""
    count = covers.sum(axis=0)
    return np.where(count > 0, total_quality(covers, w) / np.maximum(count, 1), 2.0)
