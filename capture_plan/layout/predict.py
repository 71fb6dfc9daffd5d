"""The error to expect of the solve that is used: weights held between 0 and 1, in performances as people give them.

Data       X[t]      skin of frame t, displacement from the neutral, millimetres: mixes c[t] of deltas or shapes
           M         mean of c c' over all that the performance can be, of which the frames are some
           B (r k)   what the landmarks answer to the weights; y[t] = R c[t] the landmarks of X[t]
           n[t]      noise of standard deviation sigma per coordinate; every frame is measured with n and with -n
Solve      H = B'B + lambda I;  x = argmin 1/2 x'Hx - x'B'y, 0 <= x <= 1 (`bounded`);  beside it x = H^-1 B'y
Distance   d(x, t) = x'Gx - 2 x'g[t] + s[t], mean square distance of the skin: g[t, k] is the mean of d_k . X[t] over
           the moving skin, s[t] that of |X[t]|^2
Estimate   q[t] and u[t], d of the bounded and of the other answer, are means of both measurements:
           mean q - beta (mean u - E u),  beta = cov(q, u) / var u over the frames,
           E u = tr(Q M) + sigma^2 tr(G A A'), exact: A = H^-1 B', c'Qc = d(A R c) of a frame without noise

A weight that rests at 0 loses half its noise there, which no formula for weights of any size (`Observation.error`)
knows. A simulation of some frames does; u, of which the mean is known, takes away most of what the choice of frames
and the noise add to it by chance.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Int

from capture_plan.curves.random_mixes import moment_of_mixes, random_mixes
from capture_plan.layout.box_least_squares import solve_bounded
from capture_plan.layout.observation import Observation
from capture_plan.layout.record import Prediction
from capture_plan.layout.weight_recovery import measurement_noise, normal_matrix
from capture_plan.shell.take_basis import Recording
from capture_plan.shell.takes import Takes

FRAMES = 100  # each measured twice: 0.03 to 0.08 s on one core, and a standard error of about 1 %
SEED = 20_823  # of frames and noise; no other part of the package measures with it
USUAL_NOISE_MM = 0.2  # predicted at this noise too, so that plans can be compared
ACTIVE_SHARE, MEAN_WEIGHT = 0.3, 0.25  # of blendshapes in a frame of somebody who talks, at exponential weights
MIXES, TALKING = "3 to 8 blendshapes at once", "talking"
LEAST, MOST = 0.05, 0.95  # shares of the frames between which the spread is given
EASED = 1e-9  # share of G's mean diagonal, so that dependent blendshapes have one answer
TINY = np.finfo(float).tiny


@dataclass(frozen=True, eq=False)
class Performance:
    """Frames as mixes `weights` of j shapes, `moment` (M) being what they are drawn from.

    `rows(vertices)` are what the shapes move at landmarks, three rows each (R); `cross` and `power` are their mean
    products with the deltas and with each other over the moving skin. `beyond_mm` is what the rig cannot show of a
    take.
    """

    name: str
    weights: Float[np.ndarray, "t j"]
    rows: Callable[[Int[np.ndarray, " m"]], Float[np.ndarray, "r j"]]
    cross: Float[np.ndarray, "j k"]
    power: Float[np.ndarray, "j j"]
    moment: Float[np.ndarray, "j j"]
    beyond_mm: float | None = None

    def distances(self, G: Float[np.ndarray, "k k"], x: Float[np.ndarray, "t k"]) -> Float[np.ndarray, " t"]:
        """The distances d(x, t) of weights x, square millimetres."""
        # x'Gx - 2 x'g + s
        squares = np.sum((self.weights @ self.power) * self.weights, axis=1)
        return np.maximum(np.sum((x @ G - 2 * self.weights @ self.cross) * x, axis=1) + squares, 0)

    def mean_distance(self, G: Float[np.ndarray, "k k"], X: Float[np.ndarray, "k j"]) -> float:
        """tr(Q M): the mean of d where the answer to a mix c is X c, square millimetres."""
        # Q = X'GX - 2 X' cross' + power
        return float(np.sum((X.T @ G @ X - 2 * X.T @ self.cross.T + self.power) * self.moment))


def moment_of_talking(count: int) -> Float[np.ndarray, "k k"]:
    """Mean of w w' over `talking` of any seed."""
    m, end = MEAN_WEIGHT, np.exp(-1 / MEAN_WEIGHT)
    mean, square = ACTIVE_SHARE * m * (1 - end), ACTIVE_SHARE * 2 * m * (m - (1 + m) * end)  # of min(weight, 1)
    return np.full((count, count), mean**2) + (square - mean**2) * np.eye(count)


def talking(count: int, *, frames: int, seed: int) -> Float[np.ndarray, "t k"]:
    """Frames of somebody who talks: each blendshape is active with a chance of 0.3, at an exponential weight."""
    rng = np.random.default_rng(seed)
    active = rng.uniform(size=(frames, count)) < ACTIVE_SHARE
    return np.where(active, np.minimum(rng.exponential(MEAN_WEIGHT, (frames, count)), 1), 0)


