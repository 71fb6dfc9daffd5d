"""Second looks at a choice that a solver made: without one, a better choice refutes that it is the best.

Data       c[k, s]    site s is a candidate for blendshape k, every k on some chosen site
           free       sites that may be chosen besides, at the spacing and within limits
Exchange   one chosen site for none; one, or two, for one other: what is left reaches every k and keeps every limit
Greedy     what limits ask for, then the site that reaches most blendshapes still missed for each of its landmarks, or
           the one that helps with the blendshape that fewest help with
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from jaxtyping import Bool, Float, Int

from capture_plan.layout.constraint_rows import Limit
from capture_plan.layout.costs import RESOLUTION, costs
from capture_plan.layout.exchange import Choice, Search
from capture_plan.layout.settings import LayoutSettings
from capture_plan.layout.sites import Sites
from capture_plan.layout.spacing import Spacing

MANY = 40  # sites of a choice: the pairs of more take seconds
FIRST = 10**9  # of the unit of costs: one landmark fewer is worth more than any places


@dataclass(frozen=True, eq=False)
class Room:
    """Where the sites of one program may stand: `covers` holds its blendshapes, `free` the sites it may choose."""

    covers: Bool[np.ndarray, "r s"]
    free: Bool[np.ndarray, " s"]
    spacing: Spacing | None
    limits: Sequence[Limit] = ()

    def holds(self, rest: Int[np.ndarray, " n"], subset: Int[np.ndarray, " m"]) -> Bool[np.ndarray, " m"]:
        """Of the sites `subset` those with which the chosen ones keep every limit."""
        retained = np.ones(len(subset), dtype=bool)
        for limit in self.limits:
            total = limit.amount[rest].sum() + limit.amount[subset]
            retained &= total >= limit.least
            retained &= limit.most is None or total <= limit.most
        return retained

    def spared(self, chosen: Int[np.ndarray, " n"]) -> Iterator[Int[np.ndarray, " m"]]:
        """What is left of a choice without each of the sites that it can spare."""
        for site in chosen:
            rest = chosen[chosen != site]
            if self.covers[:, rest].any(axis=1).all() and not any(limit.shortfall(rest) for limit in self.limits):
                yield rest

    def exchanges(self, chosen: Int[np.ndarray, " n"]) -> Iterator[tuple[Int[np.ndarray, " m"], Int[np.ndarray, " c"]]]:
        """What is left of a choice without one or two of its sites, and the sites that each can take their place."""
        shut = self.spacing.close(chosen) if self.spacing else np.zeros((len(chosen), len(self.free)), dtype=bool)
        shut[np.arange(len(chosen)), chosen] = True
        numbers = range(len(chosen))
        pairs = combinations(numbers, 2) if len(chosen) <= MANY else ()
        for left in (*((n,) for n in numbers), *pairs):
            stays = ~np.isin(numbers, left)
            wanted = ~self.covers[:, chosen[stays]].any(axis=1)
            fits = self.free & ~shut[stays].any(axis=0) & self.covers[wanted].all(axis=0)
            subset = np.flatnonzero(fits)
            yield chosen[stays], subset[self.holds(chosen[stays], subset)]


def cheaper(room: Room, price: Int[np.ndarray, " s"], chosen: Int[np.ndarray, " n"]) -> Int[np.ndarray, " m"] | None:
    """A choice that costs less by one exchange, or by leaving a site out; None where there is none."""
    for rest in room.spared(chosen):
        return rest
    for rest, subset in room.exchanges(chosen):
        if len(subset) and price[subset].min() < price[chosen].sum() - price[rest].sum():
            return np.sort(np.append(rest, subset[price[subset].argmin()]))
    return None


def prices(sites: Sites, settings: LayoutSettings, rows: Int[np.ndarray, " r"]) -> Int[np.ndarray, " s"]:
    """What each site costs in a program for `rows`, in units of RESOLUTION."""
    return np.rint(costs(sites, settings, rows, np.arange(len(sites.size))) / RESOLUTION).astype(np.int64)


def ranked(sites: Sites, settings: LayoutSettings, rows: Int[np.ndarray, " r"]) -> Int[np.ndarray, " s"]:
    """`prices` by which choices are ranked: where the number comes first, the fewest landmarks come first."""
    price = prices(sites, settings, rows)
    return price + FIRST * sites.size if settings.weights == "lexicographic" and settings.number is None else price


def greedy_cover(search: Search, start: Choice = ()) -> Choice | None:
    """Sites that reach all blendshapes of the search within its budget, spacing and limits; None where none was found
    in two ways, which proves nothing."""
    for scarce in (False, True):
        chosen = start
        while search.misses(chosen) and (new := _next(search, chosen, scarce=scarce)) is not None:
            chosen = (*chosen, new)
        if not search.misses(chosen):
            return chosen
    return None


def _next(search: Search, chosen: Choice, *, scarce: bool) -> int | None:
    """The site that helps most; None where no open one helps."""
    subset, wanting = search.next(chosen), search.covers[~search.covers[:, list(chosen)].any(axis=1)]
    if not len(subset):
        return None
    gain: Float[np.ndarray, " m"] = wanting[:, subset].sum(axis=0) / search.size[subset]
    if scarce and len(wanting):
        hardest = wanting[:, subset].sum(axis=1).argmin()
        gain = gain + len(wanting) * wanting[hardest, subset]
    best = int(gain.argmax())
    short = search.shortfall(chosen) > 0
    return int(subset[best]) if gain[best] > 0 or short else None
