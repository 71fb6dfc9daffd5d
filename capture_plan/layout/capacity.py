"""How many landmarks have room on a face at once, counted before anything is searched for.

Data       n[s]      landmarks of site s;  T[s, t]  sites s and t stand too close to each other, or s = t (`spacing`)
           limits    least <= sum_{s in S} amount[s] <= most (`limits`)
Greedy     of the open sites the one that shuts out the fewest landmarks for each of its own, sum_t T[s, t] n[t] / n[s],
           one after another: the rim comes first, and rows close up. A lower bound of what can stand at once
"""

import numpy as np
from jaxtyping import Int

from capture_plan.errors import InfeasibleError
from capture_plan.layout.constraint_rows import Limit, open_under
from capture_plan.layout.problem import NOTHING, Task
from capture_plan.layout.settings import BUDGETED
from capture_plan.layout.sites import Sites
from capture_plan.layout.spacing import Spacing


def fitting_sites(sites: Sites, spacing: Spacing | None, limits: tuple[Limit, ...] = ()) -> Int[np.ndarray, " n"]:
    """Sites that stand at the spacing and over no limit at once, as many landmarks as a greedy choice finds."""
    size, chosen = sites.size.astype(float), NOTHING
    open_ = open_under(limits, chosen, len(size))
    shut = spacing.table @ (open_ * size) if spacing else size
    while open_.any():
        at = np.flatnonzero(open_)
        new = at[[(shut[at] / size[at]).argmin()]]
        chosen = np.concatenate([chosen, new])
        near = spacing.close(new)[0] if spacing else np.arange(len(size)) == new
        left = open_ & ~near & open_under(limits, chosen, len(size))
        gone = np.flatnonzero(open_ & ~left)
        shut = shut - size[gone] @ spacing.table[gone] if spacing else shut
        open_ = left
    return chosen


def must_fit(task: Task, apart: Task) -> None:
    """Refuses a number of landmarks that a person asked for where fewer are found to fit. It names how many fit where
    no two may meet when the face moves (`apart`), chosen for nothing but room; chosen for what they tell, fewer may.

    Raises:
        InfeasibleError: fewer were found to fit on the face at once.
    """
    settings = task.settings
    asked = settings.budget or settings.number
    if asked is None or settings.method not in BUDGETED or asked <= room(task):
        return
    found = room(apart)
    spaced = f", {settings.spacing_mm:g} mm apart," if settings.spacing_mm else ""
    raise InfeasibleError(
        f"no room was found for {asked:,} landmarks on this face: {found:,} fit{spaced} outside the zones without "
        f"dots where nothing but room counts, fewer where they are chosen for what they tell: ask for {found:,} or "
        "fewer, or lower spacing_mm"
    )


def room(task: Task) -> int:
    """How many landmarks are found to fit at once under all constraints but that for their number."""
    size = task.sites.size
    limits = tuple(limit for limit in task.limits if not np.array_equal(limit.amount, size))
    return int(size[fitting_sites(task.sites, task.spacing, limits)].sum())
