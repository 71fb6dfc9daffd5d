"""Where nothing may be written: what was read, a plan, a link, a device, and what is a folder where a file is meant."""

import os
from collections.abc import Iterable
from pathlib import Path

import msgspec

from capture_plan.errors import PlanError

IS_A_LINK = "is a link, and no link is ever written through"
HOLDS_A_PLAN = "holds a plan, which only `plan` and `edit` replace"
PARTS = frozenset(("format", "rig", "settings", "layout", "packing"))  # of every plan, of whatever format

Inputs = Iterable[str | Path | None]


def refuse_place(path: Path, *, inputs: Inputs = (), endings: tuple[str, ...] = (), over_plan: bool = False) -> None:
    """Refuse a file as an output before any work; `over_plan` where it may take the place of a plan.

    Raises:
        PlanError: it is one of the `inputs` or lies in one that is a folder, holds a plan, has none of the `endings`,
            is a link, a device or a folder, or lies where nobody may write.
    """
    read = those_there(inputs)
    if reason := _why_not(path, False, read) or why_no_file(path, read, endings, over_plan):
        raise PlanError(f"{path} {reason}: choose another place with -o")


def refuse_folder(folder: Path, names: Iterable[str], *, inputs: Inputs = ()) -> None:
    """Refuse a folder as an output before any work, where files and folders of these `names` will be written; those
    without an ending are folders.

    Raises:
        PlanError: it or one of these places is one of the `inputs`, a link, a device, a file where a folder is meant or
            the other way round, or lies where nobody may write; or one of the `inputs` lies in one of these places.
    """
    read = those_there(inputs)
    for place in (folder, *(folder / name for name in names)):
        if reason := _why_not(place, place == folder or not place.suffix, read):
            raise PlanError(f"{place} {reason}: choose another place with -o")
        for each in read if place != folder else ():
            above = (*Path(os.path.abspath(each)).parents, *each.resolve().parents)
            if any(same(place, one) for one in above):
                raise PlanError(f"{each} is what is read and lies in {place}: choose another place with -o")


def those_there(inputs: Inputs) -> list[Path]:
    """The files and folders among what is read, which also may be words."""
    return [Path(each) for each in inputs if each is not None and os.path.exists(each)]


def _why_not(path: Path, folder: bool, inputs: list[Path]) -> str | None:
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


def why_no_file(path: Path, inputs: list[Path], endings: tuple[str, ...], over_plan: bool) -> str | None:
    """The reason not to write a file to `path`; None where there is none. In a folder that is read only a plan may
    stand: no reader takes it for a part of a rig."""
    if endings and path.suffix.lower() not in endings:
        return f"ends in none of {' '.join(endings)}"
    if holds_plan(path):
        return None if over_plan else HOLDS_A_PLAN
    if (path.exists() or path.suffix.lower() != ".json") and any(same(path.parent, each) for each in inputs):
        return f"lies in {path.parent}, which is read"
    return None


def holds_plan(path: Path) -> bool:
    """Whether a file is a plan, even one that no longer can be read as such."""
    try:
        return path.is_file() and msgspec.json.decode(path.read_bytes(), type=dict[str, msgspec.Raw]).keys() >= PARTS
    except (OSError, msgspec.DecodeError, UnicodeDecodeError, RecursionError):
        return False


def same(one: Path, other: Path) -> bool:
    """Whether two paths lead to the same place."""
    try:
        return one.samefile(other)
    except OSError:
        return False
