"""The list whose first expressions leave the least error, of the shortest lists: local search from several lists.

Data       gain[S]      what a scan of the items S takes from the expected squared error (`transfer/expected.py`)
           taken[S, p]  what it takes from the squared error of person p, as a share; E[J, p] the share that is left
                        after J scans. The persons are made up, and their mean is what is expected
           E*[J, p]     the least that any of the lists to beat leaves
Variables  parts        a colouring of the items with the fewest colours, given; order: by gain, locked places aside
Model      min mean_p ( mean_J log sqrt(E[J, p]) + END log sqrt(E[end, p])
                        + BEHIND max_J max(0, log sqrt(E[J, p] / E*[J, p])) )
               + PRICE (what is hard to perform at once, points)
Why p      Two lists that promise as much for the mean person may differ by a tenth for each single one, where one has
           scanned what the other scans next. A list that shows what the others show is behind for nobody.
Moves      Kempe chain  of two expressions: items that conflict with each other, and with each other's, change places
           exchange     of one item for one, where nothing is left that conflicts
           Neither adds an expression, so that a number that was proved the fewest stays so.
Search     The first move that lowers the model is made, until none does; from the list given, from others, and from
           the best one so far shaken by random chains, while not too many were judged. Of all these lists the lowest
           is taken: it is no proved optimum.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property
from itertools import combinations

import numpy as np
from jaxtyping import Float

from capture_plan.expressions.conflicts import conflict_graph
from capture_plan.expressions.instance import FREE, Instance
from capture_plan.expressions.listing import TargetDeltas, blendshape_importance, target_list
from capture_plan.expressions.problem import Problem
from capture_plan.expressions.settings import PackingSettings
from capture_plan.progress import go_on, track
from capture_plan.rig import Rig
from capture_plan.transfer.expected import expectation, mean_expectation
from capture_plan.transfer.targets import habit_squares

END = 0.1  # of the error after the whole list: 1 costs the first fifteen scans 15 %
BEHIND = 1.0  # of the scan after which another list is furthest ahead: without, the end was bought with J = 15
PRICE = 0.01  # a point of difficulty is worth one per cent of error
SHAKES, CHAINS = 4, 12  # random lists that are tried, and the chains that make each
PEOPLE, SEED = 16, 0  # persons: other seeds, 12 or 24 persons give lists that differ by 2 % at most
MOST_JUDGED = 200_000  # lists; real rigs need about 10,000
GAIN = 1e-9  # a move that lowers the model by less is rounding
SURELY = 1e-6  # another machine may round a move by more than GAIN
LEAST = 1e-12  # of E_0: no list leaves nothing

Items = frozenset[int]
Gain = Callable[[Items], float]
Taken = Callable[[Items], Float[np.ndarray, " p"]]


@dataclass(frozen=True, eq=False)
class Model:
    """Lists of `instance` judged by what they leave of `start`, the squared error before any scan, and of each
    person's; `to_beat` is what other lists leave of it."""

    instance: Instance
    gain: Gain
    start: float
    taken: Taken
    to_beat: tuple[Float[np.ndarray, "_ p"], ...] = ()

    @cached_property
    def rivals(self) -> tuple[Items, ...]:
        """The items that each item excludes."""
        return tuple(frozenset(np.flatnonzero(row).tolist()) for row in conflict_graph(self.instance.sets))

    def ordered(self, parts: Sequence[Items]) -> list[Items]:
        """The expressions by gain, the largest first, those with a locked item at its place."""
        return in_places(self.instance, sorted(parts, key=self.rank))

    @cached_property
    def rank(self) -> Callable[[Items], tuple[float, int]]:
        """What expressions are ordered by."""
        return cache(lambda items: (-self.gain(items), min(items, default=-1)))

    def value(self, parts: Sequence[Items]) -> float:
        """The model of the best order of these expressions."""
        return float(self.values([parts])[0])

    def values(self, lists: Sequence[Sequence[Items]]) -> Float[np.ndarray, " n"]:
        """The value of each of several lists of one length."""
        logs = self.left([self.ordered(parts) for parts in lists])
        hard = [sum(map(self.hard, parts)) for parts in lists] if self.instance.costs else [0]
        behind = np.maximum(logs - self.least(logs.shape[1]), 0).max(axis=1)
        return (logs.mean(axis=1) + END * logs[:, -1] + BEHIND * behind).mean(axis=1) + PRICE * np.array(hard)

    def left(self, lists: Sequence[Sequence[Items]]) -> Float[np.ndarray, "n j p"]:
        """log sqrt(E[J, p]) after each expression of lists of one length, in their order."""
        taken = np.cumsum([[self.taken(items) for items in parts] for parts in lists], axis=1)
        return np.log(np.maximum(1 - taken, LEAST)) / 2

    @cached_property
    def hard(self) -> Callable[[Items], int]:
        """Points of difficulty of an expression."""
        return cache(self.instance.cost)

    @cached_property
    def least(self) -> Callable[[int], Float[np.ndarray, "j _"]]:
        """log sqrt(E*[J, p]) of a list of so many expressions."""
        return cache(self._least)

    def _least(self, length: int) -> Float[np.ndarray, "j _"]:
        """Without lists to beat it is the starting error, which no list of use exceeds."""
        curves = [np.pad(curve, ((0, max(length - len(curve), 0)), (0, 0)), "edge")[:length] for curve in self.to_beat]
        return np.min(curves, axis=0) if curves else np.zeros((length, 1))

    def fits(self, items: Items) -> bool:
        """Whether an expression may hold these items."""
        chosen = list(items)
        return bool(self.instance.things[chosen].sum() <= self.instance.most)


