"""Names of markers that another program takes: never two alike, not even where it is blind to capitals."""

import re
import unicodedata
from collections.abc import Iterable


def plain_names(names: Iterable[str], *, longest: int) -> tuple[str, ...]:
    """Names of letters a to z, digits and '_' that begin with a letter, at most `longest` signs long, all different.

    Example:
        >>> plain_names(["M01", "lèvre 1", "levre_1", "7"], longest=30)
        ('M01', 'levre_1', 'levre_1_2', 'm7')
    """
    return distinct_names((_plain(name) for name in names), longest=longest)


def distinct_names(names: Iterable[str], *, longest: int) -> tuple[str, ...]:
    """The names cut to `longest` signs; one that was taken before gets a number.

    Example:
        >>> distinct_names(["Kinn", "kinn", "Kinnspitze"], longest=6)
        ('Kinn', 'kinn_2', 'Kinnsp')
    """
    taken: dict[str, str] = {}
    for name in names:
        new, number = name[:longest], 1
        while new.casefold() in taken:
            number += 1
            end = f"_{number}"
            new = f"{name[: longest - len(end)]}{end}"
        taken[new.casefold()] = new
    return tuple(taken.values())


def _plain(name: str) -> str:
    letters = unicodedata.normalize("NFKD", name).encode("ascii", "ignore").decode()
    plain = re.sub(r"[^A-Za-z0-9]+", "_", letters).strip("_")
    return plain if plain[:1].isalpha() else f"m{plain}"
