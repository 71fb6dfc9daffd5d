"""The signs of a head's pose: what each name, motion and shape says of up, facing and left.

A name alone is no sign: its blendshape has to move something, and the direction is that of the motion or of the line
between two centres of motion. Signs by name fall silent where the names contradict each other (`names_agree`).
"""

import numpy as np
from jaxtyping import Float

from capture_plan.face.axes import Role, Vote
from capture_plan.face.channels import Channels
from capture_plan.face.shape import TORN, Shape, middle_of_box

EYES = ("blink", "eye wide", "eye squint")
MOUTH = (
    *("jaw open", "mouth open", "mouth close", "mouth narrow", "mouth wide", "smile", "frown"),
    *("lip up", "lip down", "lip roll", "lip press", "mouth other"),
)
BROWS = ("brow up", "brow down")
BY_MOTION: tuple[tuple[str, tuple[str, ...], Role, float, float, float], ...] = (
    # words, kinds, role, sign of the motion, kappa, eps
    ("a blink closes downwards", ("blink",), "up", -1, 6.0, 0.04),
    ("the jaw opens downwards", ("jaw open",), "up", -1, 6.0, 0.04),
    ("the mouth opens downwards", ("mouth open",), "up", -1, 4.0, 0.10),
    ("brows are raised upwards", ("brow up",), "up", 1, 6.0, 0.03),
    ("brows are drawn downwards", ("brow down",), "up", -1, 5.0, 0.06),
    ("eyes look upwards", ("gaze up",), "up", 1, 4.0, 0.10),
    ("eyes look downwards", ("gaze down",), "up", -1, 4.0, 0.10),
    ("a smile goes upwards", ("smile",), "up", 1, 4.0, 0.06),
    ("the jaw is pushed forward", ("jaw forward",), "facing", 1, 5.0, 0.06),
    ("lips are pushed forward", ("mouth narrow",), "facing", 1, 3.0, 0.12),
    ("the tongue comes out forward", ("tongue",), "facing", 1, 3.0, 0.12),
)
SPREAD = 0.7  # of the summed lengths: left and right names that agree on a direction add up to more
SEVERAL = 3  # pairs of names that can contradict each other
CLOSING = 0.6  # share of the largest displacement: the lids alone
BODY_BEYOND = 7.0  # rho from the face: what lies there is a body


def all_votes(shape: Shape, sides: int) -> list[Vote]:
    """Every sign that speaks; `sides` is the axis across which the head mirrors itself best."""
    channels = shape.channels
    named = [*name_votes(channels), *_names_and_balls(shape, sides)] if names_agree(channels) else []
    return [*named, *shape_votes(shape, sides)]


def names_agree(channels: Channels) -> bool:
    """Whether blendshapes called left lie all to one side of those called right."""
    apart = _left_minus_right(channels)
    if len(apart) <= SEVERAL:
        return True
    return bool(np.linalg.norm(apart.sum(axis=0)) >= SPREAD * np.linalg.norm(apart, axis=1).sum())


def name_votes(channels: Channels) -> list[Vote]:
    """Signs that need names: which way what is called so moves, and what lies above what."""
    votes = []
    for words, kinds, role, sign, kappa, eps in BY_MOTION:
        rows = channels.of(*kinds)
        if rows:
            direction = sign * channels.direction[rows].mean(axis=0)
            votes.append(Vote(words, role, direction, kappa, eps, "named motion"))
    eyes, mouth, brows = (_middle_of(channels, kinds) for kinds in (EYES, MOUTH, BROWS))
    for words, above, below, kappa, eps in (
        ("what is named for the eyes lies above the mouth", eyes, mouth, 8.0, 0.02),
        ("what is named for the brows lies above the mouth", brows, mouth, 8.0, 0.02),
        ("what is named for the brows lies above the eyes", brows, eyes, 5.0, 0.08),
    ):
        if above is not None and below is not None:
            votes.append(Vote(words, "up", _unit(above - below), kappa, eps, "named place", line=True))
    apart = _left_minus_right(channels)
    if apart.any():
        strength = float(np.linalg.norm(apart.sum(axis=0)) / np.linalg.norm(apart, axis=1).sum())
        left = strength * _unit(apart.sum(axis=0))
        votes.append(Vote("names call this side left", "left", left, 6.0, 0.06, "named place"))
    return votes


def _names_and_balls(shape: Shape, sides: int) -> list[Vote]:
    """What is named for mouth and brows lies below and above two balls: for rigs that name no movement of the eyes."""
    channels = shape.channels
    balls = _balls(shape, sides)
    if channels.of(*EYES) or not balls:
        return []
    eyes, mouth, brows = balls[0].mean(axis=0), _middle_of(channels, MOUTH), _middle_of(channels, BROWS)
    votes = []
    if mouth is not None:
        words = "two balls lie above what is named for the mouth"
        votes.append(Vote(words, "up", _unit(eyes - mouth), 8.0, 0.06, "named place", line=True))
    if brows is not None:
        words = "what is named for the brows lies above two balls"
        votes.append(Vote(words, "up", _unit(brows - eyes), 5.0, 0.10, "named place", line=True))
    return votes


