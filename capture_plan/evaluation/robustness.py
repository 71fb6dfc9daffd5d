"""How much can go wrong with a layout: dots that fall off, and dots that sit beside their place.

Letters    A_m, A   deltas of landmark m and of a place beside it (3 k), D = A - A_m; B, C, G, sigma, tau: `information`
Lost       error'^2 = error^2 + trace(S^-1 A C G C A^T),   S = sigma^2 I - A C A^T,
           A being the three rows of one landmark or the six of two, so that C' = C + C A^T S^-1 A C
Measured   the solver knows where the dot sits: landmark m is lost and one at the new place added (see `gains`)
Unnoticed  the solver takes the dot for one at its place, answers C B^T y / sigma^2 to y = (B + D) w + noise, and
           error'^2 = error^2 - (2 / sigma^2) trace(D C G C A_m^T) + (tau^2 / sigma^4) trace(D D^T A_m C G C A_m^T)
"""

from itertools import combinations

import numpy as np
from jaxtyping import Bool, Float, Int
from msgspec import Struct
from scipy.sparse import csr_array

from capture_plan.evaluation.tangent_chart import Chart, in_words
from capture_plan.layout.gains import error_gains
from capture_plan.layout.observation import PRIOR_SD, Observation
from capture_plan.mesh import geodesic_distance

GROWTH = 1.1  # the upper estimate may grow by a tenth
EXTENT_MM, STEP_MM, DIRECTIONS = 15.0, 0.5, 16  # places that are tried around a landmark
DOT_MM = 4.0  # a substitute stands clear of the spot: dots are 3 to 4 mm wide


class Loss(Struct, frozen=True):
    """What is left when the landmarks of these indices fall off; `uncovered` are blendshapes that nobody sees then."""

    landmarks: tuple[int, ...]
    error_mm: float
    uncovered: tuple[str, ...]
    carry_on: bool


class Tolerance(Struct, frozen=True):
    """How far a dot may sit from its place along the skin, in the worst and in the best direction, millimetres.

    `best_mm` is `EXTENT_MM` where nothing happens as far as was tried. The end of the skin is an end too.
    """

    worst_mm: float
    worst_direction: str
    best_mm: float
    best_direction: str


class Substitute(Struct, frozen=True):
    """The nearest other place that loses no blendshape and keeps the upper estimate within `GROWTH`."""

    vertex: int
    distance_mm: float
    direction: str
    error_mm: float


def losses(
    observation: Observation,
    vertices: Int[np.ndarray, " m"],
    covers: Bool[np.ndarray, "k m"],
    names: tuple[str, ...],
    *,
    at_once: int,
) -> tuple[Loss, ...]:
    """Every way to lose `at_once` of the landmarks."""
    B, C, sigma = observation.response(vertices), observation.covariance(vertices), observation.noise_mm
    BC = B @ C
    H, Q = BC @ B.T, BC @ observation.gram @ BC.T
    lost = np.array(list(combinations(range(len(vertices)), at_once)), dtype=int).reshape(-1, at_once)
    rows = (3 * lost[:, :, None] + np.arange(3)).reshape(len(lost), -1)
    block = rows[:, :, None], rows[:, None, :]
    # S = sigma^2 I - A C A^T
    S = sigma**2 * np.eye(3 * at_once) - H[block]
    before = observation.error(C)
    error = np.sqrt(before**2 + np.trace(np.linalg.solve(S, Q[block]), axis1=1, axis2=2))
    still_seen = np.ones((len(lost), len(vertices)), dtype=bool)
    still_seen[np.arange(len(lost))[:, None], lost] = False
    left = covers.astype(int) @ still_seen.T
    gone: np.ndarray = np.minimum(covers.sum(axis=1)[:, None], 1) > left
    return tuple(
        Loss(
            landmarks=tuple(who.tolist()),
            error_mm=float(error[n]),
            uncovered=tuple(names[k] for k in np.flatnonzero(gone[:, n])),
            carry_on=bool(error[n] <= GROWTH * before and not gone[:, n].any()),
        )
        for n, who in enumerate(lost)
    )


def unnoticed_error(
    observation: Observation,
    C: Float[np.ndarray, "k k"],
    A_m: Float[np.ndarray, "3 k"],
    A: Float[np.ndarray, "p 3 k"],
) -> Float[np.ndarray, " p"]:
    """Upper estimate with the dot at each place while the solver takes it for one at its own, millimetres."""
    sigma, tau = observation.noise_mm, PRIOR_SD
    D = A - A_m
    ACGC = A_m @ C @ observation.gram @ C
    first = np.einsum("pxk,xk->p", D, ACGC)
    second = np.einsum("pxk,pyk,yx->p", D, D, ACGC @ A_m.T)
    squared = observation.error(C) ** 2 - 2 / sigma**2 * first + tau**2 / sigma**4 * second
    return np.sqrt(np.clip(squared, 0, None))


