"""Damage to a file by its structure, or by bytes; the same for the same random numbers.

Structure  numbers out of range, words gone, doubled or out of place, parts of a document of other kinds, arrays of
           other shapes and types, nodes of a tree gone or renamed, files of a folder lost or exchanged
Bytes      cut off, or changed, mostly near the start where sizes stand
"""

import io
import json
import random
import re
import struct
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from tests.fbx_files import ascii_text, binary
from tests.fuzz_seeds import fbx_tree

SPARKS = (b"", b"\xff\xff\xff\xff", b"\0\0\0\0", b"{", b"}", b'"', b"-1", b"1e999", b"nan", b"\n")
NUMBERS = ("0", "-1", "1e19", "1e300", "-1e-300", "nan", "inf", "4294967296", "9" * 400, "0.5", "3", "1e400")
WORDS = (
    "",
    "x",
    "mouthSmileLeft",
    "\x1b[31m",
    "=1+1",
    "\u0000",
    "名前",
    "a" * 2000,
    "neutral",
    "true",
    "[[",
    "#",
    '"',
    "-",
)
TOKEN = re.compile(rb"[-+]?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?|\w+|[^\w\s]|\n")
VALUES: tuple[Any, ...] = (
    None,
    True,
    0,
    -1,
    2**31,
    10**20,
    1e300,
    0.5,
    "",
    "x",
    [],
    {},
    [[]],
    [1, 2, 3],
    {"a": 1},
    [None],
)
DTYPES = ("f4", "f8", "i4", "u1", "i8", "U3", "S2", "?", "c8", "f2")


def bytes_of(data: bytes, rng: random.Random) -> bytes:
    """Cut off, or with some bytes changed, most of them near the start where sizes are declared."""
    found = bytearray(data)
    if rng.random() < 0.2:
        return bytes(found[: rng.randrange(len(found) + 1)])
    for _ in range(rng.choice((1, 1, 2, 5, 30))):
        extent = len(found) if rng.random() < 0.5 else min(len(found), 2000)
        if extent:
            at = rng.randrange(extent)
            spark = rng.choice(SPARKS)
            found[at : at + (len(spark) or 1)] = bytes([rng.randrange(256)]) if rng.random() < 0.5 else spark
    return bytes(found)


def text_of(data: bytes, rng: random.Random) -> bytes:
    """Words and numbers that became others, are gone or stand twice; lines out of place."""
    if rng.random() < 0.25:
        lines = data.split(b"\n")
        i, j = rng.randrange(len(lines)), rng.randrange(len(lines))
        lines[i : i + rng.choice((0, 1, 1, 50))] = rng.choice(([], [lines[j]], [lines[i]] * 2, lines[j : j + 50]))
        return b"\n".join(lines)
    words = list(TOKEN.finditer(data, 0, len(data) if rng.random() < 0.7 else 3000))
    if rng.random() < 0.6:
        words = [word for word in words if word[0][-1:].isdigit()]
    for word in sorted(rng.sample(words, min(len(words), rng.choice((1, 1, 2, 5, 40)))), key=lambda w: -w.start()):
        number = word[0][-1:].isdigit()
        new = rng.choice(NUMBERS if number == (rng.random() < 0.9) else WORDS).encode()
        data = data[: word.start()] + rng.choice((new, new, new, b"", word[0] * 2)) + data[word.end() :]
    return data


def document_of(data: bytes, rng: random.Random) -> bytes:
    """A JSON document of which some parts are gone, double or of another kind."""
    document = json.loads(data)
    for _ in range(rng.choice((1, 1, 1, 2, 4))):
        at = document
        while True:
            keys = list(at) if isinstance(at, dict) else list(range(len(at)))
            if not keys:
                break
            key = rng.choice(keys)
            if isinstance(at[key], dict | list) and at[key] and rng.random() < 0.8:
                at = at[key]
                continue
            how = rng.random()
            if how < 0.2:
                del at[key]
            elif how < 0.35 and isinstance(at, list):
                at.insert(key, at[key])
            elif how < 0.6 and isinstance(at[key], int | float) and not isinstance(at[key], bool):
                at[key] = rng.choice((at[key] + 1, -at[key], at[key] * 1000, 10**9, 0))
            else:
                at[key] = json.loads(json.dumps(rng.choice((*VALUES, *WORDS))))
            break
    return json.dumps(document).encode()


def glb_of(data: bytes, rng: random.Random) -> bytes:
    """A GLB whose document or numbers changed."""
    length = struct.unpack_from("<I", data, 12)[0]
    text, numbers = data[20 : 20 + length], bytearray(data[28 + length :])
    if rng.random() < 0.7:
        text = document_of(text, rng)
        text += b" " * (-len(text) % 4)
    else:
        x = np.frombuffer(numbers, "<f4").copy()
        numbers = bytearray(array_of(x, rng).astype("<f4").tobytes())
    body = struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(numbers), 0x004E4942) + numbers
    return struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body


def array_of(x: np.ndarray, rng: random.Random) -> np.ndarray:
    """Numbers of which some are out of range, or all are scaled, sorted or zero."""
    x = x.astype(float).copy() if x.dtype.kind in "fiu" else x.copy()
    if x.size == 0 or x.dtype.kind != "f":
        return x
    flat, how = x.reshape(-1), rng.random()
    if how < 0.7:
        for _ in range(rng.choice((1, 1, 3, 30))):
            flat[rng.randrange(len(flat))] = float(rng.choice(NUMBERS))
    else:
        with np.errstate(all="ignore"):
            flat[:] = rng.choice((flat * 0, flat * 1e-30, flat * 1e20, np.sort(flat), flat[::-1], flat * np.nan))
    return x


