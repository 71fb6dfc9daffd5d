"""Binary blendshapes: where on the skin a blendshape shows its meaning (Carrigan et al. 2020, section 4.1).

Data     |d[k, v]|  how far blendshape k moves vertex v, millimetres
Active   b[k, v] = 1 where |d[k, v]| >= mu max_v |d[k, v]|, and the blendshape moves the skin at all     (eq. 2)
A vertex that moves less is smoothing, one that does not move is static. Vertices off the skin are never active and do
not count for the maximum: a camera sees the lid over a rolling eye, and the actor cannot show the back of the eyeball.
"""

import numpy as np
from jaxtyping import Bool, Float, Int

from capture_plan.errors import RigError
from capture_plan.expressions.settings import PackingSettings
from capture_plan.rig import Rig

STILL_MM = 1e-3  # below what any file format keeps


def active_sets(rig: Rig, used: tuple[str, ...], mu: float) -> Bool[np.ndarray, "k v"]:
    """b[k, v] for the blendshapes `used`, in their order; `mu` is a share from 0 to 1."""
    moved = skin_displacement(rig, used)
    largest = moved.max(axis=1, keepdims=True)
    return (moved >= mu * largest) & (moved > 0) & (largest > STILL_MM)


def performed_sets(
    rig: Rig, used: tuple[str, ...], mu: float, drivers: tuple[tuple[str, str], ...]
) -> Bool[np.ndarray, "k v"]:
    """Active sets of what an actor shows: a corrective's together with those of the blendshape that it corrects."""
    active = active_sets(rig, used, mu)
    shown = active.copy()
    for corrective, driver in drivers:
        shown[used.index(corrective)] |= active[used.index(driver)]
    return shown


def vertex_kinds(rig: Rig, used: tuple[str, ...], mu: float) -> Int[np.ndarray, "k v"]:
    """0 static, 1 smoothing, 2 active, for every blendshape of `used` and every vertex (the paper's Fig. 2)."""
    moving = skin_displacement(rig, used) > STILL_MM
    return moving.astype(int) + (moving & active_sets(rig, used, mu))


def vertex_roles(rig: Rig, used: tuple[str, ...], settings: PackingSettings, blendshape: str) -> Int[np.ndarray, " v"]:
    """0 static, 1 smoothing, 2 active, for every vertex of one blendshape, as the packing sees it."""
    if blendshape not in used:
        raise RigError(f"'{blendshape}' is no blendshape in use: see what the audit lists")
    return vertex_kinds(rig, (blendshape,), settings.mu)[0]


def skin_displacement(rig: Rig, used: tuple[str, ...]) -> Float[np.ndarray, "k v"]:
    """|d[k, v]| on the skin, 0 elsewhere, millimetres."""
    rows = rig.rows(used)
    return np.where(rig.skin, rig.displacement[rows], 0)
