"""The fewest landmarks that tell as much as they should: the default method.

Goal      E(S) = sqrt(trace(G C(S))) <= target, as many mixes distinguished as can be (`information`), every constraint
          met, every blendshape of a cover on some site of S
Grow      from a cover: the site that lowers E most for each of its landmarks; where E is small enough and the rank is
          not full, the site that answers most to the mixes that nobody sees yet
Shrink    exchanges at this number (`search`), then again without the landmark that is missed least, while this holds
End       growth ends, short of the target, where another landmark lowers E by less than LEAST_GAIN of it, or at the
          ceiling: what cannot be had is not forced; and a landmark whose loss raises E by less than that is not kept
Others    the starts of a budget of as many landmarks: the least E that any of them ends at, or more mixes distinguished
          for HARDLY more; then the numbers below it again. A mix that costs the others more than HARDLY is not
          asked for
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Int

from capture_plan.layout.budget import keepable, pivoted
from capture_plan.layout.constraint_rows import Limit
from capture_plan.layout.exchange import Choice, Search
from capture_plan.layout.face import USUAL
from capture_plan.layout.gains import rank_gains
from capture_plan.layout.observation import RANK_TOLERANCE
from capture_plan.progress import track

LEAST_GAIN = 0.01  # of the error, for each landmark: what the fiftieth brings where errors fall as 1 / sqrt(number)
HARDLY = 0.005  # of the error: what one more mix that is distinguished may cost all others
CLEARLY = 3.0  # times what counts as answering at all: sites that are asked for, where a mix is not distinguished
ABOVE = 1.5  # times what is usual or needed in any case: nobody glues more on a face in silence


def ceiling(cover: int, full_rank: int) -> int:
    """Most landmarks that are proposed where nobody gave a number: half as many again as the usual 68, as a cover has,
    or as have coordinates enough to tell all mixes apart."""
    return int(np.ceil(ABOVE * max(USUAL, cover, full_rank / 3)))


def fewest(search: Search, start: Choice, target_mm: float) -> Choice:
    """Sites that reach the goal with as few landmarks as were found, from `start` on and from the starts of a budget,
    the most telling first.

    The budget of `search` is the ceiling; `start` reaches every blendshape of its covers within the limits.
    """
    goal, chosen, shrunk = Goal(search, target_mm), (), near(search, start, target_mm)
    while chosen != shrunk:
        chosen = goal.alternative_to(shrunk)
        shrunk = goal.shrunk(chosen)
    return search.in_order(shrunk)


def near(search: Search, start: Choice, target_mm: float) -> Choice:
    """Sites that reach the goal from `start` alone: of a former answer little changes."""
    goal = Goal(search, target_mm)
    settled = goal.settled(goal.grown(start))
    apart = goal.identifiable(settled)
    return search.in_order(goal.shrunk(goal.settled(apart) if apart != settled else settled))


@dataclass(frozen=True, eq=False)
class Goal:
    """What a choice has to reach, and the ways there from another."""

    search: Search
    target_mm: float

    def error(self, chosen: Choice) -> float:
        """The upper estimate E of a choice, millimetres."""
        return self.search.score(chosen)[2] ** 0.5

    def rank(self, chosen: Choice) -> int:
        """Mixes that a choice tells apart."""
        return self.search.observation.information(self.vertices(chosen)).rank

    def vertices(self, chosen: Choice) -> Int[np.ndarray, " m"]:
        """The landmarks of a choice."""
        return self.search.sites.members(np.array(chosen, dtype=int))

    def grown(self, chosen: Choice) -> Choice:
        """More sites one after another, until E is at most the target or a further landmark is not worth its while."""
        search, gains = self.search, self.search.gains(chosen)
        for _ in track(range(search.budget), "Adding landmarks that tell most", total=search.budget):
            squared, short = float(np.sum(search.observation.gram * gains.C)), search.shortfall(chosen)
            subset = search.next(chosen)
            if not len(subset) or (squared <= self.target_mm**2 and not short):
                break
            each = gains.all(subset) / search.size[subset]
            if each.max() < 2 * LEAST_GAIN * squared and not short:  # the square falls twice as fast
                break
            new = int(subset[each.argmax()])
            chosen, gains = (*chosen, new), gains.step(search.rows((new,)), -1)
        return chosen

    def identifiable(self, chosen: Choice) -> Choice:
        """More sites, while each of them tells mixes apart that none before it did."""
        search, rank = self.search, self.rank(chosen)
        while rank < search.observation.full_rank and len(subset := search.next(chosen)):
            answers = rank_gains(search.observation, search.all_rows[subset], self.vertices(chosen))
            more = (*chosen, int(subset[answers.argmax()]))
            if self.rank(more) <= rank:
                break
            chosen, rank = more, self.rank(more)
        return chosen

    def settled(self, chosen: Choice) -> Choice:
        """As many landmarks after exchanges, unless these tell fewer mixes apart."""
        better = self.of(self.search.landmarks(chosen)).swap_all(chosen)
        return better if self.rank(better) >= self.rank(chosen) else chosen

    def alternative_to(self, chosen: Choice) -> Choice:
        """Of as many landmarks the least error that the starts of a budget end at, or more mixes distinguished for
        hardly more."""
        search = self.of(self.search.landmarks(chosen))
        starts = track((chosen, (), pivoted(search)), "Looking for a lower error of as many landmarks", total=3)
        ends = [chosen, *(search.descend(search.fill(start)) for start in starts)]
        ends = [end for end in ends if search.misses(end) <= search.misses(chosen)]
        most = min(map(self.error, ends)) * (1 + HARDLY)
        ends = [self.asked_for(end, most) for end in ends if self.error(end) <= most]
        return max(ends, key=lambda end: (self.rank(end), -self.error(end)))

    def asked_for(self, chosen: Choice, most_mm: float) -> Choice:
        """As many sites, of which some answer to mixes which `chosen` does not tell apart, while E stays low."""
        search = self.of(self.search.landmarks(chosen))
        while self.rank(chosen) < search.observation.full_rank and (answering := self.answering(chosen)).any():
            search = replace(
                search, limits=(*search.limits, Limit("a mix distinguished", answering.astype(int), least=1))
            )
            more = search.descend(search.fill(keepable(search, chosen)))
            if search.misses(more) or self.rank(more) <= self.rank(chosen) or self.error(more) > most_mm:
                break
            chosen = more
        return chosen

    def answering(self, chosen: Choice) -> Bool[np.ndarray, " s"]:
        """Sites that answer clearly to mixes which `chosen` does not tell apart."""
        search, vertices = self.search, self.vertices(chosen)
        strongest = np.linalg.norm(search.observation.response(vertices), ord=2)
        answers = np.sqrt(rank_gains(search.observation, search.all_rows, vertices))
        return (answers > CLEARLY * RANK_TOLERANCE * strongest) & search.open_to(())

    def shrunk(self, chosen: Choice) -> Choice:
        """Without landmarks that the goal does not need, exchanging what is left each time."""
        while (fewer := self.next_fewer(chosen)) is not None:
            chosen = fewer
        return chosen

    def next_fewer(self, chosen: Choice) -> Choice | None:
        """One landmark fewer, or two where sites are pairs; None where neither is enough."""
        order, most = self.search.in_order(chosen), self.search.landmarks(chosen)
        for count in (most - 1, most - 2):
            search, retained = self.of(count), order
            while search.landmarks(retained) > max(count, 0):
                retained = retained[:-1]
            fewer = search.swap_all(search.fill(retained)) if retained else ()
            if fewer and self.enough(fewer, than=chosen):
                return fewer
            if search.landmarks(fewer) == count:  # with one fewer still, the error is larger
                break
        without = (tuple(other for other in chosen if other != site) for site in reversed(order))
        return next((fewer for fewer in without if fewer and self.enough(fewer, than=chosen)), None)

    def enough(self, fewer: Choice, *, than: Choice) -> bool:
        """Whether a choice of fewer landmarks serves as well as another."""
        search = self.search
        spared = search.landmarks(than) - search.landmarks(fewer)
        before = self.error(than)
        most = self.target_mm if before <= self.target_mm else before * (1 + LEAST_GAIN) ** spared
        return (
            spared > 0
            and search.misses(fewer) <= search.misses(than)
            and self.rank(fewer) >= self.rank(than)
            and self.error(fewer) <= most
        )

    def of(self, budget: int) -> Search:
        """The problem at another number of landmarks."""
        return replace(self.search, budget=budget)