def model_of(rig: Rig, problem: Problem, settings: PackingSettings, target: TargetDeltas) -> Model:
    """The model of a problem on a rig; the paper's importance takes the place of the expected error where it is asked
    for, and several targets count alike."""
    rows = rig.rows(problem.names)
    known = [expectation(rig, one) for one in target_list(rig, target) or (None,)]
    expected = mean_expectation(known).restricted_to(rows)
    if settings.importance == "paper":
        expected = expected.weighed(blendshape_importance(rig, problem.names, settings, target))
    persons = cache(lambda: habit_squares(rig, people=PEOPLE, seed=SEED)[:, rows])
    return Model(
        problem.instance,
        cache(lambda items: expected.gain(problem.blendshapes(items))),
        expected.start,
        cache(lambda items: expected.taken(persons(), problem.blendshapes(items))),
    )


def in_best_order(model: Model, parts: Sequence[Items]) -> bool:
    """Whether no other order of these expressions takes more after any number of scans, but for what is locked."""
    gains, best = ([model.gain(items) for items in order] for order in (parts, model.ordered(parts)))
    return bool(np.allclose(gains, best, rtol=0, atol=GAIN * model.start))


def proves_order(
    rig: Rig, problem: Problem, settings: PackingSettings, target: TargetDeltas, chosen: Sequence[tuple[int, ...]]
) -> bool:
    """Whether expressions, given by their blendshapes, stand as `early` promises; no other method promises this."""
    if settings.method != "early":
        return False
    return in_best_order(model_of(rig, problem, settings, target), problem.items_of(chosen))


def in_promised_order(
    rig: Rig, problem: Problem, settings: PackingSettings, target: TargetDeltas, chosen: Sequence[tuple[int, ...]]
) -> list[tuple[int, ...]]:
    """Expressions, given by their blendshapes, in the order that `early` promises; as they are for other methods."""
    if settings.method != "early":
        return list(chosen)
    items = problem.items_of(chosen)
    ordered = model_of(rig, problem, settings, target).ordered(items)
    return [chosen[items.index(each)] for each in ordered]


def early(model: Model, lists: Sequence[Sequence[Items]]) -> list[Items]:
    """The lowest list that is found from `lists`, in order; all of these have as few expressions as there can be.

    The search from the lowest of them comes to its end; others begin while no more than MOST_JUDGED lists were judged.
    """
    starts, rng = sorted(lists, key=model.value), np.random.default_rng(0)
    best, judged = list(starts[0]), 0
    for n in track(range(len(starts) + SHAKES), "Improving the list"):
        if judged > MOST_JUDGED:
            break
        tried, more = descend(model, list(starts[n]) if n < len(starts) else shaken(model, best, rng))
        judged += more
        if model.value(tried) < model.value(best) - GAIN:
            best = tried
    return model.ordered(best)


