"""Which blendshapes are the left and right half of one movement, found from geometry.

Data    d[k]      deltas, millimetres; the subject's left is +x
        m         mirror map: vertex m[v] is the mirror image of vertex v
        D[j]      mirrored delta: D[j, v] = (-1, 1, 1) * d[j, m[v]]
Tests   side      sum_v sign(x_v) |d[k, v]|^2 / sum_v |d[k, v]|^2, from -1 (right) to 1 (left)
        self      intersection over union of the active vertices of k and of their mirror image; above 0.4, unless
                  three quarters of |d[k]|^2 lie on one side, the blendshape is its own mirror image or moves the whole
                  face sideways (jawLeft), and has no partner
        unlike    |d[i] - D[j]|^2 / (|d[i]|^2 + |d[j]|^2): 0 for a mirror image, 1 for unrelated, 2 for opposite ones
        a left and a right blendshape are partners where an assignment of least total unlikeness pairs them below 0.4,
        and no other blendshape comes much nearer to the mirror image of either
        opposite   cos(d[i], d[j]): two movements of the same skin against each other, as a mouth pulled to the left and
                   to the right, are no halves, however lopsided each is. Below -0.5, or below -0.2 where the midline
                   and the whole go sideways too, since halves meet there and go out of each other's way
Source  Carrigan et al. 2020, section 4.4; made dimensionless. Names only break ties.
"""

import re

import numpy as np
from jaxtyping import Bool, Float
from scipy.optimize import linear_sum_assignment

from capture_plan.mesh.mirror import mirror_map, mirror_plane
from capture_plan.names.movements import movements_of
from capture_plan.once import once
from capture_plan.rig import Rig

ACTIVE = 0.3  # share of the largest displacement, the recommended middle of Carrigan et al. 2020, eq. 2
SELF_SYMMETRIC = 0.4  # overlap with the own mirror image
ONE_SIDED = 0.5  # three quarters on one side: half a lower lip pulled down (0.6), not a mouth moved left (0.3)
UNLIKE = 0.4  # real partners differ by 2 to 34 % in length, which is up to 0.1 here; unrelated ones by 1
AGAINST, PERHAPS = -0.5, -0.2  # cosine: halves of one movement have -0.28 and more, opposite ones -0.42 to -1
GOES_ASIDE = 0.65  # of the movement's direction, as a whole and on the midline: pulled mouths 0.75 to 1, halves to 0.54
MIDLINE = 0.06  # of half the breadth of the skin
NEARER = 0.1  # unlikeness: a smile to the left that is 0.14 from a mouth pulled to the right, 0.01 from its own partner
NAME_BONUS = 0.01  # decides between partners that geometry finds equally good, never against it
SIDES = (("left", "right"), ("Left", "Right"), ("LEFT", "RIGHT"), ("l", "r"), ("L", "R"), ("lf", "rt"), ("Lt", "Rt"))
WORD = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|[0-9]+|[^A-Za-z0-9]+")


@once
def blendshape_pairs(rig: Rig) -> tuple[tuple[str, str], ...]:
    """(left, right) names of partners, the subject's own sides, in the order of the left ones in the rig."""
    side, overlap = laterality(rig), self_symmetry(rig)
    mirrored = unlikeness(rig)
    others = np.where(np.eye(len(rig.names), dtype=bool), 2, mirrored).min(axis=1)
    worse = mirrored > np.minimum(others[:, None], others) + NEARER
    unlike = np.where(worse | opposite_movements(rig) | said_to_part(rig.names), 1, mirrored)
    one_sided = (overlap <= SELF_SYMMETRIC) | (np.abs(side) >= ONE_SIDED)
    left, right = np.flatnonzero(one_sided & (side > 0)), np.flatnonzero(one_sided & (side < 0))
    cost = np.minimum(unlike[np.ix_(left, right)], UNLIKE)
    for row, i in enumerate(left):
        named = other_names(rig.names[i])
        cost[row] -= [NAME_BONUS * (rig.names[j] in named) for j in right]
    rows, columns = linear_sum_assignment(cost)
    return tuple(
        (rig.names[i], rig.names[j]) for i, j in zip(left[rows], right[columns], strict=True) if unlike[i, j] < UNLIKE
    )


