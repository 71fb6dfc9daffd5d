"""The best landmarks that a budget buys: least upper estimate, all constraints met, every blendshape on some landmark.

Data       s           sites, a[s] = 1 or 2 landmarks each; A_s the rows of the deltas at its members
           c[k, s]     site s is a candidate for blendshape k
           C(S)        covariance of the weights given the sites S, G the skin's Gram matrix (`information`)
           limits      least <= sum_{s in S} amount[s] <= most, see `limits`: pins, keep-outs, caps, an exact number
Model      min  trace(G C(S))
           s.t. sum_{s in S} a[s] <= M, S at the spacing and within its limits, every k on some s in S where M allows
Method     from the set cover, from nothing and from pivoted QR: filled up greedily, then exchanges until none helps
           (`search`, `gains`); the best end is the answer. `relaxation` says how far from the best it can be.
"""

import numpy as np
from jaxtyping import Bool, Int

from capture_plan.errors import InfeasibleError
from capture_plan.layout.constraint_rows import Limit
from capture_plan.layout.exchange import Choice, Search
from capture_plan.layout.observation import Observation
from capture_plan.layout.pivoted_qr import Pivots
from capture_plan.layout.sites import Sites
from capture_plan.layout.spacing import Spacing
from capture_plan.progress import track


def spend_budget(
    observation: Observation,
    sites: Sites,
    covers: Bool[np.ndarray, "k s"],
    cover: Int[np.ndarray, " n"],
    *,
    budget: int,
    spacing: Spacing | None,
    limits: tuple[Limit, ...] = (),
) -> Int[np.ndarray, " m"]:
    """Sites of at most `budget` landmarks with the least upper estimate of the error found, the most telling first.

    `cover` holds sites at the spacing and within the limits that reach every blendshape of `covers`: where the budget
    pays for them, limits are kept, every blendshape keeps a landmark, and the error is at most that of the cover filled
    up greedily. A budget is left short only where no open site that it pays for is left.

    Raises:
        InfeasibleError: it does not pay for a single site.
    """
    if budget < sites.size.min():
        raise InfeasibleError(f"a budget of {budget} landmark buys no symmetric pair: raise it or switch symmetric off")
    affordable = sites.size[cover].sum() <= budget
    search = Search(observation, sites, covers if affordable else covers[:0], spacing, budget, limits)
    starts = [(), pivoted(search)] + ([tuple(cover.tolist())] if affordable else [])
    ends = [search.descend(search.fill(start)) for start in track(starts, "Spending the budget", total=len(starts))]
    return np.array(search.in_order(min(ends, key=search.score)), dtype=int)


def replan(search: Search, former: Choice) -> Int[np.ndarray, " m"]:
    """The answer to a problem close to one whose answer was `former`, the most telling first.

    What keeps the new limits, spacing and budget stays, what breaks them goes, the least missed first; then swaps, and
    no trades of pairs for singles: a person waits for it.
    """
    end = search.swap_all(search.fill(keepable(search, former)))
    while (filled := search.fill(end)) != end:  # swaps may have made room
        end = search.swap_all(filled)
    return np.array(search.in_order(end), dtype=int)


def keepable(search: Search, former: Choice) -> Choice:
    """What of a former choice can stay, and before it what the limits ask for."""
    asked = [site for limit in search.limits for site in former if asks(limit, site, former)]
    asked = asked_anew(search, former, tuple(dict.fromkeys(asked)))
    retained: Choice = ()
    for site in dict.fromkeys((*asked, *search.in_order(former))):
        if search.open_to(retained)[site]:
            retained = (*retained, site)
    return retained


def asks(limit: Limit, site: int, chosen: Choice) -> bool:
    """Whether the limit would be missed without this one of the chosen sites."""
    return bool(limit.amount[site] > 0 and limit.amount[list(chosen)].sum() - limit.amount[site] < limit.least)


def asked_anew(search: Search, former: Choice, asked: Choice) -> Choice:
    """`asked` and, of each limit that the former choice misses, the sites that tell most beside it."""
    gains = search.gains(former)
    for limit in search.limits:
        while limit.amount[list({*former, *asked})].sum() < limit.least:
            candidates = np.setdiff1d(np.flatnonzero((limit.amount > 0) & search.open_to(asked)), former)
            if not len(candidates):
                break
            asked = (*asked, int(candidates[gains.all(candidates).argmax()]))
    return asked


def pivoted(search: Search) -> Choice:
    """What the limits ask for, then pivoted QR over the open sites up to the budget."""
    chosen: Choice = ()
    pivots = Pivots(search.all_rows)
    while len(candidates := search.next(chosen)):
        chosen = (*chosen, pivots.take(candidates, search.size))
    return chosen
