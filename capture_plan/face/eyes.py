"""Places that signs take for the eyes: mirrored pairs from names, motion and shape.

Data       a head in the rig's axes (+y up, +z forward, the subject's left +x), in any unit; x0 its mirror plane
Names      what a blink moves, half way; other movements of the eyes; parts called eyes
Motion     what moves furthest for its extent; skin that parts beside the middle; openings whose border closes
Shape      balls; openings that mirror each other
A place without its mirror image stands for both, less trusted. Trusts follow a trial on 1,200 generated heads of three
base meshes; the width of an opening is no argument.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from scipy.spatial import KDTree

from capture_plan.face.candidate import PUPILS_RHO, Candidate, extent, mirror_image
from capture_plan.face.shape import Shape, middle_of_box

OTHER_EYES = ("eye wide", "eye squint", "gaze up", "gaze down", "gaze in", "gaze out")
LIDS = 0.6  # share of the largest displacement: the lids alone; one blink moves the throat by 0.55 of that
CLOSES = 0.25  # of the width of an opening, by which the largest movement near it moves its border
ONE_SIDED = 0.8  # of a movement's energy on one side less that on the other
ONE_SIDE = 0.6  # of the trust in both sides
LIDS_RATIO, LIDS_SPREAD, STRAIGHT = 1.4, 0.22, 0.85  # of a blink: displacement over spread, spread in rho, cosine
FINEST = 0.02  # rho: a smaller spread is that of a few vertices
WIDER = 1.5  # times the smallest movement of its name: it moves more than that
LARGEST_LIDS = 0.45  # rho: spread of a movement of one eye, lids 0.2


def eye_candidates(shape: Shape, x0: float, *, named: bool) -> list[Candidate]:
    """Every pair of places that a sign takes for the eyes."""
    found: list[Candidate] = []
    if named:
        found += _by_name(shape, x0, "blink", ("blink",), "what a blink moves", 2.5)
        found += _by_part(shape, x0)
        found += _by_name(shape, x0, "eye name", OTHER_EYES, "what is named for the eyes", 0.8)
    balls = [(np.r_[middle_of_box(b)[:2], b[:, 2].max()], extent(b)) for b in shape.balls]
    found += _pairs("ball", "two balls", 1.5, balls, x0)
    found += _sharpest(shape, x0)
    tears = [(np.average(place, axis=0, weights=tear), extent(place)) for place, tear in shape.openings]
    found += _pairs("tear", "skin parts beside the middle", 0.7, tears, x0)
    loops = [loop for loop in shape.rims if len(loop) >= 6]
    rims, lids = (
        [(middle_of_box(shape.neutral[loop]), extent(shape.neutral[loop])) for loop in some]
        for some in (loops, [loop for loop in loops if closes(shape, loop)])
    )
    found += _pairs("rim", "two openings", 0.3, rims, x0)
    found += _pairs("closing", "two openings that close", 0.9, lids, x0)
    for kind, words, trust, places in (
        ("ball", "a ball", 1.5, balls),
        ("closing", "an opening that closes", 0.9, lids),
    ):
        if not any(one.kind == kind for one in found):
            found += [one for place, _ in places for one in _single(kind, words, trust, place, x0, shape)]
    return found


def closes(shape: Shape, loop: Int[np.ndarray, " n"]) -> bool:
    """Whether a movement brings one part of an opening's border to the rest or away from it, as lids and lips do."""
    points = shape.neutral[loop]
    width = extent(points)
    for k in np.flatnonzero(shape.channels.facial):
        d = shape.deltas[k, loop]
        length = np.linalg.norm(d, axis=1)
        still, moving = length < 0.25 * length.max(), length > 0.6 * length.max()
        if length.max() > CLOSES * width and still.any():
            tree = KDTree(points[still])  # lids may overshoot: half way counts too
            apart = [tree.query(points[moving] + t * d[moving])[0].mean() for t in (0, 0.5, 1)]
            if min(apart) < 0.6 * max(apart):
                return True
    return False


def _by_name(shape: Shape, x0: float, kind: str, kinds: tuple[str, ...], words: str, trust: float) -> list[Candidate]:
    """Where the movements of these kinds are on either side: the median of v + d / 2, by energy, of what moves most."""
    sides: tuple[list[tuple[float, np.ndarray]], list[tuple[float, np.ndarray]]] = ([], [])
    x = shape.neutral[:, 0] - x0
    for k in shape.channels.placed(*kinds):
        d = shape.deltas[k]
        length = shape.lengths[k] * shape.front
        w = np.where(length > LIDS * length.max(), shape.channels.energy[k], 0)
        balance = float(w @ np.sign(x) / (w.sum() or 1))
        for side, sign in zip(sides, (1, -1), strict=True):
            own = np.where(sign * x > 0, w, 0)
            if sign * balance > -ONE_SIDED and own.any():
                place = weighted_median(shape.neutral + d / 2, own)
                spread = float(np.sqrt(own @ ((shape.neutral + d / 2 - place) ** 2).sum(axis=1) / own.sum()))
                side.append((spread, place))
    left, right = (_of_the_smallest(side, LARGEST_LIDS * shape.channels.rho) for side in sides)
    return _pair(kind, words, trust, left, right, x0)


@dataclass(frozen=True, eq=False)
class Sharp:
    """A movement of one half of the face: its displacement over its extent, its place, and whether lids move so."""

    ratio: float
    place: Float[np.ndarray, " 3"]
    lids: bool


