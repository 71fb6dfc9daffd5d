"""Where eyes and mouth are: candidates from names, motion and shape, and the pair of them that most signs agree on.

Data       a head in the rig's axes (+y up, +z forward, the subject's left +x), in any unit; x0 its mirror plane
Eyes       mirrored pairs of places: what a blink moves, half way; parts called eyes; balls; other movements of the
           eyes; skin that parts beside the middle; rims that mirror each other
Mouth      places on the mirror plane: what is called mouth; skin that parts across the middle; rims across it
Agreement  candidates within NEAR pupil distances are one; their trusts add up, each kind of sign once
Score      trust of the eyes + trust of the mouth - (log(h / (USUAL p)) / LOOSE)^2 / 2, h from the eyes to the mouth and
           p between the pupils
Sure       the score leads that of every other place by LEAD, at least two kinds of sign agree, and the mouth lies
           below the eyes as it does in faces
Trusts are those of a trial on 1,200 generated heads of three base meshes; the width of an opening is no argument.
"""

import re
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from scipy.spatial import KDTree

from capture_plan.rig.face.record import Sign
from capture_plan.rig.face.shape import Shape, middle_of_box

EYE_PART = re.compile(
    r"sclera|iris|cornea|pupil|eye(?!.?(lash|brow|lid|occl|blend|wet|shadow|socket|tear|lac|line|shell|fluid|glass))",
    re.IGNORECASE,
)
LIPS = (
    *("mouth narrow", "mouth wide", "smile", "frown", "lip up", "lip down", "lip roll", "lip press"),
    *("mouth close", "mouth other", "mouth side", "mouth open"),
)
BY_WORD = {"blink", "eye name", "part"}  # kinds of sign that fall together where names lie
OTHER_EYES = ("eye wide", "eye squint", "gaze up", "gaze down", "gaze in", "gaze out")
LIDS = 0.6  # share of the largest displacement: the lids alone; one blink moves the throat by 0.55 of that
NEAR = 0.35  # pupil distances
USUAL, LOOSE = (
    1.0,
    0.35,
)  # of the pupil distance from the eyes to the mouth: four human heads 0.9 to 1.15; in logarithms
LEAD = 0.5
BELOW, DEEP = (0.3, 1.9), 0.9  # pupil distances from the eyes down and in depth to the mouth
STRONG_TEAR = 6.0
FRONT = 0.25  # rho: lips are about 12 mm deep
CLOSES = 0.25  # of the width of an opening, by which the largest movement near it moves its border
ONE_SIDED = 0.8  # of a movement's energy on one side less that on the other
ONE_SIDE = 0.6  # of the trust in both sides
WIDER = 1.5  # times the smallest movement of its name: it moves more than that
LARGEST_LIDS = 0.45  # rho: spread of a movement of one eye, lids 0.2
WIDEST = 1.2  # rho: a movement of the mouth alone is smaller
PUPILS_RHO = (0.3, 3.2)  # rho between the pupils: humans 0.9 to 1.3, cartoons up to 2.5


@dataclass(frozen=True, eq=False)
class Candidate:
    """Places that one sign gives: a pair (left, right) for the eyes, one for the mouth."""

    kind: str
    words: str
    trust: float
    places: Float[np.ndarray, "n 3"]


@dataclass(frozen=True, eq=False)
class Found:
    """The places chosen, None where no sign speaks; `signs` carry each candidate's trust, below 0 if elsewhere."""

    places: Float[np.ndarray, "n 3"] | None
    sure: bool
    signs: tuple[Sign, ...]


@dataclass(frozen=True, eq=False)
class Points:
    """Mirror plane x0, eyes (left, right) and mouth of a head."""

    x0: float
    eyes: Found
    mouth: Found


def find_points(shape: Shape, parts: np.ndarray, part_names: tuple[str, ...], *, named: bool) -> Points:
    """Eyes and mouth of a head in the rig's axes; names are heeded where `named` says that they do not contradict."""
    x0 = shape.mirror_across(0)[1]
    eyes = [one for one in eye_candidates(shape, x0, parts, part_names, named=named) if _possible(one, shape)]
    mouths = mouth_candidates(shape, x0, named=named)
    return Points(x0, *choose(eyes, mouths))


