"""Procrustes fits: the motion that lays one set of points onto another of the same order.

Data       x_v, y_v in R^3, weights w_v, none of them below 0
Variables  R a rotation, never a mirror image; s a scale; u a translation
Model      min sum_v w_v |s R x_v + u - y_v|^2        s = 1: Kabsch 1976;  s free: Umeyama 1991
Answer     sum_v w_v (y_v - b) (x_v - a)^T = U diag(sigma) V^T, a and b the weighted means, e = (1, 1, det U V^T)
           R = U diag(e) V^T,   s = sigma . e / sum_v w_v |x_v - a|^2,   u = b - s R a
"""

import numpy as np
from jaxtyping import Float


def rigid_fit(
    x: Float[np.ndarray, "v 3"], y: Float[np.ndarray, "v 3"], w: Float[np.ndarray, " v"] | None = None
) -> tuple[Float[np.ndarray, "3 3"], Float[np.ndarray, " 3"]]:
    """Rotation R and translation u that lay x onto y; all weigh the same without `w`."""
    R, _, a, b = _fit(x, y, w)
    return R, b - R @ a


def similarity_fit(
    x: Float[np.ndarray, "v 3"], y: Float[np.ndarray, "v 3"], w: Float[np.ndarray, " v"] | None = None
) -> tuple[Float[np.ndarray, "3 3"], Float[np.ndarray, " 3"]]:
    """Scaled rotation s R and translation u that lay x onto y; all weigh the same without `w`."""
    R, s, a, b = _fit(x, y, w)
    return s * R, b - s * R @ a


def _fit(
    x: Float[np.ndarray, "v 3"], y: Float[np.ndarray, "v 3"], w: Float[np.ndarray, " v"] | None
) -> tuple[Float[np.ndarray, "3 3"], float, Float[np.ndarray, " 3"], Float[np.ndarray, " 3"]]:
    share = np.full(len(x), 1 / len(x)) if w is None else w / w.sum()
    a, b = share @ x, share @ y
    U, sigma, Vt = np.linalg.svd(((y - b) * share[:, None]).T @ (x - a))
    e = np.array([1, 1, np.sign(np.linalg.det(U @ Vt))])
    s = float(sigma @ e) / max(float(share @ np.square(x - a).sum(axis=1)), np.finfo(float).tiny)
    return (U * e) @ Vt, s, a, b
