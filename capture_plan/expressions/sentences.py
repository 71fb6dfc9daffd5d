"""What the actor is told: one plain sentence per expression, free of muscles and of blendshape names.

Data   phrases   expressions/data/phrases.toml, by ARKit name
Rule   names that are known become phrases; what stands under `together` is merged, then left and right of one movement,
       from the brow down, the jaw before the lips; sides are the actor's own. The mouth's shape for a sound is asked
       for by the sound (`sounds.py`). What has no known name is described by where it moves most, which way and how
       far, in millimetres, each place once; and so are expressions that would read alike, and what has a known name
       where something without one moves the same place the other way: nobody is told up and down at once.
"""

import tomllib
from functools import cache
from importlib.resources import files
from itertools import pairwise
from typing import Any

from capture_plan.anatomy.meaning import arkit_by_motion, base_name
from capture_plan.expressions.lips import stays_open
from capture_plan.expressions.movement import against, goes_against, movements
from capture_plan.expressions.sounds import sounds_of
from capture_plan.prose import in_series
from capture_plan.rig import Rig

CLAUSES = 3  # in one breath; more become a second sentence
BROWS = {"browInnerUp": "up", "browOuterUp": "up", "browDown": "down"}  # a cartoon's smiling brows may go down
FROM_REST = "From a relaxed face: "  # every expression starts from the neutral, not from the one before


def sentence(rig: Rig, blendshapes: tuple[str, ...]) -> str:
    """What to do to show `blendshapes` at full weight, all at once."""
    parts = [in_series(part) for part in _breaths(_said(rig, blendshapes))] + list(_sounded(rig, blendshapes))
    if unknown := _unknown(rig, blendshapes):
        found = movements(rig, unknown)
        parts.append(f"match the picture: move {in_series(found)}" if found else "match the picture")
    parts[1:] = [f"at the same time {part}" for part in parts[1:]]
    return " ".join(part[0].upper() + part[1:] + "." for part in parts)


def distinct_sentences(rig: Rig, expressions: list[tuple[str, ...]]) -> list[str]:
    """The sentence of every expression; what reads like another's says how it moves as well."""
    said = [sentence(rig, one) for one in expressions]
    found = []
    for one, text in zip(expressions, said, strict=True):
        moves = movements(rig, one) if said.count(text) > 1 else ()
        new = [move for move in moves if move not in text]
        found.append(f"{text} It moves {in_series(tuple(new))}." if new else text)
    return found


def from_rest(sentence: str) -> str:
    """A sentence with where it starts: 'From a relaxed face: close your eyes.'"""
    return FROM_REST + sentence[:1].lower() + sentence[1:]


def movements_in_words(rig: Rig, blendshapes: tuple[str, ...]) -> tuple[str, ...]:
    """The separate movements in words; those that only the picture tells are one."""
    unknown = _unknown(rig, blendshapes)
    return (*_said(rig, blendshapes), *_sounded(rig, blendshapes)) + (
        (movements(rig, unknown) or ("match the picture",)) if unknown else ()
    )


def mistakes(rig: Rig, blendshapes: tuple[str, ...]) -> tuple[str, ...]:
    """What people often do wrong here, as a warning: of the highest and of the lowest place that has one."""
    table, _ = phrases()
    bases = {base_name(arkit) for arkit in _known(rig, blendshapes)}
    bases -= {"mouthClose"} if stays_open(rig, blendshapes) is not None else set()
    found = [table[base] for base in table if base in bases and "mistake" in table[base]]
    warnings = [entry["mistake"] for entry in found if bases.isdisjoint(entry.get("unless", ()))]
    return tuple(dict.fromkeys([*warnings[:1], *warnings[-1:]]))


def _said(rig: Rig, blendshapes: tuple[str, ...]) -> tuple[str, ...]:
    """The phrases of what has one; lips that the rig leaves open are not asked to be closed."""
    said, gap = spoken(_known(rig, blendshapes)), stays_open(rig, blendshapes)
    if gap is None:
        return said
    entry = phrases()[0]["mouthClose"]
    return tuple(entry["open"].format(gap=gap) if phrase == entry["both"] else phrase for phrase in said)


def _sounded(rig: Rig, blendshapes: tuple[str, ...]) -> tuple[str, ...]:
    """What to say for mouths that stand for a sound, and how they move."""
    said = []
    for name in blendshapes:
        if sound := sounds_of(rig).get(name):
            moves = movements(rig, (name,))
            said.append(f"say {sound} and hold your mouth there" + (f": move {in_series(moves)}" if moves else ""))
    return tuple(said)


def _known(rig: Rig, blendshapes: tuple[str, ...]) -> tuple[str, ...]:
    """ARKit's names of those blendshapes that are told by a phrase."""
    unknown = _unknown(rig, blendshapes)
    return tuple(arkit for name, arkit in _phrased(rig, blendshapes).items() if name not in unknown)


def _unknown(rig: Rig, blendshapes: tuple[str, ...]) -> tuple[str, ...]:
    """Blendshapes that are told by how they move: without a phrase, or with one that such a movement contradicts."""
    phrased = _phrased(rig, blendshapes)
    nameless = tuple(name for name in blendshapes if name not in phrased and name not in sounds_of(rig))
    return tuple(
        name
        for name in blendshapes
        if name in nameless or (nameless and name in phrased and against(rig, name, nameless))
    )


def _phrased(rig: Rig, blendshapes: tuple[str, ...]) -> dict[str, str]:
    """ARKit's name for every blendshape that has a phrase; none for brows whose motion goes against it."""
    table, _ = phrases()
    heard = sounds_of(rig)
    names = [name for name in blendshapes if name not in heard]
    found = {name: arkit for name in names if (arkit := arkit_by_motion(rig, name)) and base_name(arkit) in table}
    ways = {name: BROWS[base_name(arkit)] for name, arkit in found.items() if base_name(arkit) in BROWS}
    return {name: found[name] for name in found if not (name in ways and goes_against(rig, name, ways[name]))}


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


@cache
def phrases() -> tuple[dict[str, dict[str, Any]], tuple[tuple[tuple[str, ...], str], ...]]:
    """Phrases by ARKit name without its side, and what is said where several meet."""
    table = tomllib.loads(files("capture_plan.expressions").joinpath("data", "phrases.toml").read_text("utf-8"))
    del table["sounds"]
    together = tuple((tuple(entry["names"]), entry["say"]) for entry in table.pop("together"))
    return table, together


def _side(arkit: str) -> str:
    return arkit.removeprefix(base_name(arkit)).lower()


def _breaths(clauses: tuple[str, ...]) -> list[tuple[str, ...]]:
    """Clauses in as few sentences of at most CLAUSES as possible, evenly."""
    count = -(-len(clauses) // CLAUSES)
    cuts = [round(number * len(clauses) / count) for number in range(count + 1)] if count else [0]
    return [clauses[a:b] for a, b in pairwise(cuts)]
