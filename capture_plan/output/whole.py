"""One file, whole or not at all.

It is made in the folder of its place under a name that nobody can guess, flushed to disk, renamed, and the folder
flushed: at any moment there is the old file or the new one.
"""

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

from capture_plan.errors import PlanError
from capture_plan.output.leavings import is_being_made, new_file, release, sweep


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


def keep_old(path: Path, *, unless: bytes | None = None) -> Path | None:
    """Keep what stands at `path` under its name and `~`; returns where, None where nothing stands there or the same.

    Raises:
        PlanError: the place cannot be written.
    """
    with in_one_line(path):
        if not path.exists() or (unless is not None and path.read_bytes() == unless):
            return None
        old = path.with_name(f"{path.name}~")
        with whole_file(old) as copy, path.open("rb") as file:
            shutil.copyfileobj(file, copy)
        return old


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
