"""Visibility kept on disk under a name made from everything it depends on.

Key      SHA-256 over the kind of answer, the version below, and the bytes, type and shape of every array that went in
File     <user cache>/capture-plan/visibility/<key>.npy, the user cache being $XDG_CACHE_HOME where that is set

The folder holds the newest `ENTRIES` answers. A broken entry is computed again; deleting the folder is always safe.
"""

import hashlib
import os
import sys
import tempfile
from collections.abc import Callable
from contextlib import suppress
from importlib.metadata import version
from pathlib import Path

import numpy as np
from jaxtyping import Float

ENTRIES = 200  # about 40 MB for heads of 27,000 vertices
METHOD = "1"  # raise it when the same arrays would give other numbers


def cache_dir() -> Path:
    """Where this user's programs keep what they can compute again."""
    if chosen := os.environ.get("XDG_CACHE_HOME"):
        return Path(chosen) / "capture-plan" / "visibility"
    home = {"darwin": "Library/Caches", "win32": "AppData/Local"}.get(sys.platform, ".cache")
    return Path.home() / home / "capture-plan" / "visibility"


def key(kind: str, *arrays: np.ndarray) -> str:
    """The name of the answer of this kind to these arrays."""
    digest = hashlib.sha256(f"{METHOD} {version('embreex')} {kind}".encode())
    for array in arrays:
        digest.update(f"{array.dtype.str} {array.shape}".encode())
        digest.update(np.ascontiguousarray(array).data)
    return digest.hexdigest()


def cached(compute: Callable[[], np.ndarray], kind: str, *arrays: np.ndarray) -> Float[np.ndarray, " m"]:
    """`compute()`, or what it answered when it was last given the same arrays."""
    path = cache_dir() / f"{key(kind, *arrays)}.npy"
    with suppress(OSError, ValueError, EOFError), path.open("rb") as file:
        answer = np.lib.format.read_array(file, allow_pickle=False)
        path.touch()  # the newest entries stay
        return answer
    answer = compute()
    with suppress(OSError):  # a cache that cannot be written costs time, not the answer
        store(path, answer)
    return answer


def store(path: Path, answer: np.ndarray) -> None:
    """Write the entry whole or not at all, then drop the oldest beyond `ENTRIES`."""
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, temporary = tempfile.mkstemp(dir=path.parent, suffix=".part")
    try:
        with os.fdopen(handle, "wb") as file:
            np.save(file, answer)
        os.replace(temporary, path)
    except OSError:
        Path(temporary).unlink(missing_ok=True)
        raise
    entries = sorted(path.parent.glob("*.npy"), key=lambda entry: entry.stat().st_mtime_ns, reverse=True)
    for entry in entries[ENTRIES:]:
        entry.unlink(missing_ok=True)
