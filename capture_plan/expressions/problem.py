"""From a rig, settings and rules to items that share expressions, and why some cannot.

Item      blendshapes that are performed together: a left/right pair, an upper/lower pair, a group that an artist asks
          for, and whatever these link. Its active set is the union of theirs
Overlap   inside pairs it is allowed, since partners are distinguished by their side, with a warning where it is large
Apart     two blendshapes are kept apart that share an active vertex, or by a rule, or because their surfaces would run
          through each other, or by an artist, or because they are locked to different expressions
Relaxed   a pair that cannot be performed together for one of these reasons is split, and no other pair with it
"""

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path

import numpy as np
from jaxtyping import Bool
from msgspec.structs import replace as change

from capture_plan.errors import InfeasibleError
from capture_plan.expressions.active_sets import active_sets, performed_sets
from capture_plan.expressions.compatibility import (
    driven,
    eyes_that_part,
    groups,
    hard_together,
    never_together,
    performed_together,
)
from capture_plan.expressions.conflicts import maximal_sets
from capture_plan.expressions.instance import FREE, Instance, locked_apart, pair_sets
from capture_plan.expressions.local_pairs import local_pairs
from capture_plan.expressions.record import Overlap
from capture_plan.expressions.rules import Rules, check_rule_names, default_rules, read_rules
from capture_plan.expressions.settings import Edits, PackingSettings
from capture_plan.input.documents import closest
from capture_plan.rig import Rig

MUCH = 0.2  # of the smaller active set: beyond it one scan of two partners does not tell them apart
Pairs = tuple[tuple[str, str], ...]


@dataclass(frozen=True, eq=False)
class Problem:
    """Everything that decides which lists are possible; `names` are the used blendshapes that are not dropped.

    `active[k]` belongs to `names[k]`, and so does every number in `items`.
    """

    names: tuple[str, ...]
    active: Bool[np.ndarray, "k v"]
    items: tuple[tuple[int, ...], ...]
    instance: Instance
    pairs: Pairs
    local: Pairs
    relaxed: Pairs
    exclusive: Pairs
    colliding: Pairs
    drivers: Pairs
    most_things: int | None
    edits: Edits

    def blendshapes(self, items: Iterable[int]) -> tuple[int, ...]:
        """The numbers of all blendshapes of some items."""
        return tuple(sorted(k for i in items for k in self.items[i]))

    def items_of(self, expressions: Iterable[tuple[int, ...]]) -> list[frozenset[int]]:
        """The items of every expression given by its blendshapes; of an item that is split, where its first is."""
        return [frozenset(i for i, item in enumerate(self.items) if item[0] in ks) for ks in expressions]

    def hard_in(self, expressions: list[tuple[int, ...]]) -> tuple[tuple[str, str, int], ...]:
        """(a, b, cost) of movements performed at once though it is hard, each movement under its first name."""
        place = {i: e for e, ks in enumerate(expressions) for i, item in enumerate(self.items) if item[0] in ks}
        costs = [(i, j, c) for i, j, c in self.instance.costs if place[i] == place[j]]
        return tuple((self.labels(i)[0], self.labels(j)[0], c) for i, j, c in costs)

    @property
    def overlapping(self) -> Bool[np.ndarray, "g n"]:
        """Sets of items that meet at a vertex, all rules aside."""
        return maximal_sets(_unions(self.active, self.items))

    @property
    def overlaps(self) -> tuple[Overlap, ...]:
        """Partners performed together that share more than MUCH of the smaller active set."""
        at = dict(zip(self.names, self.active, strict=True))
        partners = [pair for pair in (*self.pairs, *self.local) if pair not in self.relaxed]
        shares = [(pair, _shared_part(at[pair[0]], at[pair[1]])) for pair in partners]
        return tuple(Overlap(pair, round(share, 4)) for pair, share in shares if share > MUCH)

    def item_of(self, name: str) -> int:
        """The item that a blendshape belongs to."""
        k = self.names.index(name)
        return next(i for i, item in enumerate(self.items) if k in item)

    def labels(self, item: int) -> tuple[str, ...]:
        """The blendshapes of an item."""
        return tuple(self.names[k] for k in self.items[item])


