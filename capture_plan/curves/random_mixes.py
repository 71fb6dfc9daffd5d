"""A performance as chance makes it: frames of 3 to 8 blendshapes at uniform weights, and the moments of many of them.

Letters: t frames, k blendshapes; w (t k) weights, 0 to 1.
"""

import numpy as np
from jaxtyping import Float

FEWEST_ACTIVE, MOST_ACTIVE = 3, 8  # blendshapes at once, as in recorded animation


def random_mixes(count: int, *, frames: int, seed: int) -> Float[np.ndarray, "t k"]:
    """Frames of 3 to 8 blendshapes (all, where there are fewer) at uniform weights."""
    rng = np.random.default_rng(seed)
    w = np.zeros((frames, count))
    for row in w:
        active = rng.permutation(count)[: rng.integers(FEWEST_ACTIVE, MOST_ACTIVE + 1)]
        row[active] = rng.uniform(size=len(active))
    return w


def moment_of_mixes(count: int) -> Float[np.ndarray, "k k"]:
    """Mean of w w' over `random_mixes` of any seed, exactly."""
    active = np.minimum(np.arange(FEWEST_ACTIVE, MOST_ACTIVE + 1), count)
    # a weight is active in n of k mixes, two are in n (n - 1) of k (k - 1), each uniform from 0 to 1
    both = np.mean(active * (active - 1)) / max(count * (count - 1), 1) / 4
    return np.full((count, count), both) + (np.mean(active) / count / 3 - both) * np.eye(count)
