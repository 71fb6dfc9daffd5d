"""How little error any layout can predict: a proved lower bound, with a certificate that anybody can check.

Data       n[s]          landmarks of site s; A_s its rows of the deltas; sigma, tau, G as in `information`
Variables  lam[s]        share of site s, 0 to 1; 0 where a limit shuts it out, 1 where one pins it
Model      min f(lam) = trace(G C(lam)),  C(lam) = (sum_s lam[s] A_s^T A_s / sigma^2 + I / tau^2)^-1
           s.t. sum_s n[s] lam[s] <= M
Bound      f is convex, so that for any lam >= 0 and every layout mu
               f(mu) >= f(lam) + sum_s g[s] (lam[s] - mu[s]),   g[s] = trace(A_s C G C A_s^T) / sigma^2 = -df/dlam[s];
           least over mu: pinned sites, then sites in the order of g[s] / n[s] up to M, the last one in part

Number     the same shares bound every other M too: the least that can reach a target is the first whose bound does. A
           bound is a tangent, closest at its own M: shares of that number prove more, until they prove no more (Newton)

Rank       M landmarks answer to 3 M mixes at most: error^2 >= tau^2 (sum of the eigenvalues of G beyond the first 3 M)

Spacing, covers and constraints about several sites are left out, which can only lower the bound. Multiplicative updates
lam <- lam (g / n)^p, scaled to the budget and held at 1 (Silvey et al. 1978 without the hold), on the few sites that
matter; sites that the others' price calls for join them, until the bound is close to f.
"""

from bisect import bisect_left
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Int
from msgspec.structs import replace as replace_fields

from capture_plan.layout.constraint_rows import Limit
from capture_plan.layout.gains import site_rows, times
from capture_plan.layout.observation import PRIOR_SD, Observation
from capture_plan.layout.record import ErrorBound
from capture_plan.layout.sites import Sites

CLOSE = 0.003  # of f, 0.15 % of the error: what better shares could still add to the bound
ROUNDS, UPDATES = 60, 15  # real faces need fewer than ten rounds
SHARE_DIGITS, ERROR_DIGITS = (2, 3, 4), 4
BRIEF = 0.005  # of f, given up for a certificate of fewer digits and sites
JOINS = 0.02  # share that a site begins with


@dataclass(frozen=True, eq=False)
class Relaxed:
    """The relaxed problem; `open_` may have shares, `held` have share 1."""

    observation: Observation
    A: Float[np.ndarray, "s r k"]
    size: Int[np.ndarray, " s"]
    open_: Bool[np.ndarray, " s"]
    held: Bool[np.ndarray, " s"]
    budget: int

    def value(self, lam: Float[np.ndarray, " s"]) -> tuple[float, Float[np.ndarray, " s"]]:
        """f and g at any shares, square millimetres."""
        sigma2, G, at = self.observation.noise_mm**2, self.observation.gram, np.flatnonzero(lam)
        k = self.A.shape[2]
        scaled = (self.A[at] * lam[at, None, None]).reshape(-1, k)
        C = np.linalg.inv(scaled.T @ self.A[at].reshape(-1, k) / sigma2 + np.eye(k) / PRIOR_SD**2)
        # trace(A_s C G C A_s^T) = sum of squares of A_s C Q, Q Q^T = G
        w, Q = np.linalg.eigh(G)
        answers = times(self.A, C @ (Q * np.sqrt(np.clip(w, 0, None))))
        return float(np.sum(G * C)), np.einsum("srk,srk->s", answers, answers) / sigma2

    def bound(self, f: float, g: Float[np.ndarray, " s"], lam: Float[np.ndarray, " s"]) -> float:
        """What no layout falls below, square millimetres."""
        left = self.budget - self.size[self.held].sum()
        free = np.flatnonzero(self.open_ & ~self.held)
        order = free[np.argsort(-g[free] / self.size[free], kind="stable")]
        before = np.cumsum(self.size[order]) - self.size[order]
        mu = np.clip((left - before) / self.size[order], 0, 1)
        return f + float(g @ lam - g[self.held].sum() - g[order] @ mu)

    def scaled(self, y: Float[np.ndarray, " s"]) -> Float[np.ndarray, " s"]:
        """min(1, theta y) of the budget, pinned sites at 1; all open ones at 1 where the budget pays for them."""
        lam, free = self.held.astype(float), np.flatnonzero(self.open_ & ~self.held & (y > 0))
        left, n, y = self.budget - self.size[self.held].sum(), self.size[free], y[free]
        order = np.argsort(-y, kind="stable")
        # with the i largest at 1, theta spends what is left on the others
        spent = np.concatenate([[0], np.cumsum(n[order])])
        others = np.concatenate([np.cumsum((n * y)[order][::-1])[::-1], [0]])
        theta = np.divide(left - spent, others, out=np.full(len(spent), np.inf), where=others > 0)
        fits = np.flatnonzero(theta[:-1] * y[order] <= 1)
        lam[free] = np.minimum(1, theta[fits[0]] * y) if len(fits) else 1.0
        return lam

    def restricted_to(self, at: Int[np.ndarray, " n"]) -> "Relaxed":
        """The relaxed problem with these sites alone."""
        return Relaxed(self.observation, self.A[at], self.size[at], self.open_[at], self.held[at], self.budget)