def _shared_part(a: Bool[np.ndarray, " v"], b: Bool[np.ndarray, " v"]) -> float:
    """|a & b| over the smaller of |a| and |b|."""
    return float((a & b).sum() / max(min(a.sum(), b.sum()), 1))


def state_problem(
    rig: Rig, used: tuple[str, ...], settings: PackingSettings, rules: Rules | None, apart: Pairs
) -> Problem:
    """The problem of packing `used`. Raises InfeasibleError where edits contradict each other or the face."""
    rules = (rules or rules_of(settings)) if settings.poseable else Rules()
    check_rule_names(rig, rules)
    edits = settings.edits
    check_edits(used, edits)
    names = tuple(name for name in used if name not in edits.dropped)
    drivers = tuple(pair for pair in driven(rig, used, rules) if pair[0] in names) if settings.poseable else ()
    edits = change(edits, apart=apart_with_bases(edits.apart, drivers))
    shown = performed_sets(rig, used, settings.mu, drivers)
    active = shown[[used.index(name) for name in names]]
    exclusive = _within(names, never_together(rig, used, rules)) if settings.poseable else ()
    colliding = _within(names, apart)
    pairs = _within(names, performed_together(rig, used)) if settings.paired else ()
    if settings.poseable:
        parting = eyes_that_part(rig, names)
        exclusive += parting if edits.names else _unsaid(parting, exclusive, pairs)
    local = local_pairs(rig, names, active_sets(rig, names, settings.mu)) if settings.local_pairs else ()
    most = settings.most_things or rules.most_things
    hard = _within_hard(names, hard_together(rig, used, rules)) if settings.poseable else ()
    linked = _Links(names, active, pairs, local, (*exclusive, *colliding), edits, most)
    relaxed = linked.relax()
    items = tuple(tuple(names.index(name) for name in group) for group in linked.groups(relaxed))
    separated = (*exclusive, *colliding, *edits.apart)
    instance = _instance(names, active, items, separated, hard, edits, linked, most)
    return Problem(names, active, items, instance, pairs, local, relaxed, exclusive, colliding, drivers, most, edits)


def apart_with_bases(apart: Pairs, drivers: Pairs) -> Pairs:
    """What is asked to be apart, and what is performed on either of the two: it would bring it along.

    Raises InfeasibleError where one of the two is performed on the other, or something on both.
    """
    shows = {name: (name, *(of for of, base in drivers if base == name)) for pair in apart for name in pair}
    for a, b in apart:
        for name in (name for name in shows[a] if name in shows[b]):
            bases = " and ".join(f"'{base}'" for base in (a, b) if base != name)
            raise InfeasibleError(
                f"'{name}' is performed on {bases}, and '{a}' and '{b}' are asked to be apart: take the edit back"
            )
    return tuple(dict.fromkeys((one, other) for a, b in apart for one in shows[a] for other in shows[b]))


def _unsaid(parting: Pairs, exclusive: Pairs, pairs: Pairs) -> Pairs:
    """Those of `parting` that do not follow yet, because the partner of the one excludes the other."""
    partner, said = dict(pairs), {frozenset(pair) for pair in exclusive}
    return tuple((a, b) for a, b in parting if frozenset((partner.get(a), b)) not in said)


def rules_of(settings: PackingSettings) -> Rules:
    """The rules that settings name."""
    return read_rules(Path(settings.rules)) if settings.rules else default_rules()


def check_edits(used: tuple[str, ...], edits: Edits) -> None:
    """InfeasibleError where an edit is about a blendshape that is not in use, about a dropped one, or about all."""
    if not set(used) - set(edits.dropped):
        raise InfeasibleError("every blendshape is dropped: keep one")
    for name in edits.names:
        if name not in used:
            meant = closest(name, used) or ": see what the audit lists"
            raise InfeasibleError(f"an edit names '{name}', which is no blendshape in use{meant}")
    for name in (name for group in (*edits.companions, *edits.apart) for name in group):
        if name in edits.dropped:
            raise InfeasibleError(f"'{name}' is dropped and another edit gives it a place: take one of the two back")


