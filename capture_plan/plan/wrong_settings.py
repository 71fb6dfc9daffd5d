"""What is wrong with a setting, in words: where, what was expected, what was found, and what might have been meant."""

import re
from collections.abc import Callable, Iterator
from typing import Any, get_args, get_type_hints

import msgspec

from capture_plan.input.documents import closest

KINDS = {
    "float": "a number", "int": "a whole number", "str": "text in quotes", "bool": "true or false",
    "array": "a list", "object": "a table", "null": "nothing",
}  # fmt: skip
SIGNS = {">=": "of at least", "<=": "of at most", ">": "above", "<": "below"}
PLACE = re.compile(r" - at `(?:key in )?`?\$\.?([^`]*)`$")
KIND = re.compile(r"`(\w+)(?: \| null)?`(?: (>=|<=|>|<) ([-\d.e]+))?")
ENUM = re.compile(r"Invalid enum value '?(.*?)'?")
UNKNOWN = re.compile(r"Object contains unknown field `([^`]*)`")


def what_is_wrong(error: msgspec.ValidationError, spelled: Callable[[str], str] = str) -> str:
    """'--epsilon: expected a number above 0'; `spelled` turns 'landmarks.epsilon' into the word that a person wrote."""
    text = str(error)
    found = PLACE.search(text)
    where, said = (found[1], text[: found.start()]) if found else ("", text)
    if unknown := UNKNOWN.search(said):
        likely = closest(unknown[1], names_at(where))
        return f"'{unknown[1]}' is no setting{f' of [{where}]' if where else ''}{likely}"
    if other := ENUM.fullmatch(said):
        choices = choices_at(where)
        return f"{spelled(where)}: '{other[1]}' is none of {', '.join(choices)}{closest(other[1], choices)}"
    words = KIND.sub(lambda kind: _kind(*kind.groups()), said)
    if words == said:  # our own sentence
        return said
    return f"{spelled(where.partition('[')[0])}: {words[:1].lower()}{words[1:].replace(', got', ', found')}"


def _kind(name: str, sign: str | None, number: str | None) -> str:
    words, limit = KINDS.get(name, name), float(number or 0)
    return f"{words} {SIGNS[sign]} {f'{limit:,.0f}' if limit.is_integer() else f'{limit:g}'}" if sign else words


def choices_at(where: str) -> list[str]:
    """The words that a setting may be, by its path in the file; none where it is no choice."""
    from capture_plan.plan.settings import Settings

    found: list[Any] = [Settings]
    for part in where.partition("[")[0].split("."):
        hints = [get_type_hints(kind) for kind in found if isinstance(kind, type)]
        found = [kind for hint in hints if part in hint for kind in (get_args(hint[part]) or (hint[part],))]
        found = [inner for kind in found for inner in (get_args(kind) or (kind,))]
    return [choice for choice in found if isinstance(choice, str)]


def names_at(where: str) -> list[str]:
    """The names that a table of the settings may have."""
    from capture_plan.plan.settings import Settings

    return list(dict.fromkeys(_names(msgspec.to_builtins(Settings()), where.split(".") if where else [])))


def _names(settings: Any, path: list[str]) -> Iterator[str]:
    for part in path:
        settings = settings.get(part, {}) if isinstance(settings, dict) else {}
    yield from settings if isinstance(settings, dict) else ()
