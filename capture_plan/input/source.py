"""Where a reader's bytes come from: a file or folder on the disk, or one inside a zip archive, read in memory.

Both kinds have `name`, `stem`, `suffix`, `iterdir`, `is_dir`, `read_bytes`, `open`; a reader that uses no more than
these (and the functions below) reads archives without anything being unpacked to the disk.
"""

import zipfile
from collections.abc import Iterator
from pathlib import Path

from capture_plan.errors import RigError

Source = Path | zipfile.Path
DEEPEST = 8  # folders within folders
MOST_FILES = 20_000


def folder_name(folder: Source) -> str:
    """What a person calls a folder, also when it was given as '.'; of a whole archive its name without .zip."""
    if isinstance(folder, Path):
        return folder.resolve().name
    return Path(folder.name).stem if folder.at == "" else folder.name


def sibling(path: Source, name: str) -> Source:
    """The file of this name in the folder of `path`, or in one below it."""
    parent = path.parent
    assert isinstance(parent, Source)  # a member of an archive has a parent in it
    return parent / name


def is_kind(source: Source, suffix: str) -> bool:
    """Whether this is a file of a kind that a person would see (macOS leaves `._name.obj` files behind)."""
    return source.suffix.lower() == suffix and not source.name.startswith(".") and not source.is_dir()


def walk(folder: Source, depth: int = 0) -> Iterator[Source]:
    """All files below a folder, in the order of their names; links to folders are not followed."""
    if depth > DEEPEST:
        raise RigError(f"{folder.name} lies more than {DEEPEST} folders deep: give the folder that holds the rig")
    inside = sorted(folder.iterdir(), key=lambda source: source.name)
    if len(inside) > MOST_FILES:
        raise RigError(f"the folder {folder.name} holds {len(inside):,} files: give the folder that holds the rig")
    for source in inside:
        if source.name.startswith(".") or source.name == "__MACOSX":
            continue
        if not source.is_dir():
            yield source
        elif not (isinstance(source, Path) and source.is_symlink()):
            yield from walk(source, depth + 1)
