"""What is being made, who makes it, and what is done with what a killed process left.

Whatever is made stands in the folder of its place under a name that nobody else gives (`.capture-plan-` and 16 hex
digits), and its maker holds a lock on it, which ends with the process. Whoever writes there next takes what nobody
holds: a file is removed; a folder with a list of moves is a set that was cut off in the middle, and what stood before
is put back. The list has digests of both, and only what still is what was moved there is touched: what a person wrote
since stays, and what stood before is then kept as `~`.
"""

import hashlib
import json
import os
import re
import secrets
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from itertools import count
from pathlib import Path

from capture_plan.progress import tell

try:
    import fcntl
except ImportError:  # Windows: an open file cannot be removed there, and nothing is swept
    fcntl = None

OURS = ".capture-plan-"
MADE = re.compile(re.escape(OURS) + "[0-9a-f]{16}")
MOVES, OLD, NEW = "moves.json", "old", "new"
_FILE = os.O_RDWR | os.O_CREAT | os.O_EXCL | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_BINARY", 0)
_LOOK = os.O_RDONLY | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0)
Stood = dict[str, tuple[str | None, str | None]]  # digests of what stood at a place and of what is moved there


def is_being_made(path: Path) -> bool:
    """Whether a place lies in a set that is being made."""
    return any(MADE.fullmatch(part) for part in path.parts)


def new_file(folder: Path) -> tuple[Path, int, int | None]:
    """A new file in `folder`, open for writing, and the lock on it; no link is followed."""
    while True:
        path = folder / f"{OURS}{secrets.token_hex(8)}"
        handle = os.open(path, _FILE, 0o666)
        lock = os.dup(handle) if fcntl else None
        if lock is None or holds(path, lock):
            return path, handle, lock
        release(lock)
        os.close(handle)


def new_folder(folder: Path) -> tuple[Path, int | None]:
    """A new folder in `folder`, and the lock on it."""
    while True:
        path = folder / f"{OURS}{secrets.token_hex(8)}"
        os.mkdir(path)
        lock = os.open(path, _LOOK) if fcntl else None
        if lock is None or holds(path, lock):
            return path, lock
        release(lock)


def holds(path: Path, lock: int) -> bool:
    """Hold a lock on what was just made; False where a sweep was faster. True where the file system knows no locks."""
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)  # pyright: ignore[reportOptionalMemberAccess]
        return os.path.samestat(os.stat(path), os.fstat(lock))
    except (BlockingIOError, FileNotFoundError):
        return False
    except OSError:
        return True


@contextmanager
def alone_in(folder: Path) -> Iterator[None]:
    """Let nobody else move a set into `folder` meanwhile."""
    lock = os.open(folder, os.O_RDONLY) if fcntl else None
    try:
        if lock is not None:
            wait_for(lock, folder)
        yield
    finally:
        release(lock)


def wait_for(lock: int, folder: Path) -> None:
    """Hold a lock on a folder, and say so where somebody else does; without one where the file system knows none."""
    with suppress(OSError):
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)  # pyright: ignore[reportOptionalMemberAccess]
        except BlockingIOError:
            tell([f"{folder} is being written to by another command: waiting for its end"])
            fcntl.flock(lock, fcntl.LOCK_EX)  # pyright: ignore[reportOptionalMemberAccess]


def release(lock: int | None) -> None:
    """End a lock on a folder."""
    if lock is not None:
        os.close(lock)


def sweep(folder: Path) -> None:
    """Take away what was being made in `folder` by processes that are no more."""
    for left in sorted(each for each in folder.glob(f"{OURS}*") if MADE.fullmatch(each.name)) if fcntl else ():
        with suppress(OSError):
            lock = os.open(left, _LOOK)
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)  # pyright: ignore[reportOptionalMemberAccess]
                undo(left) if left.is_dir() else os.unlink(left)
            finally:
                os.close(lock)


def undo(made: Path) -> None:
    """Put back what stood where a set was being moved to, and remove the folder that it was made in."""
    if (made / MOVES).exists():
        put_back(made, moves_of(made))
    shutil.rmtree(made)


def moves_of(made: Path) -> Stood:
    """The list of moves in a folder. None of it is believed where it is no such list or leads out of the folder: it may
    have come from outside with what lies beside it."""
    try:
        stood = json.loads((made / MOVES).read_bytes())
        found = {name: (before, now) for name, (before, now) in stood.items()}
    except (OSError, ValueError, RecursionError, TypeError, AttributeError):
        return {}
    known = all(isinstance(each, str | None) for both in found.values() for each in both)
    return found if known and all(stays_in(made.parent, name) for name in found) else {}


def stays_in(folder: Path, name: str) -> bool:
    """Whether a name leads to a place in `folder`, by no link."""
    path = Path(name)
    if path.is_absolute() or path.drive or ".." in path.parts:
        return False
    return not any((folder / step).is_symlink() for step in path.parents[:-1])


def put_back(made: Path, stood: Stood) -> None:
    """Undo moves out of `made`, as often as it is asked."""
    for name, (before, moved) in stood.items():
        place, old = made.parent / name, made / OLD / name
        there, retained = digest_of(place), digest_of(old)
        mine = there is not None and there == moved
        if before is not None and retained == before and there != before:
            os.replace(old, place if mine or not os.path.lexists(place) else _better_of(place))
        elif before is None and mine:
            os.unlink(place)
    with suppress(FileNotFoundError):
        os.unlink(made / MOVES)


def _better_of(path: Path) -> Path:
    """A free name for what stood at a place before: its own and `~`, else `~2` and so on."""
    names = (path.with_name(f"{path.name}~{n if n > 1 else ''}") for n in count(1))
    return next(each for each in names if not os.path.lexists(each))


def digest_of(path: Path) -> str | None:
    """SHA-256 of a plain file; None where there is none, or a link."""
    if path.is_symlink() or not path.is_file():
        return None
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
