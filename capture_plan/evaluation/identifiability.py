"""What a layout lets us see: which blendshapes it knows, which it confuses, and what each landmark is there for.

Data       B          landmark response (3m k), three rows a landmark, millimetres at full weight; b_k its columns
           sigma      noise of a landmark coordinate, millimetres;  C the covariance of the weights (see `information`)
Answers    B = U S V^T               singular values: how strongly each mix of blendshapes moves the landmarks
           |b_k| / sigma             signal to noise: blendshape k alone at full weight against the noise along b_k
           angle(b_i, b_j)           0 degrees: i and j move all landmarks alike. Weights are never negative, so that
                                     opposites (180 degrees) are distinguished
           B^T B - A_m^T A_m         the same without landmark m, A_m being its three rows; B^T B + A^T A with one more
"""

import numpy as np
from jaxtyping import Float, Int
from msgspec import Struct

from capture_plan.layout.face import Face
from capture_plan.layout.observation import Observation
from capture_plan.layout.settings import LayoutSettings
from capture_plan.layout.sites import single_sites
from capture_plan.mesh import geodesic_distance

WEAK = 10.0  # a tenth of the full movement drowns in the noise below this
CONFUSABLE_DEG = 25.0  # two responses share nine tenths of their length: cos 25 degrees = 0.91
NAMED = 0.3  # parts of a mix that are worth saying; the squares of all parts add up to 1
ROUNDING = 1e-9  # share of the largest response below which a response is none


class Mix(Struct, frozen=True):
    """A direction of the weights, of length 1: its largest parts by name, and what it moves, millimetres.

    `response_mm` is the length of what all landmarks together answer (a singular value), `skin_mm` the root mean
    square movement of the skin.
    """

    parts: tuple[tuple[str, float], ...]
    response_mm: float
    skin_mm: float


class Sight(Struct, frozen=True):
    """How well one blendshape is seen: its response, and the other one whose response is most like it.

    `weight_sd` is the standard deviation to which its weight (0 to 1) is known with all others unknown too.
    """

    name: str
    response_mm: float
    signal_to_noise: float
    weight_sd: float
    partner: str
    angle_degrees: float


class Separator(Struct, frozen=True):
    """The one more dot that would tell two confusable blendshapes apart best, and the angle with it."""

    blendshapes: tuple[str, str]
    angle_degrees: float
    vertex: int
    position: tuple[float, float, float]
    nearest: int
    nearest_mm: float
    angle_then_degrees: float


class Reason(Struct, frozen=True):
    """Why a landmark is there: blendshapes that no other sees, else the pair that it tells apart most."""

    only_one: tuple[str, ...]
    pair: tuple[str, str]
    angle_degrees: float
    angle_without_degrees: float


def weakest_mixes(
    observation: Observation, vertices: Int[np.ndarray, " m"], names: tuple[str, ...], *, count: int
) -> tuple[Mix, ...]:
    """The `count` mixes that move the landmarks least, the weakest first."""
    _, sigma, V = np.linalg.svd(observation.response(vertices), full_matrices=True)
    sigma = np.pad(sigma, (0, max(0, len(names) - len(sigma))))[: len(names)]
    mixes = []
    for k in range(len(names) - 1, max(-1, len(names) - 1 - count), -1):
        v = V[k] * np.sign(V[k, np.abs(V[k]).argmax()])
        named = [i for i in np.argsort(-np.abs(v), kind="stable").tolist() if abs(v[i]) >= NAMED] or [int(v.argmax())]
        skin_mm = float(np.sqrt(max(0.0, v @ observation.gram @ v)))
        mixes.append(Mix(tuple((names[i], round(float(v[i]), 3)) for i in named), float(sigma[k]), skin_mm))
    return tuple(mixes)


def angles(gram: Float[np.ndarray, "*n k k"]) -> Float[np.ndarray, "*n k k"]:
    """Between every two responses of which `gram` holds the products, degrees; 180 where one is none, and to itself."""
    length = np.sqrt(np.clip(np.diagonal(gram, axis1=-2, axis2=-1), 0, None))
    none = length <= ROUNDING * max(float(length.max(initial=0)), 1e-300)
    safe = np.where(none, 1, length)
    cosine = gram / safe[..., :, None] / safe[..., None, :]
    cosine = np.where(none[..., :, None] | none[..., None, :] | np.eye(gram.shape[-1], dtype=bool), -1, cosine)
    return np.degrees(np.arccos(np.clip(cosine, -1, 1)))


