"""What each program of a layout is about and what its sites cost: all of it without a solver, for who checks a plan.

A blendshape is owned by the chosen site that it moves most; where a landmark owns more than a tenth of all blendshapes,
they stay for the next round (Zell & McDonnell 2022, section 3.3.2).
"""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float, Int

from capture_plan.layout.constraint_rows import Limit, open_under
from capture_plan.layout.quality import importance_weights, mean_quality, total_quality
from capture_plan.layout.settings import LayoutSettings
from capture_plan.layout.sites import Sites

RESOLUTION = 1e-4  # costs are compared to four decimals: finer differences of quality mean nothing on a face
OWNED_SHARE = 0.1  # section 3.3.2: one landmark should not be assigned to more than 10 % of the blendshapes


def costs(
    sites: Sites, settings: LayoutSettings, rows: Int[np.ndarray, " r"], at: Int[np.ndarray, " n"]
) -> Float[np.ndarray, " n"]:
    """What each of the sites `at` costs in a program for blendshapes `rows`."""
    if settings.weights == "count":
        return sites.size[at].astype(float)
    relative = sites.relative_displacement[np.ix_(rows, at)]
    covers, w = relative >= settings.epsilon, importance_weights(relative, sites.visibility[at], settings.alpha)
    return total_quality(covers, w) if settings.weights == "paper" else sites.size[at] * mean_quality(covers, w)


def to_cover(
    sites: Sites,
    settings: LayoutSettings,
    chosen: Int[np.ndarray, " n"],
    free: Bool[np.ndarray, " s"],
    limits: Sequence[Limit],
) -> Int[np.ndarray, " r"]:
    """Blendshapes that the next round is about: all in the first, then what is crowded, where a free site is left."""
    covers = sites.covers(settings.epsilon)
    active = crowded(sites, chosen, settings.epsilon) if len(chosen) else np.arange(len(covers))
    return active[covers[active][:, free & open_under(limits, chosen, len(free))].any(axis=1)]


def crowded(sites: Sites, chosen: Int[np.ndarray, " n"], epsilon: float) -> Int[np.ndarray, " r"]:
    """Blendshapes whose owner among the chosen sites owns more than its share of all blendshapes."""
    relative = np.where(sites.covers(epsilon)[:, chosen], sites.relative_displacement[:, chosen], -1)
    owner = np.where(relative.max(axis=1) >= 0, relative.argmax(axis=1), -1)
    owned = np.bincount(owner[owner >= 0], minlength=len(chosen))
    allowed = max(1, int(OWNED_SHARE * len(relative))) * sites.size[chosen]
    return np.flatnonzero((owner >= 0) & (owned > allowed)[owner])
