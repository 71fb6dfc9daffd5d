"""One file, whole or not at all.

It is made in the folder of its place under a name that nobody can guess, flushed to disk, renamed, and the folder
flushed: at any moment there is the old file or the new one.
"""

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from itertools import count
from pathlib import Path
from typing import BinaryIO

from capture_plan.errors import PlanError
from capture_plan.output.leavings import alone_in, is_being_made, new_file, release, sweep


def write_whole(path: Path, content: bytes) -> None:
    """Write `content` to `path`, in place of what stands there.

    Raises:
        PlanError: the place cannot be written; what stood there still does.
    """
    with whole_file(path) as file:
        file.write(content)


@contextmanager
def whole_file(path: Path, *, durable: bool = True) -> Iterator[BinaryIO]:
    """A file to write into that stands at `path` once the block ends well; flushed to disk where it must be `durable`.

    Raises:
        PlanError: the place cannot be written; what stood there still does.
    """
    durable = durable and not is_being_made(path)  # a set is flushed as one
    with in_one_line(path), folder_of(path) as folder:
        part, handle, lock = new_file(folder)
        try:
            with os.fdopen(handle, "w+b") as file:
                yield file
                file.flush()
                if durable:
                    os.fsync(handle)
            os.replace(part, path)
        except BaseException:
            with suppress(OSError):
                os.unlink(part)
            raise
        finally:
            release(lock)
        if durable:
            flush_folder(folder)


@contextmanager
def in_one_line(path: Path) -> Iterator[None]:
    """Say in one line what the system refuses.

    Raises:
        PlanError: whatever the system said of `path`.
    """
    try:
        yield
    except OSError as error:
        said = error.strerror or type(error).__name__
        raise PlanError(f"{path} cannot be written ({said}): choose another place with -o") from None


@contextmanager
def folder_of(path: Path) -> Iterator[Path]:
    """The folder of `path`, made where it is missing and taken away again where nothing comes of it; swept of what
    processes left there that are no more."""
    missing = [folder for folder in path.parents if not folder.exists()]
    try:
        os.makedirs(path.parent, exist_ok=True)
        sweep(path.parent)
        yield path.parent
    except BaseException:
        for folder in missing:
            with suppress(OSError):
                os.rmdir(folder)
        raise


def replace_whole(path: Path, content: bytes) -> list[str]:
    """Write `content` to `path` and keep another one that stands there, which nobody replaces meanwhile. Returns what
    to say of that.

    Raises:
        PlanError: the place cannot be written; what stood there still does.
    """
    with in_one_line(path), folder_of(path) as folder, alone_in(folder):
        retained = keeping(path) if path.exists() and path.read_bytes() != content else {}
        for place, old in retained.items():
            write_whole(place, old.read_bytes())
        write_whole(path, content)
        return [f"kept {old} as {place}" for place, old in retained.items()]


def keeping(path: Path) -> dict[Path, Path]:
    """Where to keep what stands at `path`: under its name and `~`. What was kept there before goes on as `~2`, `~3` and
    so on, the first that is free. Each new place with the old one, in the order to copy; none where it is kept."""
    last = path.with_name(f"{path.name}~")
    if _alike(last, path):
        return {}
    if not os.path.lexists(last):
        return {last: path}
    further = next(each for n in count(2) if _alike(each := Path(f"{last}{n}"), last) or not os.path.lexists(each))
    return {last: path} if further.exists() else {further: last, last: path}


def _alike(one: Path, other: Path) -> bool:
    """Whether two files are there and hold the same."""
    return one.is_file() and other.is_file() and one.read_bytes() == other.read_bytes()


def flush_folder(folder: Path) -> None:
    """Flush the names in a folder to disk, where the system knows how to."""
    with suppress(OSError):
        flush(folder)


def flush(path: Path) -> None:
    """Flush a file, or the names in a folder, to disk."""
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
