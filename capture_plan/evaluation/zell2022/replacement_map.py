"""Where else a landmark could stand (Zell & McDonnell 2022, fig. 5), and how well each place suits a blendshape.

Data       c[k, v]    vertex v is a candidate for blendshape k (eq. 3);  w[k, v] its weight (eq. 1), 0 best, 2 worst
           S, m       a layout, and the landmark of it that is looked at
           K(m)       blendshapes that m stands for and no other landmark of S; all of m's where there are none
Answer     q[v]       mean over K(m) of 2 - w[k, v], divided by the largest of all v that can replace m:
                      c[k, v] for every k in K(m), v no other landmark. S without m and with v covers what S covers.
"""

import numpy as np
from jaxtyping import Bool, Float, Int

from capture_plan.errors import InfeasibleError
from capture_plan.face.blocking import opaque_triangles
from capture_plan.layout.face import Face
from capture_plan.layout.quality import importance_weights
from capture_plan.layout.settings import LayoutSettings
from capture_plan.visibility import hemisphere_visibility


def replacement_map(
    face: Face, settings: LayoutSettings, vertices: Int[np.ndarray, " m"], which: int
) -> Float[np.ndarray, " v"]:
    """q: how well every vertex would do in the place of landmark number `which`, up to 1; NaN where none can stand.

    Raises:
        InfeasibleError: the landmark stands for no blendshape at this epsilon.
    """
    covers = face.relative_displacement(settings) >= settings.epsilon
    others = np.delete(vertices, which)
    own = covers[:, vertices[which]]
    if not own.any():
        raise InfeasibleError(
            f"landmark {which} stands for no blendshape at epsilon {settings.epsilon:g}: lower epsilon"
        )
    needed = own & ~covers[:, others].any(axis=1)
    needed = needed if needed.any() else own
    able = covers[needed].all(axis=0) & face.allowed(settings)
    able[others] = False
    return _best_is_one(importance(face, settings)[needed].mean(axis=0), able)


def blendshape_map(face: Face, settings: LayoutSettings, name: str) -> Float[np.ndarray, " v"]:
    """How well every vertex stands for one blendshape, the best at 1; NaN elsewhere."""
    k = face.used.index(name)
    able = (face.relative_displacement(settings)[k] >= settings.epsilon) & face.allowed(settings)
    return _best_is_one(importance(face, settings)[k], able)


def importance(face: Face, settings: LayoutSettings) -> Float[np.ndarray, "k v"]:
    """2 - w = (1 - alpha) r + alpha l, from 0 to 1."""
    return 2 - importance_weights(face.relative_displacement(settings), face.visibility, settings.alpha)


def neutral_visibility(face: Face) -> Float[np.ndarray, " v"]:
    """Share of the hemisphere that sees each markable vertex on the neutral alone, 0 elsewhere.

    Beside `face.visibility`, which is the worst of all expressions: the difference is what expressions hide.
    """
    at, share = np.flatnonzero(face.markable), np.zeros(len(face.rig.neutral))
    share[at] = hemisphere_visibility(face.rig.neutral, opaque_triangles(face.rig), at)
    return share


def _best_is_one(q: Float[np.ndarray, " v"], able: Bool[np.ndarray, " v"]) -> Float[np.ndarray, " v"]:
    largest = q[able].max(initial=0.0)
    return np.where(able, q / (largest or 1.0), np.nan)
