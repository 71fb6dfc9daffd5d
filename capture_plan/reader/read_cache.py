"""A rig that was read before, from the cache: parsing 150 MB of OBJ text takes seconds, hashing it a fraction of one.

Key    the bytes and names of all files that the reader may open, what the person gave, and the code that reads
Cached the arrays of the `Rig` and its other fields as text
Only rigs that lie in one file or in one folder of their own are kept: `.gltf` and `.usd` files point to others.
"""

import hashlib
import os
from collections.abc import Callable, Iterator
from dataclasses import fields
from pathlib import Path

import msgspec
import numpy as np

from capture_plan.cache import Arrays, cached, code_digest, digest
from capture_plan.input.bounds import MOST_BYTES, content
from capture_plan.input.source import walk
from capture_plan.rig.record import Rig
from capture_plan.rig.understood import Understood

ENTRIES = 8  # rigs; of 27,000 vertices and 57 blendshapes 20 MB each
WHOLE = (".npz", ".glb", ".vrm", ".fbx", ".zip", ".usdz")
PARTS = (".obj", ".ply", ".csv", ".target")
ROOMS = (
    "input",
    "mesh",
    "names",
    "rig",
    "visibility",
    "camera",
    "formats",
    "face",
    "reader",
)  # every room that reading asks


def remembered_rig(read: Callable[[], Rig], path: Path, given: tuple[float | str | None, ...]) -> Rig:
    """`read()`, or the rig that the same files gave before."""
    skin = given[-1]
    try:
        files = list(_files(path))
        named = [content(Path(skin))] if isinstance(skin, str) and os.path.isfile(skin) else []
    except OSError:
        return read()
    if not files:
        return read()
    inside = [part for file in files for part in file]
    name = digest([code_digest(*ROOMS), repr(given), path.resolve().name, *named, *inside])
    return _rig(cached(lambda: _arrays(read()), "rigs", name, entries=ENTRIES))


def _files(path: Path) -> Iterator[tuple[str, bytes]]:
    """Name and SHA-256 of every file of the rig; nothing where it may lie in other places too."""
    if path.is_file() and path.suffix.lower() in WHOLE:
        yield path.name, _sha256(path)
    elif path.is_dir():
        inside = [Path(str(file)) for file in walk(path) if file.suffix.lower() in PARTS]
        yield from ((file.relative_to(path).as_posix(), _sha256(file)) for file in inside)


def _sha256(path: Path) -> bytes:
    if not path.is_file() or path.stat().st_size > MOST_BYTES:
        raise OSError("no file that is read")
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").digest()


def everything_of(rig: Rig) -> list[str | np.ndarray]:
    """All that a rig is, its name and notes too, for the name of an answer about it."""
    return [part for name, values in sorted(_arrays(rig).items()) for part in (name, values)]


def _arrays(rig: Rig) -> Arrays:
    values = {field.name: getattr(rig, field.name) for field in fields(rig)}
    plain = {name: value for name, value in values.items() if not isinstance(value, np.ndarray)}
    arrays = {name: value for name, value in values.items() if isinstance(value, np.ndarray)}
    return arrays | {"plain": np.frombuffer(msgspec.json.encode(plain), dtype=np.uint8)}


def _rig(arrays: Arrays) -> Rig:
    plain = msgspec.json.decode(arrays["plain"].tobytes())
    plain["understood"] = msgspec.convert(plain["understood"], Understood | None)
    lists = {name: _tuples(value) for name, value in plain.items() if isinstance(value, list)}
    return Rig(**{name: value for name, value in arrays.items() if name != "plain"} | plain | lists)


def _tuples(values: list) -> tuple:
    return tuple(_tuples(value) if isinstance(value, list) else value for value in values)