@dataclass(frozen=True, eq=False)
class _Links:
    """What may be performed together, and what speaks against it."""

    names: tuple[str, ...]
    active: Bool[np.ndarray, "k v"]
    pairs: Pairs
    local: Pairs
    forbidden: Pairs
    edits: Edits
    most: int | None

    def groups(self, relaxed: Iterable[tuple[str, str]]) -> list[tuple[str, ...]]:
        gone = set(relaxed)
        retained = [pair for pair in (*self.pairs, *self.local) if pair not in gone]
        return groups(self.names, [*self.edits.companions, *retained])

    def relax(self) -> Pairs:
        """The pairs that would bring together what is kept apart, tried one after the other."""
        every = (*self.pairs, *self.local)
        relaxed = list(every)
        for group in self.groups(relaxed):
            if fault := self.fault(group):
                raise InfeasibleError(f"{fault} and are asked to be together: take the edit back")
        for pair in every:
            relaxed.remove(pair)
            if any(self.fault(group) for group in self.groups(relaxed) if pair[0] in group):
                relaxed.append(pair)
        return tuple(relaxed)

    def things(self, group: tuple[str, ...]) -> int:
        """Separate movements: a left/right pair is one."""
        return len(groups(group, list(self.pairs)))

    def fault(self, group: tuple[str, ...]) -> str | None:
        """What keeps members of a group apart, as the beginning of a sentence."""
        if len(group) == 1:
            return None
        forbidden = {frozenset(pair) for pair in self.forbidden}
        asked = {frozenset(pair) for pair in self.edits.apart}
        numbers = self.edits.numbers
        partners = {name: family for family in groups(self.names, [*self.pairs, *self.local]) for name in family}
        for a, b in combinations(group, 2):
            shared = int((self.active[self.names.index(a)] & self.active[self.names.index(b)]).sum())
            if shared and b not in partners[a]:
                return f"'{a}' and '{b}' share {shared:,} vertices"
            if frozenset((a, b)) in forbidden:
                return f"'{a}' and '{b}' cannot be performed at once"
            if frozenset((a, b)) in asked:
                return f"'{a}' and '{b}' are asked to be apart"
            if a in numbers and b in numbers and numbers[a] != numbers[b]:
                return f"'{a}' and '{b}' are locked to E{numbers[a]:02d} and E{numbers[b]:02d}"
        if self.most and self.things(group) > self.most:
            return f"{', '.join(group)} are {self.things(group)} movements at once, {self.most} are allowed,"
        return None


def _instance(
    names: tuple[str, ...],
    active: Bool[np.ndarray, "k v"],
    items: tuple[tuple[int, ...], ...],
    apart: Pairs,
    hard: tuple[tuple[str, str, int], ...],
    edits: Edits,
    links: _Links,
    most: int | None,
) -> Instance:
    of_item = {names[k]: i for i, item in enumerate(items) for k in item}
    numbers = {of_item[name]: number - 1 for name, number in edits.numbers.items()}
    place = np.array([numbers.get(i, FREE) for i in range(len(items))])
    exclude = dict.fromkeys([*((of_item[a], of_item[b]) for a, b in apart), *locked_apart(place)])
    cost: dict[tuple[int, int], int] = {}
    for a, b, c in hard:
        i, j = sorted((of_item[a], of_item[b]))
        if i != j:
            cost[i, j] = max(cost.get((i, j), 0), c)
    sets = maximal_sets(np.hstack([_unions(active, items), pair_sets(len(items), exclude)]))
    things = np.array([links.things(tuple(names[k] for k in item)) for item in items])
    clash = sets.astype(int) @ sets.T > 0
    costs = tuple((i, j, c) for (i, j), c in cost.items() if not clash[i, j])
    return Instance(sets, things, most or max(int(things.sum()), 1), place, costs)


def _unions(active: Bool[np.ndarray, "k v"], items: tuple[tuple[int, ...], ...]) -> Bool[np.ndarray, "g v"]:
    return np.array([active[list(item)].any(axis=0) for item in items]).reshape(len(items), -1)


def _within(names: tuple[str, ...], pairs: Pairs) -> Pairs:
    return tuple((a, b) for a, b in pairs if a in names and b in names)


def _within_hard(names: tuple[str, ...], hard: tuple[tuple[str, str, int], ...]) -> tuple[tuple[str, str, int], ...]:
    return tuple((a, b, c) for a, b, c in hard if a in names and b in names)
