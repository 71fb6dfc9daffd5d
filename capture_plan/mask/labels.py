"""The number beside each hole: where its flat pad lies, and its letters as outlines.

Places    16 directions x 4 distances around each hole, letters of three sizes; the pad is tangent to the shell, the
          line of the number level as somebody reads it who stands before the face
Fits      all of a pad lies on the shell, clear of every eyelet, nearer to its own hole than to others
Choice    at most one place for each hole, none of two that touch: as many numbers as can be, the largest and nearest
          (an integer program, solved by HiGHS)
Floor     the letters are cut `DEPTH_MM` into a pad that stands so high that `FLOOR_MM` of material lies beneath them

Letters: n points of the skin, m holes, i candidate places.
"""

from dataclasses import dataclass
from itertools import product

import numpy as np
from jaxtyping import Float, Int
from scipy.optimize import Bounds, LinearConstraint, milp
from scipy.sparse import coo_array
from scipy.spatial import KDTree

from capture_plan.mask.record import Hole, Label, MaskSettings, level_frame
from capture_plan.mask.skin import Skin

HEIGHTS_MM = (4.0, 3.4, 2.8)
WIDTH = 0.70  # of a letter's advance over its height
MARGIN_MM = (0.9, 0.8)  # of the pad beside and above its letters
DEPTH_MM = 0.6
FLOOR_MM = 1.8
DIRECTIONS, APART_MM = 16, (0.0, 1.0, 2.2, 3.6)  # of pads from the feet of their eyelets
CLEAR_MM = 0.2
OFF_MM = 4.0  # from the plane of the eyelet to the skin where a pad would lie
OWN, PLAIN = 1.25, 1.8  # times as near to its own hole as to any other: at least, and without doubt
STEEP = 2.2  # mm between the highest and the mean skin under a pad: where skin is as bent as that it is no plane


@dataclass(frozen=True, eq=False)
class _Place:
    label: Label
    hole: int
    cost: float
    discs: Float[np.ndarray, "d 3"]  # middles of discs that cover the pad
    disc_mm: float


def labels_for(
    holes: tuple[Hole, ...], skin: Skin, cover: Float[np.ndarray, " n"], settings: MaskSettings
) -> tuple[Label, ...]:
    """A pad for each hole that has room for one."""
    places = [place for m, hole in enumerate(holes) for place in _places(m, hole, holes, skin, cover, settings)]
    return tuple(places[i].label for i in _chosen(places, len(holes)))


def _places(
    m: int, hole: Hole, holes: tuple[Hole, ...], skin: Skin, cover: Float[np.ndarray, " n"], settings: MaskSettings
) -> list[_Place]:
    reach = hole.around_mm + max(APART_MM) + 12.0
    near = np.array(skin.tree.query_ball_point(hole.dot.position, reach))[::2]  # every second is dense enough
    points, normals, inside = skin.points[near], skin.normals[near], cover[near]
    frame = level_frame(hole.axis)
    found = []
    for height in HEIGHTS_MM:
        half = np.array(pad_size(hole.dot.text, height)) / 2
        for apart, angle in product(APART_MM, 2 * np.pi * np.arange(DIRECTIONS) / DIRECTIONS):
            out = np.array([np.cos(angle), np.sin(angle)])
            way = hole.around_mm + apart + _support(half, out)
            away, first = skin.tree.query(hole.dot.position + way * (out @ frame[:2]))
            if away > OFF_MM or cover[first] < half.min():
                continue
            around = np.linalg.norm(points - skin.points[first], axis=1) <= half.max()
            normal = normals[around].sum(axis=0)
            at, own = skin.points[first], normal / np.linalg.norm(normal)
            label = _label(hole, at, own, points, inside, half, height, settings)
            if label is not None and np.isfinite(doubt := _doubt(label, half, hole, holes)):
                cost = 3.0 * HEIGHTS_MM.index(height) + apart + doubt + 0.5 * (1 + np.sin(angle))  # below, if it can be
                found.append(_Place(label, m, cost, *_discs(label, half)))
    return found


def pad_size(text: str, height: float) -> tuple[float, float]:
    """Width and height of a pad, millimetres."""
    return len(text) * WIDTH * height + 2 * MARGIN_MM[0], height + 2 * MARGIN_MM[1]


def _support(half: Float[np.ndarray, " 2"], out: Float[np.ndarray, " 2"]) -> float:
    """How far a rectangle with rounded corners reaches against a direction from its middle."""
    return float(np.abs(out) @ (half - 1.0) + 1.0)