def choose(eyes: list[Candidate], mouths: list[Candidate]) -> tuple[Found, Found]:
    """The pair of eyes and mouth of the highest score, each with its doubt."""
    if not eyes:
        return Found(None, False, ()), Found(None, False, _signs(mouths, ()))
    scored = [
        (_trust(eye, eyes, pupils(eye)) + _trust_of_mouth(eye, mouth, mouths), i, j)
        for i, eye in enumerate(eyes)
        for j, mouth in enumerate([*mouths, None])
    ]
    best, i, j = max(scored, key=lambda one: (round(one[0], 6), -one[1], -one[2]))
    eye, p = eyes[i], pupils(eyes[i])
    mouth = mouths[j] if j < len(mouths) else None
    with_eye = [one for one in eyes if _same(one, eye, p)]
    other_eyes = max((s for s, a, _ in scored if not _same(eyes[a], eye, p)), default=-np.inf)
    kinds = {one.kind for one in with_eye}
    several = len(kinds - BY_WORD) + bool(kinds & BY_WORD) > 1 or (mouth is not None and bool(kinds & BY_WORD))
    fits = not mouths if mouth is None else _face_like(eye, mouth)
    sure = best - other_eyes > LEAD and several and fits
    found_eyes = Found(_together(with_eye), sure, _signs(eyes, with_eye))
    if mouth is None:
        return found_eyes, Found(None, False, ())
    with_mouth = [one for one in mouths if _same(one, mouth, p)]
    other = max((s for s, a, b in scored if a == i and b < len(mouths) and not _same(mouths[b], mouth, p)), default=0.0)
    several = len({one.kind for one in with_mouth}) > 1 or mouth.trust >= 2
    return found_eyes, Found(
        _most_trusted(with_mouth), best - other > LEAD and several and fits, _signs(mouths, with_mouth)
    )


def _most_trusted(agreeing: list[Candidate]) -> Float[np.ndarray, "n 3"]:
    return max(agreeing, key=lambda one: one.trust).places


def _together(agreeing: list[Candidate]) -> Float[np.ndarray, "n 3"]:
    """Mean of the places of the best sign of each kind, by trust."""
    best = {one.kind: one for one in sorted(agreeing, key=lambda one: one.trust)}.values()
    return np.average([one.places for one in best], axis=0, weights=[one.trust for one in best])


def pupils(eyes: Candidate) -> float:
    """Distance between the places of a pair."""
    return float(np.linalg.norm(eyes.places[0] - eyes.places[1]))


