"""What can be computed again, kept on disk under a name made from everything it depends on.

Key      SHA-256 over the bytes of whatever went in: text, bytes, and arrays with their type and shape
File     <user cache>/capture-plan/<shelf>/<key>.npz, the user cache being $XDG_CACHE_HOME where that is set

A shelf holds its newest entries. A broken entry is computed again; deleting the folder is always safe.
"""

import hashlib
import os
import sys
import zipfile
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


def cache_dir() -> Path:
    """Where this user's programs keep what they can compute again."""
    if chosen := os.environ.get("XDG_CACHE_HOME"):
        return Path(chosen) / "capture-plan"
    home = {"darwin": "Library/Caches", "win32": "AppData/Local"}.get(sys.platform, ".cache")
    return Path.home() / home / "capture-plan"


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
    path = cache_dir() / shelf / f"{name}.npz"
    with (
        suppress(OSError, ValueError, EOFError, KeyError, zipfile.BadZipFile),
        np.load(path, allow_pickle=False) as file,
    ):
        answer = {key: file[key] for key in file.files}
        path.touch()  # the newest entries stay
        return answer
    answer = compute()
    with suppress(OSError, PlanError):  # a cache that cannot be written costs time, not the answer
        _store(path, answer, entries)
    return answer


def _store(path: Path, answer: Arrays, entries: int) -> None:
    """Write the entry whole or not at all, then drop the oldest beyond `entries`."""
    with whole_file(path, durable=False) as file:
        np.savez(file, allow_pickle=False, **answer)
    kept = sorted(path.parent.glob("*.npz"), key=lambda entry: entry.stat().st_mtime_ns, reverse=True)
    for entry in kept[entries:]:
        entry.unlink(missing_ok=True)
