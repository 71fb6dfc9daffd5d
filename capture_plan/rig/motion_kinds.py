"""Which blendshapes are expressions of the face, and what the others are, from what moves: the core on raw arrays.

Data      x[v]  neutral;  d[k, v]  deltas, in any unit and any axes;  a[v]  areas, of the skin where it is known
          e[k, v] = a[v] |d[k, v]|^2, what a blendshape moves, by area
Nothing   d[k] = 0
Head      x + d[k] = s R x + t on a core of the skin: a rigid motion, or one of size, fitted to what moves and again to
          what fits, so that a neck that bends does not count. Three signs, all of them: the core holds most of e[k];
          around it the motion fades and does nothing else (d is between 0 and that motion); and the core holds what the
          other blendshapes move. A jaw fails all three, a face sculpted on a head that had slipped the second
Elsewhere nearly none of e[k] lies within reach of the face. Without a place of the face: apart from the largest group
          of blendshapes that move the same places, and many of its radii away
Calls     d[k] = sum w[j] d[j] with 0 <= w <= 1, two or more: nothing that the others do not hold. One pair of halves is
          no such sum, since an actor does both sides at once, and halves are cut from what that scan shows
Face      everything else, and whatever is in doubt
"""

from typing import Literal, NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.optimize import nnls
from scipy.sparse.csgraph import connected_components

from capture_plan.mesh import vertex_areas

MotionKind = Literal["face", "head movement", "not of the face", "calls others", "moves nothing"]
STILL = 1e-6  # of the largest extent: no file is finer
BENT = 0.15  # of a vertex's own motion may be off the rigid one
MOST, NEARLY_ALL = 0.5, 0.9  # of e in the core: jaws have up to 0.7, turned heads with a neck 0.6 and more
HALF = 0.5  # of the rigid motion: a turned head fades along its neck, and its chin has less than its brow
SLIPPED = 0.15  # of the largest motion: a turn that fades along the neck leaves 0.1, a smile on a slipped head its own
HELD, HOLDS = 0.7, 0.8  # of another blendshape's e lies in the core; so many do. Of a jaw's others 0.05 do
ROUNDS = 15  # of fitting
MOVES = 0.1  # share of the largest motion
INSIDE = 0.1  # of e within reach of the face: a breath that pulls at the neck has less
FACE_REACH = 2.6  # pupil distances around the middle between eyes and mouth: brow, chin and ears, no chest
LINKED = 0.05  # overlap of what two blendshapes move; lips and lids have 0
FAR = 6.0  # radii of the largest group: brows lie up to 4 of those of a mouth away, a chest 8 of those of a face
GROUP = 4  # so many blendshapes that move the same places are a face
UNEXPLAINED = 3e-3  # share of a blendshape's length that others leave over; real ones leave over 0.04
FULL = 1.05  # weights end at 1
PART = 0.02  # a smaller weight is rounding


class Sphere(NamedTuple):
    """Where the face is: its middle and how far it reaches, in the unit of the neutral."""

    centre: Float[np.ndarray, " 3"]
    radius: float


class Motions(NamedTuple):
    """`kinds[k]` is what blendshape k is; `shares[k, j]` the weight of j in a k that calls others, else 0."""

    kinds: tuple[MotionKind, ...]
    shares: Float[np.ndarray, "k k"]


def motion_kinds(
    neutral: Float[np.ndarray, "v 3"],
    triangles: Int[np.ndarray, "f 3"],
    deltas: Float[np.ndarray, "k v 3"],
    *,
    face: Sphere | None = None,
    halves: tuple[tuple[int, int], ...] = (),
) -> Motions:
    """What each blendshape is. `triangles` are those of the skin where it is known, else all of them; `face` says where
    the face is where that is known; `halves` are left and right of one movement.
    """
    a = vertex_areas(neutral, triangles)
    length = np.linalg.norm(deltas, axis=2)
    nothing = length.max(axis=1) <= STILL * np.ptp(neutral, axis=0).max()
    e = a * length.astype(float) ** 2
    head = head_movements(neutral, a, deltas)
    away = ~head & ~nothing & elsewhere(neutral, np.where(head[:, None], 0, e), face)
    shares = calls(deltas[:, a > 0], np.flatnonzero(~nothing & ~head & ~away), halves)
    answers: list[tuple[MotionKind, Bool[np.ndarray, " k"]]] = [
        ("moves nothing", nothing),
        ("head movement", head),
        ("not of the face", away),
        ("calls others", shares.any(axis=1)),
    ]
    kinds = [next((kind for kind, where in answers if where[k]), "face") for k in range(len(deltas))]
    return Motions(tuple(kinds), shares)