def archive_of(data: bytes, rng: random.Random) -> bytes:
    """An NPZ archive in which an array is gone, or has another shape, type or other numbers."""
    with np.load(io.BytesIO(data)) as archive:
        arrays = {name: archive[name] for name in archive.files}
    for name in rng.sample(sorted(arrays), rng.choice((1, 1, 2))):
        x, how = arrays[name], rng.random()
        if how < 0.1:
            del arrays[name]
            continue
        if how < 0.3 and x.ndim:
            axis = rng.randrange(x.ndim)
            x = rng.choice((np.take(x, range(x.shape[axis] // 2), axis), x.T, x.reshape(-1), x[None], x[:0]))
        elif how < 0.45:
            with np.errstate(all="ignore"):
                x = x.astype(rng.choice(DTYPES)) if x.dtype.kind in "fiu" else x.astype("U1")
        elif x.dtype.kind == "U" and x.size:
            x = x.astype("U2000")
            x.reshape(-1)[rng.randrange(x.size)] = rng.choice(WORDS)
        else:
            x = (
                array_of(x, rng)
                if x.dtype.kind == "f" or rng.random() < 0.5
                else (x + rng.choice((-1, 1, 10**6))).astype("i8")
            )
        arrays[name] = x
    out = io.BytesIO()
    np.savez(out, **arrays)
    return out.getvalue()


def tree_of(tree: list[tuple], rng: random.Random) -> list[tuple]:
    """An FBX tree in which a node is gone, doubled, renamed or of other values."""

    def every(nodes: list[tuple]) -> list[tuple[list[tuple], int]]:
        return [p for i, (_, _, inner) in enumerate(nodes) for p in ((nodes, i), *every(inner))]

    tree = copied(tree)
    for _ in range(rng.choice((1, 1, 2, 4))):
        nodes, i = rng.choice(every(tree))
        name, values, inner = nodes[i]
        how = rng.random()
        if how < 0.15:
            del nodes[i]
        elif how < 0.3:
            nodes.insert(i, nodes[i])
        elif how < 0.4:
            nodes[i] = (rng.choice(("Vertices", "Indexes", "Geometry", "x")), values, inner)
        else:
            nodes[i] = (name, tuple(value_of(value, rng) for value in values), inner)
        if not tree:
            break
    return tree


def copied(tree: list[tuple]) -> list[tuple]:
    """A copy of the lists of a tree."""
    return [(name, values, copied(inner)) for name, values, inner in tree]


def value_of(value: Any, rng: random.Random) -> Any:
    """Another value of an FBX node."""
    if isinstance(value, np.ndarray):
        if value.dtype.kind == "i":
            changed = value.copy()
            changed[rng.randrange(len(value))] = rng.choice((-1, 0, 10**6, -(10**9), 2**31 - 1)) if len(value) else 0
            return rng.choice((changed, value[: len(value) // 2], value[::-1].copy()))
        return array_of(value, rng)
    if isinstance(value, str):
        return rng.choice((value, "", "Geometry::", "Mesh", "x" * 500))
    return rng.choice((value, 0, 1, -1, 10**12, 1e300)) if rng.random() < 0.5 else value


def members_of(data: bytes, rng: random.Random) -> bytes:
    """A ZIP archive in which one of the OBJ files is damaged, gone or elsewhere."""
    out = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(data)) as old, zipfile.ZipFile(out, "w") as new:
        victim = rng.choice(old.namelist())
        for name in old.namelist():
            if name != victim:
                new.writestr(name, old.read(name))
            elif rng.random() < 0.8:
                new.writestr(rng.choice((name, name, name, f"x/{name}", f"../{name}")), text_of(old.read(name), rng))
    return out.getvalue()


Damage = Callable[[bytes, random.Random], bytes]
STRUCTURED: dict[str, Damage] = {
    **dict.fromkeys((".obj", ".ply", ".csv", ".target", ".usda", ".toml"), text_of),
    **dict.fromkeys((".yml", ".yaml", ".xml", ".xcp", ".txt"), text_of),
    **dict.fromkeys((".gltf", ".json"), document_of), **dict.fromkeys((".glb", ".vrm"), glb_of), ".npz": archive_of,
}  # fmt: skip


def damage(path: Path, kind: str, rng: random.Random) -> None:
    """Damage the input at `path` in place."""
    if kind.startswith("fbx"):
        tree = tree_of(fbx_tree(), rng) if rng.random() < 0.7 else fbx_tree()
        data = ascii_text(tree) if kind == "fbx_text" else binary(tree, rng.choice((7400, 7500)))
        path.write_bytes(bytes_of(data, rng) if rng.random() < 0.3 else data)
        return
    files = sorted(file for file in path.rglob("*") if file.is_file()) if path.is_dir() else [path]
    victim, how = rng.choice(files), rng.random()
    if path.is_dir() and how < 0.1:
        other = rng.choice(files)
        rng.choice((victim.unlink, lambda: victim.write_bytes(b""), lambda: victim.replace(other)))()
        return
    if kind == "zip" and how < 0.7:
        path.write_bytes(members_of(path.read_bytes(), rng))
        return
    data = victim.read_bytes()
    change = STRUCTURED.get(victim.suffix)
    if victim.suffix == ".ply" and b"binary" in data[:40]:
        top = data.index(b"end_header\n") + 11
        numbers = rng.random() < 0.5
        body = array_of(np.frombuffer(data[top:], "<f4"), rng).astype("<f4").tobytes() if numbers else data[top:]
        victim.write_bytes((data[:top] if numbers else text_of(data[:top], rng)) + body)
        return
    victim.write_bytes(change(data, rng) if change and rng.random() < 0.75 else bytes_of(data, rng))