def of_weights(
    observation: Observation, name: str, w: Float[np.ndarray, "t k"], moment: Float[np.ndarray, "k k"]
) -> Performance:
    """Frames that are posed by weights of the planned blendshapes."""
    return Performance(name, w, observation.response, observation.gram, observation.gram, moment)


def of_recording(observation: Observation, one: Recording, *, frames: int = FRAMES) -> Performance:
    """Frames of a take, evenly over its time and several times where it has fewer, with all that it moves: blendshapes
    that are not planned for, and what no blendshape does."""
    inside, count = observation.skin[one.at], int(observation.skin.sum())
    every = one.weights.astype(float)
    C = every[np.arange(frames) * len(one) // frames]
    S = one.shapes[:, inside].reshape(len(one.shapes), -1).astype(float)
    D = observation.deltas[:, one.at[inside]].reshape(len(observation.deltas), -1).astype(float)

    def rows(vertices: Int[np.ndarray, " m"]) -> Float[np.ndarray, "r j"]:
        moved, known = np.zeros((len(vertices), 3, len(one.shapes))), np.isin(vertices, one.at)
        moved[known] = one.shapes[:, np.searchsorted(one.at, vertices[known])].transpose(1, 2, 0)
        return observation.as_measured(vertices, moved).reshape(-1, len(one.shapes))

    shown = Performance(one.sequence.name, C, rows, S @ D.T / count, S @ S.T / count, every.T @ every / len(every))
    return replace(shown, beyond_mm=beyond(observation, shown))


def beyond(observation: Observation, shown: Performance) -> float:
    """What the rig cannot show: root mean square distance (mm) that is left when weights from 0 to 1 are solved from
    the whole moving skin without noise."""
    G = observation.gram
    x = solve_bounded(G + EASED * np.trace(G) / len(G) * np.eye(len(G)), shown.weights @ shown.cross)
    return round(float(np.sqrt(shown.distances(G, x).mean())), 4)


def performances(observation: Observation, takes: Takes | None) -> list[Performance]:
    """Mixes, talking, and every take."""
    k = len(observation.deltas)
    made = (
        of_weights(observation, MIXES, random_mixes(k, frames=FRAMES, seed=SEED), moment_of_mixes(k)),
        of_weights(observation, TALKING, talking(k, frames=FRAMES, seed=SEED), moment_of_talking(k)),
    )
    recordings = [one for person in takes.subjects for one in person.recordings] if takes else []
    return [*made, *(of_recording(observation, one) for one in recordings)]


def predictions(
    observation: Observation, vertices: Int[np.ndarray, " m"], given: Sequence[Performance]
) -> tuple[Prediction, ...]:
    """The error to expect with landmarks at `vertices`, at the observation's noise and, where no cameras are known, at
    the usual one."""
    noises = sorted({observation.noise_mm, USUAL_NOISE_MM} if observation.root is None else {observation.noise_mm})
    return tuple(predict(observation, vertices, one, noise_mm=noise) for noise in noises for one in given)


def predict(
    observation: Observation, vertices: Int[np.ndarray, " m"], shown: Performance, *, noise_mm: float
) -> Prediction:
    """The error of the skin to expect of one performance, its spread over frames, and how well that is known."""
    G, B, R = observation.gram, observation.response(vertices), shown.rows(vertices)
    y = shown.weights @ R.T
    H, n = normal_matrix(B, noise_mm), noise_mm * measurement_noise(vertices, frames=len(y), seed=SEED)
    A = np.linalg.solve(H, B.T)  # H^-1 B'
    bounded = np.split(solve_bounded(H, np.concatenate([y + n, y - n]) @ B), 2)
    every = np.stack([shown.distances(G, x) for x in bounded])
    q, u = every.mean(axis=0), np.mean([shown.distances(G, both @ A.T) for both in (y + n, y - n)], axis=0)
    # E u = tr(Q M) + sigma^2 tr(G A A')
    mean_u = shown.mean_distance(G, A @ R) + noise_mm**2 * np.sum((G @ A) * A)
    beta = np.sum((q - q.mean()) * (u - u.mean())) / max(np.sum(np.square(u - u.mean())), TINY)
    error = np.sqrt(max(q.mean() - beta * (u.mean() - mean_u), 0.0))
    sure = np.std(q - beta * u) / np.sqrt(len(q)) / max(2 * error, TINY)
    low, high = np.sqrt(np.quantile(every, [LEAST, MOST]))
    found, seen = _rounded(error, low, high, sure), observation.root is not None
    return Prediction(shown.name, noise_mm, *found, beyond_mm=shown.beyond_mm, by_cameras=seen)


def _rounded(*lengths: float) -> list[float]:
    return [round(float(length), 4) for length in lengths]
