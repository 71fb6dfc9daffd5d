"""The best landmarks that a budget buys: least predicted error, every blendshape still on some landmark.

Data       s           sites, a[s] = 1 or 2 landmarks each; A_s the rows of the deltas at its members
           c[k, s]     site s is a candidate for blendshape k
           C(S)        covariance of the weights given the sites S, G the skin's Gram matrix (`worth`)
Model      min  trace(G C(S))
           s.t. sum_{s in S} a[s] <= M, S at the spacing, every k on some s in S where M allows

Greedy from the set cover and from nothing, then exchanges until none helps. With P = A C, T = A C A^T and
H = P G P^T, leaving out a site whose rows are R changes C into C + U U^T, U = C R^T (sigma^2 I - R C R^T)^-1/2, so that

    T' = T + V V^T,   H' = H + V X^T + X V^T + V U^T G U V^T,   V = A U,   X = P G U,

and the gain trace((sigma^2 I + T'_s)^-1 H'_s) of every site s in the place of the one left out takes thin products.
"""

from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import numpy as np
from jaxtyping import Bool, Float, Int

from capture_plan.errors import InfeasibleError
from capture_plan.layout.multicover import Spacing
from capture_plan.layout.repair import error_gains, site_rows, times
from capture_plan.layout.sites import Sites
from capture_plan.layout.worth import Observation
from capture_plan.progress import track

BETTER = 1e-9  # relative: smaller gains are rounding, and following them could go round in circles