def head_movements(
    neutral: Float[np.ndarray, "v 3"], a: Float[np.ndarray, " v"], deltas: Float[np.ndarray, "k v 3"]
) -> Bool[np.ndarray, " k"]:
    """Whether a blendshape moves the whole head as one; `a` areas, 0 off the skin."""
    length = np.linalg.norm(deltas, axis=2)
    e = a * length.astype(float) ** 2
    total = e.sum(axis=1)
    moved = (length >= MOVES * length.max(axis=1, keepdims=True)) & (e > 0)
    cores, own, clean = np.zeros(e.shape, dtype=bool), np.zeros(len(e)), np.zeros(len(e), dtype=bool)
    for k in np.flatnonzero(total > 0):
        cores[k], off = _rigid_core(neutral, deltas[k].astype(float), e[k], moved[k])
        own[k] = e[k, cores[k]].sum() / total[k]
        clean[k] = off <= SLIPPED
    rigid = (own >= MOST) & clean
    others = ~rigid & (total > 0)
    if not others.any():
        return rigid & (own >= NEARLY_ALL)
    return np.array([rigid[k] and _holds(cores[k], moved[k], e[others], a, moved[others]) for k in range(len(e))])


def elsewhere(
    neutral: Float[np.ndarray, "v 3"], e: Float[np.ndarray, "k v"], face: Sphere | None
) -> Bool[np.ndarray, " k"]:
    """Whether nearly all that a blendshape moves lies off the face; False for what moves nothing."""
    total = e.sum(axis=1)
    moves = total > 0
    if face is None:
        face = _largest_group(neutral, e[moves])
    if face is None:
        return np.zeros(len(e), dtype=bool)
    near = np.linalg.norm(neutral - face.centre, axis=1) <= face.radius
    return moves & (e[:, near].sum(axis=1) < INSIDE * total)


def calls(
    deltas: Float[np.ndarray, "k v 3"], among: Int[np.ndarray, " n"], halves: tuple[tuple[int, int], ...] = ()
) -> Float[np.ndarray, "k k"]:
    """Weights of those blendshapes of `among` that are plain sums of others of it, a row each; 0 for the rest."""
    shares = np.zeros((len(deltas), len(deltas)))
    d = deltas[among].reshape(len(among), -1)
    gram = (d @ d.T).astype(float)
    length = np.sqrt(np.diag(gram))
    moving = length > 0
    among, gram, length = among[moving], gram[np.ix_(moving, moving)], length[moving]
    cosine = gram / np.outer(length, length)
    left = list(_dependent(cosine))
    kept = np.ones(len(among), dtype=bool)
    for k in sorted(left, key=lambda k: -length[k]):
        kept[k] = False
        weights = _sum_of(cosine, k, np.flatnonzero(kept)) * length[k] / length
        parts = [int(among[j]) for j in np.flatnonzero(weights > PART)]
        if len(parts) < 2 or weights.max() > FULL or tuple(parts) in {tuple(sorted(pair)) for pair in halves}:
            kept[k] = True
        else:
            shares[among[k], parts] = weights[weights > PART]
    return shares


