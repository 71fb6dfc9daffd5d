"""What the other methods choose at a budget, cached on disk, and how layouts fare blendshape by blendshape.

A baseline depends on the rig, its candidates, the number and the seed; not on noise, epsilon or spacing. Whoever turns
those finds the baselines of the budget where they were.

Letters    sqrt(G[k, k] C[k, k])   error of the skin (rms, mm) where only blendshape k is as uncertain as it is
"""

from collections.abc import Mapping, Sequence

import numpy as np
from jaxtyping import Float, Int

from capture_plan.cache import cached, digest
from capture_plan.curves.random_mixes import random_mixes
from capture_plan.errors import RigError
from capture_plan.evaluation.baselines import BASELINES, choose_baseline
from capture_plan.layout.face import SIXTY_EIGHT, Face
from capture_plan.layout.farthest import Candidates, candidates
from capture_plan.layout.observation import Observation
from capture_plan.layout.settings import LayoutSettings
from capture_plan.layout.weight_recovery import Score, reconstruct
from capture_plan.progress import track
from capture_plan.registration.empirical_layouts import place_ibug68

ENTRIES = 2000  # 1 kB each
METHOD = "1"  # raise it when the same rig would give other baselines
BUDGETS = (12, 20, 30, 44)
SEEDS = (0, 1, 2, 3)
MIXES = 200  # frames: the error is known to some 3 %

Layouts = dict[str, Int[np.ndarray, " _"]]  # as many landmarks as each has


def peers(face: Face, settings: LayoutSettings, count: int, *, seed: int = 0) -> Layouts:
    """`count` vertices by every baseline.

    Raises:
        InfeasibleError: there are fewer candidates.
    """
    allowed = candidates(face)
    return {name: _remembered(face, allowed, name, count, seed) for name in track(tuple(BASELINES), "Laying out peers")}


def peers_by_budget(face: Face, settings: LayoutSettings, budgets: Sequence[int] = BUDGETS) -> dict[int, Layouts]:
    """The baselines of every budget that the candidates allow."""
    most = len(candidates(face).vertices)
    return {
        budget: peers(face, settings, budget)
        for budget in track([b for b in budgets if b <= most], "Laying out peers for every budget")
    }


def seeded(
    face: Face, settings: LayoutSettings, count: int, *, seeds: Sequence[int] = SEEDS
) -> dict[str, list[np.ndarray]]:
    """For every baseline whose answer hangs on the seed, its layouts by seed."""
    found = [peers(face, settings, count, seed=seed) for seed in seeds]
    return {
        name: [one[name] for one in found]
        for name in BASELINES
        if any(set(one[name].tolist()) != set(found[0][name].tolist()) for one in found)
    }


def placed_points(face: Face) -> Layouts:
    """The 68 points of iBUG on this face; nothing where it has no eyes and mouth to lay them on."""
    try:
        return {SIXTY_EIGHT: place_ibug68(face.rig)}
    except RigError:
        return {}


def upper_estimates(observation: Observation, layouts: Layouts) -> dict[str, float]:
    """Upper estimate of the error of the skin (`Observation.error`), mm (rms), by layout."""
    return {name: observation.error(observation.covariance(vertices)) for name, vertices in layouts.items()}


def blendshape_errors(observation: Observation, vertices: Int[np.ndarray, " m"]) -> Float[np.ndarray, " k"]:
    """Upper estimate of the error of the skin, mm (rms), from the uncertainty of each weight alone."""
    return np.sqrt(np.diag(observation.gram) * np.diag(observation.covariance(vertices)))


def predicted_by_seed(
    observation: Observation, layouts: Mapping[str, Sequence[Int[np.ndarray, " _"]]]
) -> dict[str, list[float]]:
    """Predicted errors of layouts by seed, millimetres, by the name of their method."""
    return {name: [observation.error(observation.covariance(one)) for one in some] for name, some in layouts.items()}


def measure(face: Face, layouts: Layouts, noise_mm: float, *, seed: int = 0) -> dict[str, Score]:
    """What comes back from random mixes, measured with the same noise at every layout."""
    observation = face.observation(noise_mm)
    truth = random_mixes(len(face.used), frames=MIXES, seed=seed)
    return {
        name: reconstruct(observation, face.used, vertices, truth, noise_mm=noise_mm, seed=seed)
        for name, vertices in track(tuple(layouts.items()), "Measuring")
    }


def _remembered(face: Face, candidates: Candidates, name: str, count: int, seed: int) -> Int[np.ndarray, " m"]:
    key = digest([METHOD, face.rig.fingerprint, *face.used, candidates.vertices, name, str(count), str(seed)])

    def choose() -> dict[str, np.ndarray]:
        return {"vertices": choose_baseline(name, candidates, count, seed)}

    return cached(choose, "baselines", key, entries=ENTRIES)["vertices"]
