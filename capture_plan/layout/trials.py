"""Mishaps played through by seeded simulation: dots beside their place, dots out of sight, dots taken for each other.

Data       B        response of the landmarks the solver believes in (3m k), B' of those that are there
           o        constant offset of each coordinate (3m), millimetres: two markers that are swapped stand apart
Measured   y = B' w + o + noise                 w a mix of 3 to 8 blendshapes, noise sigma per coordinate
Answer     C B^T y / sigma^2                    C the covariance of the landmarks in sight, see `worth`
Predicted  E = C B^T B' / sigma^2 - I,  error^2 = trace(G (tau^2 E E^T + C B^T B C / sigma^2 + b b^T)),
           b = C B^T o / sigma^2               for weights of standard deviation tau about 0
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int
from msgspec import Struct

from capture_plan.layout.chart import Chart
from capture_plan.layout.worth import PRIOR_SD, Observation

DRAWS = 200
SEED = 20251  # any; fixed so that a page is the same every time
PLACEMENT_MM = (0.5, 1.0, 2.0, 4.0)
HIDDEN = (0.05, 0.1, 0.2, 0.3)  # shares of the markers


class Trial(Struct, frozen=True):
    """Errors of the skin under one mishap over `DRAWS` draws, millimetres.

    The solver is linear: what it gains from knowing that weights are 0 to 1 is left out.
    `predicted_mm` by formula for the same mishaps, root mean square over the draws; `simulated_mm` with sparse mixes;
    `worst_mm` is exceeded in 1 of 20 draws.
    """

    what: str
    predicted_mm: float
    simulated_mm: float
    worst_mm: float


@dataclass(frozen=True, eq=False)
class Mishap:
    """What happens in one draw: the response that is there, which landmarks are in sight, and offsets (mm)."""

    response: Float[np.ndarray, "r k"]
    in_sight: Bool[np.ndarray, " m"]
    offset: Float[np.ndarray, " r"]


def trials(
    observation: Observation,
    vertices: Int[np.ndarray, " m"],
    neutral: Float[np.ndarray, "v 3"],
    charts: tuple[Chart, ...],
) -> tuple[Trial, ...]:
    """Nothing wrong, placement noise, occlusion, and a swap of two neighbours."""
    B = observation.response(vertices)
    m = len(vertices)
    everything, still = np.ones(m, dtype=bool), np.zeros(3 * m)
    rng = np.random.default_rng(SEED)
    nearest = neighbours(neutral[vertices])
    plays = {"nothing goes wrong": [Mishap(B, everything, still)] * DRAWS}
    for mm in PLACEMENT_MM:
        moved = misplaced(observation, charts, mm, rng)
        plays[f"every dot off its place by {mm:g} mm (rms)"] = [Mishap(rows, everything, still) for rows in moved]
    for share in HIDDEN:
        count = max(1, round(share * m))
        sights = [~np.isin(np.arange(m), rng.permutation(m)[:count]) for _ in range(DRAWS)]
        plays[f"{count} of {m} markers out of sight"] = [Mishap(B, sight, still) for sight in sights]
    if m > 1:
        swaps = [swapped(B, neutral[vertices], i, int(nearest[i])) for i in rng.integers(m, size=DRAWS).tolist()]
        plays["two neighbours taken for each other"] = swaps
    return tuple(play(observation, B, what, mishaps) for what, mishaps in plays.items())


def neighbours(points: Float[np.ndarray, "m 3"]) -> Int[np.ndarray, " m"]:
    """The nearest other point of each."""
    distance = np.linalg.norm(points[:, None] - points[None], axis=2)
    np.fill_diagonal(distance, np.inf)
    return distance.argmin(axis=1)


def misplaced(
    observation: Observation, charts: tuple[Chart, ...], rms_mm: float, rng: np.random.Generator
) -> Float[np.ndarray, "t r k"]:
    """Responses with every landmark at a normally distributed place around its own, `DRAWS` of them."""
    rows = []
    for chart in charts:
        places = rng.normal(scale=rms_mm / np.sqrt(2), size=(DRAWS, 2))
        rows.append(chart.deltas(observation.deltas, places))
    return np.concatenate(rows, axis=1)


def swapped(B: Float[np.ndarray, "r k"], points: Float[np.ndarray, "m 3"], i: int, j: int) -> Mishap:
    """Landmarks i and j change names in the middle of a take."""
    order = np.arange(len(points))
    order[[i, j]] = j, i
    there = B.reshape(len(points), 3, -1)[order].reshape(B.shape)
    return Mishap(there, np.ones(len(points), dtype=bool), (points[order] - points).ravel())


def play(observation: Observation, B: Float[np.ndarray, "r k"], what: str, mishaps: list[Mishap]) -> Trial:
    """One trial: a mix and a draw of noise for every mishap."""
    rng = np.random.default_rng(SEED)
    k = B.shape[1]
    predicted, found = [], []
    for mishap in mishaps:
        answer = solver(observation, B, mishap.in_sight)
        predicted.append(predicted_error(observation, answer, mishap) ** 2)
        w = sparse_mix(rng, k)
        y = mishap.response @ w + mishap.offset + rng.normal(scale=observation.noise_mm, size=len(B))
        off = answer @ y - w
        found.append(max(0.0, off @ observation.gram @ off))
    error = np.sqrt(found)
    rms, simulated = (float(np.sqrt(np.mean(squares))) for squares in (predicted, found))
    return Trial(what, rms, simulated, float(np.quantile(error, 0.95)))


def solver(
    observation: Observation, B: Float[np.ndarray, "r k"], in_sight: Bool[np.ndarray, " m"]
) -> Float[np.ndarray, "k r"]:
    """C B^T / sigma^2 for the landmarks in sight, zeros for the others."""
    seen = B * np.repeat(in_sight, 3)[:, None]
    C = np.linalg.inv(seen.T @ seen / observation.noise_mm**2 + np.eye(B.shape[1]) / PRIOR_SD**2)
    return C @ seen.T / observation.noise_mm**2


def predicted_error(observation: Observation, answer: Float[np.ndarray, "k r"], mishap: Mishap) -> float:
    """Root mean square error of the skin for normally distributed weights and noise, millimetres."""
    E = answer @ mishap.response - np.eye(len(answer))
    b = answer @ mishap.offset
    spread = PRIOR_SD**2 * E @ E.T + observation.noise_mm**2 * answer @ answer.T + np.outer(b, b)
    return observation.error(spread)


def sparse_mix(rng: np.random.Generator, k: int) -> Float[np.ndarray, " k"]:
    """3 to 8 blendshapes at weights from 0 to 1, as in recorded animation."""
    w = np.zeros(k)
    count = min(k, int(rng.integers(3, 9)))
    w[rng.permutation(k)[:count]] = rng.uniform(size=count)
    return w