def descend(model: Model, parts: list[Items]) -> tuple[list[Items], int]:
    """The list after every move that lowers the model, the first that does made each time; how many were judged."""
    value, judged = model.value(parts), 0
    pairs = [(a, b) for a in range(len(parts)) for b in range(a)]
    unchanged = 0
    while unchanged < len(pairs):
        a, b = pairs[0]
        pairs.append(pairs.pop(0))
        unchanged += 1
        go_on()
        tried = list(_neighbours(model, parts, a, b))
        values = model.values(tried) if tried else np.zeros(0)
        judged += len(tried)
        lower = np.flatnonzero(values < value - GAIN)
        if len(lower):
            parts, value, unchanged = tried[lower[0]], values[lower[0]], 0
    return parts, judged


def _neighbours(model: Model, parts: list[Items], a: int, b: int) -> Iterator[list[Items]]:
    """The lists that a move of two expressions leads to."""
    for first, second in moves(model, parts[a], parts[b]):
        tried = parts.copy()
        tried[a], tried[b] = first, second
        yield tried


def can_be_lowered(model: Model, parts: Sequence[Items]) -> bool:
    """Whether a move lowers the model whatever the lists to beat are, so that no search ended here.

    Behind any of them, a list falls back by no more than it falls behind what it was itself before the move.
    """
    own, every = replace(model, to_beat=(*model.left([model.ordered(parts)]),)), list(parts)
    most = own.value(every) - SURELY
    by_pair = (list(_neighbours(own, every, a, b)) for a, b in combinations(range(len(every)), 2))
    return any((own.values(tried) < most).any() for tried in by_pair if tried)


def moves(model: Model, a: Items, b: Items) -> Iterator[tuple[Items, Items]]:
    """What two expressions may become, neither of them empty."""
    for chain in chains(model.rivals, a, b):
        yield from _changed(model, a, b, chain)
    for i in sorted(a):
        for j in sorted(b):
            if model.rivals[i].isdisjoint(b - {j}) and model.rivals[j].isdisjoint(a - {i}):
                yield from _changed(model, a, b, frozenset((i, j)))


def chains(rivals: Sequence[Items], a: Items, b: Items) -> list[Items]:
    """Connected components of the conflicts between two expressions."""
    left, found = a | b, []
    while left:
        chain, reached = set[int](), {min(left)}
        while reached:
            chain |= reached
            reached = {j for i in reached for j in rivals[i]} & left - chain
        found.append(frozenset(chain))
        left -= chain
    return found


def shaken(model: Model, parts: Sequence[Items], rng: np.random.Generator) -> list[Items]:
    """The list after CHAINS random chains."""
    new = list(parts)
    for _ in range(CHAINS if len(new) > 1 else 0):
        a, b = rng.choice(len(new), 2, replace=False).tolist()
        every = [
            pair for chain in chains(model.rivals, new[a], new[b]) for pair in _changed(model, new[a], new[b], chain)
        ]
        if every:
            new[a], new[b] = every[int(rng.integers(len(every)))]
    return new


def in_places(instance: Instance, parts: Sequence[Items]) -> list[Items]:
    """The expressions in this order, but those with a locked item at its place, where the list has it."""
    if (instance.place == FREE).all():
        return list(parts)
    places = [int(instance.place[list(items)].max(initial=FREE)) for items in parts]
    at = {place: n for n, place in enumerate(places) if FREE < place < len(parts)}
    rest = iter([n for n in range(len(parts)) if n not in at.values()])
    return [parts[at[e] if e in at else next(rest)] for e in range(len(parts))]


def _changed(model: Model, a: Items, b: Items, chain: Items) -> Iterator[tuple[Items, Items]]:
    first, second = (a - chain) | (b & chain), (b - chain) | (a & chain)
    if first and second and {first, second} != {a, b} and model.fits(first) and model.fits(second):
        yield first, second
