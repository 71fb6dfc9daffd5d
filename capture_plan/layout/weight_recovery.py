"""What a layout recovers: weights from noisy landmarks, and how far the skin they pose is from the truth.

Data       B (3m k)    what the landmarks answer to the weights, millimetres
           y[t]        measured landmark movement of frame t: B w + noise of standard deviation sigma per coordinate
Variables  w[t, k]     weights
Model      min |B w - y|^2 / sigma^2 + |w|^2 / tau^2   s.t.  0 <= w <= 1, and beside it the same without bounds
Scores     e = estimate - truth:  mean |e|;  sqrt(mean_t e' G e), the root mean square over all moving skin and frames;
           the largest distance of any vertex in any frame; the blendshape whose weight is wrong most

The noise of a vertex is drawn from a generator of its own: two layouts that share a vertex measure it equally wrong.
"""

import numpy as np
from jaxtyping import Float, Int
from msgspec import Struct

from capture_plan.layout.box_least_squares import solve_bounded
from capture_plan.layout.observation import PRIOR_SD, Observation

FINEST_MM = 1e-3  # noise that the solver assumes at least: finer than any capture, and the answer stays unique
CHUNK_BYTES = 8e6  # of skin positions at a time: they stay near the processor


class Errors(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """How far weights and skin are from the truth; `worst` is the blendshape with the largest mean error of its
    weight, `weight_mae` the mean absolute error over all weights, lengths in millimetres."""

    weight_mae: float
    rmse_mm: float
    max_mm: float
    worst: str


class Score(Errors, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """How well a performance came back at noise `noise_mm` with weights held in their bounds, and without bounds."""

    noise_mm: float
    unbounded: Errors


def single_blendshapes(count: int) -> Float[np.ndarray, "k k"]:
    """Every blendshape alone at full weight, one frame each."""
    return np.eye(count)


def measurement_noise(vertices: Int[np.ndarray, " m"], *, frames: int, seed: int) -> Float[np.ndarray, "t r"]:
    """Standard normal noise, three columns a landmark; a vertex has the same in every layout."""
    draws = [np.random.default_rng([seed, int(v)]).standard_normal((frames, 3)) for v in vertices]
    return np.concatenate([np.empty((frames, 0)), *draws], axis=1)


def recover_weights(
    B: Float[np.ndarray, "r k"], y: Float[np.ndarray, "t r"], *, noise_mm: float
) -> Float[np.ndarray, "t k"]:
    """The weights of every frame; `y` is the movement from the neutral, millimetres."""
    return solve_bounded(normal_matrix(B, noise_mm), y @ B)


def recover_unbounded(
    B: Float[np.ndarray, "r k"], y: Float[np.ndarray, "t r"], *, noise_mm: float
) -> Float[np.ndarray, "t k"]:
    """The weights of measured landmarks, where these are of any size and sign."""
    return np.linalg.solve(normal_matrix(B, noise_mm), (y @ B).T).T


def normal_matrix(B: Float[np.ndarray, "r k"], noise_mm: float) -> Float[np.ndarray, "k k"]:
    """H = B'B + lambda I with lambda = (sigma / tau)^2."""
    return B.T @ B + (max(noise_mm, FINEST_MM) / PRIOR_SD) ** 2 * np.eye(B.shape[1])


def reconstruct(
    observation: Observation,
    names: tuple[str, ...],
    vertices: Int[np.ndarray, " m"],
    truth: Float[np.ndarray, "t k"],
    *,
    noise_mm: float,
    seed: int,
) -> Score:
    """Measure `truth` at `vertices` with noise, solve for the weights, and compare. Names are of the k blendshapes."""
    B = observation.response(vertices)
    y = truth @ B.T + noise_mm * measurement_noise(vertices, frames=len(truth), seed=seed)
    bounded, free = (
        errors_of(observation, names, solve(B, y, noise_mm=noise_mm) - truth)
        for solve in (recover_weights, recover_unbounded)
    )
    return Score(
        noise_mm=noise_mm,
        weight_mae=bounded.weight_mae,
        rmse_mm=bounded.rmse_mm,
        max_mm=bounded.max_mm,
        worst=bounded.worst,
        unbounded=free,
    )


def errors_of(observation: Observation, names: tuple[str, ...], e: Float[np.ndarray, "t k"]) -> Errors:
    """What errors of the weights mean."""
    wrong = np.abs(e).mean(axis=0)
    return Errors(
        weight_mae=round(float(wrong.mean()), 5),
        rmse_mm=round(squared_error(observation, e) ** 0.5, 5),
        max_mm=round(largest_error(observation, e), 4),
        worst=names[int(wrong.argmax())],
    )


def squared_error(observation: Observation, e: Float[np.ndarray, "t k"]) -> float:
    """mean_t e' G e, square millimetres."""
    return float(np.mean(np.sum((e @ observation.gram) * e, axis=1)))


def largest_error(observation: Observation, e: Float[np.ndarray, "t k"]) -> float:
    """max over frames and moving skin of |sum_k e_k d_k|, millimetres.

    Frames are looked at in the order of sum_k |e_k| max_v |d_kv|, until that is less than what was found.
    """
    d = observation.deltas[:, observation.skin].astype(np.float32)
    most = np.abs(e) @ np.sqrt(np.einsum("kvx,kvx->kv", d, d).max(axis=1))
    order = np.argsort(-most, kind="stable")
    flat, largest = d.reshape(len(d), -1), 0.0
    size = max(1, int(CHUNK_BYTES / (4 * flat.shape[1])))
    for start in range(0, len(e), size):
        t = order[start : start + size]
        if most[t[0]] < largest:
            break
        off = (e[t].astype(np.float32) @ flat).reshape(len(t), -1, 3)
        largest = max(largest, float(np.einsum("tvx,tvx->tv", off, off).max()) ** 0.5)
    return largest