@dataclass(frozen=True, eq=False)
class Gains:
    """What every site tells at `covariance` = C: P = A C, and at each site T = A C A^T and H = P G P^T."""

    observation: Observation
    A: Float[np.ndarray, "s r k"]
    covariance: Float[np.ndarray, "k k"]
    P: Float[np.ndarray, "s r k"]
    T: Float[np.ndarray, "s r r"]
    H: Float[np.ndarray, "s r r"]

    def without(self, left: int, among: Int[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
        """By how much each of the sites `among` lowers trace(G C) once the chosen site `left` is gone, mm^2."""
        R, G = self.A[left], self.observation.gram
        noise = self.observation.noise_mm**2
        # U = C R^T L^-T, L L^T = sigma^2 I - R C R^T
        L = np.linalg.cholesky(noise * np.eye(len(R)) - R @ self.covariance @ R.T)
        U = np.linalg.solve(L, R @ self.covariance).T
        P = self.P[among].reshape(-1, len(U))
        V = (self.A[among].reshape(-1, len(U)) @ U).reshape(len(among), -1, len(R))
        X = (P @ (G @ U)).reshape(V.shape)
        VT = V.transpose(0, 2, 1)
        T = self.T[among] + V @ VT
        cross = X @ VT
        H = self.H[among] + cross + cross.transpose(0, 2, 1) + V @ (U.T @ G @ U) @ VT
        return np.trace(np.linalg.solve(T + noise * np.eye(T.shape[1]), H), axis1=1, axis2=2)


def gains_at(observation: Observation, A: Float[np.ndarray, "s r k"], covariance: Float[np.ndarray, "k k"]) -> Gains:
    """`Gains` at a covariance C, by large products."""
    P = times(A, covariance)
    T, H = P @ A.transpose(0, 2, 1), times(P, observation.gram) @ P.transpose(0, 2, 1)
    return Gains(observation, A, covariance, P, T, H)


@dataclass(frozen=True, eq=False)
class Search:
    """One problem; choices are tuples of sites. `covers` holds the blendshapes that must keep a landmark."""

    observation: Observation
    sites: Sites
    covers: Bool[np.ndarray, "k s"]
    spacing: Spacing | None
    budget: int

    @cached_property
    def rows(self) -> Float[np.ndarray, "s r k"]:
        """Rows of the deltas at every site."""
        return site_rows(self.sites, self.observation.deltas)

    @cached_property
    def size(self) -> Int[np.ndarray, " s"]:
        """Landmarks of every site."""
        return self.sites.size

    @cached_property
    def _near(self) -> dict[int, Bool[np.ndarray, " s"]]:
        return {}

    def near(self, site: int) -> Bool[np.ndarray, " s"]:
        """Sites that `site` shuts out: itself, and what stands too close."""
        if site not in self._near:
            alone = np.arange(len(self.size)) == site
            self._near[site] = self.spacing.close(np.array([site]))[0] if self.spacing else alone
        return self._near[site]

    def open_to(self, chosen: tuple[int, ...]) -> Bool[np.ndarray, " s"]:
        """Sites that keep the spacing to all that are chosen."""
        return ~np.any([self.near(site) for site in chosen], axis=0) if chosen else np.ones(len(self.size), dtype=bool)

    def landmarks(self, chosen: tuple[int, ...]) -> int:
        """How many landmarks the chosen sites place."""
        return int(self.size[list(chosen)].sum())

    def covariance(self, chosen: tuple[int, ...]) -> Float[np.ndarray, "k k"]:
        """C of the weights given the chosen sites."""
        return self.observation.covariance(self.sites.members(np.array(chosen, dtype=int)))

    def score(self, chosen: tuple[int, ...]) -> tuple[int, float]:
        """Blendshapes without a landmark, and trace(G C) in square millimetres: the less, the better, in this order."""
        missed = (~self.covers[:, list(chosen)].any(axis=1)).sum()
        return int(missed), float(np.sum(self.observation.gram * self.covariance(chosen)))

    def best_open(self, chosen: tuple[int, ...], fits: Bool[np.ndarray, " s"]) -> int | None:
        """Of the open sites that fit, the one that lowers the error most for each of its landmarks."""
        among = np.flatnonzero(fits & self.open_to(chosen))
        if not len(among):
            return None
        gain = error_gains(self.observation, self.rows[among], self.covariance(chosen)) / self.size[among]
        return int(among[gain.argmax()])

    def fill(self, chosen: tuple[int, ...]) -> tuple[int, ...]:
        """Greedy: `chosen` and the best open sites one after another, up to the budget."""
        while (new := self.best_open(chosen, self.size <= self.budget - self.landmarks(chosen))) is not None:
            chosen = (*chosen, new)
        return chosen

    def descend(self, chosen: tuple[int, ...]) -> tuple[int, ...]:
        """Exchanges from `chosen` on, each of which lowers the score, until none does."""
        while (swapped := self.swap_all(chosen)) and (chosen := self.trade(swapped)) != swapped:
            continue
        return chosen

    def swap_all(self, chosen: tuple[int, ...]) -> tuple[int, ...]:
        """The best swap of every site in turn for one of its size, until no site has a better one."""
        gains, settled = gains_at(self.observation, self.rows, self.covariance(chosen)), 0
        while settled < len(chosen):
            site, *rest = chosen
            new = self.best_instead(gains, site, tuple(rest))
            settled += 1
            chosen = (*rest, new)
            if new != site:
                gains, settled = gains_at(self.observation, self.rows, self.covariance(chosen)), 1
        return chosen

    def best_instead(self, gains: Gains, site: int, rest: tuple[int, ...]) -> int:
        """The open site that leaves least uncovered and lowers the error most in the place of `site`, or `site`."""
        wanting = self.covers[~self.covers[:, list(rest)].any(axis=1)]
        missed = (~wanting).sum(axis=0)
        fits = self.open_to(rest) & (self.size == self.size[site])
        among = np.flatnonzero(fits & (missed == missed[fits].min()))
        gain = gains.without(site, among)
        stays = gain[among == site]
        return site if len(stays) and gain.max() <= stays[0] * (1 + BETTER) else int(among[gain.argmax()])

    def trade(self, chosen: tuple[int, ...]) -> tuple[int, ...]:
        """The first trade of a pair for two singles, or of two singles for a pair, that lowers the score."""
        before = self.score(chosen)
        singles = [site for site in chosen if self.size[site] == 1]
        for left in [*((site,) for site in chosen if self.size[site] == 2), *combinations(singles, 2)]:
            new = tuple(site for site in chosen if site not in left)
            for _ in range(3 - len(left)):
                found = self.best_open(new, self.size == len(left))
                new = new if found is None else (*new, found)
            if self.score(new) < before:
                return new
        return chosen


def spend_budget(
    observation: Observation,
    sites: Sites,
    covers: Bool[np.ndarray, "k s"],
    cover: Int[np.ndarray, " n"],
    *,
    budget: int,
    spacing: Spacing | None,
) -> Int[np.ndarray, " m"]:
    """Sites of at most `budget` landmarks with the least predicted error found, the most telling first.

    `cover` holds sites at the spacing that reach every blendshape of `covers`: where the budget pays for them, every
    blendshape keeps a landmark, and the error is at most that of the cover filled up greedily. A budget is left short
    only where no open site that it pays for is left.

    Raises:
        InfeasibleError: it does not pay for a single site.
    """
    if budget < sites.size.min():
        raise InfeasibleError(f"a budget of {budget} landmark buys no symmetric pair: raise it or switch symmetric off")
    affordable = sites.size[cover].sum() <= budget
    search = Search(observation, sites, covers if affordable else covers[:0], spacing, budget)
    starts = [tuple(cover.tolist()), ()] if affordable else [()]
    ends = [search.descend(search.fill(start)) for start in track(starts, "Spending the budget", total=len(starts))]
    return nested(observation, sites, np.array(min(ends, key=search.score), dtype=int))


def nested(observation: Observation, sites: Sites, chosen: Int[np.ndarray, " n"]) -> Int[np.ndarray, " n"]:
    """`chosen` in the order of worth: the last is always the one that is missed least, for each of its landmarks."""
    kept, order = chosen, []
    while len(kept):
        A = site_rows(Sites(sites.vertices[kept], sites.reach[:, kept], sites.visibility[kept]), observation.deltas)
        gains = gains_at(observation, A, observation.covariance(sites.members(kept)))
        lost = [gains.without(i, np.array([i]))[0] for i in range(len(kept))] / sites.size[kept]
        order.append(kept[lost.argmin()])
        kept = np.delete(kept, lost.argmin())
    return np.array(order[::-1], dtype=int)