def _rigid_core(
    x: Float[np.ndarray, "v 3"], d: Float[np.ndarray, "v 3"], e: Float[np.ndarray, " v"], moved: Bool[np.ndarray, " v"]
) -> tuple[Bool[np.ndarray, " v"], float]:
    """The vertices that one similarity moves, and by how much of the largest motion the others do anything else."""
    x, d, e = x[moved], d[moved], e[moved]
    length, weight = np.linalg.norm(d, axis=1), e
    for _ in range(ROUNDS):
        p = _similarity(x, x + d, weight) - x
        off = np.linalg.norm(d - p, axis=1)
        least = max(float(np.median(off)), BENT / 2 * float(np.sqrt(np.average(length**2, weights=e / length**2))))
        weight = e / (1 + (off / least) ** 2) ** 2
    # d = c p, 0 <= c <= 1, where the motion only fades
    c = np.clip(np.einsum("vx,vx->v", d, p) / np.maximum((p**2).sum(axis=1), 1e-30), 0, 1)
    other = np.linalg.norm(d - c[:, None] * p, axis=1)
    core = np.zeros(len(moved), dtype=bool)
    core[np.flatnonzero(moved)[(other <= BENT * length) & (c >= HALF)]] = True
    return core, float(np.quantile(other, 0.99) / length.max())


def _similarity(
    x: Float[np.ndarray, "v 3"], y: Float[np.ndarray, "v 3"], weight: Float[np.ndarray, " v"]
) -> Float[np.ndarray, "v 3"]:
    """s R x + t of least sum w |y - s R x - t|^2 (Umeyama 1991)."""
    w = weight / weight.sum()
    X, Y = x - w @ x, y - w @ y
    U, S, Vt = np.linalg.svd((Y * w[:, None]).T @ X)
    sign = np.array([1, 1, np.sign(np.linalg.det(U @ Vt))])
    s = (S * sign).sum() / max(float(w @ (X**2).sum(axis=1)), 1e-30)
    return s * X @ ((U * sign) @ Vt).T + w @ y


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
        return bool(a[core].sum() >= NEARLY_ALL * a[moved].sum())
    held = e[around][:, core].sum(axis=1) >= HELD * total[around]
    region = moved | places[around].any(axis=0)
    return bool(held.mean() >= HOLDS and a[core].sum() >= MOST * a[region].sum())


def _largest_group(neutral: Float[np.ndarray, "v 3"], e: Float[np.ndarray, "n v"]) -> Sphere | None:
    """Where the largest group of blendshapes that move the same places is; None where no group is large enough."""
    if len(e) < GROUP:
        return None
    root = np.sqrt(e / e.sum(axis=1, keepdims=True))
    # overlap of two distributions, Bhattacharyya 1943
    _, group = connected_components(root @ root.T >= LINKED, directed=False)
    largest = np.bincount(group).argmax()
    if (group == largest).sum() < max(GROUP, len(e) / 2):
        return None
    weight = (root[group == largest] ** 2).sum(axis=0)
    centre = np.average(neutral, axis=0, weights=weight)
    spread = np.average(((neutral - centre) ** 2).sum(axis=1), weights=weight)
    return Sphere(centre, FAR * float(np.sqrt(spread)))


def _dependent(cosine: Float[np.ndarray, "n n"]) -> Int[np.ndarray, " _"]:
    """Blendshapes that the others explain, with whatever signs: 1 / (C^-1)_kk is what they leave over."""
    inverse = np.linalg.inv(cosine + 1e-9 * np.eye(len(cosine)))
    return np.flatnonzero(1 / np.maximum(np.diag(inverse), 1e-30) <= 2 * UNEXPLAINED**2)


def _sum_of(cosine: Float[np.ndarray, "n n"], k: int, kept: Int[np.ndarray, " m"]) -> Float[np.ndarray, " n"]:
    """Weights, none negative, of the `kept` ones that give k, all of length 1; 0 where they do not."""
    weights = np.zeros(len(cosine))
    # |d_k - D w|^2 = 1 - 2 c w + w C w with C = L L^T: least squares in L^T w - L^-1 c
    values, vectors = np.linalg.eigh(cosine[np.ix_(kept, kept)])
    root = np.sqrt(np.clip(values, 0, None))
    right = (vectors.T @ cosine[kept, k]) / np.maximum(root, 1e-6)
    w, _ = nnls(root[:, None] * vectors.T, np.where(root > 1e-6, right, 0))
    left = 1 - 2 * cosine[kept, k] @ w + w @ cosine[np.ix_(kept, kept)] @ w
    if left <= UNEXPLAINED**2:
        weights[kept] = w
    return weights