def shape_votes(shape: Shape, sides: int) -> list[Vote]:
    """Signs of shape and motion alone."""
    channels, rho = shape.channels, shape.channels.rho
    moved, a = channels.moved, shape.areas * shape.head
    head = a @ shape.neutral / a.sum()
    away = shape.neutral - head
    outer = moved * np.clip(np.einsum("vx,vx->v", away, shape.normals), 0, None)  # not the inside of the mouth
    votes = []
    if outer.any():
        looks = outer @ shape.normals / outer.sum()
        votes.append(Vote("the skin that moves looks forward", "facing", looks, 6.0, 0.03))
    votes.append(Vote("the face lies before the head", "facing", (channels.middle - head) / rho, 4.0, 0.30))
    votes += _largest_motion(shape)
    votes += _small_above_wide(channels, sides)
    votes += _eyes_and_mouth(shape, sides)
    votes += _lower_lip(shape, sides)
    votes += _closing(shape, sides)
    if channels.few:
        votes.append(Vote("the neck is cut below the head", "up", 4 * (a @ shape.normals) / a.sum(), 3.0, 0.35))
    votes += _body_votes(shape)
    return votes


def _largest_motion(shape: Shape) -> list[Vote]:
    """The largest motion of a whole face is the jaw's, downwards."""
    channels = shape.channels
    rows = np.flatnonzero(channels.facial)
    size = [float(shape.areas @ shape.lengths[k] ** 2) for k in rows]
    if len(rows) < 8:
        return []
    largest = rows[int(np.argmax(size))]
    return [Vote("the largest motion is the jaw's, downwards", "up", -channels.direction[largest], 3.0, 0.20)]


def _small_above_wide(channels: Channels, sides: int) -> list[Vote]:
    """Small movements beside the middle (lids, brows) lie above the wide ones of jaw and mouth."""
    rows = np.flatnonzero(channels.facial)
    aside = np.abs(channels.centre[rows, sides] - channels.middle[sides]) / channels.rho
    small = rows[(aside > 0.25) & (channels.radius[rows] < 0.45 * channels.rho)]
    wide = rows[(aside < 0.15) & (channels.radius[rows] > 0.45 * channels.rho)]
    if len(small) < 2 or len(wide) < 2:
        return []
    up = channels.centre[small].mean(axis=0) - channels.centre[wide].mean(axis=0)
    return [
        Vote(
            "small movements at the sides lie above wide ones in the middle",
            *("up", 2 * up / channels.rho, 6.0, 0.12),
            line=True,
        )
    ]


def _eyes_and_mouth(shape: Shape, sides: int) -> list[Vote]:
    """Balls, lids and lips by shape: the eyes lie above the mouth, and lids lie before the balls that they cover."""
    rho = shape.channels.rho
    votes = []
    balls = _balls(shape, sides)
    openings = [tear @ place / tear.sum() for place, tear in shape.openings]
    lids = _mirrored(openings, sides, shape, 0.15)
    lips = _lips(shape, sides)
    rims = [shape.neutral[loop] for loop in shape.rims if len(loop) >= 6]
    if lips is not None:
        lids = [pair for pair in lids if np.linalg.norm(pair.mean(axis=0) - lips) > 0.5 * rho]  # no mouth corners
        pairs = _mirrored([rim.mean(axis=0) for rim in rims if np.ptp(rim, axis=0).max() < rho], sides, shape, 0.05)
        pairs = [pair for pair in pairs if np.linalg.norm(pair.mean(axis=0) - lips) > 0.5 * rho]
        for eyes, words, eps in (
            (shape.eye_parts(sides), "parts called eyes lie above where lips part", 0.04),
            (balls[:1], "two balls lie above where lips part", 0.06),
            (lids[:1], "lids part above the lips", 0.10),
            (pairs[:1], "two openings lie above where lips part", 0.25),
        ):
            if eyes:
                votes.append(Vote(words, "up", _unit(eyes[0].mean(axis=0) - lips), 8.0, eps, line=True))
                break
    for pair in balls[:1]:
        before = pair.mean(axis=0) - shape.areas @ shape.neutral / shape.areas.sum()
        votes.append(Vote("two balls lie before the head", "facing", before / rho, 4.0, 0.25))
        covers = [rim.mean(axis=0) - ball for ball in pair for rim in rims if _covers(rim, ball, rho)]
        if covers:
            votes.append(Vote("lids lie before the eyeballs", "facing", _unit(np.mean(covers, axis=0)), 6.0, 0.08))
    return votes


def _balls(shape: Shape, sides: int) -> list[Float[np.ndarray, "2 3"]]:
    """Middles of two balls that mirror each other, the pair nearest to what moves first: earrings lie further."""
    return _mirrored([middle_of_box(ball) for ball in shape.balls], sides, shape, 0.05)


