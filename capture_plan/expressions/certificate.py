"""Does a packing hold? Recomputed from the rig by code that knows no solver.

Each used blendshape is performed once, listed as left out or dropped; no two in an expression share an active vertex,
unless they are partners, nor are kept apart by a rule, by colliding surfaces or by an artist; pairs are together; no
expression asks for too many movements; edits are followed; pairs and rules are those that the rig has; every two
members of the clique conflict, so that no list is shorter than the clique; what is called proven equals its bound.
"""

from collections.abc import Callable
from itertools import combinations, pairwise

import numpy as np

from capture_plan.expressions.active_sets import active_sets, performed_sets
from capture_plan.expressions.compatibility import (
    bases_of,
    driven,
    eyes_that_part,
    groups,
    hard_together,
    never_together,
    performed_together,
)
from capture_plan.expressions.local_pairs import local_pairs
from capture_plan.expressions.record import Packing
from capture_plan.expressions.rules import Rules
from capture_plan.rig import Rig

ROUNDED = 2e-6  # shares carry six decimals
Active = dict[str, np.ndarray]


def packing_faults(
    rig: Rig, used: tuple[str, ...], packing: Packing, mu: float, rules: Rules | None = None
) -> tuple[str, ...]:
    """What does not hold, a line each; empty where all of it does."""
    return tuple(line for lines in packing_claims(rig, used, packing, mu, rules).values() for line in lines)


def packing_claims(
    rig: Rig, used: tuple[str, ...], packing: Packing, mu: float, rules: Rules | None = None
) -> dict[str, list[str]]:
    """What a packing claims, and for each claim the lines that say what does not hold; `rules` other than ours."""
    active = dict(zip(used, performed_sets(rig, used, mu, packing.drivers), strict=True))
    claims = {
        "every blendshape is performed once or listed as left out": each_once(used, packing),
        "no two blendshapes of an expression overlap or exclude each other": _disjoint(active, packing),
        "left and right partners are performed together": _together(packing),
        "pairs, rules and drivers are those of the rig and its names": own_rules(rig, used, packing, mu, rules),
        f"no list has fewer than {len(packing.clique)} expressions (a clique)": bound(active, packing),
    }
    if packing.most_things:
        claims[f"no expression asks for more than {packing.most_things} movements at once"] = not_too_much(packing)
    if packing.edits.names:
        claims["the artist's edits are followed"] = edited(packing)
    return claims


def each_once(used: tuple[str, ...], packing: Packing) -> list[str]:
    """Faults where a used blendshape is not listed exactly once, or one that was dropped still is."""
    listed = [name for expression in packing.expressions for name in expression.blendshapes] + [*packing.left_out]
    dropped = set(packing.edits.dropped)
    return [
        f"blendshape '{name}' is listed {listed.count(name)} times, expected {int(name not in dropped)}"
        for name in dict.fromkeys([*used, *listed])
        if listed.count(name) != (name not in dropped) or name not in used
    ]


def _disjoint(active: Active, packing: Packing) -> list[str]:
    partners = _partners(packing)
    rules = {frozenset(pair) for pair in (*packing.exclusive, *packing.colliding, *packing.edits.apart)}
    faults = []
    for expression in packing.expressions:
        for a, b in combinations(expression.blendshapes, 2):
            if a in active and b in active and b not in partners.get(a, ()):
                shared = int((active[a] & active[b]).sum())
                if shared:
                    faults.append(f"{expression.name}: '{a}' and '{b}' share {shared} active vertices, expected 0")
            if frozenset((a, b)) in rules:
                faults.append(f"{expression.name}: '{a}' and '{b}' cannot be performed at once")
    return faults


def _together(packing: Packing) -> list[str]:
    place = _places(packing)
    return [
        f"'{a}' is in {place.get(a)} and its partner '{b}' in {place.get(b)}, expected together"
        for a, b in (*packing.pairs, *packing.local)
        if (a, b) not in packing.relaxed and place.get(a) != place.get(b)
    ]


def not_too_much(packing: Packing) -> list[str]:
    """Faults where an expression asks for more movements at once than the settings allow."""
    counted = [(e, len(groups(e.blendshapes, list(packing.pairs)))) for e in packing.expressions]
    return [
        f"{e.name} asks for {count} movements at once, expected at most {packing.most_things}"
        for e, count in counted
        if packing.most_things and count > packing.most_things
    ]


def edited(packing: Packing) -> list[str]:
    """Faults where the list does not follow what a person decided."""
    place, edits = _places(packing), packing.edits
    return [
        *(
            f"'{name}' is in {place.get(name)}, an edit locks it to E{number:02d}"
            for name, number in edits.numbers.items()
            if name not in packing.left_out and place.get(name) != f"E{number:02d}"
        ),
        *(
            f"{', '.join(group)} are in {', '.join(str(place.get(name)) for name in group)}, an edit puts them together"
            for group in edits.companions
            if len({place.get(name) for name in group}) > 1
        ),
    ]


