"""Lists and numbers in sentences."""

from collections.abc import Sequence


def in_series(words: Sequence[str], last: str = "and") -> str:
    """'a', 'a and b', 'a, b and c'."""
    return f" {last} ".join(filter(None, (", ".join(words[:-1]), words[-1])))


def count(number: int, what: str) -> str:
    """A number with its noun: '1 frame', '3,046 frames'."""
    return f"{number:,} {what}{'' if number == 1 else 's'}"