def error_bound(
    observation: Observation,
    sites: Sites,
    *,
    budget: int,
    limits: tuple[Limit, ...] = (),
    former: ErrorBound | None = None,
) -> ErrorBound:
    """The upper estimate that no layout of at most `budget` landmarks on these sites is below; `former` is a
    certificate of a problem close to this one, from whose shares the search starts."""
    relaxed = relax_budget(observation, sites, budget, limits)
    start = np.ones(len(sites.size)) if former is None else shares_of(sites, former)
    lam = brief(relaxed, best_shares(relaxed, relaxed.scaled(start)))
    at = np.flatnonzero(lam)
    return ErrorBound(
        error_mm=bound_from(observation, sites, lam, budget=budget, limits=limits),
        vertices=tuple(sites.vertices[at, 0].tolist()),
        shares=tuple(lam[at].tolist()),
    )


def target_bound(
    observation: Observation, sites: Sites, start: ErrorBound, *, target_mm: float, limits: tuple[Limit, ...] = ()
) -> ErrorBound | None:
    """The certificate of the number below which no layout has an upper estimate of `target_mm` or less, and the bound
    of that number, from another certificate on; None where no number of landmarks has as low a one."""
    proved, best, found = 0, start, start
    while True:
        shares = shares_of(sites, found)
        number = fewest_for(observation, sites, shares, target_mm=target_mm, limits=limits)
        if number is None:
            return None
        if number <= proved:
            least = bound_from(observation, sites, shares_of(sites, best), budget=proved, limits=limits)
            return replace_fields(best, error_mm=least)
        proved, best = number, found
        found = error_bound(observation, sites, budget=number, limits=limits, former=found)


def best_shares(relaxed: Relaxed, lam: Float[np.ndarray, " s"]) -> Float[np.ndarray, " s"]:
    """Shares whose bound comes within `CLOSE` of their f, or the best that were found, from a start on."""
    best, found = -np.inf, lam
    for _ in range(ROUNDS):
        f, g = relaxed.value(lam)
        if (bound := relaxed.bound(f, g, lam)) > best:
            best, found = bound, lam
        if f - best <= CLOSE * f:
            break
        lam = np.round(improved(relaxed, lam, g), SHARE_DIGITS[-1])
    return found


def brief(relaxed: Relaxed, lam: Float[np.ndarray, " s"]) -> Float[np.ndarray, " s"]:
    """The shares with as few digits as leave the bound nearly what it is."""
    rounded = [np.round(lam, digits) for digits in SHARE_DIGITS]
    bounds = [relaxed.bound(*relaxed.value(shares), shares) for shares in rounded]
    return next(shares for shares, bound in zip(rounded, bounds, strict=True) if bound >= max(bounds) * (1 - BRIEF))