def sights(observation: Observation, vertices: Int[np.ndarray, " m"], names: tuple[str, ...]) -> tuple[Sight, ...]:
    """Every blendshape, in the order of `names`."""
    B = observation.response(vertices)
    between = angles(B.T @ B)
    partner = between.argmin(axis=1)
    length = np.linalg.norm(B, axis=0)
    sd = np.sqrt(np.diagonal(observation.covariance(vertices)))
    return tuple(
        Sight(
            name=name,
            response_mm=float(length[k]),
            signal_to_noise=float(length[k] / observation.noise_mm),
            weight_sd=float(sd[k]),
            partner=names[partner[k]],
            angle_degrees=float(between[k, partner[k]]),
        )
        for k, name in enumerate(names)
    )


def confusable(sights: tuple[Sight, ...]) -> tuple[tuple[str, str], ...]:
    """Pairs closer than `CONFUSABLE_DEG` of which one is the other's nearest, the closest first, each once."""
    near = sorted((s for s in sights if s.angle_degrees < CONFUSABLE_DEG), key=lambda s: s.angle_degrees)
    return tuple(dict.fromkeys((min(s.name, s.partner), max(s.name, s.partner)) for s in near))


def separators(
    face: Face,
    settings: LayoutSettings,
    vertices: Int[np.ndarray, " m"],
    pairs: tuple[tuple[str, str], ...],
) -> tuple[Separator, ...]:
    """For each pair the vertex, at the spacing to all landmarks, that would open the angle between the two most."""
    sites = single_sites(face.relative_displacement(settings), face.visibility, face.allowed(settings))
    along = geodesic_distance(face.graph, vertices)[:, sites.vertices[:, 0]]
    apart = along.min(axis=0) >= max(settings.spacing_mm, 1e-9)
    at = sites.vertices[apart, 0]
    if not len(at):
        return ()
    observation = face.observation(settings.noise_mm, settings.dot_mm)
    B, deltas = observation.response(vertices), observation.measured
    answers = []
    for pair in pairs:
        i, j = (face.used.index(name) for name in pair)
        # B^T B + A^T A of the two blendshapes, for every place at once
        A = deltas[[i, j]][:, at].astype(np.float64)
        gram = (B[:, [i, j]].T @ B[:, [i, j]])[None] + np.einsum("ivx,jvx->vij", A, A)
        after = angles(gram)[:, 0, 1]
        best = int(after.argmax())
        reached = along[:, np.flatnonzero(apart)[best]]
        answers.append(
            Separator(
                blendshapes=pair,
                angle_degrees=float(angles(B.T @ B)[i, j]),
                vertex=int(at[best]),
                position=tuple(np.round(face.rig.neutral[at[best]], 1).tolist()),
                nearest=int(reached.argmin()),
                nearest_mm=float(reached.min()),
                angle_then_degrees=float(after[best]),
            )
        )
    return tuple(answers)


def shares(face: Face, settings: LayoutSettings, vertices: Int[np.ndarray, " m"]) -> Float[np.ndarray, "k m"]:
    """How far each blendshape moves each vertex, as a share of its largest movement of skin that is seen."""
    displacement = face.displacement
    largest = np.where(face.allowed(settings), displacement, 0).max(axis=1, keepdims=True)
    return displacement[:, vertices] / np.where(largest > 0, largest, np.inf)


def blind_spots(face: Face, settings: LayoutSettings, vertices: Int[np.ndarray, " m"]) -> tuple[str, ...]:
    """Blendshapes that move none of `vertices` by epsilon of their largest movement."""
    seen = np.any(shares(face, settings, vertices) >= settings.epsilon, axis=1)
    return tuple(name for k, name in enumerate(face.used) if not seen[k])


def reasons(face: Face, settings: LayoutSettings, vertices: Int[np.ndarray, " m"]) -> tuple[Reason, ...]:
    """Why each of `vertices` is there, in their order."""
    covers = shares(face, settings, vertices) >= settings.epsilon
    alone = covers & (covers.sum(axis=1, keepdims=True) == 1)
    B = face.observation(settings.noise_mm, settings.dot_mm).response(vertices)
    k = B.shape[1]
    A = B.reshape(-1, 3, k)
    whole = angles(B.T @ B)
    found = []
    for m in range(len(vertices)):
        without = angles(B.T @ B - A[m].T @ A[m])
        retained = np.divide(without, whole, out=np.ones((k, k)), where=whole > 0)
        i, j = (int(n) for n in np.unravel_index(retained.argmin(), (k, k)))
        pair = (min(face.used[i], face.used[j]), max(face.used[i], face.used[j]))
        only_one = tuple(face.used[n] for n in np.flatnonzero(alone[:, m]))
        found.append(Reason(only_one, pair, float(whole[i, j]), float(without[i, j])))
    return tuple(found)
