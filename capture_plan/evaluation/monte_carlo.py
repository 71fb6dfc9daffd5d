"""Mishaps played through by seeded simulation: dots beside their place, dots out of sight, dots taken for each other.

Data       B        response of the landmarks the solver believes in (3m k), B' of those that are there
           o        constant offset of each coordinate (3m), millimetres: two markers that are swapped stand apart
Measured   y = B' w + o + noise    w a mix of 3 to 8 blendshapes, noise sigma per coordinate
Answer     weights from 0 to 1 that B explains y with at the landmarks in sight (`reconstruct`)
No formula is stated for that: those for weights of any size are far off when dots are not where they are taken to be.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int
from msgspec import Struct

from capture_plan.curves.random_mixes import random_mixes
from capture_plan.evaluation.tangent_chart import Chart
from capture_plan.layout.observation import Observation
from capture_plan.layout.weight_recovery import recover_weights

DRAWS = 200
SEED = 20251  # any; fixed so that a page is the same every time
PLACEMENT_MM = (0.5, 1.0, 2.0, 4.0)
HIDDEN = (0.05, 0.1, 0.2, 0.3)  # shares of the markers


class Trial(Struct, frozen=True):
    """Errors of the skin under one mishap over `DRAWS` draws, millimetres.

    Weights are solved between 0 and 1. `error_mm` is the root mean square over the draws; `worst_mm` is exceeded in 1
    of 20.
    """

    what: str
    error_mm: float
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
        moved = misplaced_responses(observation, charts, mm, rng)
        plays[f"every dot off its place by {mm:g} mm (rms)"] = [Mishap(rows, everything, still) for rows in moved]
    for share in HIDDEN:
        count = max(1, round(share * m))
        sights = [~np.isin(np.arange(m), rng.permutation(m)[:count]) for _ in range(DRAWS)]
        plays[f"{count} of {m} markers out of sight"] = [Mishap(B, sight, still) for sight in sights]
    if m > 1:
        swaps = [
            swapped(observation, vertices, neutral[vertices], i, int(nearest[i]))
            for i in rng.integers(m, size=DRAWS).tolist()
        ]
        plays["two neighbours taken for each other"] = swaps
    return tuple(play(observation, B, what, mishaps) for what, mishaps in plays.items())


def neighbours(points: Float[np.ndarray, "m 3"]) -> Int[np.ndarray, " m"]:
    """The nearest other point of each."""
    distance = np.linalg.norm(points[:, None] - points[None], axis=2)
    np.fill_diagonal(distance, np.inf)
    return distance.argmin(axis=1)


def misplaced_responses(
    observation: Observation, charts: tuple[Chart, ...], rms_mm: float, rng: np.random.Generator
) -> Float[np.ndarray, "t r k"]:
    """Responses with every landmark at a normally distributed place around its own, `DRAWS` of them."""
    rows = []
    for chart in charts:
        places = rng.normal(scale=rms_mm / np.sqrt(2), size=(DRAWS, 2))
        rows.append(chart.deltas(observation.measured, places))
    return np.concatenate(rows, axis=1)


def swapped(
    observation: Observation, vertices: Int[np.ndarray, " m"], points: Float[np.ndarray, "m 3"], i: int, j: int
) -> Mishap:
    """Landmarks i and j change names in the middle of a take."""
    order = np.arange(len(points))
    order[[i, j]] = j, i
    moved = np.moveaxis(observation.deltas[:, vertices[order]].astype(float), 0, 2)  # (m 3 k)
    there, offset = (observation.as_measured(vertices, one) for one in (moved, (points[order] - points)[:, :, None]))
    return Mishap(there.reshape(3 * len(points), -1), np.ones(len(points), dtype=bool), offset.ravel())


def play(observation: Observation, B: Float[np.ndarray, "r k"], what: str, mishaps: list[Mishap]) -> Trial:
    """One trial: a mix and a draw of noise for every mishap."""
    w = random_mixes(B.shape[1], frames=len(mishaps), seed=SEED)
    noise = observation.noise_mm * np.random.default_rng(SEED).standard_normal((len(mishaps), len(B)))
    y = noise + np.stack([one.response @ row + one.offset for one, row in zip(mishaps, w, strict=True)])
    e = solved(B, y, np.stack([one.in_sight for one in mishaps]), noise_mm=observation.noise_mm) - w
    error = np.sqrt(np.maximum(np.sum((e @ observation.gram) * e, axis=1), 0))
    return Trial(what, float(np.sqrt(np.mean(error**2))), float(np.quantile(error, 0.95)))


def solved(
    B: Float[np.ndarray, "r k"], y: Float[np.ndarray, "t r"], in_sight: Bool[np.ndarray, "t m"], *, noise_mm: float
) -> Float[np.ndarray, "t k"]:
    """Weights from 0 to 1 of every draw, from the landmarks that are in sight in it."""
    w = np.zeros((len(y), B.shape[1]))
    sights, which = np.unique(in_sight, axis=0, return_inverse=True)
    for n, sight in enumerate(sights):
        t, rows = np.flatnonzero(which.ravel() == n), np.repeat(sight, 3)
        w[t] = recover_weights(B[rows], y[t][:, rows], noise_mm=noise_mm)
    return w