def shares_of(sites: Sites, bound: ErrorBound) -> Float[np.ndarray, " s"]:
    """The shares of a certificate, one a site."""
    share = dict(zip(bound.vertices, bound.shares, strict=True))
    return np.array([share.get(vertex, 0.0) for vertex in sites.vertices[:, 0].tolist()])


def bound_from(
    observation: Observation,
    sites: Sites,
    lam: Float[np.ndarray, " s"],
    *,
    budget: int,
    limits: tuple[Limit, ...] = (),
) -> float:
    """The bound (mm, rounded down) that shares `lam` >= 0 of the sites prove, whoever found them."""
    relaxed = relax_budget(observation, sites, budget, limits)
    return proved(relaxed, *relaxed.value(lam), lam)


def proved(relaxed: Relaxed, f: float, g: Float[np.ndarray, " s"], lam: Float[np.ndarray, " s"]) -> float:
    """The larger of what shares and rank prove, mm, rounded down."""
    eigenvalues = np.linalg.eigvalsh(relaxed.observation.gram)[::-1]
    unseen = PRIOR_SD**2 * float(np.clip(eigenvalues[3 * relaxed.budget :], 0, None).sum())
    error = np.sqrt(max(unseen, relaxed.bound(f, g, lam)))
    return float(np.floor(error * (1 - 1e-9) * 10**ERROR_DIGITS) / 10**ERROR_DIGITS)


def fewest_for(
    observation: Observation,
    sites: Sites,
    lam: Float[np.ndarray, " s"],
    *,
    target_mm: float,
    limits: tuple[Limit, ...] = (),
) -> int | None:
    """The number below which no layout has an upper estimate of `target_mm` or less, as the shares prove it; None where
    landmarks on all open sites together have more."""
    relaxed = relax_budget(observation, sites, int(sites.size.sum()), limits)
    everywhere = observation.covariance(sites.members(np.flatnonzero(relaxed.open_)))
    if observation.error(everywhere) > target_mm:
        return None
    f, g = relaxed.value(lam)
    numbers = range(1, relaxed.budget + 1)
    at = bisect_left(numbers, True, key=lambda M: proved(replace(relaxed, budget=M), f, g, lam) <= target_mm)
    return numbers[min(at, len(numbers) - 1)]


def relax_budget(observation: Observation, sites: Sites, budget: int, limits: tuple[Limit, ...]) -> Relaxed:
    """The relaxed problem: keep-outs shut sites out, pins that one site alone can fulfil hold it."""
    size, open_ = sites.size, np.ones(len(sites.size), dtype=bool)
    for limit in limits:
        open_ &= (limit.amount == 0) | (limit.most != 0)
    held = np.zeros(len(size), dtype=bool)
    for limit in limits:
        helps = open_ & (limit.amount > 0)
        if limit.least > 0 and helps.sum() == 1:
            held |= helps
    return Relaxed(observation, site_rows(sites, observation.measured), size, open_, held, budget)


def improved(relaxed: Relaxed, lam: Float[np.ndarray, " s"], g: Float[np.ndarray, " s"]) -> Float[np.ndarray, " s"]:
    """Better shares: updates among the sites that have some, and those whose g / n calls for one."""
    price = g / relaxed.size
    inside = (lam > 0) & (lam < 1)
    theta = np.average(price[inside], weights=lam[inside]) if inside.any() else price[lam > 0].min(initial=0)
    joins = relaxed.open_ & (lam < JOINS) & (price > theta)
    y = np.where(joins, JOINS, lam)
    at = np.flatnonzero(y > 0)
    few, part = relaxed.restricted_to(at), relaxed.restricted_to(at).scaled(y[at])
    power, before = 1.0, np.inf
    for _ in range(UPDATES):
        f, g = few.value(part)
        if f > before:
            power = max(0.5, power * 0.7)
        before = f
        part = few.scaled(part * (g / few.size) ** power)
    lam = np.zeros(len(lam))
    lam[at] = part
    return lam