def eye_candidates(
    shape: Shape, x0: float, parts: np.ndarray, part_names: tuple[str, ...], *, named: bool
) -> list[Candidate]:
    """Every pair of places that a sign takes for the eyes."""
    found: list[Candidate] = []
    if named:
        found += _by_name(shape, x0, "blink", ("blink",), "what a blink moves", 2.5)
        found += _by_part(shape, x0, parts, part_names)
        found += _by_name(shape, x0, "eye name", OTHER_EYES, "what is named for the eyes", 0.8)
    balls = [(np.r_[middle_of_box(b)[:2], b[:, 2].max()], _width(b)) for b in shape.balls]
    found += _pairs("ball", "two balls", 1.5, balls, x0)
    tears = [(np.average(place, axis=0, weights=tear), _width(place)) for place, tear in shape.openings]
    found += _pairs("tear", "skin parts beside the middle", 0.7, tears, x0)
    loops = [loop for loop in shape.rims if len(loop) >= 6]
    rims, lids = (
        [(middle_of_box(shape.neutral[loop]), _width(shape.neutral[loop])) for loop in some]
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


def mouth_candidates(shape: Shape, x0: float, *, named: bool) -> list[Candidate]:
    """Every place that a sign takes for the mouth."""
    channels, rho = shape.channels, shape.channels.rho
    found = []
    rows = [k for k in channels.of(*LIPS) if channels.radius[k] < WIDEST * rho] if named else []
    if rows:
        place = np.median(channels.centre[rows], axis=0)
        found.append(Candidate("name", "what is named for the mouth", 2.0, _on_plane(place, x0)))
    for place, tear in shape.openings:
        middle = np.abs(place[:, 0] - x0) < 0.25 * rho
        across = middle.any() and place[:, 0].min() < x0 < place[:, 0].max()
        if across:  # at the front: behind the lips, teeth and tongue part too
            front = middle & (place[:, 2] > place[middle, 2].max() - FRONT * rho)
            centre = np.average(place[front], axis=0, weights=tear[front] ** 2)
            trust = 1.8 if tear.max() > STRONG_TEAR else 1.2
            found.append(Candidate("tear", "skin parts across the middle", trust, _on_plane(centre, x0)))
    for loop in shape.rims:
        points = shape.neutral[loop]
        centre = middle_of_box(points)
        if len(loop) >= 6 and abs(centre[0] - x0) < 0.1 * rho and _width(points) < 2.5 * rho:
            found.append(Candidate("rim", "an opening across the middle", 0.7, _on_plane(centre, x0)))
    return found[:12]


def closes(shape: Shape, loop: Int[np.ndarray, " n"]) -> bool:
    """Whether a movement brings one part of an opening's border to the rest or away from it, as lids and lips do."""
    points = shape.neutral[loop]
    width = _width(points)
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
    for k in shape.channels.of(*kinds):
        d = shape.deltas[k]
        length = np.linalg.norm(d, axis=1) * shape.front
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


def _of_the_smallest(found: list[tuple[float, Float[np.ndarray, " 3"]]], most: float) -> Float[np.ndarray, " 3"] | None:
    """Mean of the places of movements as small as the smallest: a grin that closes the eyes too is left out."""
    smallest = min((spread for spread, _ in found), default=np.inf)
    if smallest > most:
        return None
    return np.mean([place for spread, place in found if spread <= WIDER * smallest], axis=0)


def weighted_median(x: Float[np.ndarray, "v 3"], w: Float[np.ndarray, " v"]) -> Float[np.ndarray, " 3"]:
    """The median of each coordinate, with weights."""
    x, w = x[w > 0], w[w > 0]
    order = np.argsort(x, axis=0, kind="stable")
    below = np.cumsum(w[order], axis=0)
    at = (below < below[-1] / 2).sum(axis=0)
    return x[order[at, np.arange(3)], np.arange(3)]


def _by_part(shape: Shape, x0: float, parts: np.ndarray, part_names: tuple[str, ...]) -> list[Candidate]:
    """Middles of the parts called eyes, at their front."""
    named = np.isin(parts, [i for i, name in enumerate(part_names) if EYE_PART.search(name)]) & shape.near
    x = shape.neutral[:, 0] - x0
    halves = [shape.neutral[named & (sign * x > 0)] for sign in (1, -1)]
    left, right = (np.r_[middle_of_box(h)[:2], h[:, 2].max()] if len(h) > 2 else None for h in halves)
    return _pair("part", "parts called eyes", 2.0, left, right, x0)


def _pair(
    kind: str, words: str, trust: float, left: np.ndarray | None, right: np.ndarray | None, x0: float
) -> list[Candidate]:
    """A pair of places; where one is missing or no mirror image, either with its own image, and less trusted."""
    if left is not None and right is not None:
        if np.linalg.norm(left - _image(right, x0)) < 0.25 * (left[0] - right[0]):
            return [Candidate(kind, words, trust, np.stack([left, right]))]
        trust /= 2
    places = [np.stack([left, _image(left, x0)])] if left is not None else []
    places += [np.stack([_image(right, x0), right])] if right is not None else []
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
            if size > 0.7 * max(a, b) and clear and np.linalg.norm(left - _image(right, x0)) < 0.25 * size:
                found.append((size, Candidate(kind, words, trust, np.stack([left, right]))))
    found.sort(key=lambda one: -one[0])
    return [one for _, one in found[:6]]


def _possible(eyes: Candidate, shape: Shape) -> bool:
    low, high = (share * shape.channels.rho for share in PUPILS_RHO)
    return low < pupils(eyes) < high


def _same(one: Candidate, other: Candidate, p: float) -> bool:
    return bool(np.linalg.norm((one.places - other.places) * [1, 1, 0.5], axis=1).max() < NEAR * p)


def _trust(one: Candidate, all_of_them: Iterable[Candidate], p: float) -> float:
    """Trusts of all that agree with a candidate, the most trusted of each kind."""
    best: dict[str, float] = {}
    for other in all_of_them:
        if _same(one, other, p):
            best[other.kind] = max(best.get(other.kind, 0.0), other.trust)
    return sum(best.values())


def _trust_of_mouth(eye: Candidate, mouth: Candidate | None, mouths: list[Candidate]) -> float:
    if mouth is None:
        return 0.0
    p = pupils(eye)
    h = float(np.linalg.norm(eye.places.mean(axis=0) - mouth.places[0]))
    usual = np.log(max(h, 1e-9) / (USUAL * p)) / LOOSE
    return _trust(mouth, mouths, p) - 0.5 * float(usual) ** 2 - (0 if _face_like(eye, mouth) else 2.0)


def _face_like(eye: Candidate, mouth: Candidate) -> bool:
    """Whether the mouth lies below the eyes, and not far behind or before them."""
    p, off = pupils(eye), eye.places.mean(axis=0) - mouth.places[0]
    return bool(BELOW[0] * p < off[1] < BELOW[1] * p and abs(off[2]) < DEEP * p)


def _signs(all_of_them: list[Candidate], agreeing: Iterable[Candidate]) -> tuple[Sign, ...]:
    agree = {id(one) for one in agreeing}
    best: dict[tuple[str, bool], Candidate] = {}
    for one in all_of_them:
        key = (one.words, id(one) in agree)
        if key not in best or best[key].trust < one.trust:
            best[key] = one
    return tuple(
        Sign(words, "here" if here else "elsewhere", one.trust if here else -one.trust)
        for (words, here), one in best.items()
        if here or (words, True) not in best
    )


def _on_plane(place: Float[np.ndarray, " 3"], x0: float) -> Float[np.ndarray, "1 3"]:
    return np.array([[x0, place[1], place[2]]])


def _image(place: Float[np.ndarray, " 3"], x0: float) -> Float[np.ndarray, " 3"]:
    return np.array([2 * x0 - place[0], place[1], place[2]])


def _width(points: Float[np.ndarray, "n 3"]) -> float:
    return float(np.ptp(points, axis=0).max())
