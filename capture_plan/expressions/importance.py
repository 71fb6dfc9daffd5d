"""How much a scan of each blendshape is worth (Carrigan et al. 2020, section 4.3, eq. 4-8).

Letters  b[k, v]  active sets      d[k, v]  deltas, millimetres
lambda_k = alpha Dis_k + (1 - alpha) TD_k + beta U_k                                                     (eq. 4)
Dis_k    mean of |d[k, v]| over the active vertices / the largest such mean: strong movements differ most (eq. 5)
TD_k     sum of s_t over the triangles with an active corner / the largest such sum                     (eq. 7)
s_t      sum over the three edges of max(a / b, b / a) - 1, a and b its lengths in the rig and the target (eq. 6)
U_k      1 - mean_r max(cos(d_k, d_r), 0) / the largest such mean, over the packed blendshapes r         (eq. 8)
Three things differ from the print, each on purpose: s_t is 0 for equal triangles, it uses all three edges, so that the
order of corners is of no matter, and the target is first scaled to the rig (equal root mean square edge length).
`DistortionForm` gives the print back (two edges, nothing subtracted, no scaling), and a mean in place of the sum of eq.
7. Of several targets, as where the actor is not yet known, the largest TD_k or their mean counts.
"""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float, Int

from capture_plan.expressions.settings import DistortionForm
from capture_plan.mesh import edges

ROUNDING = 1e-3  # edges of 0.5 mm from coordinates in single precision; a target like the rig distorts nothing
LEAST = 1e-3  # no blendshape is worth nothing: each is packed in the end


def displacement_strength(
    displacement: Float[np.ndarray, "k v"], active: Bool[np.ndarray, "k v"]
) -> Float[np.ndarray, " k"]:
    """Dis_k, 0 to 1; `displacement` in any unit."""
    mean = (displacement * active).sum(axis=1, dtype=float) / np.maximum(active.sum(axis=1), 1)
    return mean / (mean.max() or 1)


def triangle_distortion(
    neutral: Float[np.ndarray, "v 3"],
    targets: Sequence[Float[np.ndarray, "v 3"]],
    triangles: Int[np.ndarray, "f 3"],
    active: Bool[np.ndarray, "k v"],
    form: DistortionForm,
) -> Float[np.ndarray, " k"]:
    """TD_k, 0 to 1: how differently the triangles that blendshape k moves are built in the targets' neutral faces."""
    moved = active[:, triangles].any(axis=2)
    each = []
    for target in targets:
        total = moved @ triangle_stretch(neutral, target, triangles, form)
        if form.reduce == "mean":
            total = total / np.maximum(moved.sum(axis=1), 1)
        each.append(total / (total.max() or 1))
    return np.max(each, axis=0) if form.targets == "max" else np.mean(each, axis=0)


def triangle_stretch(
    neutral: Float[np.ndarray, "v 3"],
    target: Float[np.ndarray, "v 3"],
    triangles: Int[np.ndarray, "f 3"],
    form: DistortionForm,
) -> Float[np.ndarray, " f"]:
    """s_t, at least 0 (of two edges: at least 2); 0 for a triangle with an edge of no length."""
    pairs = edges(triangles)

    def lengths(vertices: Float[np.ndarray, "v 3"]) -> Float[np.ndarray, "f 3"]:
        scale = np.sqrt(((vertices[pairs[:, 0]] - vertices[pairs[:, 1]]) ** 2).sum(axis=1).mean())
        corners = vertices[triangles]
        length = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
        return length / scale if form.scaled else length

    a, b = lengths(neutral), lengths(target)
    degenerate = (np.minimum(a, b) <= 0).any(axis=1)
    a[degenerate] = b[degenerate] = 1
    ratio = np.maximum(a / b, b / a)
    if form.edges == "two":
        return np.where(degenerate, 0, ratio[:, :2].sum(axis=1))
    stretch = (ratio - 1).sum(axis=1)
    return np.where(stretch < ROUNDING, 0, stretch)


def uniqueness(cosine: Float[np.ndarray, "k k"], packed: Bool[np.ndarray, " k"]) -> Float[np.ndarray, " k"]:
    """U_k, 0 to 1, of every blendshape against the packed ones; the largest is over those not yet packed.

    0 for all while nothing is packed, 1 for all where nothing is like what is packed.
    """
    if not packed.any():
        return np.zeros(len(cosine))
    like = np.maximum(cosine[:, packed], 0).mean(axis=1)
    largest = like[~packed].max(initial=0)
    return np.where(packed, 0, 1 - like / largest) if largest > 0 else np.ones(len(cosine))


def cosine_similarity(deltas: Float[np.ndarray, "k v 3"]) -> Float[np.ndarray, "k k"]:
    """cos(d_i, d_j), -1 to 1; 0 where a blendshape does not move."""
    flat = deltas.reshape(len(deltas), -1)
    inner = (flat @ flat.T).astype(float)
    length = np.sqrt(np.diag(inner))
    return inner / np.where(length > 0, length, 1)[:, None] / np.where(length > 0, length, 1)
