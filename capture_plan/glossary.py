"""The words of the field as this package uses them, as data: `glossary.toml` says each in one sentence.

Pages and notebooks explain words from here; names, messages and help use these words and no others for the same things.
"""

from collections.abc import Iterable
from functools import cache
from importlib.resources import files

import msgspec
from msgspec import Struct


class Term(Struct, frozen=True, forbid_unknown_fields=True):
    """What a word means, the unit of its number where it has one, and where the word is from."""

    says: str
    source: str
    unit: str = ""


@cache
def glossary() -> dict[str, Term]:
    """All terms by their word, in the order in which a reader meets them."""
    text = files("capture_plan").joinpath("glossary.toml").read_bytes()
    return msgspec.toml.decode(text, type=dict[str, Term])


def explained(words: Iterable[str]) -> list[tuple[str, str]]:
    """Each word and its sentence, with the unit of its number.

    Raises:
        KeyError: the glossary has no such word.
    """
    terms = {word: glossary()[word] for word in words}
    measured = {"": "", "0 to 1": " From 0 to 1."}
    return [(word, one.says + measured.get(one.unit, f" Unit: {one.unit}.")) for word, one in terms.items()]
