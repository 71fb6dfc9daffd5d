"""A layout that grows and settles, on rows of the motion that are as fine as its error asks for.

Data       subjects as given; sites; pinned markers, which stay
Grow       the site that leaves the least error, again and again; pieces that nothing holds get one first
Settle     each marker, or mirrored pair, to its best place, until no move of one gains; no step goes uphill
Two        neighbouring markers at once, each among the vertices around it
Refine     the search sees the strongest rows alone: E = E_seen + E_left_out >= E_seen. Where that makes more than
           `LOST` of the RMSE, finer rows take over, so that in the end RMSE <= (1 + LOST) RMSE_seen: no move of one
           marker, on any rows, could gain more than that. A layout that all rows find worse than the greedy one was
           is searched again on all of them
"""

from collections.abc import Sequence

import numpy as np

from capture_plan.errors import InfeasibleError
from capture_plan.progress import track
from capture_plan.shell.pair_exchange import near_pairs, neighbourhoods
from capture_plan.shell.sites import Best, MarkerSites, least
from capture_plan.shell.subjects import Subject, Subjects

GAIN = 1e-10  # share of the error: a smaller gain is rounding
NOTHING = 1e-18  # share of the squared motion: 1e-9 of its size is as good as no error
SWEEPS = 100  # a sweep without a gain ends the search; five to ten are usual
LOST = 0.01  # share of the error that the rows left out may make up
FINER = 0.1  # share of the error that the next rows leave out: sqrt(1 + 0.1^2) is 0.5 % more than 1


