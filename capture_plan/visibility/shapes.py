"""The least of something over the shapes of a rig: the neutral, and each blendshape at full weight."""

from collections.abc import Callable
from importlib.metadata import version

import numpy as np
from jaxtyping import Float, Int

from capture_plan.cache import cached, digest
from capture_plan.progress import track_in_threads

ENTRIES = 200  # about 40 MB for heads of 27,000 vertices
METHOD = "2"  # raise it when the same arrays would give other numbers


def least_over_shapes(
    share: Callable[[Float[np.ndarray, "v 3"], Int[np.ndarray, " n"]], Float[np.ndarray, " n"]],
    neutral: Float[np.ndarray, "v 3"],
    deltas: Float[np.ndarray, "k v 3"],
    at: Int[np.ndarray, " m"],
) -> Float[np.ndarray, " m"]:
    """min over v0 and v0 + d_k of share(shape, at), for shares that are never negative.

    What is 0 on the neutral stays 0, so it is not asked again: a third to a half of a head with a mouth inside.
    """
    least = share(neutral, at)
    seen = np.flatnonzero(least)
    for of_shape in track_in_threads(
        lambda delta: share(neutral + delta, at[seen]), list(deltas), "Tracing visibility"
    ):
        least[seen] = np.minimum(least[seen], of_shape)
    return least


def remembered(compute: Callable[[], np.ndarray], kind: str, *arrays: np.ndarray) -> Float[np.ndarray, " m"]:
    """`compute()`, or what it answered when it was last given the same arrays."""
    name = digest([METHOD, version("embreex"), kind, *arrays])
    return cached(lambda: {"share": compute()}, "visibility", name, entries=ENTRIES)["share"]
