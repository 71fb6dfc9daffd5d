"""Which blendshapes move the whole head as one, from what moves: on raw arrays, in any unit and any axes.

Data      x[v]  neutral;  d[k, v]  deltas;  a[v]  areas, 0 off the skin;  e[k, v] = a[v] |d[k, v]|^2
Motion    x + p = s R x + t, a rigid motion or one of size, fitted to what moves and again to what fits, so that a neck
          that bends does not count
Signs     rigid   most of the skin that moves follows p
          fades   what does not follow p does a part of it and nothing else: d = c p with 0 <= c <= 1. A jaw bends the
                  cheeks, a smile on a head that had slipped has a motion of its own
          holds   the core, where c is a half and more, holds what the other blendshapes there move, most of the skin
                  that they and it move, and most of the face where its place is known
All three are asked; a name that says so stands for the third, and never for the others.

Slip      a head that lies elsewhere than the neutral's while its face moves: most vertices of the mesh follow one such
          motion, as in scans that were not laid onto each other
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from capture_plan.mesh import similarity_fit

BENT = 0.15  # of a vertex's own motion may be off the rigid one
MOST = 0.5  # of the moved skin: jaws, lids and lips have up to 0.37, turned heads with a neck from 0.65
NEARLY_ALL = 0.9  # of the moved skin
SLIPPED = 0.1  # of the largest motion: a fading turn of 45 degrees along the neck leaves 0.09, jaws and lids from 0.11
HALF = 0.5  # of the rigid motion: a turned head fades along its neck, and its chin has less than its brow
HELD, HOLDS = 0.5, 0.8  # of another blendshape's e lies in the core; so many do
ROUNDS = 15  # of fitting
SLIP_MM, ALONG = 1.0, 0.1  # less is the precision of good scans; of the slip: they differ in by no more
MOVES = 0.1  # share of the largest motion


class Sphere(NamedTuple):
    """Where the face is: its middle and how far it reaches, in the unit of the neutral."""

    centre: Float[np.ndarray, " 3"]
    radius: float


class Core(NamedTuple):
    """The vertices that go along with a rigid motion; `rigid` is the share of the moved skin that follows it wholly,
    `other` how far anything else goes, of the largest motion.
    """

    vertices: Bool[np.ndarray, " v"]
    rigid: float
    other: float


def head_movements(
    neutral: Float[np.ndarray, "v 3"],
    a: Float[np.ndarray, " v"],
    deltas: Float[np.ndarray, "k v 3"],
    *,
    face: Sphere | None,
    called: Bool[np.ndarray, " k"],
) -> Bool[np.ndarray, " k"]:
    """Whether a blendshape moves the whole head as one; `called` where its name says so."""
    length = np.linalg.norm(deltas, axis=2).astype(float) * (a > 0)
    e, moved = a * length**2, (length >= MOVES * length.max(axis=1, keepdims=True)) & (length > 0)
    cores = [rigid_core(neutral, delta.astype(float), a, at) for delta, at in zip(deltas, moved, strict=True)]
    rigid = np.array([core.rigid >= MOST and core.other <= SLIPPED for core in cores])
    others = ~rigid & moved.any(axis=1)
    near = np.ones(len(a), dtype=bool) if face is None else within_sphere(neutral, face)
    found = np.zeros(len(deltas), dtype=bool)
    for k in np.flatnonzero(rigid):
        over_face = face is None or a[cores[k].vertices & near].sum() >= MOST * a[near].sum()
        alone = not others.any() and (face is not None or cores[k].rigid >= NEARLY_ALL)
        found[k] = called[k] or (
            over_face and (alone or _holds(cores[k].vertices, moved[k], e[others], a, moved[others]))
        )
    return found


def within_sphere(neutral: Float[np.ndarray, "v 3"], face: Sphere) -> Bool[np.ndarray, " v"]:
    """The vertices within reach of the face."""
    return np.linalg.norm(neutral - face.centre, axis=1) <= face.radius


def rigid_core(
    neutral: Float[np.ndarray, "v 3"],
    delta: Float[np.ndarray, "v 3"],
    a: Float[np.ndarray, " v"],
    moved: Bool[np.ndarray, " v"],
) -> Core:
    """What goes along with the one motion that fits most of the vertices that are `moved`."""
    core = np.zeros(len(moved), dtype=bool)
    if not moved.any():
        return Core(core, 0.0, 0.0)
    x, d, area = neutral[moved], delta[moved], a[moved]
    length = np.linalg.norm(d, axis=1)
    e = area * length**2
    p = _motion(x, d, e)
    for _ in range(ROUNDS):
        off = np.linalg.norm(d - p, axis=1)
        least = max(float(np.median(off)), BENT / 2 * float(np.sqrt(e.sum() / area.sum())))
        p = _motion(x, d, e / (1 + (off / least) ** 2) ** 2)
    # d = c p
    c = np.clip(np.einsum("vx,vx->v", d, p) / np.maximum((p**2).sum(axis=1), np.finfo(float).tiny), 0, 1)
    other = np.linalg.norm(d - c[:, None] * p, axis=1)
    follows = np.linalg.norm(d - p, axis=1) <= BENT * length
    core[np.flatnonzero(moved)[(other <= BENT * length) & (c >= HALF)]] = True
    return Core(core, float(area[follows].sum() / area.sum()), float(np.quantile(other, 0.99) / length.max()))


def slips(neutral: Float[np.ndarray, "v 3"], deltas: Float[np.ndarray, "k v 3"]) -> Float[np.ndarray, " k"]:
    """How far, millimetres, the head lies from the neutral's in each blendshape; 0 where most of the mesh stays."""
    return np.array([_slip(neutral, delta.astype(float)) for delta in deltas])


def _slip(x: Float[np.ndarray, "v 3"], d: Float[np.ndarray, "v 3"]) -> float:
    """The median of the one motion that most vertices follow."""
    far = float(np.median(np.linalg.norm(d, axis=1)))
    if far < SLIP_MM:
        return 0.0
    p = _motion(x, d, np.ones(len(x)))
    for _ in range(ROUNDS):
        off = np.linalg.norm(d - p, axis=1)
        least = max(float(np.median(off)), ALONG / 2 * far)
        p = _motion(x, d, 1 / (1 + (off / least) ** 2) ** 2)
    follows = np.linalg.norm(d - p, axis=1) <= ALONG * far
    return float(np.median(np.linalg.norm(p, axis=1))) if follows.mean() >= MOST else 0.0


def _motion(
    x: Float[np.ndarray, "v 3"], d: Float[np.ndarray, "v 3"], w: Float[np.ndarray, " v"]
) -> Float[np.ndarray, "v 3"]:
    """The displacements p = s R x + u - x of the motion nearest to displacements d."""
    sR, u = similarity_fit(x, x + d, w)
    return x @ sR.T + u - x


def _holds(
    core: Bool[np.ndarray, " v"],
    moved: Bool[np.ndarray, " v"],
    e: Float[np.ndarray, "n v"],
    a: Float[np.ndarray, " v"],
    places: Bool[np.ndarray, "n v"],
) -> bool:
    """Whether the core holds what the others around it move, and most of the skin that they and it move."""
    total = e.sum(axis=1)
    around = e[:, moved].sum(axis=1) >= MOST * total  # neither chests nor hats nor whole bodies speak
    if not around.any():
        return False
    held = e[around][:, core].sum(axis=1) >= HELD * total[around]
    region = moved | places[around].any(axis=0)
    return bool(held.mean() >= HOLDS and a[core].sum() >= MOST * a[region].sum())
