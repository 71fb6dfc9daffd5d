"""The named weights in a part of a JSON frame, however deep their names and sides stand.

    {name: weight}, {name: "0,5"}, {name: "50 %"}          numbers, also in quotes
    {"mouthSmile": {"left": w, "right": w}}, {"left": {"mouthSmile": w}}, {"mouth": {"smileLeft": w}}
    {"jawOpen": {"value": w}}                              an object of its own for each weight
    [{"categoryName": name, "score": w}, ...], [{name: w}, ...], [[name, w], ...]
Of the ways to join the words on the way to a weight, the one that says most of a face is its name.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from functools import lru_cache
from typing import Any, TypeGuard

from capture_plan.curves.columns import MANY, plain, why_not
from capture_plan.names.recognise import recognise

LABEL_KEYS = (
    *("categoryname", "name", "displayname", "label", "shape", "shapename", "key", "id", "blendshape"),
    *("blendshapename", "channel", "target", "morph", "location"),
    *("blendshapelocation", "parameter", "expression", "k", "n"),
)
SCORE_KEYS = ("score", "value", "weight", "coefficient", "intensity", "amount", "v", "w")
QUOTED = re.compile(r"[+-]?(\d+[.,]?\d*|[.,]\d+)(e[+-]?\d+)?\s*%?", re.IGNORECASE)
SIDES = {"left": "Left", "l": "Left", "right": "Right", "r": "Right"}
NUMBERS = {int, float}
DEEPEST = 6  # objects within each other


def named_numbers(value: Mapping[str, Any]) -> Mapping[str, Any]:
    """The numbers and nulls under names that can be weights', those in objects below them among these."""
    if set(map(type, value.values())) <= NUMBERS and all_weights(tuple(value)):
        return value
    found: dict[str, Any] = {}
    for path, x in leaves(value):
        name = spelled(path)
        if len(path) > 1 or not why_not(name):
            found[_joined(path) if name in found else name] = x
    return found


def leaves(value: Mapping[str, Any], above: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], Any]]:
    """(names on the way, number or null) of all numbers in an object, and in objects below it."""
    for name, x in value.items():
        if isinstance(x, dict) and len(above) < DEEPEST:
            score = next((inner for key, inner in x.items() if plain(key) in SCORE_KEYS and is_weight(inner)), None)
            if score is None:
                yield from leaves(x, (*above, name))
            else:
                yield (*above, name), score
        elif x is None or is_weight(x):
            yield (*above, name), x


def unread(value: Mapping[str, Any]) -> list[str]:
    """Names of what an object of weights holds beside numbers."""
    if set(map(type, value.values())) <= NUMBERS:
        return []
    return [
        name
        for name, x in value.items()
        if not (x is None or is_weight(x) or (isinstance(x, dict) and any(True for _ in leaves(x))) or why_not(name))
    ]


@lru_cache(MANY)
def spelled(path: tuple[str, ...]) -> str:
    """The name that the names on the way to a weight make together."""
    if len(path) == 1:
        return path[0]
    sides = [SIDES[plain(word)] for word in path if plain(word) in SIDES][:1]
    rest = tuple(word for word in path if plain(word) not in SIDES)
    ways = [(*rest[i:], *sides) for i in range(len(rest))] or [path]
    surest = max(ways, key=lambda way: (meaning.confidence if (meaning := recognise(_joined(way))) else 0.0, len(way)))
    return _joined(surest)


def _joined(path: Sequence[str]) -> str:
    """Names in one: mouthSmileLeft of mouth, smile and left."""
    return path[0] + "".join(word[:1].upper() + word[1:] for word in path[1:])


@lru_cache(MANY)
def known(name: str) -> bool:
    """Whether a name says something of a face."""
    return recognise(name) is not None


@lru_cache(64)
def all_weights(names: tuple[str, ...]) -> bool:
    """Whether all of these can be weights; asked once for frames of the same names."""
    return not any(map(why_not, names))


def has_numbers(value: Any) -> bool:
    """Whether an object holds a number under a name that can be a weight's, or below it one whose name is known."""
    if not isinstance(value, dict):
        return False
    if any(is_weight(x) and not why_not(name) for name, x in value.items()):
        return True
    return any(x is not None and known(spelled(path)) for path, x in leaves(value))


def named_weights(values: Any) -> Mapping[str, Any] | None:
    """The weights of a list that names each; None where it is no such list."""
    if not isinstance(values, list) or not values:
        return None
    if is_category(values[0]):
        return categories(values)
    if all(isinstance(one, dict) and len(one) == 1 and not why_not(*one) for one in values):
        pairs = [next(iter(one.items())) for one in values]
        return dict(pairs) if all(x is None or is_weight(x) for _, x in pairs) else None
    if all(isinstance(one, list) and len(one) == 2 and isinstance(one[0], str) for one in values):
        return dict(values) if all(x is None or is_weight(x) for _, x in values) else None
    return None


@lru_cache(MANY)
def category_keys(keys: tuple[str, ...]) -> tuple[tuple[str, ...], str]:
    """Of the keys of an object those that may hold the name of a weight, first the likeliest, and that of its number.

    Asked once for all objects of the same keys. The second is empty where none holds a number.
    """
    found = {plain(key): key for key in keys}
    labels = tuple(found[key] for key in LABEL_KEYS if key in found)
    return labels, next((found[key] for key in SCORE_KEYS if key in found), "")


def is_category(value: Any) -> bool:
    """Whether an object names one weight: {"categoryName": "jawOpen", "score": 0.5}."""
    if not isinstance(value, dict):
        return False
    labels, score = category_keys(tuple(value))
    return bool(score) and any(isinstance(value[key], str) for key in labels)


def categories(values: Sequence[Any]) -> Mapping[str, Any]:
    """Weights of a list of categories."""
    found = {}
    for one in values:
        if is_category(one):
            labels, score = category_keys(tuple(one))
            found[next((one[key] for key in labels if isinstance(one[key], str) and one[key]), "")] = one[score]
    return found


def number_in(value: Any) -> float:
    """The number of a weight, also of one in quotes, with a comma or a %; NaN of null."""
    if isinstance(value, str):
        return float(value.strip().removesuffix("%").strip().replace(",", "."))
    return float("nan") if value is None else float(value)


def is_weight(value: Any) -> bool:
    """Whether a value is a number, also one in quotes."""
    return is_number(value) or (isinstance(value, str) and bool(QUOTED.fullmatch(value.strip())))


def is_number(value: Any) -> TypeGuard[int | float]:
    """Whether a value is a number and no truth value."""
    return isinstance(value, int | float) and not isinstance(value, bool)
