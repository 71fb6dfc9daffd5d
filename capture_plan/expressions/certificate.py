"""Does a packing hold? Recomputed from the rig by code that knows no solver.

Each used blendshape is performed once or listed as left out; no two in an expression share an active vertex, unless
they are a left/right pair, nor are kept apart by a rule; pairs are together; pairs and rules are those that the rig
has; every two members of the clique conflict, so that no list is shorter than the clique; what is called proven equals
its bound.
"""

from itertools import combinations

import numpy as np

from capture_plan.expressions.active import performed_sets
from capture_plan.expressions.record import Packing
from capture_plan.expressions.together import driven, never_together, performed_together
from capture_plan.rig import Rig


def packing_faults(rig: Rig, used: tuple[str, ...], packing: Packing, mu: float) -> tuple[str, ...]:
    """What does not hold, a line each; empty where all of it does."""
    return tuple(line for lines in packing_claims(rig, used, packing, mu).values() for line in lines)


def packing_claims(rig: Rig, used: tuple[str, ...], packing: Packing, mu: float) -> dict[str, list[str]]:
    """What a packing claims, and for each claim the lines that say what does not hold."""
    active = dict(zip(used, performed_sets(rig, used, mu, packing.drivers), strict=True))
    return {
        "every blendshape is performed once or listed as left out": each_once(used, packing),
        "no two blendshapes of an expression overlap or exclude each other": disjoint(active, packing),
        "left and right partners are performed together": together(packing),
        "pairs, rules and drivers are those of the rig and its names": own_rules(rig, used, packing),
        f"no list has fewer than {len(packing.clique)} expressions (a clique)": bound(active, packing),
    }


def each_once(used: tuple[str, ...], packing: Packing) -> list[str]:
    listed = [name for expression in packing.expressions for name in expression.blendshapes] + [*packing.left_out]
    return [
        f"blendshape '{name}' is listed {listed.count(name)} times, expected once"
        for name in dict.fromkeys([*used, *listed])
        if listed.count(name) != 1 or name not in used
    ]


def disjoint(active: dict[str, np.ndarray], packing: Packing) -> list[str]:
    pairs = {frozenset(pair) for pair in packing.pairs}
    rules = {frozenset(pair) for pair in packing.exclusive}
    faults = []
    for expression in packing.expressions:
        for a, b in combinations(expression.blendshapes, 2):
            if a in active and b in active and {a, b} not in pairs:
                shared = int((active[a] & active[b]).sum())
                if shared:
                    faults.append(f"{expression.name}: '{a}' and '{b}' share {shared} active vertices, expected 0")
            if {a, b} in rules:
                faults.append(f"{expression.name}: '{a}' and '{b}' cannot be performed at once")
    return faults


def together(packing: Packing) -> list[str]:
    place = {name: expression.name for expression in packing.expressions for name in expression.blendshapes}
    return [
        f"'{a}' is in {place.get(a)} and its partner '{b}' in {place.get(b)}, expected together"
        for a, b in packing.pairs
        if (a, b) not in packing.relaxed and place.get(a) != place.get(b)
    ]


def own_rules(rig: Rig, used: tuple[str, ...], packing: Packing) -> list[str]:
    never, pairs, drivers = set(never_together(rig, used)), set(performed_together(rig, used)), set(driven(rig, used))
    driver_of = dict(packing.drivers)
    return [
        *(f"nothing says that '{a}' and '{b}' exclude each other" for a, b in packing.exclusive if (a, b) not in never),
        *(f"'{a}' and '{b}' are no partners" for a, b in packing.pairs if (a, b) not in pairs),
        *(f"'{a}' is no corrective of '{b}'" for a, b in packing.drivers if (a, b) not in drivers),
        *(
            f"{e.name} holds {list(e.drivers)}, its blendshapes need {needed}"
            for e in packing.expressions
            if (needed := [driver_of[name] for name in e.blendshapes if name in driver_of]) != list(e.drivers)
        ),
    ]


def bound(active: dict[str, np.ndarray], packing: Packing) -> list[str]:
    partner = {name: pair for pair in packing.pairs if pair not in packing.relaxed for name in pair}
    rules = {frozenset(pair) for pair in packing.exclusive}
    whole = {name: partner.get(name, (name,)) for name in packing.clique}
    faults = [
        f"'{a}' and '{b}' of the clique do not conflict"
        for a, b in combinations(packing.clique, 2)
        if not any(
            frozenset((i, j)) in rules or (i in active and j in active and (active[i] & active[j]).any())
            for i in whole[a]
            for j in whole[b]
        )
        or whole[a] == whole[b]
    ]
    if not len(packing.clique) <= packing.bound <= packing.objective:
        faults.append(
            f"clique {len(packing.clique)}, bound {packing.bound} and objective {packing.objective} are out of order"
        )
    if packing.proven_optimal != (packing.bound == packing.objective):
        faults.append(f"{packing.objective} expressions against a bound of {packing.bound}: the proof is misstated")
    missing = packing.objective - len(packing.expressions)
    if missing < 0 or (missing > 0) != bool(packing.left_out):
        faults.append(f"{len(packing.expressions)} expressions listed, objective {packing.objective}")
    return faults