def laterality(rig: Rig) -> Float[np.ndarray, " k"]:
    """Where a blendshape moves: 1 on the subject's left only, -1 on the right only, 0 on both alike or nowhere."""
    squared = rig.displacement**2
    total = squared.sum(axis=1)
    return squared @ np.sign(rig.neutral[:, 0] - mirror_plane(rig.neutral)) / np.where(total > 0, total, 1)


def self_symmetry(rig: Rig) -> Float[np.ndarray, " k"]:
    """Overlap of each blendshape's active vertices with their mirror image, 0 to 1; 0 where nothing moves."""
    active = _active(rig)
    image = active[:, mirror_map(rig.neutral)]
    return (active & image).sum(axis=1) / np.maximum((active | image).sum(axis=1), 1)


def unlikeness(rig: Rig) -> Float[np.ndarray, "k k"]:
    """|d[i] - D[j]|^2 / (|d[i]|^2 + |d[j]|^2) = 1 - 2 <d[i], D[j]> / (|d[i]|^2 + |d[j]|^2); 1 where neither moves."""
    k = len(rig.names)
    mirrored = rig.deltas[:, mirror_map(rig.neutral)] * np.array([-1, 1, 1], dtype=rig.deltas.dtype)
    inner = (rig.deltas.reshape(k, -1) @ mirrored.reshape(k, -1).T).astype(float)
    squared = (rig.displacement.astype(float) ** 2).sum(axis=1)
    total = squared[:, None] + squared
    return 1 - (inner + inner.T) / np.where(total > 0, total, 1)


def opposite_movements(rig: Rig) -> Bool[np.ndarray, "k k"]:
    """Whether two blendshapes move the same skin against each other, up to the direction of both."""
    d = rig.deltas.reshape(len(rig.names), -1)
    inner = (d @ d.T).astype(float)
    length = np.sqrt(np.diag(inner))
    cosine = inner / np.where(length > 0, length, 1)[:, None] / np.where(length > 0, length, 1)
    x = np.abs(rig.neutral[:, 0] - mirror_plane(rig.neutral))
    everywhere, middle = np.ones(len(x), dtype=bool), x < MIDLINE * x[rig.skin].max()
    aside = (_aside(rig, everywhere) > GOES_ASIDE) & (_aside(rig, middle) > GOES_ASIDE)
    return (cosine < AGAINST) | ((cosine < PERHAPS) & (aside[:, None] & aside))


def said_to_part(names: tuple[str, ...]) -> Bool[np.ndarray, "k k"]:
    """Whether two names say one movement to two sides, as mouthLeft and mouthRight."""
    said = [(one.kind, one.towards) if one is not None and one.towards else None for one in movements_of(names)]
    apart = {(a, towards): (a, {"left": "right", "right": "left"}[towards]) for a, towards in filter(None, said)}
    return np.array([[a is not None and b is not None and apart[a] == b for b in said] for a in said])


def _aside(rig: Rig, where: Bool[np.ndarray, " v"]) -> Float[np.ndarray, " k"]:
    """|sum |d| d_x| / sum |d|^2 of the vertices `where`: 1 where all goes to one side."""
    length = rig.displacement[:, where].astype(float)
    squared = (length**2).sum(axis=1)
    return np.abs(np.einsum("kv,kv->k", length, rig.deltas[:, where, 0])) / np.where(squared > 0, squared, 1)


def _active(rig: Rig) -> Bool[np.ndarray, "k v"]:
    largest = rig.displacement.max(axis=1, keepdims=True)
    return (rig.displacement >= ACTIVE * largest) & (largest > 0)


def other_names(name: str) -> set[str]:
    """What the partner may be called: one word that names a side, exchanged ('eyeBlink_L' gives 'eyeBlink_R')."""
    words = WORD.findall(name)
    swap = {a: b for pair in SIDES for a, b in (pair, pair[::-1])}
    return {
        "".join([*words[:place], swap[word], *words[place + 1 :]]) for place, word in enumerate(words) if word in swap
    }