def own_rules(rig: Rig, used: tuple[str, ...], packing: Packing, mu: float, rules: Rules | None) -> list[str]:
    """Faults in exclusions, partners and drivers that the packing names for its own rules."""
    never, pairs = set(never_together(rig, used, rules)), set(performed_together(rig, used))
    never |= set(eyes_that_part(rig, used))
    drivers = set(driven(rig, used, rules))
    faults = [
        *(f"nothing says that '{a}' and '{b}' exclude each other" for a, b in packing.exclusive if (a, b) not in never),
        *(f"'{a}' and '{b}' are no partners" for a, b in packing.pairs if (a, b) not in pairs),
        *(f"'{a}' is no corrective of '{b}'" for a, b in packing.drivers if (a, b) not in drivers),
        *(
            f"{e.name} holds {list(e.drivers)}, its blendshapes need {list(needed)}"
            for e in packing.expressions
            if (needed := bases_of(e.blendshapes, packing.drivers)) != e.drivers
        ),
        *(f"'{a}' and '{b}' are split and no pair" for a, b in packing.relaxed if (a, b) not in _pairs(packing)),
    ]
    if packing.local:
        planned = tuple(name for name in used if name not in packing.edits.dropped)
        found = set(local_pairs(rig, planned, active_sets(rig, planned, mu)))
        faults += [f"'{a}' and '{b}' are no halves of one movement" for a, b in packing.local if (a, b) not in found]
    if packing.hard:
        whole = _items(used, packing)
        costs = {frozenset((a, b)): cost for a, b, cost in hard_together(rig, used, rules)}
        for a, b, cost in packing.hard:
            message = max((costs.get(frozenset((i, j)), 0) for i in whole[a] for j in whole[b]), default=0)
            if message != cost:
                faults.append(f"'{a}' with '{b}' costs {message}, not {cost}")
    return faults


def bound(active: Active, packing: Packing) -> list[str]:
    """Faults in the clique that proves how few expressions there can be."""
    whole = _items(tuple(active), packing)
    number = packing.edits.numbers
    rules = {frozenset(pair) for pair in (*packing.exclusive, *packing.colliding, *packing.edits.apart)}

    def conflict(i: str, j: str) -> bool:
        overlap = bool(i in active and j in active and (active[i] & active[j]).any())
        return overlap or frozenset((i, j)) in rules or (i in number and j in number and number[i] != number[j])

    faults = [
        f"'{a}' and '{b}' of the clique do not conflict"
        for a, b in combinations(packing.clique, 2)
        if whole.get(a, a) == whole.get(b, b) or not any(conflict(i, j) for i in whole[a] for j in whole[b])
    ]
    faults += [
        f"'{name}' conflicts with all of the clique, which leaves it out"
        for name in _left_out(packing, whole, conflict)
    ]
    shown = max(len(packing.clique), packing.counted)
    if packing.bound != shown or packing.objective < shown:
        faults.append(f"{packing.objective} expressions and a bound of {packing.bound}, the certificates prove {shown}")
    if not packing.bound <= packing.solver_bound <= packing.objective:
        faults.append(
            f"the solver's bound of {packing.solver_bound} lies outside {packing.bound} to {packing.objective}"
        )
    if packing.solver_bound == packing.objective or packing.method in ("early", "minimum"):
        faults += [
            f"{a} and {b} can be performed as one: fewer are enough" for a, b in mergeable(packing, whole, conflict)
        ]
    if packing.proven_optimal != (packing.bound == packing.objective):
        faults.append(f"{packing.objective} expressions against a bound of {packing.bound}: the proof is misstated")
    missing = packing.objective - len(packing.expressions)
    if missing < 0 or (missing > 0) != bool(packing.left_out):
        faults.append(f"{len(packing.expressions)} expressions listed, objective {packing.objective}")
    return faults


def _left_out(packing: Packing, whole: dict[str, tuple[str, ...]], conflict: Callable[[str, str], bool]) -> list[str]:
    """Blendshapes with which the clique would prove more: a certificate is as strong as it can be made by one name."""
    members = [whole[name] for name in packing.clique if name in whole]
    return [
        item[0]
        for item in dict.fromkeys(whole[name] for name in whole if name not in packing.edits.dropped)
        if item not in members and all(any(conflict(i, j) for i in item for j in one) for one in members)
    ]


def mergeable(
    packing: Packing, whole: dict[str, tuple[str, ...]], conflict: Callable[[str, str], bool]
) -> list[tuple[str, str]]:
    """Two expressions that could be one, which refutes that no list is shorter; not where edits number them. `whole` is
    who is performed together: partners that had to be split exclude each other like anybody."""
    limit = packing.most_things or len(whole)
    return [
        (one.name, other.name)
        for one, other in combinations(packing.expressions, 2)
        if not packing.edits.numbers
        and len(groups((*one.blendshapes, *other.blendshapes), list(packing.pairs))) <= limit
        and not any(conflict(i, j) for i in one.blendshapes for j in other.blendshapes if j not in whole[i])
    ]


def falling(packing: Packing) -> list[str]:
    """Expressions of more importance than the one before, which could have taken its place; not where edits number
    them or nobody says that the order is proved."""
    if packing.edits.numbers or not packing.order_proven:
        return []
    return [
        f"{later.name} has a share of {later.gain:.4f}, {former.name} of {former.gain:.4f}"
        for former, later in pairwise(packing.expressions)
        if later.gain > former.gain + ROUNDED
    ]


def misplaced(packing: Packing) -> list[str]:
    """A list that does not claim the order which its method promises; edits may have another."""
    claims = packing.order_proven or packing.edits.names
    return [] if claims else ["another order of them covers more earlier"]


def _items(names: tuple[str, ...], packing: Packing) -> dict[str, tuple[str, ...]]:
    """Who is performed together, by each of them."""
    retained = [pair for pair in _pairs(packing) if pair not in packing.relaxed]
    return {name: item for item in groups(names, [*retained, *packing.edits.companions]) for name in item}


def _pairs(packing: Packing) -> tuple[tuple[str, str], ...]:
    return (*packing.pairs, *packing.local)


def _partners(packing: Packing) -> dict[str, tuple[str, ...]]:
    """Who may overlap whom: left and right, upper and lower, and all four of a loop."""
    names = tuple(name for expression in packing.expressions for name in expression.blendshapes)
    return {name: family for family in groups(names, list(_pairs(packing))) for name in family}


def _places(packing: Packing) -> dict[str, str]:
    return {name: expression.name for expression in packing.expressions for name in expression.blendshapes}
