"""Adaptive multi-cover: more landmarks where one would have to tell too many blendshapes apart.

Zell & McDonnell 2022, Algorithm 1: cover, take away the chosen sites and their neighbourhood, cover again what needs
more. A blendshape is owned by the chosen site that it moves most; where a landmark owns more than a tenth of all
blendshapes, they stay for the next round (section 3.3.2). Unlike the paper's, every single cover keeps the spacing too.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Int
from msgspec import structs

from capture_plan.errors import InfeasibleError
from capture_plan.layout.constraint_rows import Limit
from capture_plan.layout.costs import RESOLUTION, costs, to_cover
from capture_plan.layout.cover import Cover, solve_cover
from capture_plan.layout.second_look import Room, cheaper, prices, ranked
from capture_plan.layout.settings import LayoutSettings
from capture_plan.layout.sites import Sites
from capture_plan.layout.spacing import Spacing, taken_by


def best_cover(
    sites: Sites,
    settings: LayoutSettings,
    rows: Int[np.ndarray, " r"],
    open_: Int[np.ndarray, " o"],
    spacing: Spacing | None,
    limits: Sequence[Limit] = (),
    *,
    demand: Int[np.ndarray, " r"] | int = 1,
) -> Cover:
    """The cover of blendshapes `rows` by sites `open_` that `settings.weights` calls best, at the spacing if given.

    A fixed number of landmarks leaves nothing to be fewest: the places alone count then.
    """
    size = sites.size[open_]
    covers = sites.relative_displacement[np.ix_(rows, open_)] >= settings.epsilon
    wanted = [limit.restricted_to(open_) for limit in limits]
    fewest: list[Limit] = []
    if settings.weights == "lexicographic" and settings.number is None:
        least = best_cover(
            sites, structs.replace(settings, weights="count"), rows, open_, spacing, limits, demand=demand
        )
        fewest = [Limit("the fewest landmarks", size, most=round(least.objective))]
    apart = spacing.restricted_to(open_) if spacing else None
    cost = costs(sites, settings, rows, open_)
    cover = solve_cover(covers, cost, demand=demand, spacing=apart, limits=[*wanted, *fewest])
    cover = replace(cover, rows=rows, chosen=open_[cover.chosen])
    return (
        cover
        if cover.proven_optimal or np.max(demand) > 1
        else polished(cover, sites, settings, open_, spacing, limits)
    )


def polished(
    cover: Cover,
    sites: Sites,
    settings: LayoutSettings,
    open_: Int[np.ndarray, " o"],
    spacing: Spacing | None,
    limits: Sequence[Limit],
) -> Cover:
    """A cover that nobody proved the cheapest, after exchanges until none makes it cheaper."""
    chosen, free = cover.chosen, np.isin(np.arange(len(sites.size)), open_)
    room = Room(sites.covers(settings.epsilon)[cover.rows], free, spacing, limits)
    price = ranked(sites, settings, cover.rows)
    while (better := cheaper(room, price, chosen)) is not None:
        chosen = better
    cost = float(prices(sites, settings, cover.rows)[chosen].sum()) * RESOLUTION
    return replace(cover, chosen=chosen, objective=cost, proven_optimal=cover.bound >= cost)


def adaptive_cover(
    sites: Sites, settings: LayoutSettings, spacing: Spacing | None, limits: Sequence[Limit] = ()
) -> list[Cover]:
    """The covers of Algorithm 1, one for each round that found something to do; the first keeps all limits, the
    others what they leave."""
    chosen = np.empty(0, dtype=int)
    rounds: list[Cover] = []
    for _ in range(settings.rounds):
        free = ~taken_by(chosen, spacing, len(sites.visibility))
        rows = to_cover(sites, settings, chosen, free, limits)
        if not len(rows):
            break
        try:
            left = [limit.after(chosen) for limit in limits]
            rounds.append(best_cover(sites, settings, rows, np.flatnonzero(free), spacing, left))
        except InfeasibleError:
            if not rounds:
                raise
            break  # caps leave less than one more landmark for each: what the first round has is enough to see all
        chosen = np.concatenate([chosen, rounds[-1].chosen])
    return rounds
