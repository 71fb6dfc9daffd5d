"""What the actor is told: one plain sentence per expression, free of muscles and of blendshape names.

Data   phrases   expressions/data/phrases.toml, by ARKit name
Rule   names that are known become phrases; what stands under `together` is merged, then left and right of one movement,
       from the brow down; sides are the actor's own. What has no known name is described by where it moves most, which
       way and how far, in millimetres.
"""

import tomllib
from functools import cache
from importlib.resources import files
from itertools import pairwise

from capture_plan.expressions.movement import movements
from capture_plan.expressions.together import base_name
from capture_plan.rig import Rig

CLAUSES = 3  # in one breath; more become a second sentence


def sentence(rig: Rig, blendshapes: tuple[str, ...]) -> str:
    """What to do to show `blendshapes` at full weight, all at once."""
    table, _ = phrases()
    known = {name: arkit for name in blendshapes if (arkit := rig.arkit(name)) and base_name(arkit) in table}
    unknown = tuple(name for name in blendshapes if name not in known)
    clauses = spoken(tuple(known.values()))
    parts = [_list(part) for part in _breaths(clauses)]
    if unknown:
        found = movements(rig, unknown)
        parts.append(f"match the picture: move {_list(found)}" if found else "match the picture")
    return " ".join(part[0].upper() + part[1:] + "." for part in parts)


def spoken(arkit: tuple[str, ...]) -> tuple[str, ...]:
    """The phrases for ARKit names, merged, from the brow down."""
    table, together = phrases()
    place = {base: number for number, base in enumerate(table)}
    left = list(arkit)
    said: list[tuple[int, str]] = []
    for names, phrase in together:
        if set(names) <= set(left):
            left = [name for name in left if name not in names]
            said.append((place[base_name(names[0])], phrase))
    for base in dict.fromkeys(base_name(name) for name in left):
        sides = [_side(name) for name in left if base_name(name) == base]
        one = table[base].get("one", "") if len(sides) == 1 and sides[0] else ""
        said.append((place[base], one.format(side=sides[0]) if one else table[base]["both"]))
    return tuple(phrase for _, phrase in sorted(said))


def said_as_one(rig: Rig, names: tuple[str, ...]) -> bool:
    """Whether these blendshapes have one phrase in common, whatever their side: people make them as one movement."""
    bases = {base_name(arkit) if (arkit := rig.arkit(name)) else name for name in names}
    return len(bases) > 1 and any(bases <= {base_name(name) for name in merged} for merged, _ in phrases()[1])


@cache
def phrases() -> tuple[dict[str, dict[str, str]], tuple[tuple[tuple[str, ...], str], ...]]:
    """Phrases by ARKit name without its side, and what is said where several meet."""
    table = tomllib.loads(files("capture_plan.expressions").joinpath("data", "phrases.toml").read_text("utf-8"))
    together = tuple((tuple(entry["names"]), entry["say"]) for entry in table.pop("together"))
    return table, together


def _side(arkit: str) -> str:
    return arkit.removeprefix(base_name(arkit)).lower()


def _breaths(clauses: tuple[str, ...]) -> list[tuple[str, ...]]:
    """Clauses in as few sentences of at most CLAUSES as possible, evenly."""
    count = -(-len(clauses) // CLAUSES)
    cuts = [round(number * len(clauses) / count) for number in range(count + 1)] if count else [0]
    return [clauses[a:b] for a, b in pairwise(cuts)]


def _list(items: tuple[str, ...]) -> str:
    return items[0] if len(items) == 1 else f"{', '.join(items[:-1])} and {items[-1]}"
