"""Made-up people: one rig in other shapes, where no rig of anybody else is at hand. Nobody was measured.

Data    from a seed: centres c_i on the skin with amplitudes a_i, each beside its mirror image; scale s of each axis
Shape   f(x) = s x + sum_i a_i exp(-|x - c_i|^2 / 2 r^2), millimetres: smooth, and as symmetric as the rig
Motion  d'_k(v) = g_k J_f(x_v) d_k(v): a movement goes along with the skin, by a strength g_k of this person's own
"""

from dataclasses import replace

import numpy as np
from jaxtyping import Float

from capture_plan.rig.record import Rig

BUMPS, AMPLITUDE_MM, RADIUS_MM = 8, 3.5, 35.0  # wide enough that no skin folds over
SCALE_SD = 0.04  # heads of adults differ by about as much in width, height and depth
STRENGTH_SD = 0.25


def made_up_people(rig: Rig, count: int, seed: int = 0) -> tuple[Rig, ...]:
    """So many people on the mesh of `rig`, with its blendshapes; the same seed gives the same people."""
    return tuple(made_up_person(rig, np.random.default_rng((seed, n)), f"made-up person {n + 1}") for n in range(count))


def made_up_person(rig: Rig, rng: np.random.Generator, name: str) -> Rig:
    """The rig in another shape."""
    x, flip = rig.neutral.astype(float), np.array([-1.0, 1.0, 1.0])
    centres = x[rng.choice(np.flatnonzero(rig.skin), BUMPS, replace=False)]
    amplitudes = rng.normal(0, AMPLITUDE_MM, (BUMPS, 3))
    scale = 1 + SCALE_SD * rng.standard_normal(3)
    strength = np.exp(STRENGTH_SD * rng.standard_normal(len(rig.names)))
    shape, jacobian = reshaped(
        x, scale, np.vstack([centres, centres * flip]), np.vstack([amplitudes, amplitudes * flip])
    )
    # d' = g J d
    deltas = np.einsum("k,vxy,kvy->kvx", strength, jacobian, rig.deltas, optimize=True).astype(np.float32)
    return replace(rig, name=name, neutral=shape, deltas=deltas)


def reshaped(
    x: Float[np.ndarray, "v 3"],
    scale: Float[np.ndarray, " 3"],
    centres: Float[np.ndarray, "b 3"],
    amplitudes: Float[np.ndarray, "b 3"],
) -> tuple[Float[np.ndarray, "v 3"], Float[np.ndarray, "v 3 3"]]:
    """f and J_f at x."""
    away = x[:, None] - centres
    weight = np.exp(-np.square(away).sum(axis=2) / (2 * RADIUS_MM**2))
    # J = diag(s) - sum_i a_i (x - c_i)' exp(..) / r^2
    turned = np.einsum("bx,vby,vb->vxy", amplitudes, away, weight, optimize=True) / RADIUS_MM**2
    return x * scale + weight @ amplitudes, np.diag(scale) - turned
