"""How much a scan of each blendshape is worth: the error of its transferred delta that a scan would take away.

Data       d[k]   deltas of the rig on the skin, millimetres;  e[k] deformation transfer onto the target's neutral
           J      how the space around each vertex is stretched from the rig's neutral to the target's
Expected   mean_v |e[k] - J d[k]|^2 + HABIT_SQUARE mean_v |J d[k]|^2                                         (mm^2)
           what triangles cannot tell of this face, and what no neutral tells: a person moves everything otherwise by a
           share of the movement. Without a target J is the identity and the first term is not known: 0.

Squared errors of blendshapes add up, so that the expression of largest sum is the one to scan next. The mean is over
the whole skin: Carrigan et al. 2020 (eq. 5) take it over the active vertices, by which a lid is worth as much as a jaw
(`triangle_distortion` looks at the same neutrals, yet not at what the blendshapes do with them).
J is fitted: the affine map of least squares to the vertices around each of some controls, blended between these.
"""

import numpy as np
from jaxtyping import Float

from capture_plan.mesh import similarity_fit
from capture_plan.once import once
from capture_plan.rig import Rig
from capture_plan.transfer.deformation import deformation_transfer
from capture_plan.transfer.targets import HABIT_SQUARE

CONTROLS = 300  # on a face about 10 mm apart
AROUND_MM = 15.0  # standard deviation of the weights of a fit: a lip with the teeth behind it, not both corners
FLAT_MM = 1.0  # vertices that spread less than this along some direction do not tell how it is stretched


def transfer_importance(rig: Rig, target: Float[np.ndarray, "n 3"] | None = None) -> Float[np.ndarray, " k"]:
    """Expected squared error of every blendshape that no scan shows, mean over the skin, mm^2.

    `target` is the neutral of the face to be scanned, on the rig's mesh.

    Raises:
        RigError: the target has another number of vertices.
    """
    return _importance(rig, None if target is None else target.astype(float).tobytes())


@once
def _importance(rig: Rig, given: bytes | None) -> Float[np.ndarray, " k"]:
    """The same of a target given by the bytes of its coordinates: one list asks several times."""
    target = None if given is None else np.frombuffer(given).reshape(-1, 3)
    found = foreseen(rig, target)[1].mean(axis=1)
    found.flags.writeable = False
    return found


def foreseen(
    rig: Rig, target: Float[np.ndarray, "n 3"] | None = None
) -> tuple[Float[np.ndarray, "k v 3"], Float[np.ndarray, "k s"]]:
    """Deltas by deformation transfer (mm), and their expected squared error at every vertex of the skin (mm^2).

    Raises:
        RigError: the target has another number of vertices.
    """
    d = rig.deltas[:, rig.skin].astype(float)
    if target is None:
        return rig.deltas, HABIT_SQUARE * np.square(d).sum(axis=2)
    e = deformation_transfer(rig.neutral, rig.triangles, rig.deltas, target)
    carried = np.einsum("vxy,kvy->kvx", local_maps(rig.neutral, target, rig.neutral[rig.skin]), d)
    squares = np.square(e[:, rig.skin] - carried).sum(axis=2) + HABIT_SQUARE * np.square(carried).sum(axis=2)
    return e, squares


def local_maps(
    source: Float[np.ndarray, "v 3"], target: Float[np.ndarray, "v 3"], at: Float[np.ndarray, "s 3"]
) -> Float[np.ndarray, "s 3 3"]:
    """J at the places `at`: (Cov(y, x) + c^2 sR) (Cov(x, x) + c^2 I)^-1 of each control, sR where it is flat."""
    sR, _ = similarity_fit(source, target)
    centres = at[np.linspace(0, len(at) - 1, min(CONTROLS, len(at))).astype(int)]
    maps = np.empty((len(centres), 3, 3))
    for i, centre in enumerate(centres):
        w = closeness(source, centre)
        w /= w.sum()
        x = source - w @ source
        xx, yx = (x.T * w) @ x, (target.T * w) @ x
        maps[i] = np.linalg.solve(xx + FLAT_MM**2 * np.eye(3), (yx + FLAT_MM**2 * sR).T).T
    near = np.stack([closeness(at, centre) for centre in centres], axis=1)
    near /= np.maximum(near.sum(axis=1, keepdims=True), np.finfo(float).tiny)
    return np.einsum("sc,cxy->sxy", near, maps)


def closeness(points: Float[np.ndarray, "n 3"], centre: Float[np.ndarray, " 3"]) -> Float[np.ndarray, " n"]:
    """exp(-|x - centre|^2 / 2 s^2)."""
    return np.exp(-np.square(points - centre).sum(axis=1) / (2 * AROUND_MM**2))