def _sharpest(shape: Shape, x0: float) -> list[Candidate]:
    """Where skin moves furthest for its extent, on both sides of the middle; where it moves down so, lids close.

    On five heads the ratio of a blink is 1.8 to 4.3 over a spread of 0.10 to 0.14 rho, straight down; that of brows
    drawn down is 1.2 at most.
    """
    rho = shape.channels.rho
    left, right = (sorted(_sharp(shape, x0, sign), key=lambda one: -one.ratio) for sign in (1, -1))
    pairs = [
        (a.ratio + b.ratio, a.lids and b.lids, np.stack([a.place, b.place]))
        for a in left
        for b in right
        if np.linalg.norm(a.place - mirror_image(b.place, x0)) < 0.15 * rho
    ]
    found = []
    for kind, words, trust, some in (
        ("lids", "something small beside the middle closes downwards", 1.2, [pair for pair in pairs if pair[1]]),
        ("motion", "what moves most sharply on both sides", 0.5, pairs),
    ):
        apart: list[np.ndarray] = []
        for _, _, pair in sorted(some, key=lambda one: -one[0]):
            if all(np.linalg.norm(pair[0] - other[0]) > 0.3 * rho for other in apart):
                apart.append(pair)
        found += [Candidate(kind, words, trust, pair) for pair in apart[:3]]
    return found


def _sharp(shape: Shape, x0: float, sign: int) -> list[Sharp]:
    """The movements of one half of the face, those around the middle left out."""
    rho, found = shape.channels.rho, []
    aside = sign * (shape.neutral[:, 0] - x0) > 0
    for k in np.flatnonzero(shape.channels.facial):
        length = shape.lengths[k] * shape.front
        own = np.flatnonzero((length > LIDS * length.max()) & aside)
        e, d = shape.channels.energy[k, own], shape.deltas[k, own]
        if not e.any():
            continue
        posed = shape.neutral[own] + d / 2
        place = weighted_median(posed, e)
        if sign * (place[0] - x0) < 0.5 * PUPILS_RHO[0] * rho:
            continue
        spread = float(np.sqrt(e @ ((posed - place) ** 2).sum(axis=1) / e.sum())) / rho
        ratio = float(length.max()) / rho / max(spread, FINEST)
        down = float(e @ d[:, 1]) < -STRAIGHT * float(e @ length[own])
        found.append(Sharp(ratio, place, down and ratio > LIDS_RATIO and spread < LIDS_SPREAD))
    return found


def _of_the_smallest(found: list[tuple[float, Float[np.ndarray, " 3"]]], most: float) -> Float[np.ndarray, " 3"] | None:
    """Mean of the places of movements as small as the smallest: a grin that closes the eyes too is left out.

    None where the smallest is larger than `most`, or where they lie further apart: the eyes of two heads.
    """
    smallest = min((spread for spread, _ in found), default=np.inf)
    if smallest > most:
        return None
    places = np.array([place for spread, place in found if spread <= WIDER * smallest])
    return places.mean(axis=0) if np.ptp(places, axis=0).max() < most else None


def weighted_median(x: Float[np.ndarray, "v n"], w: Float[np.ndarray, " v"]) -> Float[np.ndarray, " n"]:
    """The median of each coordinate, with weights."""
    x, w = x[w > 0], w[w > 0]
    order = np.argsort(x, axis=0, kind="stable")
    below = np.cumsum(w[order], axis=0)
    at, axes = (below < below[-1] / 2).sum(axis=0), np.arange(x.shape[1])
    return x[order[at, axes], axes]


def _by_part(shape: Shape, x0: float) -> list[Candidate]:
    """Middles of the parts called eyes, at their front."""
    named = shape.called_eyes
    x = shape.neutral[:, 0] - x0
    halves = [shape.neutral[named & (sign * x > 0)] for sign in (1, -1)]
    left, right = (np.r_[middle_of_box(h)[:2], h[:, 2].max()] if len(h) > 2 else None for h in halves)
    return _pair("part", "parts called eyes", 2.0, left, right, x0)


def _pair(
    kind: str, words: str, trust: float, left: np.ndarray | None, right: np.ndarray | None, x0: float
) -> list[Candidate]:
    """A pair of places; where one is missing or no mirror image, either with its own image, and less trusted."""
    if left is not None and right is not None:
        if np.linalg.norm(left - mirror_image(right, x0)) < 0.25 * (left[0] - right[0]):
            return [Candidate(kind, words, trust, np.stack([left, right]))]
        trust /= 2
    places = [np.stack([left, mirror_image(left, x0)])] if left is not None else []
    places += [np.stack([mirror_image(right, x0), right])] if right is not None else []
    return [Candidate(kind, f"{words} on one side", ONE_SIDE * trust, both) for both in places]


def _single(
    kind: str, words: str, trust: float, place: Float[np.ndarray, " 3"], x0: float, shape: Shape
) -> list[Candidate]:
    """A place clear of the middle with its mirror image."""
    if abs(place[0] - x0) < 0.5 * PUPILS_RHO[0] * shape.channels.rho:
        return []
    left, right = (place, None) if place[0] > x0 else (None, place)
    return _pair(kind, words, trust, left, right, x0)


def _pairs(
    kind: str, words: str, trust: float, places: list[tuple[Float[np.ndarray, " 3"], float]], x0: float
) -> list[Candidate]:
    """Every mirrored pair of these places (with sizes) of nearly one size, clear of the middle; the six largest."""
    found = []
    for left, a in places:
        for right, b in places:
            size = min(a, b)
            clear = left[0] > x0 > right[0] and left[0] - right[0] > size
            if size > 0.7 * max(a, b) and clear and np.linalg.norm(left - mirror_image(right, x0)) < 0.25 * size:
                found.append((size, Candidate(kind, words, trust, np.stack([left, right]))))
    found.sort(key=lambda one: -one[0])
    return [one for _, one in found[:6]]