def _lower_lip(shape: Shape, sides: int) -> list[Vote]:
    """Where lips part, the lower one moves more: it hangs on the jaw."""
    tear, pair = shape.tears
    lips = _lips(shape, sides)
    if lips is None:
        return []
    one, other = (shape.neutral[pair[tear > TORN, end]] for end in (0, 1))
    near = np.linalg.norm((one + other) / 2 - lips, axis=1) < 0.6 * shape.channels.rho
    m = shape.lengths[shape.channels.facial].max(axis=0)
    more = (m[pair[tear > TORN, 0]] - m[pair[tear > TORN, 1]])[near, None]
    apart = (one - other)[near]
    if not more.any():  # a card that flaps about its middle
        return []
    down = (more * apart).sum(axis=0) / (np.abs(more).sum() * np.linalg.norm(apart, axis=1).mean())
    return [Vote("the lower lip moves more than the upper", "up", -2 * down, 4.0, 0.12)]


def _closing(shape: Shape, sides: int) -> list[Vote]:
    """What is small, beside the middle, and moves towards the mouth by more than its size is a lid, above the mouth."""
    lips, rho = _lips(shape, sides), shape.channels.rho
    if lips is None:
        return []
    ups = []
    for k in np.flatnonzero(shape.channels.facial):
        length = shape.lengths[k]
        most = length > CLOSING * length.max()
        place, way = shape.neutral[most].mean(axis=0), _unit(shape.deltas[k, most].sum(axis=0))
        spread = np.sqrt(((shape.neutral[most] - place) ** 2).sum(axis=1).mean())
        apart = lips - place
        aside = abs(apart[sides])
        apart[sides] = 0
        small = spread < 0.25 * rho and length.max() > 1.2 * spread and 0.25 * rho < aside < 1.2 * rho
        if small and np.linalg.norm(apart) > 0.5 * rho and way @ _unit(apart) > 0.85:
            ups.append(-way)
    if not ups:
        return []
    return [Vote("something small beside the middle closes towards the mouth", "up", np.mean(ups, axis=0), 6.0, 0.12)]


def _lips(shape: Shape, sides: int) -> Float[np.ndarray, " 3"] | None:
    """Where skin parts most across the middle; None where none does, or so little moves that it may be lids."""
    if shape.channels.few:
        return None
    openings = (tear @ place / tear.sum() for place, tear in shape.openings)
    return next((place for place in openings if _aside(place, sides, shape) < 0.2), None)


def _covers(rim: Float[np.ndarray, "n 3"], ball: Float[np.ndarray, " 3"], rho: float) -> bool:
    """Whether a rim may be that of the lids over a ball: near it, and no wider than an eye."""
    return bool(np.linalg.norm(rim.mean(axis=0) - ball) < 0.4 * rho and np.ptp(rim, axis=0).max() < rho)


def _mirrored(places: list[np.ndarray], sides: int, shape: Shape, tolerance: float) -> list[Float[np.ndarray, "2 3"]]:
    """Pairs of places that mirror each other within a share of rho, as far apart as eyes are; the nearest first."""
    middle, rho = shape.mirror_across(sides)[1], shape.channels.rho
    flip = np.where(np.arange(3) == sides, -1.0, 1.0)
    images = [one * flip + np.where(np.arange(3) == sides, 2 * middle, 0.0) for one in places]
    pairs = [
        np.stack([one, other])
        for i, (one, image) in enumerate(zip(places, images, strict=True))
        for other in places[i + 1 :]
        if np.linalg.norm(image - other) < tolerance * rho and 0.15 < abs(one[sides] - middle) / rho < 1.6
    ]
    return sorted(pairs, key=lambda pair: float(np.linalg.norm(pair.mean(axis=0) - shape.channels.middle)))


def _aside(place: Float[np.ndarray, " 3"], sides: int, shape: Shape) -> float:
    """How far a place lies from the mirror plane, in rho."""
    return abs(float(place[sides]) - shape.mirror_across(sides)[1]) / shape.channels.rho


def _body_votes(shape: Shape) -> list[Vote]:
    """A body hangs below the head."""
    channels = shape.channels
    away = shape.neutral - channels.middle
    far = shape.areas * (np.linalg.norm(away, axis=1) > BODY_BEYOND * channels.rho)
    if far.sum() < 0.5 * (shape.areas @ shape.near):
        return []
    return [Vote("the body hangs below the head", "up", -_unit(far @ away), 5.0, 0.25)]


def _left_minus_right(channels: Channels) -> Float[np.ndarray, "n 3"]:
    """From the right to the left one of every pair of names that differ in their side, by kind."""
    kinds = {m.kind for m in channels.movements if m and m.side and not m.kind.startswith("gaze")}
    apart = []
    for kind in sorted(kinds):
        left, right = (channels.of(kind, side=side) for side in ("left", "right"))
        if left and right:
            apart.append(channels.centre[left].mean(axis=0) - channels.centre[right].mean(axis=0))
    return np.array(apart).reshape(-1, 3)


def _middle_of(channels: Channels, kinds: tuple[str, ...]) -> Float[np.ndarray, " 3"] | None:
    rows = channels.placed(*kinds) or channels.of(*kinds)
    return channels.centre[rows].mean(axis=0) if rows else None


def _unit(u: Float[np.ndarray, " 3"]) -> Float[np.ndarray, " 3"]:
    length = float(np.linalg.norm(u))
    return u / length if length > 0 else u