def _label(
    hole: Hole,
    at: Float[np.ndarray, " 3"],
    normal: Float[np.ndarray, " 3"],
    points: Float[np.ndarray, "n 3"],
    inside: Float[np.ndarray, " n"],
    half: Float[np.ndarray, " 2"],
    height: float,
    settings: MaskSettings,
) -> Label | None:
    """A pad there, where all of it lies on the shell and on skin that is not too bent."""
    frame = level_frame(normal)
    local = (points - at) @ frame.T
    under = (np.abs(local[:, :2]) <= half + 0.2).all(axis=1) & (np.abs(local[:, 2]) < 6.0)
    heights = local[under, 2]
    if not under.any() or inside[under].min() < 0.3 or heights.max() - heights.mean() > STEEP:
        return None
    tall = max(FLOOR_MM + DEPTH_MM, settings.wall_mm + 0.2)
    top = float(heights.max()) + settings.gap_mm + tall
    size = (float(2 * half[0]), float(2 * half[1]))
    return Label(hole.dot.name, hole.dot.text, at, frame, height, size, top)


def _doubt(label: Label, half: Float[np.ndarray, " 2"], own: Hole, holes: tuple[Hole, ...]) -> float:
    """Price of the doubt whose number it is: 0 where every other hole is much further; infinite where another is as
    near, where its own is not beside it, or where it touches an eyelet."""
    dots = (np.stack([hole.dot.position for hole in holes]) - label.place) @ label.frame.T
    rims = np.array([hole.around_mm for hole in holes])
    gaps = np.linalg.norm(np.maximum(np.abs(dots[:, :2]) - half, 0), axis=1)
    near = np.abs(dots[:, 2]) < 10.0
    mine = np.array([hole is own for hole in holes])
    if not near[mine].all() or (near & (gaps < rims + np.where(mine, -0.2, CLEAR_MM))).any():
        return np.inf
    ratio = gaps[near & ~mine].min(initial=np.inf) / gaps[mine][0]
    return np.inf if ratio < OWN else 4 * max(0.0, PLAIN - float(ratio))


def _discs(label: Label, half: Float[np.ndarray, " 2"]) -> tuple[Float[np.ndarray, "d 3"], float]:
    count = max(1, int(np.ceil(half[0] / half[1])))
    x = (np.arange(count) - (count - 1) / 2) * 2 * half[0] / count
    return label.place + x[:, None] * label.frame[0], float(max(half[1], half[0] / count))


def _chosen(places: list[_Place], m: int) -> list[int]:
    """Indices of the places that are taken."""
    if not places:
        return []
    own = np.array([place.hole for place in places])
    i, j = _touching(places, own)
    # x_i + sum of x_j over the places j of one hole that touch place i <= 1: at most one j of a hole is taken at all
    key, row = np.unique(i * m + own[j], return_inverse=True)
    rows = np.concatenate([own, m + row, m + np.arange(len(key))])
    columns = np.concatenate([np.arange(len(places)), j, key // m])
    A = coo_array((np.ones(len(rows)), (rows, columns)), shape=(m + len(key), len(places)))
    cost = np.array([place.cost for place in places]) - 100.0  # a number less is worse than all numbers small
    found = milp(
        cost,
        constraints=LinearConstraint(A.tocsr(), ub=1.0),
        integrality=np.ones(len(places)),
        bounds=Bounds(0, 1),
        options={"time_limit": 5.0, "mip_rel_gap": 1e-3},
    )
    return [] if found.x is None else np.flatnonzero(found.x > 0.5).tolist()


def _touching(places: list[_Place], own: Int[np.ndarray, " i"]) -> tuple[Int[np.ndarray, " p"], Int[np.ndarray, " p"]]:
    """Pairs of places of different holes whose pads touch, each pair both ways."""
    discs, radius = np.concatenate([p.discs for p in places]), np.array([p.disc_mm for p in places])
    of = np.repeat(np.arange(len(places)), [len(p.discs) for p in places])
    pairs = KDTree(discs).query_pairs(2 * radius.max() + CLEAR_MM, output_type="ndarray")
    away = np.linalg.norm(discs[pairs[:, 0]] - discs[pairs[:, 1]], axis=1)
    a, b = of[pairs].T
    a, b = np.stack([a, b])[:, (away < radius[a] + radius[b] + CLEAR_MM) & (own[a] != own[b])]
    both = np.unique(np.stack([np.r_[a, b], np.r_[b, a]]), axis=1)
    return both[0], both[1]
