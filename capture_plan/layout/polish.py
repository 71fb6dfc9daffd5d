"""The last exchanges, for what faces do: few blendshapes at a time, and no weight below 0 or above 1.

Data       w[t]      mixes of the kind that a performance is made of (`random_mixes`), from a seed of their own
           F_t       weights that the bounded solver leaves strictly between 0 and 1 when the layout measures w[t]:
                     about half; the others stand at a bound and cannot be wrong by little
           C_t       (B_F^T B_F / sigma^2 + I / tau^2)^-1 on F_t, 0 elsewhere; G, sigma, tau as in `information`
Model      min  mean_t trace(G C_t)   by swaps that keep what `search` keeps, F_t found anew every round
Answer     of all rounds the layout whose weights, solved for in other mixes, give back the skin best

The upper estimate of `information` knows nothing of bounds: it counts what the solver would never confuse. Rivals of a
site are screened by that error first, then by some of the mixes, then by all.
"""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float, Int

from capture_plan.curves.random_mixes import random_mixes
from capture_plan.layout.exchange import Choice, Search
from capture_plan.layout.observation import PRIOR_SD, Observation
from capture_plan.layout.weight_recovery import measurement_noise, recover_weights, squared_error

ROUNDS = 4
MIXES, SOME, JUDGING = 96, 16, 1000  # frames: to descend on, to screen with, to choose the best round by
RIVALS, FINALISTS = 1000, 100
FAR = -0.9  # rivals give back at least a tenth of what is lost
BETTER = 1e-6  # relative


def polish(search: Search, starts: Sequence[Choice], *, seed: int) -> Choice:
    """A choice that measures sparse, bounded weights better than the best of `starts`, or that one."""

    def judged(choice: Choice) -> float:
        return mixes_error(search, choice, seed=seed + ROUNDS)

    rounds = [min(starts, key=judged)]
    for n in range(ROUNDS):
        free = free_weights(search, rounds[-1], seed=seed + n)
        rounds.append(swap_each(search, rounds[-1], free))
    return min(rounds, key=judged)


def members(search: Search, chosen: Choice) -> Int[np.ndarray, " m"]:
    """The vertices of a choice of sites."""
    return search.sites.members(np.array(chosen, dtype=int))


def mixes_error(search: Search, chosen: Choice, *, seed: int) -> float:
    """Mean squared error of the skin over mixes of that seed, square millimetres."""
    observation, w, estimate = search.observation, *_measure(search, chosen, frames=JUDGING, seed=seed)
    return squared_error(observation, estimate - w)


def _measure(
    search: Search, chosen: Choice, *, frames: int, seed: int
) -> tuple[Float[np.ndarray, "t k"], Float[np.ndarray, "t k"]]:
    """Mixes, and what the bounded solver makes of their measurement."""
    observation, at = search.observation, members(search, chosen)
    B = observation.response(at)
    w = random_mixes(B.shape[1], frames=frames, seed=seed)
    y = w @ B.T + observation.noise_mm * measurement_noise(at, frames=frames, seed=seed)
    return w, recover_weights(B, y, noise_mm=observation.noise_mm)


def free_weights(search: Search, chosen: Choice, *, seed: int) -> Bool[np.ndarray, "t k"]:
    """F: which weights of each mix lie inside their bounds, (t k)."""
    _, estimate = _measure(search, chosen, frames=MIXES, seed=seed)
    return (estimate > 0) & (estimate < 1)


def covariances(
    observation: Observation, at: Int[np.ndarray, " m"], free: Bool[np.ndarray, "t k"]
) -> Float[np.ndarray, "t k k"]:
    """C_t for landmarks at these vertices."""
    B, k = observation.response(at), free.shape[1]
    both = free[:, :, None] & free[:, None, :]
    H = B.T @ B / observation.noise_mm**2 + np.eye(k) / PRIOR_SD**2
    return np.where(both, np.linalg.inv(np.where(both, H, np.eye(k))), 0)


def swap_each(search: Search, chosen: Choice, free: Bool[np.ndarray, "t k"]) -> Choice:
    """Every site in turn for the rival that lowers mean_t trace(G C_t) most."""
    for site in chosen:
        rest = tuple(other for other in chosen if other != site)
        size = int(search.size[site])
        listed = search.instead(search.gains(chosen), search.everywhere, (site,), rest, size, FAR)[:RIVALS]
        listed = np.union1d(listed, [site])
        C = covariances(search.observation, members(search, rest), free)
        listed = listed[np.argsort(-mean_gains(search, listed, C[:SOME]), kind="stable")[:FINALISTS]]
        listed = np.union1d(listed, [site])
        gain = mean_gains(search, listed, C)
        new = int(listed[gain.argmax()])
        chosen = (*rest, new if gain.max() > gain[listed == site][0] * (1 + BETTER) else site)
    return chosen


def mean_gains(search: Search, listed: Int[np.ndarray, " n"], C: Float[np.ndarray, "t k k"]) -> Float[np.ndarray, " n"]:
    """By how much each listed site lowers mean_t trace(G C_t), square millimetres."""
    rows = search.all_rows[listed, : 3 * search.size[listed].max()]
    n, r, k = rows.shape
    total = np.zeros(n)
    for one in C:
        F = np.flatnonzero(one.diagonal())
        A, G = rows.reshape(-1, k)[:, F], search.observation.gram[np.ix_(F, F)]
        P = A @ one[np.ix_(F, F)]
        A, Q, P = (X.reshape(n, r, -1) for X in (A, P @ G, P))
        S = P @ A.transpose(0, 2, 1) + search.observation.noise_mm**2 * np.eye(r)
        total += np.trace(np.linalg.solve(S, Q @ P.transpose(0, 2, 1)), axis1=1, axis2=2)
    return total / len(C)
