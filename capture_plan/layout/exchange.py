"""One budget, one face: the moves by which a choice of sites gets better, and what each move must keep.

Data       a[s], c[k, s], C(S), G    as in `budget`; limits least <= sum_{s in S} amount[s] <= most
Score      (how far S is from its limits, blendshapes of c without a site of S, trace(G C(S))): the less, the better,
           in this order
Moves      fill: what a limit still asks for, the scarcest first, then whatever lowers the error most
           swap: one site for another of its size;  trade: a pair for two singles, two singles for a pair, and a
           single for a pair where the budget leaves one over
No move goes over the upper end of a limit, against the spacing or over the budget.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import numpy as np
from jaxtyping import Bool, Float, Int

from capture_plan.layout.constraint_rows import Limit, open_under
from capture_plan.layout.gains import Gains, gains_at, site_rows
from capture_plan.layout.observation import Observation
from capture_plan.layout.sites import Sites
from capture_plan.layout.spacing import Spacing

FEW = 60  # rivals of each chosen site: swaps among a few hundred sites cost a tenth
CLOSE = -0.5  # sites that give back half of what is lost may give more once others have moved
BETTER = 1e-9  # relative: smaller gains are rounding, and following them could go round in circles

Choice = tuple[int, ...]


@dataclass(frozen=True, eq=False)
class Search:
    """One problem; choices are tuples of sites. `covers` holds the blendshapes that must keep a landmark."""

    observation: Observation
    sites: Sites
    covers: Bool[np.ndarray, "k s"]
    spacing: Spacing | None
    budget: int
    limits: tuple[Limit, ...] = ()

    @cached_property
    def everywhere(self) -> Int[np.ndarray, " s"]:
        """All sites as a mask of yes."""
        return np.arange(len(self.size))

    @cached_property
    def all_rows(self) -> Float[np.ndarray, "s r k"]:
        """Rows of the deltas at every site."""
        return site_rows(self.sites, self.observation.measured)

    @cached_property
    def size(self) -> Int[np.ndarray, " s"]:
        """How many landmarks every site has, (s)."""
        return self.sites.size

    @cached_property
    def singles(self) -> Int[np.ndarray, " n"]:
        """The sites that have one landmark alone."""
        return np.flatnonzero(self.size == 1)

    @cached_property
    def _near(self) -> dict[int, Bool[np.ndarray, " s"]]:
        return {}

    def near(self, site: int) -> Bool[np.ndarray, " s"]:
        """Sites that `site` shuts out: itself, and what stands too close."""
        if site not in self._near:
            alone = np.arange(len(self.size)) == site
            self._near[site] = self.spacing.close(np.array([site]))[0] if self.spacing else alone
        return self._near[site]

    def rows(self, left: Choice) -> Float[np.ndarray, "q k"]:
        """Rows of the deltas at some sites, one under the other."""
        return np.concatenate([self.all_rows[site, : 3 * self.size[site]] for site in left])

    def open_to(self, chosen: Choice) -> Bool[np.ndarray, " s"]:
        """Sites that may join the chosen ones: at the spacing, within the budget, over no limit."""
        fits = self.size <= self.budget - self.landmarks(chosen)
        for site in chosen:
            fits &= ~self.near(site)
        return fits & open_under(self.limits, np.array(chosen, dtype=int), len(fits))

    def landmarks(self, chosen: Choice) -> int:
        """How many landmarks the chosen sites place."""
        return int(self.size[list(chosen)].sum())

    def gains(self, chosen: Choice) -> Gains:
        """What every site tells beside the chosen ones."""
        C = self.observation.covariance(self.sites.members(np.array(chosen, dtype=int)))
        return gains_at(self.observation, self.all_rows, C)

    def shortfall(self, chosen: Choice) -> int:
        """How far a choice is from its limits."""
        return sum(limit.shortfall(np.array(chosen, dtype=int)) for limit in self.limits)

    def uncovered(self, chosen: Choice) -> int:
        """Blendshapes of `covers` without a site."""
        return int((~self.covers[:, list(chosen)].any(axis=1)).sum())

    def score(self, chosen: Choice) -> tuple[int, int, float]:
        """What is compared: limits missed, blendshapes without a landmark, squared error in mm^2."""
        C = self.observation.covariance(self.sites.members(np.array(chosen, dtype=int)))
        return self.shortfall(chosen), self.uncovered(chosen), float(np.sum(self.observation.gram * C))

    def fill(self, chosen: Choice) -> Choice:
        """Greedy: `chosen`, what its limits ask for, and the best open sites one after another, up to the budget."""
        gains = self.gains(chosen)
        while len(subset := self.next(chosen)):
            new = int(subset[(gains.all(subset) / self.size[subset]).argmax()])
            chosen, gains = (*chosen, new), gains.step(self.rows((new,)), -1)
        return chosen

    def next(self, chosen: Choice) -> Int[np.ndarray, " n"]:
        """Open sites; where a limit is not reached yet, those that help with the one that fewest help with."""
        fits, at = self.open_to(chosen), list(chosen)
        short = [limit for limit in self.limits if limit.amount[at].sum() < limit.least]
        for limit in sorted(short, key=lambda limit: int((limit.amount > 0).sum())):
            if (helps := fits & (limit.amount > 0)).any():
                return np.flatnonzero(helps)
        return np.flatnonzero(fits)

    def in_order(self, chosen: Choice) -> Choice:
        """`chosen` by what each adds: the last is always the one that is missed least, for each of its landmarks."""
        retained, order = list(chosen), []
        while retained:
            C = self.observation.covariance(self.sites.members(np.array(retained)))
            gains = gains_at(self.observation, self.all_rows[retained], C)
            lost = [gains.loss(self.rows((site,))) / self.size[site] for site in retained]
            order.append(retained.pop(int(np.argmin(lost))))
        return tuple(order[::-1])

    def descend(self, chosen: Choice) -> Choice:
        """Exchanges from `chosen` on, each of which lowers the score, until none does and no site is open."""
        while (swapped := self.swap_all(chosen)) and (chosen := self.fill(self.trade(swapped))) != swapped:
            continue
        return chosen

    def swap_all(self, chosen: Choice) -> Choice:
        """Swaps until no site has a better one: among those that come close everywhere, then among the better ones."""
        listed = self.rivals(chosen, CLOSE)
        chosen = self.swap_within(chosen, listed)
        while len(better := self.rivals(chosen, BETTER)):
            listed = np.union1d(listed, better)
            chosen = self.swap_within(chosen, listed)
        return chosen

    def rivals(self, chosen: Choice, share: float) -> Int[np.ndarray, " n"]:
        """For each of the chosen sites the few best that lower the score in its place, or do but for `share`."""
        if not chosen:
            return np.empty(0, dtype=int)
        gains, found, retained = self.gains(chosen), [], self.misses(chosen) == 0
        for site, most in zip(chosen, gains.most(self.all_rows[list(chosen)]), strict=True):
            rest = tuple(other for other in chosen if other != site)
            listed = (
                np.flatnonzero(most > (1 + share) * gains.loss(self.rows((site,)))) if retained else self.everywhere
            )
            few = self.instead(gains.at(listed), listed, (site,), rest, int(self.size[site]), share)
            found.append(few[:FEW])
        return np.unique(np.concatenate(found))

    def swap_within(self, chosen: Choice, listed: Int[np.ndarray, " n"]) -> Choice:
        """The best swap of every site in turn for a listed one of its size, until no site has a better one."""
        gains, settled = self.gains(chosen).at(listed), 0
        while settled < len(chosen):
            site, *rest = chosen
            better = self.instead(gains, listed, (site,), tuple(rest), int(self.size[site]))
            new = int(better[0]) if len(better) else site
            settled += 1
            chosen = (*rest, new)
            if new != site:
                gains, settled = gains.step(self.rows((new,)), -1).step(self.rows((site,)), 1), 1
        return chosen

    def instead(
        self, gains: Gains, listed: Int[np.ndarray, " n"], left: Choice, rest: Choice, size: int, share: float = BETTER
    ) -> Int[np.ndarray, " m"]:
        """Of the listed sites, whose gains are given, those of one size that lower the score in the place of `left`.

        The best is first. Those count whose gain is 1 + `share` of what is lost.
        """
        at = np.flatnonzero((self.open_to(rest) & (self.size == size))[listed])
        if not len(at):
            return at
        before, after = self.misses((*rest, *left)), self.misses_with(rest, listed[at])
        at = at[after == after.min()]
        if after.min() > before:
            return at[:0]
        beat = gains.loss(self.rows(left)) * (1 + share) if after.min() == before else -1.0
        gain = gains.without(self.rows(left), at, beat=beat)
        order = np.argsort(-gain, kind="stable")
        return listed[at[order[: int((gain > beat).sum())]]]

    def misses(self, chosen: Choice) -> int:
        """The score but for the error, as one number."""
        return self.shortfall(chosen) * (len(self.covers) + 1) + self.uncovered(chosen)

    def misses_with(self, rest: Choice, subset: Int[np.ndarray, " n"]) -> Int[np.ndarray, " n"]:
        """What is missed by `rest` with each of the sites `subset` added."""
        wanting = self.covers[~self.covers[:, list(rest)].any(axis=1)]
        short = np.zeros(len(subset), dtype=int)
        for limit in self.limits:
            total = limit.amount[subset] + limit.amount[list(rest)].sum()
            short += np.maximum(0, limit.least - total)
            short += 0 if limit.most is None else np.maximum(0, total - limit.most)
        return short * (len(self.covers) + 1) + (~wanting[:, subset]).sum(axis=0)

    def trade(self, chosen: Choice) -> Choice:
        """The first trade that lowers the score, or `chosen`."""
        before, gains = self.score(chosen), self.gains(chosen)
        for left, size in self.trades(chosen):
            rest = tuple(site for site in chosen if site not in left)
            if size == 1:
                new = self.two_singles(gains, left, rest)
            else:
                new = (*rest, *self.instead(gains, self.everywhere, left, rest, 2)[:1].tolist())
            if self.score(new) < before:
                return new
        return chosen

    def two_singles(self, gains: Gains, left: Choice, rest: Choice) -> Choice:
        """`rest` and the two best open singles, or as many as there are, in the place of `left`."""
        gains = gains.at(self.singles).step(self.rows(left), 1)
        for _ in range(2):
            open_ = np.flatnonzero(self.open_to(rest)[self.singles])
            if len(open_):
                new = int(self.singles[open_[gains.all(open_).argmax()]])
                rest, gains = (*rest, new), gains.step(self.rows((new,)), -1)
        return rest

    def trades(self, chosen: Choice) -> Iterator[tuple[Choice, int]]:
        """Sites to leave out, and the size of what takes their place."""
        if len(set(self.size.tolist())) < 2:
            return
        singles = [site for site in chosen if self.size[site] == 1]
        yield from (((site,), 1) for site in chosen if self.size[site] == 2)
        yield from ((left, 2) for left in combinations(singles, 2))
        if self.landmarks(chosen) < self.budget:
            yield from (((site,), 2) for site in singles)
