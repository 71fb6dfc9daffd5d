"""The user's own names, which win over everything that is recognised: a TOML file.

full = 100                       # a full weight in recorded takes: 1, 100 where they are per cent, 255, ...

[names]                          # what a blendshape or column is: an ARKit name, an action unit, or words
"Smile_01" = "mouthSmileLeft"
"AU_blink" = "AU45"

[weights]                        # a recorded column, and the blendshapes of the rig that it drives
"AU25_r" = "jawOpen"
"Sneer" = { "noseSneerLeft" = 1.0, "noseSneerRight" = 0.8 }
"HeadRoll" = ""                  # drives nothing
"""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from capture_plan.errors import RigError
from capture_plan.input.bounds import check_names
from capture_plan.input.documents import read_toml

TABLES = ("names", "weights")
FULL = "full"


@dataclass(frozen=True)
class NameMap:
    """`names[n]` is what n means; `weights[c][b]` is how much of column c goes to blendshape b.

    `full` is the value of a full weight in recorded takes; None where the takes tell it.
    """

    names: dict[str, str] = field(default_factory=dict)
    weights: dict[str, dict[str, float]] = field(default_factory=dict)
    full: float | None = None

    def meaning(self, name: str) -> str | None:
        """What the user calls `name`; None where the map does not say."""
        return self.names.get(name)


def read_name_map(path: str | Path) -> NameMap:
    """The map in the TOML file at `path`. RigError that names the entry where it is none."""
    path = Path(path)
    document = read_toml(path, RigError, 'write lines such as "Smile_01" = "mouthSmileLeft"')
    unknown = [table for table in document if table not in (*TABLES, FULL)]
    if unknown:
        raise RigError(
            f"{path.name} has '{unknown[0]}', expected the tables [names] and [weights] or the line full = ...: "
            "move it into one"
        )
    for table in TABLES:
        if not isinstance(document.get(table, {}), dict):
            raise RigError(f"{path.name}: '{table}' is no table: write [{table}] and its entries below")
    names = document.get("names", {})
    for name, meaning in names.items():
        if not (isinstance(meaning, str) and meaning.strip()):
            raise RigError(f"{path.name}: '{name}' is {meaning!r}, expected a name in quotes")
    check_names([*names, *names.values()], path.name)
    columns = document.get("weights", {})
    shares = {column: _shares(path, column, entry) for column, entry in columns.items()}
    return NameMap(dict(names), shares, _full(path, document.get(FULL)))


def _full(path: Path, value: Any) -> float | None:
    """The value of a full weight."""
    if value is not None and not (_is_number(value) and value > 0):
        raise RigError(f"{path.name}: full is {value!r}, expected a number above 0, such as full = 100")
    return None if value is None else float(value)


def _shares(path: Path, column: str, entry: Any) -> dict[str, float]:
    """How much of a column goes to each blendshape."""
    if isinstance(entry, str):
        return {entry: 1.0} if entry.strip() else {}
    if isinstance(entry, dict) and all(_is_number(share) for share in entry.values()):
        return {blendshape: float(share) for blendshape, share in entry.items()}
    raise RigError(
        f'{path.name}: what "{column}" drives is {entry!r}, expected a blendshape in quotes, or {{ "jawOpen" = 0.5 }}'
    )


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and bool(np.isfinite(value))
