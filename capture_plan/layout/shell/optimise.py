"""Marker optimisation: the few vertices whose motion bends a thin shell into all the others (Le et al. 2013).

Data       shell, motion of one or several subjects (`Subject`); M markers; kept vertices; near[u, v] vertices too
           close along the skin for two markers; candidates
Variables  H, M vertices
Model      min E(H) = sum_v s_v |Y_v - W_v Y_H|^2,   kept in H in candidates,  no two of H near
Method     add the vertex that leaves the least error until there are M, then move one marker at a time to its best
           place until no move of one marker gains. Pieces of the mesh that nothing holds get one first. Every score
           is exact and no step goes uphill
Mirror     sites are pairs (v, mirror of v) and single vertices of the middle; a pair is placed and moved as one
Joint      at last two neighbouring markers at once, each among the vertices around it

    result = optimise(shell, motion, 80, candidates=moving)           -> Result
    results = nested(shell, motion, (40, 60, 80, 100), candidates=moving)
    result = optimise_together(((shell_a, motion_a), (shell_b, motion_b)), 80, candidates=moving)
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Int
from scipy.sparse import csr_array

from capture_plan.errors import InfeasibleError
from capture_plan.layout.shell.importance import spare_order
from capture_plan.layout.shell.joint import near_pairs, neighbourhoods
from capture_plan.layout.shell.model import Shell
from capture_plan.layout.shell.motion import TAIL_MM, Motion
from capture_plan.layout.shell.subjects import Subject, Subjects
from capture_plan.progress import track

GAIN = 1e-10  # share of the error: a smaller gain is rounding
NOTHING = 1e-18  # share of the squared motion: 1e-9 of its size is as good as no error
SWEEPS = 100  # a sweep without a gain ends the search; five to ten are usual


@dataclass(frozen=True)
class Result:
    """A layout: `markers` as placed, kept ones first; in `order` the least needed ones are last.

    `rmse_mm` is over all vertices and frames of the motion as given. `curve_mm[m - 1]` is what the first m of `order`
    leave, on the compressed motion; `greedy_mm` what the layout left before any marker was moved, likewise; `swaps`
    is the number of moves.
    """

    markers: tuple[int, ...]
    rmse_mm: float
    order: tuple[int, ...]
    curve_mm: tuple[float, ...]
    greedy_mm: float
    swaps: int


@dataclass(frozen=True, eq=False)
class Sites:
    """Where a marker may stand beside others; `near` holds vertices too close to each other, `mirror` pairs them."""

    candidates: Bool[np.ndarray, " v"]
    near: csr_array | None
    mirror: Int[np.ndarray, " v"] | None

    def beside(self, markers: Sequence[int]) -> Bool[np.ndarray, " v"]:
        """Candidates that are not too close to any of these markers."""
        if self.near is None or not len(markers):
            return self.candidates
        return self.candidates & ~(self.near[list(markers)].sum(axis=0) > 0)

    @property
    def apart(self) -> Bool[np.ndarray, " v"]:
        """Vertices that are not too close to their mirror image."""
        if self.near is None or self.mirror is None:
            return np.ones(len(self.candidates), dtype=bool)
        v = np.arange(len(self.mirror))
        return np.asarray(self.near[v, self.mirror]).ravel() == 0


class Search:
    """A layout while it grows and settles; the first `pinned` markers stay where they are."""

    def __init__(self, subjects: Sequence[Subject], sites: Sites, kept: Sequence[int], tail_mm: float) -> None:
        self.given, self.sites = subjects, sites
        small = [(shell, motion.compressed(tail_mm)) for shell, motion in subjects]
        self.state = Subjects(small, sites.mirror)
        self.pinned, self.swaps = len(kept), 0
        self.power = sum(float(np.square(motion.rows).sum(axis=1) @ motion.weights) for _, motion in small)
        self.state.refresh(kept)
        self.greedy_mm = self.state.rmse_mm

    def grow(self, count: int) -> None:
        """Greedily until there are `count` markers.

        Raises:
            InfeasibleError: no vertex is left that may carry one more.
        """
        for _ in track(range(count - len(self.state.markers)), "placing markers"):
            if len(self.state.markers) < count:
                site = self._best_site(self.state, count - len(self.state.markers))[1]
                if not site:
                    raise InfeasibleError(
                        f"room for {len(self.state.markers)} of {count} markers: ask for fewer, or for less spacing"
                    )
                for v in site:
                    self.state.add(v)
        self.greedy_mm = self.state.rmse_mm

    def _best_site(self, state: Subjects, left: int) -> tuple[float, tuple[int, ...]]:
        """The error with the best site added, and its one or two vertices, of `left` that may be placed."""
        free, mirror = self.sites.beside(state.markers), self.sites.mirror
        single, floating = state.add_scores(), state.floating
        if floating.any():
            return _least(single, free & floating)
        if mirror is None:
            return _least(single, free)
        own = np.arange(len(mirror))
        one = _least(single, free & (mirror == own))
        if left == 1:
            return one
        two = _least_pair(state.add_pair_scores(), free & free[mirror] & self.sites.apart, mirror)
        E = state.error
        return two if two[1] and (E - two[0]) / 2 >= E - one[0] else one

    @property
    def _to_beat(self) -> float:
        """The error below which a move has gained; none has where there is no error."""
        E = self.state.error
        return E * (1 - GAIN) if NOTHING * self.power < E else -np.inf

    def settle(self) -> None:
        """Sweeps over the markers, each moved to its best place, until one sweep gains nothing."""
        move = self._move if self.sites.mirror is None else self._move_site
        for _ in range(SWEEPS):
            gained = sum([move(h) for h in track(tuple(self.state.markers[self.pinned :]), "moving markers")])
            self.state.refresh(self.state.markers)
            self.swaps += gained
            if not gained:
                return

    def _move(self, h: int) -> bool:
        j, markers = self.state.markers.index(h), self.state.markers
        others = markers[:j] + markers[j + 1 :]
        at = np.flatnonzero(self.sites.beside(others))
        scores = self.state.swap_scores(j, at)
        best = int(scores.argmin()) if len(at) else -1
        if best < 0 or not scores[best] < self._to_beat:
            return False
        self.state.swap(j, int(at[best]))
        return True

    def _move_site(self, h: int) -> bool:
        """A pair to its best place, or a marker of the middle to another one there."""
        mirror, markers = self.sites.mirror, self.state.markers
        if mirror is None or h not in markers:
            return False
        site = {h, int(mirror[h])}
        movable = markers[self.pinned :]
        if not site <= set(movable):
            return False
        twin = self.state.copy()
        for v in site:
            twin.drop(twin.markers.index(v))
        free = self.sites.beside(twin.markers)
        if len(site) == 1:
            score, to = _least(twin.add_scores(), free & (mirror == np.arange(len(mirror))))
        else:
            score, to = _least_pair(twin.add_pair_scores(), free & free[mirror] & self.sites.apart, mirror)
        if not score < self._to_beat:
            return False
        for v in to:
            twin.add(v)
        return self._take(twin)

    def settle_two(self) -> None:
        """Neighbouring markers in pairs, until none gains; then single moves again, until neither gains."""
        for _ in range(SWEEPS):
            if self._to_beat == -np.inf:
                return
            movable = self.state.markers[self.pinned :]
            places = self.given[0][0].vertices[movable]
            pairs = [(movable[i], movable[j]) for i, j in near_pairs(places)]
            gained = sum([self._move_two(i, j) for i, j in track(pairs, "moving markers two at a time")])
            self.state.refresh(self.state.markers)
            self.swaps += gained
            if not gained:
                return
            self.settle()

    def _move_two(self, i: int, j: int) -> bool:
        if not {i, j} <= set(self.state.markers[self.pinned :]):
            return False
        twin = self.state.copy()
        for h in (i, j):
            twin.drop(twin.markers.index(h))
        free = self.sites.beside(twin.markers)
        a, b = neighbourhoods(self.given[0][0].vertices, free & ~self.state.fixed, np.array([i, j]))
        scores = twin.two_scores(a, b)
        if self.sites.near is not None:
            scores[self.sites.near[a][:, b].toarray() > 0] = np.inf
        u, v = np.unravel_index(scores.argmin(), scores.shape)
        if not scores[u, v] < self._to_beat:
            return False
        twin.add(int(a[u]))
        twin.add(int(b[v]))
        return self._take(twin)

    def _take(self, twin: Subjects) -> bool:
        """Two vertices that move almost as one have a score full of rounding: the error itself decides."""
        gained = twin.error < self._to_beat
        self.state = twin if gained else self.state
        return gained

    def result(self) -> Result:
        """The layout as it stands, its error on all that was given."""
        markers, states = tuple(self.state.markers), self.state.states
        H = np.array(markers, dtype=int)
        E = sum(motion.squared_error(shell.weights(H), H) for shell, motion in self.given)
        total = sum(motion.weights.sum() for _, motion in self.given)
        order, errors = spare_order(states, np.arange(len(H)) < self.pinned)
        curve = np.sqrt(np.maximum(errors, 0) / total)
        return Result(
            markers,
            float(np.sqrt(E / total)),
            tuple(H[order].tolist()),
            tuple(curve.tolist()),
            self.greedy_mm,
            self.swaps,
        )


def _least(scores: np.ndarray, may: Bool[np.ndarray, " v"]) -> tuple[float, tuple[int, ...]]:
    """The least finite score among some vertices and its vertex, or infinity and none."""
    among = np.where(may, scores, np.inf)
    v = int(among.argmin())
    return (float(among[v]), (v,)) if np.isfinite(among[v]) else (np.inf, ())


def _least_pair(
    scores: np.ndarray, may: Bool[np.ndarray, " v"], mirror: Int[np.ndarray, " v"]
) -> tuple[float, tuple[int, ...]]:
    score, site = _least(scores, may)
    return score, (*site, *(int(mirror[v]) for v in site))


def optimise_together(
    subjects: Sequence[Subject],
    count: int,
    *,
    candidates: Bool[np.ndarray, " v"],
    kept: Sequence[int] = (),
    spacing: csr_array | None = None,
    mirror: Int[np.ndarray, " v"] | None = None,
    joint: bool = False,
    tail_mm: float = TAIL_MM,
) -> Result:
    """`optimise` for the motions of several subjects on one topology, each with its own shell."""
    search = Search(subjects, sites_of(candidates, spacing, mirror), kept, tail_mm)
    search.grow(count)
    search.settle()
    if joint:
        search.settle_two()
    return search.result()


def optimise(
    shell: Shell,
    motion: Motion,
    count: int,
    *,
    candidates: Bool[np.ndarray, " v"],
    kept: Sequence[int] = (),
    spacing: csr_array | None = None,
    mirror: Int[np.ndarray, " v"] | None = None,
    joint: bool = False,
    tail_mm: float = TAIL_MM,
) -> Result:
    """`count` markers, the kept ones among them, none of which alone could be moved for the better.

    `spacing` is `near_table` of the skin at the least distance between two markers, `mirror` the mirror image of each
    vertex where the layout is to be symmetric, and `with_mirror_image` the motion for that. `joint` moves neighbouring
    markers in twos at last.

    Raises:
        InfeasibleError: there is no room for so many.
    """
    return optimise_together(
        [(shell, motion)],
        count,
        candidates=candidates,
        kept=kept,
        spacing=spacing,
        mirror=mirror,
        joint=joint,
        tail_mm=tail_mm,
    )


def nested(
    shell: Shell,
    motion: Motion,
    counts: Sequence[int],
    *,
    candidates: Bool[np.ndarray, " v"],
    kept: Sequence[int] = (),
    spacing: csr_array | None = None,
    mirror: Int[np.ndarray, " v"] | None = None,
    tail_mm: float = TAIL_MM,
) -> tuple[Result, ...]:
    """One layout for each count, each a part of the next (Le et al. 2013, section 4.6): only new markers are moved."""
    search = Search([(shell, motion)], sites_of(candidates, spacing, mirror), kept, tail_mm)
    results = []
    for count in sorted(counts):
        search.grow(count)
        search.settle()
        results.append(search.result())
        search.pinned = count
    return tuple(results)


def sites_of(
    candidates: Bool[np.ndarray, " v"], spacing: csr_array | None, mirror: Int[np.ndarray, " v"] | None
) -> Sites:
    """What is stored of the table of distances is near, whatever its length."""
    near = (
        None if spacing is None else csr_array((np.ones(spacing.nnz), spacing.indices, spacing.indptr), spacing.shape)
    )
    return Sites(candidates, near, mirror)
