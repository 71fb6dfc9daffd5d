"""Where two records of one kind differ, each place by its path: `layout.landmarks[M04].label`."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import msgspec

NEAR, SHARE = 1.5e-4, 1e-6  # one unit in the last of four decimals may differ between machines


@dataclass(frozen=True)
class Difference:
    """A place, what is said there and what was found; a value that one side does not have is `ABSENT`. In the path dots
    and expressions go by their names and what is shot by its number, as people know them, all else by its number."""

    path: str
    said: Any
    found: Any

    def __str__(self) -> str:
        return f"{self.path} says {_shown(self.said)}, the rig gives {_shown(self.found)}"


ABSENT = "nothing"


def differences(said: Any, found: Any, path: str = "") -> Iterator[Difference]:
    """Every place in which two records, or parts of them, differ; numbers may by rounding."""
    yield from _differences(msgspec.to_builtins(said), msgspec.to_builtins(found), path)


def _differences(said: Any, found: Any, path: str) -> Iterator[Difference]:
    if isinstance(said, dict) and isinstance(found, dict):
        for name in dict.fromkeys([*said, *found]):
            inner = f"{path}.{name}" if path else str(name)
            yield from _differences(said.get(name, ABSENT), found.get(name, ABSENT), inner)
    elif isinstance(said, list | tuple) and isinstance(found, list | tuple):
        for n in range(max(len(said), len(found))):
            one, other = (side[n] if n < len(side) else ABSENT for side in (said, found))
            yield from _differences(one, other, f"{path}[{_called(other) or _called(one) or n}]")
    elif not _same(said, found):
        yield Difference(path, said, found)


def _called(entry: Any) -> str:
    """'shot 6' or 'M13'; empty for what has no name."""
    if not isinstance(entry, dict):
        return ""
    return f"shot {str(entry['slate']).lstrip('0')}" if entry.get("slate") else str(entry.get("name", ""))


def _same(said: Any, found: Any) -> bool:
    if isinstance(said, bool) or isinstance(found, bool) or not _numbers(said, found):
        return type(said) is type(found) and bool(said == found)
    if isinstance(said, int) and isinstance(found, int):
        return said == found
    return bool(abs(said - found) <= NEAR + SHARE * abs(found))


def _numbers(*values: Any) -> bool:
    return all(isinstance(value, int | float) for value in values)


def _shown(value: Any) -> str:
    text = repr(value) if isinstance(value, str) and value != ABSENT else str(value)
    return text if len(text) <= 80 else f"{text[:77]}..."