class MarkerSearch:
    """A layout while it grows and settles; the first `pinned` markers stay where they are."""

    def __init__(
        self, subjects: Sequence[Subject], sites: MarkerSites, retained: Sequence[int], tail_mm: float
    ) -> None:
        self.given, self.sites = subjects, sites
        self.pinned, self.swaps = len(retained), 0
        self.greedy_mm = np.inf
        self._see(tail_mm, retained)

    def _see(self, tail_mm: float, markers: Sequence[int]) -> None:
        """The motion but for `tail_mm` of it."""
        seen = [(shell, motion.compressed(tail_mm)) for shell, motion in self.given]
        self.tail_mm, self.rows = tail_mm, sum(motion.rows.shape[1] for _, motion in seen)
        self.power = sum(float(np.square(motion.rows).sum(axis=1) @ motion.weights) for _, motion in seen)
        self.state = Subjects(seen, self.sites.mirror)
        self.state.refresh(markers)

    @property
    def rmse_mm(self) -> float:
        """Of the layout as it stands, on the motion as it was given."""
        H = np.array(self.state.markers, dtype=int)
        E = sum(motion.squared_error(shell.weights(H), H) for shell, motion in self.given)
        return float(np.sqrt(E / sum(motion.weights.sum() for _, motion in self.given)))

    def refine(self) -> bool:
        """Finer rows, where those left out make up too much of the error and there are finer ones."""
        seen_mm, rows = self.state.rmse_mm, self.rows
        if self.rmse_mm <= (1 + LOST) * seen_mm:
            return False
        self._see(min(FINER * seen_mm, self.tail_mm / 2), self.state.markers)
        return self.rows > rows

    def grow(self, count: int) -> None:
        """Greedily until there are `count` markers.

        Raises:
            InfeasibleError: no vertex is left that may carry one more.
        """
        for _ in track(range(count - len(self.state.markers)), "Placing markers"):
            if len(self.state.markers) < count:
                site = self._best_site(count - len(self.state.markers))[1]
                if not site:
                    raise InfeasibleError(
                        f"room for {len(self.state.markers)} of {count} markers: ask for fewer, or for less spacing"
                    )
                for v in site:
                    self.state.add(v)
        self.greedy_mm = self.rmse_mm

    def _best_site(self, left: int) -> Best:
        """The error with the best site added, and its one or two vertices, of `left` that may be placed."""
        state, sites = self.state, self.sites
        free, floating, single = sites.clear_of(state.markers), state.floating, state.add_scores()
        if floating.any():
            return least(single, free & floating)
        if sites.mirror is None:
            return least(single, free)
        one = sites.best_middle(single, free)
        if left == 1:
            return one
        two, E = sites.best_pair(state.add_pair_scores(), free), state.error
        return two if two[1] and (E - two[0]) / 2 >= E - one[0] else one

    @property
    def _to_beat(self) -> float:
        """The error below which a move has gained; none has where there is no error."""
        E = self.state.error
        return E * (1 - GAIN) if NOTHING * self.power < E else -np.inf

    def finish(self, *, joint: bool) -> None:
        """Until no move gains, on rows that tell enough of the error."""
        grown = tuple(self.state.markers)
        self.refine()
        while True:
            self.settle()
            if joint:
                self.settle_two()
            if not self.refine():
                break
        if self.rmse_mm > self.greedy_mm:  # what gained on the rows seen lost more on the others
            self._see(0.0, grown)
            self.settle()

    def settle(self) -> None:
        """Sweeps over the markers, each moved to its best place, until one sweep gains nothing."""
        move = self._move if self.sites.mirror is None else self._move_site
        for _ in range(SWEEPS):
            gained = sum([move(h) for h in track(tuple(self.state.markers[self.pinned :]), "Moving markers")])
            if not gained:
                return
            self.swaps += gained
            self.state.refresh(self.state.markers)

    def _move(self, h: int) -> bool:
        j, markers = self.state.markers.index(h), self.state.markers
        at = np.flatnonzero(self.sites.clear_of(markers[:j] + markers[j + 1 :]))
        scores = self.state.swap_scores(j, at)
        best = int(scores.argmin()) if len(at) else -1
        if best < 0 or not scores[best] < self._to_beat:
            return False
        self.state.swap(j, int(at[best]))
        return True

    def _move_site(self, h: int) -> bool:
        """A pair to its best place, or a marker of the middle to another one there."""
        mirror = self.sites.mirror
        assert mirror is not None, "single markers are moved where nothing is mirrored"
        site = {h, int(mirror[h])}
        if not site <= set(self.state.markers):
            return False
        twin = self._without(site)
        free = self.sites.clear_of(twin.markers)
        if len(site) == 1:
            score, to = self.sites.best_middle(twin.add_scores(), free)
        else:
            score, to = self.sites.best_pair(twin.add_pair_scores(), free)
        return self._take(twin, score, to)

    def settle_two(self) -> None:
        """Neighbouring markers in pairs, until none gains; then single moves again, until neither gains."""
        for _ in range(SWEEPS):
            if self._to_beat == -np.inf:
                return
            movable = self.state.markers[self.pinned :]
            pairs = [(movable[i], movable[j]) for i, j in near_pairs(self._vertices[movable])]
            gained = sum([self._move_two(i, j) for i, j in track(pairs, "Moving markers two at a time")])
            if not gained:
                return
            self.swaps += gained
            self.state.refresh(self.state.markers)
            self.settle()

    def _move_two(self, i: int, j: int) -> bool:
        if not {i, j} <= set(self.state.markers):
            return False
        twin = self._without({i, j})
        free = self.sites.clear_of(twin.markers) & ~self.state.fixed
        a, b = neighbourhoods(self._vertices, free, np.array([i, j]))
        scores = np.where(self.sites.too_close(a, b), np.inf, twin.two_scores(a, b))
        u, v = np.unravel_index(scores.argmin(), scores.shape)
        return self._take(twin, float(scores[u, v]), (int(a[u]), int(b[v])))

    @property
    def _vertices(self) -> np.ndarray:
        return self.given[0][0].vertices

    def _without(self, markers: set[int]) -> Subjects:
        twin = self.state.copy()
        for h in markers:
            twin.drop(twin.markers.index(h))
        return twin

    def _take(self, twin: Subjects, score: float, to: tuple[int, ...]) -> bool:
        """The twin with markers `to` where it gains.

        Two vertices that move almost as one have a score full of rounding: the error itself decides.
        """
        if not score < self._to_beat:
            return False
        for v in to:
            twin.add(v)
        gained = twin.error < self._to_beat
        self.state = twin if gained else self.state
        return gained
