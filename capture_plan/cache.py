"""What can be computed again, cached on disk under a name made from everything it depends on.

Key      SHA-256 over the bytes of whatever went in: text, bytes, and arrays with their type and shape
File     <user cache>/capture-plan/<shelf>/<key>.npz, the user cache being $XDG_CACHE_HOME where that is set

A shelf holds its newest entries. An entry carries a digest of its name and of what it holds: one that is broken, or
was made for another question, is computed again, as is a link or a file of somebody else. Deleting the folder is always
safe. The folder is this user's alone: one of somebody else, or a link, is not used, since what others put there would
be believed.
"""

import hashlib
import os
import re
import stat
import struct
import sys
import tokenize
import zipfile
import zlib
from collections.abc import Callable, Iterable
from contextlib import suppress
from functools import cache
from pathlib import Path

import numpy as np

from capture_plan.errors import PlanError
from capture_plan.output import whole_file

Arrays = dict[str, np.ndarray]
PACKAGE = Path(__file__).parent
DECIDING = (".py", ".toml", ".json", ".npz")
NAMED = re.compile("[0-9a-f]{64}")  # an entry: a shelf may hold files of a person
SEAL = "seal"  # of an entry: no answer has an array of this name
NOT_ELSEWHERE = getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)
DAMAGE = (
    *(OSError, ValueError, EOFError, KeyError, TypeError, SyntaxError, RuntimeError, MemoryError),
    *(zipfile.BadZipFile, zlib.error, struct.error, tokenize.TokenError),
)  # what NumPy and zipfile raise on archives that are none


def cache_dir() -> Path:
    """Where this user's programs keep what they can compute again."""
    if chosen := os.environ.get("XDG_CACHE_HOME"):
        return Path(chosen) / "capture-plan"
    home = {"darwin": "Library/Caches", "win32": "AppData/Local"}.get(sys.platform, ".cache")
    return Path.home() / home / "capture-plan"


@cache
def is_private(folder: Path) -> bool:
    """Whether a folder, made where it is missing, is this user's alone; what is this user's is made so."""
    with suppress(OSError):
        os.makedirs(folder.parent, exist_ok=True)
        with suppress(FileExistsError):
            os.mkdir(folder, 0o700)
        if os.name != "posix":
            return True
        found = os.stat(folder, follow_symlinks=False)
        if not stat.S_ISDIR(found.st_mode) or found.st_uid != os.getuid():
            return False
        if found.st_mode & 0o077:
            os.chmod(folder, 0o700)
        return True
    return False


def digest(parts: Iterable[str | bytes | np.ndarray]) -> str:
    """The name of the answer to `parts`; equal parts in equal order give equal names."""
    total = hashlib.sha256()
    for part in parts:
        if isinstance(part, np.ndarray):
            total.update(f"{part.dtype.str} {part.shape}".encode())
            total.update(np.ascontiguousarray(part).data)
        else:
            content = part.encode() if isinstance(part, str) else part
            total.update(f"{len(content)} ".encode())
            total.update(content)
    return total.hexdigest()


@cache
def code_digest(*rooms: str) -> str:
    """Changes whenever code or data of these rooms of the package do; of all of it where none is named."""
    folders = [PACKAGE / room for room in rooms] or [PACKAGE]
    files = (file for folder in folders for file in sorted(folder.rglob("*")) if file.suffix in DECIDING)
    return digest(file.read_bytes() for file in files)


def cached(compute: Callable[[], Arrays], shelf: str, name: str, *, entries: int) -> Arrays:
    """`compute()`, or what it answered when it was last asked under this name; the shelf keeps the newest `entries`."""
    try:
        folder = cache_dir()
    except RuntimeError:  # a user without a home
        return compute()
    if not is_private(folder):
        return compute()
    path = folder / shelf / f"{name}.npz"
    if (found := _entry(path)) is not None:
        return found
    answer = compute()
    with suppress(OSError, PlanError):  # a cache that cannot be written costs time, not the answer
        _store(path, answer, entries)
    return answer


def _entry(path: Path) -> Arrays | None:
    """What stands at `path`, where it is this user's own whole answer to the question of that name."""
    with suppress(*DAMAGE):
        with os.fdopen(os.open(path, os.O_RDONLY | NOT_ELSEWHERE), "rb") as file:
            about = os.fstat(file.fileno())
            if not stat.S_ISREG(about.st_mode) or (os.name == "posix" and about.st_uid != os.getuid()):
                return None
            with np.load(file, allow_pickle=False) as archive:
                answer = {key: archive[key] for key in archive.files}
        if str(answer.pop(SEAL)) == _seal(path.stem, answer):
            path.touch()  # the newest entries stay
            return answer
    return None


def _seal(name: str, answer: Arrays) -> str:
    """A digest of an entry's name and of all that it holds."""
    return digest([name, *(part for key, values in sorted(answer.items()) for part in (key, values))])


def _store(path: Path, answer: Arrays, entries: int) -> None:
    """Write the entry whole or not at all, then drop the oldest beyond `entries`."""
    with whole_file(path, durable=False) as file:
        np.savez(file, allow_pickle=False, **answer, **{SEAL: np.array(_seal(path.stem, answer))})
    entries_there = [entry for entry in path.parent.glob("*.npz") if NAMED.fullmatch(entry.stem)]
    retained = sorted(entries_there, key=lambda entry: entry.stat().st_mtime_ns, reverse=True)
    for entry in retained[entries:]:
        entry.unlink(missing_ok=True)