def measured_error(
    observation: Observation,
    C: Float[np.ndarray, "k k"],
    A_m: Float[np.ndarray, "3 k"],
    A: Float[np.ndarray, "p 3 k"],
) -> Float[np.ndarray, " p"]:
    """Upper estimate of the error with the dot at each place when the solver is told, millimetres."""
    AC = A_m @ C
    # C' = C + C A^T S^-1 A C
    without = C + AC.T @ np.linalg.solve(observation.noise_mm**2 * np.eye(3) - AC @ A_m.T, AC)
    return np.sqrt(observation.error(without) ** 2 - error_gains(observation, A, without))


def polar_places() -> Float[np.ndarray, "d r 2"]:
    """Places around a landmark: `DIRECTIONS` rays, every `STEP_MM` to `EXTENT_MM`."""
    angle = 2 * np.pi * np.arange(DIRECTIONS) / DIRECTIONS
    radius = STEP_MM * np.arange(1, round(EXTENT_MM / STEP_MM) + 1)
    return radius[None, :, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)[:, None, :]


def keeps_covers(
    A: Float[np.ndarray, "p 3 k"], largest: Float[np.ndarray, " k"], alone: Bool[np.ndarray, " k"], epsilon: float
) -> Bool[np.ndarray, " p"]:
    """Places where the blendshapes that only this landmark sees (`alone`) still move by epsilon of their largest."""
    length = np.linalg.norm(A, axis=1)
    lost = np.less(length[:, alone], epsilon * largest[alone] * (1 - 1e-6))
    return lost.sum(axis=1) == 0


def tolerance(chart: Chart, good: Bool[np.ndarray, "d r"]) -> Tolerance:
    """The last good place on every ray before the first that is not."""
    steps = np.where(good.all(axis=1), good.shape[1], (~good).argmax(axis=1))
    worst, best = int(steps.argmin()), int(steps.argmax())
    rays = polar_places()[:, 0] / STEP_MM @ chart.axes
    return Tolerance(
        float(STEP_MM * steps[worst]), in_words(rays[worst]), float(STEP_MM * steps[best]), in_words(rays[best])
    )


def tolerances(
    observation: Observation,
    vertices: Int[np.ndarray, " m"],
    charts: tuple[Chart, ...],
    covers: Bool[np.ndarray, "k m"],
    largest: Float[np.ndarray, " k"],
    epsilon: float,
) -> tuple[tuple[Tolerance, Tolerance], ...]:
    """For every landmark: where nobody notices that it sits elsewhere, and where its place is measured.

    `largest` is the largest movement of every blendshape, millimetres.
    """
    C = observation.covariance(vertices)
    before = observation.error(C)
    A_all = observation.response(vertices).reshape(len(vertices), 3, -1)
    alone = covers & (covers.sum(axis=1, keepdims=True) == 1)
    rays = polar_places()
    places = rays.reshape(-1, 2)
    answers = []
    for m, chart in enumerate(charts):
        A = chart.deltas(observation.measured, places)
        moved = A if observation.root is None else chart.deltas(observation.deltas, places)
        retained = chart.on_skin(places) & keeps_covers(moved, largest, alone[:, m], epsilon)
        found = [
            tolerance(
                chart, (retained & (error(observation, C, A_all[m], A) <= GROWTH * before)).reshape(rays.shape[:2])
            )
            for error in (unnoticed_error, measured_error)
        ]
        answers.append((found[0], found[1]))
    return tuple(answers)


def substitutes(
    observation: Observation,
    vertices: Int[np.ndarray, " m"],
    charts: tuple[Chart, ...],
    covers: Bool[np.ndarray, "k m"],
    largest: Float[np.ndarray, " k"],
    epsilon: float,
    free: Bool[np.ndarray, "m v"],
) -> tuple[Substitute | None, ...]:
    """For every landmark the nearest vertex that can stand for it; `free[m, v]` says where a dot may go instead."""
    C = observation.covariance(vertices)
    A_all = observation.response(vertices).reshape(len(vertices), 3, -1)
    alone = covers & (covers.sum(axis=1, keepdims=True) == 1)
    answers = []
    for m, chart in enumerate(charts):
        distance = np.linalg.norm(chart.flat, axis=1)
        A = np.moveaxis(observation.measured[:, chart.at], 0, 2).astype(np.float64)
        error = measured_error(observation, C, A_all[m], A)
        good = free[m, chart.at] & (distance >= DOT_MM) & (error <= GROWTH * observation.error(C))
        moved = A if observation.root is None else np.moveaxis(observation.deltas[:, chart.at], 0, 2)
        good &= keeps_covers(moved, largest, alone[:, m], epsilon)
        if not good.any():
            answers.append(None)
            continue
        n = int(np.where(good, distance, np.inf).argmin())
        direction = in_words(chart.flat[n] / distance[n] @ chart.axes)
        answers.append(Substitute(int(chart.at[n]), float(distance[n]), direction, float(error[n])))
    return tuple(answers)


def free_for(graph: csr_array, vertices: Int[np.ndarray, " m"], spacing_mm: float) -> Bool[np.ndarray, "m v"]:
    """free[m, v]: vertex v keeps the spacing to every landmark but m, and carries none."""
    close = geodesic_distance(graph, vertices, limit=spacing_mm) < spacing_mm
    close[np.arange(len(vertices)), vertices] = True
    return close.sum(axis=0) - close == 0
