"""Where nothing may be written: what was read, a link, a device, and what is a folder where a file is meant."""

import os
from collections.abc import Iterable
from pathlib import Path

from capture_plan.errors import PlanError

IS_A_LINK = "is a link, and no link is ever written through"


def refuse_place(path: Path, *, folder: bool = False, inputs: Iterable[str | Path | None] = ()) -> None:
    """Refuse an output before any work.

    Raises:
        PlanError: it is one of the `inputs`, a link, a device, a folder where a file is meant or the other way round,
            or lies where nobody may write.
    """
    if reason := why_not(path, folder, [Path(each) for each in inputs if each is not None]):
        raise PlanError(f"{path} {reason}: choose another place with -o")


def why_not(path: Path, folder: bool, inputs: list[Path]) -> str | None:
    """The reason not to write to `path`; None where there is none."""
    if path.is_symlink():
        return IS_A_LINK
    if any(same(path, each) for each in inputs):
        return "is what is read"
    if path.exists() and path.is_dir() != folder:
        return f"is a {'folder' if path.is_dir() else 'file'}, expected a {'folder' if folder else 'file'}"
    if path.exists() and not (path.is_dir() or path.is_file()):
        return "is a device, expected a file"
    first = next((each for each in (path, *path.parents) if each.exists()), Path())
    if not first.is_dir() and first != path:
        return f"would lie in {first}, which is a file"
    if not os.access(first if first.is_dir() else first.parent, os.W_OK | os.X_OK):
        return "cannot be written (no permission)"
    return None


def same(one: Path, other: Path) -> bool:
    """Whether two paths lead to the same place."""
    try:
        return one.samefile(other)
    except OSError:
        return False
