"""Other faces whose true rig is known, to see what a packing is worth before anybody is scanned.

Data       v0, d[k]    neutral and deltas of a rig, millimetres
           phi         a smooth map of space that bends one face into another
           p           a person: g[k] and r[k], smooth random fields of mean square 1 and 1 per axis
Truth      neutral phi(v0);  delta  J d + A g[k] J d + A r[k] x J d,  J the derivative of phi at each vertex
           A = 0 for the same person reshaped, else the share by which this person moves more, less or otherwise

Why it is fair: J carries a movement as the flesh around it is carried, lengthwise and into depth alike, which no
triangle can tell; deformation transfer sees triangles alone, so that neither is a special case of the other, and they
agree where phi turns and scales evenly. What a person does differently is not in any neutral and grows with the
movement, as Carrigan et al. 2020 (section 4.3) observe. Half of a field is common to all blendshapes of a person.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from capture_plan.mesh.mirror import mirror_plane, reflect
from capture_plan.once import once
from capture_plan.rig import Rig

Map = Callable[[np.ndarray], np.ndarray]
STEP = 1e-3  # mm: far above rounding, far below any curve of phi
HABIT = 0.25  # A of another person: a smile a quarter wider or narrower
HABIT_SQUARE = 3 * HABIT**2  # of |d|^2: once along the movement, twice across it, for r x d has no part along r
WAVE_MM = 60.0  # over which a person's habit changes: a cheek, not a pore
WAVES = 64  # that make up a random field
PLACES = 400  # at which a habit is looked at, about 8 mm apart on a face: it changes over 60
BUMPS = 12  # on either side, that make another face
BUMP_MM, BUMP_WIDTH_MM = 4.0, 25.0  # height and standard deviation: no fold, for 4 / 25 is far below 1


@dataclass(frozen=True, eq=False)
class Target:
    """Another face on the rig's mesh, with the deltas that a perfect rig of it has, millimetres."""

    name: str
    neutral: Float[np.ndarray, "v 3"]
    deltas: Float[np.ndarray, "k v 3"]


def all_targets(rig: Rig, *, people: int, seed: int) -> tuple[Target, ...]:
    """The rig lowered to 0.6, wider, narrower, and as `people` other persons."""
    others = (another_person(rig, seed + number, name=f"person {number + 1}") for number in range(people))
    return (lower(rig, 0.6), wider(rig, 0.25), wider(rig, -0.25), *others)


def lower(rig: Rig, factor: float) -> Target:
    """Everything scaled along y: the case in which deformation transfer fails (Carrigan et al. 2020, Fig. 3)."""
    return bent(rig, f"height x {factor:g}", lambda x: x * np.array([1, factor, 1]))


def wider(rig: Rig, by: float) -> Target:
    """Wider (narrower: negative) by a share at the middle of the face's height, less above and below."""
    y = rig.neutral[rig.skin, 1]
    middle, width = float((y.min() + y.max()) / 2), float(np.ptp(y)) / 4
    c = mirror_plane(rig.neutral)

    def phi(x: np.ndarray) -> np.ndarray:
        stretch = 1 + by * np.exp(-(((x[..., 1] - middle) / width) ** 2) / 2)
        return np.stack([c + (x[..., 0] - c) * stretch, x[..., 1], x[..., 2]], axis=-1)

    return bent(rig, "wide" if by > 0 else "narrow", phi)


def another_person(rig: Rig, seed: int, *, name: str) -> Target:
    """A symmetric face with other proportions, and habits of its own."""
    rng = np.random.default_rng(seed)
    skin = rig.neutral[rig.skin]
    at, push = skin[rng.integers(len(skin), size=BUMPS)], rng.normal(0, BUMP_MM, (BUMPS, 3))
    at = np.concatenate([at, reflect(at, mirror_plane(rig.neutral))])
    push = np.concatenate([push, push * np.array([-1, 1, 1])])

    def phi(x: np.ndarray) -> np.ndarray:
        return x + sum(
            c * np.exp(-np.square(x - p).sum(axis=-1, keepdims=True) / (2 * BUMP_WIDTH_MM**2))
            for p, c in zip(at, push, strict=True)
        )

    reshaped = bent(rig, name, phi)
    fields = habit_fields(rig.neutral, len(rig.names), rng)
    deltas = np.stack([habit(d, field) for d, field in zip(reshaped.deltas, fields, strict=True)])
    return Target(name, reshaped.neutral, deltas)


def bent(rig: Rig, name: str, phi: Map) -> Target:
    """phi(v0) and J d = (phi(v0 + h d / |d|) - phi(v0 - h d / |d|)) |d| / 2 h."""
    deltas = np.zeros(rig.deltas.shape)
    for k, d in enumerate(rig.deltas.astype(float)):
        moving = rig.displacement[k] > 0
        length = np.linalg.norm(d[moving], axis=1, keepdims=True)
        step = STEP * d[moving] / length
        there = phi(rig.neutral[moving] + step) - phi(rig.neutral[moving] - step)
        deltas[k, moving] = there * length / (2 * STEP)
    return Target(name, phi(rig.neutral), deltas)


def habit(d: Float[np.ndarray, "v 3"], field: Float[np.ndarray, "v 4"]) -> Float[np.ndarray, "v 3"]:
    """d + A g d + A r x d."""
    return d + HABIT * (field[:, :1] * d + np.cross(field[:, 1:], d))


def habit_fields(
    points: Float[np.ndarray, "v 3"], blendshapes: int, rng: np.random.Generator
) -> Iterator[Float[np.ndarray, "v 4"]]:
    """g and r of a person at these places, for one blendshape after another; half of each is common to all."""
    common = random_field(points, rng)
    for _ in range(blendshapes):
        yield np.sqrt(0.5) * (common + random_field(points, rng))


@once
def habit_squares(rig: Rig, *, people: int, seed: int) -> Float[np.ndarray, "p k"]:
    """Squared error that the habits of persons add to each blendshape, as a share of its mean over these persons."""
    at = np.flatnonzero(rig.skin)
    at = at[np.linspace(0, len(at) - 1, min(PLACES, len(at))).astype(int)]
    d, rng = rig.deltas[:, at].astype(float), np.random.default_rng(seed)
    squares = np.empty((people, len(d)))
    for person in squares:
        fields = habit_fields(rig.neutral[at], len(d), rng)
        person[:] = [np.square(habit(one, field) - one).sum() for one, field in zip(d, fields, strict=True)]
    mean = squares.mean(axis=0)
    return np.divide(squares, mean, out=np.ones_like(squares), where=mean > 0)


def random_field(points: Float[np.ndarray, "v 3"], rng: np.random.Generator) -> Float[np.ndarray, "v 4"]:
    """Four smooth functions of space of mean square 1: waves of random direction, length and phase."""
    waves = rng.normal(0, 2 * np.pi / WAVE_MM / np.sqrt(3), (3, WAVES))
    phase, height = rng.uniform(0, 2 * np.pi, WAVES), rng.normal(0, np.sqrt(2 / WAVES), (WAVES, 4))
    return np.cos(points @ waves + phase) @ height
