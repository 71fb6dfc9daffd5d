"""How hard an expression is to perform, 1 to 5, and why.

Data    expressions/data/difficulty.toml: movements that few people can make at will, and what pulls against each other
Level   1 + points, at most 5, for: several movements at once, one side only, hard movements without what eases them,
        movements that pull against each other, very small ones, and those that only the picture tells
The points are assumptions; that both sides at once are easier, and that trained actors fail some movements, is from
Carrigan et al. 2020, sections 4.2 and 4.4.
"""

import tomllib
from functools import cache
from importlib.resources import files
from itertools import combinations
from typing import NamedTuple

from msgspec import Struct

from capture_plan.anatomy.meaning import arkit_by_motion, base_name
from capture_plan.expressions.groups import grouped, pairs_of
from capture_plan.expressions.sentences import movements_in_words
from capture_plan.rig import Rig

HARDEST = 5


class Difficulty(Struct, frozen=True, forbid_unknown_fields=True):
    """`level` from 1, anybody can do it at once, to 5, expect to fall back; `reasons` the weightiest first."""

    level: int
    reasons: tuple[str, ...]


def difficulty(rig: Rig, blendshapes: tuple[str, ...]) -> Difficulty:
    """How hard it is to perform these blendshapes at once, drivers included."""
    table = _table()
    arkit = {name: known for name in blendshapes if (known := arkit_by_motion(rig, name))}
    bases = {base_name(known) for known in arkit.values()}
    found = [*_many(rig, blendshapes, table.points), *_one_sided(rig, blendshapes, table.points)]
    hard = (hard for base, hard in table.hard.items() if base in bases)
    found += [(each.points, each.why) for each in hard if bases.isdisjoint(each.eased_by)]
    pulls = [words for pair, words in _against(rig, blendshapes, bases).items() if pair in table.against]
    found += [(table.points["against"], words) for words in pulls[:1]]
    found += _small(rig, blendshapes, table.points)
    if len(arkit) < len(blendshapes):
        found.append((table.points["nameless"], "no words for it: the picture has to tell"))
    level = 1 + round(sum(points for points, _ in found))
    ordered = sorted(found, key=lambda reason: -reason[0])
    return Difficulty(min(level, HARDEST), tuple(why for _, why in ordered))


class _Hard(NamedTuple):
    points: float
    why: str
    eased_by: frozenset[str]


class _Table(NamedTuple):
    points: dict[str, float]
    hard: dict[str, _Hard]
    against: frozenset[frozenset[str]]


def _many(rig: Rig, blendshapes: tuple[str, ...], points: dict[str, float]) -> list[tuple[float, str]]:
    """Movements that are distinguished; what has no words is counted by its partners."""
    named = tuple(name for name in blendshapes if arkit_by_motion(rig, name))
    nameless = tuple(name for name in blendshapes if name not in named)
    count = len(movements_in_words(rig, named)) + len(grouped(rig, nameless))
    if count < 2:
        return []
    return [(points["four_movements" if count > 3 else "two_movements"], f"{count} movements at once")]


def _one_sided(rig: Rig, blendshapes: tuple[str, ...], points: dict[str, float]) -> list[tuple[float, str]]:
    alone = any((a in blendshapes) != (b in blendshapes) for a, b in pairs_of(rig))
    return [(points["one_sided"], "one side of the face only")] if alone else []


def _against(rig: Rig, blendshapes: tuple[str, ...], bases: set[str]) -> dict[frozenset[str], str]:
    """What each two of the bases do, in words."""
    phrase = {
        base: movements_in_words(
            rig,
            tuple(name for name in blendshapes if (known := arkit_by_motion(rig, name)) and base_name(known) == base),
        )
        for base in bases
    }
    return {
        frozenset((a, b)): f"one pulls against the other: {phrase[a][0]}; {phrase[b][0]}"
        for a, b in combinations(sorted(bases), 2)
    }


def _small(rig: Rig, blendshapes: tuple[str, ...], points: dict[str, float]) -> list[tuple[float, str]]:
    """The smallest movement, where it is too small to be felt; eyes turn under lids that hardly move."""
    seen = [name for name in blendshapes if not (arkit_by_motion(rig, name) or "").startswith("eyeLook")]
    least = min((float(rig.displacement[rig.names.index(name), rig.skin].max()) for name in seen), default=1e9)
    return [(points["fine"], f"a fine movement: {least:.1f} mm at most")] if least < points["fine_mm"] else []


@cache
def _table() -> _Table:
    table = tomllib.loads(files("capture_plan.expressions").joinpath("data", "difficulty.toml").read_text("utf-8"))
    hard = {
        name: _Hard(float(entry["points"]), entry["why"], frozenset(entry["eased_by"]))
        for name, entry in table["hard"].items()
    }
    against = frozenset(frozenset((a, b)) for a, others in table["against"].items() for b in others)
    return _Table({what: float(points) for what, points in table["points"].items()}, hard, against)
