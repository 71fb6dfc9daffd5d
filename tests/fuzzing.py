"""Damaged files of every format, and what the whole tool makes of them: a valid result, or one of our errors.

Seeds     a small whole head, take, settings, rules, cameras and plan in every format that is read (`SEEDS`)
Damage    by structure: numbers out of range, words gone, doubled or out of place, parts of a document of other kinds,
          arrays of other shapes and types; and by bytes: cut off, changed, mostly near the start where sizes stand
Through   reading, `check_rig`, the audit and a plan of cheap settings; a take drives the head, a plan is checked, edited
Damage number n of a format is the same on every machine.
"""

import json
import random
import re
import struct
import zipfile
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from capture_plan.errors import CapturePlanError
from capture_plan.expressions.settings import Edits, PackingSettings
from capture_plan.layout.settings import LayoutSettings
from capture_plan.mesh.decimate import decimate
from capture_plan.plan.check import check_plan
from capture_plan.plan.files import plan_bytes, read_plan, read_settings, rig_of
from capture_plan.plan.make import make_plan
from capture_plan.plan.revise import edited_plan
from capture_plan.plan.settings import Settings
from capture_plan.rig import Rig
from capture_plan.rig.audit import audit
from capture_plan.rig.read import read_raw, rig_from_raw
from capture_plan.rig.sequence import read_sequence
from tests.face_heads import cut, sample_head, visible_skin
from tests.fbx_files import HEAD, MESH, ascii_text, binary, channel, deformer, mesh, model, scene
from tests.test_gltf import Writer, primitive

NAMES = ("jawOpen", "browInnerUp", "mouthSmileLeft", "mouthSmileRight", "eyeBlinkLeft", "eyeBlinkRight", "mouthPucker")
CHEAP = PackingSettings(method="greedy")
METHODS = ("cover", "distance", "adaptive")
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
CAMERA = '[[cameras]]\nname = "{}"\nwidth = 1536\nheight = 2048\nfx = 2100.0\nfy = 2100.0\n'
POSE = "position = [{}, 740.0, 500.0]\nlook_at = [0.0, 690.0, 140.0]\n"


@cache
def small() -> dict[str, Any]:
    """The skin of the bundled head in few vertices: arrays as an NPZ rig has them."""
    head = sample_head()
    head = cut(head, visible_skin(head) & (head.neutral[:, 1] > 630))
    kept, triangles = decimate(head.neutral, head.triangles, 600)
    rows = [head.names.index(name) for name in NAMES]
    names, deltas = np.array(NAMES), head.deltas[rows][:, kept]
    return {"vertices": head.neutral[kept], "faces": triangles, "deltas": deltas, "names": names, "units": "mm"}


@cache
def small_rig(folder: Path) -> Rig:
    """It as a rig, written into `folder`."""
    np.savez(folder / "small.npz", **small())
    return rig_from_raw(read_raw(folder / "small.npz"))


# ------------------------------------------------------------------------------------------------------------- seeds
def shapes() -> dict[str, np.ndarray]:
    """Vertices of the neutral and of each blendshape, as folders of meshes have them."""
    x = small()["vertices"]
    return {"neutral": x} | {name: x + d for name, d in zip(NAMES[:4], small()["deltas"], strict=False)}


def obj_folder(path: Path) -> None:
    """OBJ files."""
    path.mkdir()
    faces = "".join(f"f {a}/1/1 {b}//2 {c}\n" for a, b, c in small()["faces"] + 1)
    for name, x in shapes().items():
        (path / f"{name}.obj").write_text(
            "o head\n" + "".join("v {:.3f} {:.3f} {:.3f}\n".format(*p) for p in x) + faces
        )


def ply_folder(path: Path, *, text: bool = False) -> None:
    """PLY files, binary or text."""
    path.mkdir()
    faces = np.hstack([np.full((len(small()["faces"]), 1), 3), small()["faces"]]).astype("<i4")
    for name, x in shapes().items():
        top = f"ply\nformat {'ascii' if text else 'binary_little_endian'} 1.0\nelement vertex {len(x)}\n"
        top += "property float x\nproperty float y\nproperty float z\n"
        top += f"element face {len(faces)}\nproperty list int int vertex_indices\nend_header\n"
        rows = "\n".join(" ".join(map(str, row)) for table in (x.round(3), faces) for row in table.tolist())
        body = rows.encode() if text else x.astype("<f4").tobytes() + faces.tobytes()
        (path / f"{name}.ply").write_bytes(top.encode() + body)


def csv_folder(path: Path) -> None:
    """Tables of numbers."""
    path.mkdir()
    for name, x in shapes().items():
        (path / f"{name}.csv").write_text("x,y,z\n" + "".join("{:.3f},{:.3f},{:.3f}\n".format(*p) for p in x))
    (path / "faces.csv").write_text("".join("{},{},{}\n".format(*f) for f in small()["faces"]))


def target_folder(path: Path) -> None:
    """MakeHuman's files."""
    path.mkdir()
    obj_folder(path / "all")
    (path / "all" / "neutral.obj").rename(path / "base.obj")
    for file in (path / "all").iterdir():
        file.unlink()
    for name, d in zip(NAMES[:4], small()["deltas"], strict=False):
        rows = [(i, *d[i] / 100) for i in np.flatnonzero(d.any(axis=1))]
        (path / "all" / f"{name}.target").write_text("".join("{} {:.4f} {:.4f} {:.4f}\n".format(*row) for row in rows))


def zip_of(path: Path) -> None:
    """A folder of OBJ files in an archive."""
    obj_folder(path.with_suffix(".folder"))
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for file in sorted(path.with_suffix(".folder").iterdir()):
            archive.write(file, f"rig/{file.name}")


def gltf(path: Path) -> None:
    """GLB, or glTF with its buffer inside; an avatar's expressions in a VRM."""
    writer, head = Writer(), small()
    corners = head["faces"].astype(np.uint16).ravel()
    deltas = [(d / 1000).astype(np.float32) for d in head["deltas"][:4]]
    parts = [primitive(writer, (head["vertices"] / 1000).astype(np.float32), corners, deltas, path.suffix == ".vrm")]
    writer.mesh(parts, list(NAMES[:4]), name="head")
    if path.suffix == ".vrm":
        binds = [{"mesh": 0, "index": 0, "weight": 100}]
        groups = [{"name": "A", "presetName": "a", "binds": binds}]
        writer.document["extensions"] = {"VRM": {"blendShapeMaster": {"blendShapeGroups": groups}}}
    writer.glb(path)
    if path.suffix == ".gltf":
        import base64

        data, document = path.read_bytes(), writer.document
        length = struct.unpack_from("<I", data, 12)[0]
        address = "data:application/octet-stream;base64," + base64.b64encode(data[28 + length :]).decode()
        document["buffers"][0] |= {"uri": address}
        path.write_text(json.dumps(document))


def fbx_tree() -> list[tuple]:
    """An FBX file's tree."""
    head, faces = small(), small()["faces"].copy()
    faces[:, 2] = ~faces[:, 2]
    body = [mesh(MESH, head["vertices"] / 10, faces.ravel()), model(HEAD, "head")], [(HEAD, 0), (MESH, HEAD)]
    channels = []
    for number, (name, d) in enumerate(zip(NAMES[:4], head["deltas"], strict=False)):
        moved = np.flatnonzero(d.any(axis=1))
        channels.append(channel(100 + 10 * number, f"shapes.{name}", [(moved, d[moved] / 10)]))
    return scene(body, deflect(), *channels, UnitScaleFactor=1.0, UpAxis=1, FrontAxis=2, CoordAxis=0)


def deflect() -> tuple:
    """The deformer of all channels."""
    return deformer(20, MESH)


def usd(path: Path) -> None:
    """A stage of one mesh with blendshapes; USDZ is a package of it."""
    from tests.test_usd import add_mesh, bind, new_stage

    head = small()
    inner = path.with_suffix(".usdc") if path.suffix == ".usdz" else path
    stage = new_stage(inner)
    moved = [np.flatnonzero(d.any(axis=1)) for d in head["deltas"][:4]]
    found = {n: (d[i] / 10, i) for n, d, i in zip(NAMES, head["deltas"], moved, strict=False)}
    bind(add_mesh(stage, "head", head["vertices"] / 10, head["faces"]), found)
    stage.Save()
    if inner != path:
        from pxr import UsdUtils

        UsdUtils.CreateNewUsdzPackage(str(inner), str(path))


def weights() -> np.ndarray:
    """A take of three blendshapes."""
    t = np.arange(40)[:, None]
    return (0.5 - 0.5 * np.cos(t * [0.3, 0.4, 0.5])).round(3)


def csv_take(path: Path) -> None:
    """A table of weights."""
    rows = "".join(f"{i},{i / 30:.3f},{','.join(map(str, row))}\n" for i, row in enumerate(weights().tolist()))
    path.write_text(f"frame,time,{','.join(NAMES[:3])}\n{rows}")


def json_take(path: Path) -> None:
    """Frames of named weights."""
    frames = [
        {"time": i / 30, "blendShapes": dict(zip(NAMES, row, strict=False))} for i, row in enumerate(weights().tolist())
    ]
    path.write_text(json.dumps({"fps": 30, "frames": frames}))


def npz_take(path: Path) -> None:
    """Weights, names and a rate as arrays."""
    np.savez(path, weights=weights(), names=np.array(NAMES[:3]), fps=30)


def settings_toml(path: Path) -> None:
    """Settings that people set."""
    path.write_text(
        "[expressions]\nmu = 0.3\npaired = true\nlimit = 9\nmost_things = 5\n[expressions.edits]\n"
        'together = [["jawOpen", "browInnerUp"]]\n[session]\nminutes = 60\n[landmarks]\nepsilon = 0.5\nspacing_mm = 8.0\n'
        "noise_mm = 1.0\nmin_visibility = 0.0\nrounds = 2\ndot_mm = 3.0\npins = [20]\nforbidden = [5, 7]\n"
        "symmetric = true\n[landmarks.caps]\nnose = 3\n[landmarks.keep_out]\n"
        '"wet lip" = 1.0\n'
    )


def rules_toml(path: Path) -> None:
    """A rule file."""
    path.write_text(
        'most_things = 4\nhard = [{ names = ["jawOpen", "mouthPucker"], cost = 2 }]\n[same_side]\n'
        'mouthSmile = ["mouthPucker", "cheekPuff"]\n[any_side]\njawOpen = ["mouthPucker"]\n'
    )


def cameras_toml(path: Path) -> None:
    """Two cameras."""
    path.write_text("".join(CAMERA.format(f"c{x}") + POSE.format(x) for x in (-100, 100)))


def plan_json(path: Path) -> None:
    """A plan of the small head beside it."""
    rig = small_rig(path.parent)
    from capture_plan.plan.files import refer_to

    path.write_bytes(
        plan_bytes(make_plan(rig, cheap("cover"), reference=refer_to(rig, str(path.parent / "small.npz"), path)))
    )


# ------------------------------------------------------------------------------------------------------------ damage
def bytes_of(data: bytes, rng: random.Random) -> bytes:
    """Cut off, or with some bytes changed, most of them near the start where sizes are declared."""
    found = bytearray(data)
    if rng.random() < 0.2:
        return bytes(found[: rng.randrange(len(found) + 1)])
    for _ in range(rng.randint(1, 30)):
        reach = len(found) if rng.random() < 0.5 else min(len(found), 2000)
        if reach:
            at = rng.randrange(reach)
            found[at : at + 1] = rng.choice((bytes([rng.randrange(256)]), rng.choice(SPARKS)))
    return bytes(found)


def text_of(data: bytes, rng: random.Random) -> bytes:
    """Words and numbers that became others, are gone or stand twice; lines out of place."""
    if rng.random() < 0.25:
        lines = data.split(b"\n")
        i, j = rng.randrange(len(lines)), rng.randrange(len(lines))
        lines[i : i + rng.choice((0, 1, 1, 50))] = rng.choice(([], [lines[j]], [lines[i]] * 2, lines[j : j + 50]))
        return b"\n".join(lines)
    words = list(TOKEN.finditer(data, 0, len(data) if rng.random() < 0.7 else 3000))
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
    import io

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

    tree = msgspec_free(tree)
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


def msgspec_free(tree: list[tuple]) -> list[tuple]:
    """A copy of the lists of a tree."""
    return [(name, values, msgspec_free(inner)) for name, values, inner in tree]


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


Damage = Callable[[bytes, random.Random], bytes]
STRUCTURED: dict[str, Damage] = {
    **dict.fromkeys((".obj", ".ply", ".csv", ".target", ".usda", ".toml"), text_of),
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
    data = victim.read_bytes()
    change = STRUCTURED.get(victim.suffix)
    if victim.suffix == ".ply" and b"binary" in data[:40]:
        top = data.index(b"end_header\n") + 11
        numbers = rng.random() < 0.5
        body = array_of(np.frombuffer(data[top:], "<f4"), rng).astype("<f4").tobytes() if numbers else data[top:]
        victim.write_bytes((data[:top] if numbers else text_of(data[:top], rng)) + body)
        return
    victim.write_bytes(change(data, rng) if change and rng.random() < 0.75 else bytes_of(data, rng))


# ----------------------------------------------------------------------------------------------------------- through
def cheap(method: str, **landmarks: Any) -> Settings:
    """Settings whose plan takes a fraction of a second."""
    layout = LayoutSettings(method=method, min_visibility=0.0, noise_mm=1.0, **landmarks)  # pyright: ignore
    return Settings(landmarks=layout, expressions=CHEAP)


def check_rig(rig: Rig) -> None:
    """AssertionError unless all of a rig is what `Rig` says."""
    v, k = len(rig.neutral), len(rig.names)
    assert rig.neutral.shape == (v, 3) and rig.deltas.shape == (k, v, 3) and rig.triangles.shape[1] == 3
    assert np.isfinite(rig.neutral).all() and np.isfinite(rig.deltas).all() and np.isfinite(rig.displacement).all()
    assert 0 <= rig.triangles.min() <= rig.triangles.max() < v
    assert rig.skin.dtype == bool and rig.skin.any() and len(rig.skin) == len(rig.source_index) == len(rig.parts) == v
    assert 0 <= rig.parts.min() <= rig.parts.max() < len(rig.part_names) and rig.source_index.min() >= 0
    assert len(set(rig.names)) == k > 0 and all(name.isprintable() for name in (*rig.names, *rig.part_names, rig.note))
    assert np.isfinite(rig.unit_mm) and rig.unit_mm > 0 and np.isfinite(rig.turn).all()


def through_rig(path: Path, n: int) -> None:
    """A rig becomes a plan that can be written and read."""
    rig = rig_from_raw(read_raw(path))
    check_rig(rig)
    assert audit(rig).used is not None
    plan = make_plan(rig, cheap(METHODS[n % len(METHODS)]))
    msgspec.json.decode(plan_bytes(plan), type=type(plan))


def through_take(path: Path, n: int) -> None:
    """A take drives the head, and a layout may follow it."""
    rig = small_rig(path.parent)
    take = read_sequence(path, rig=rig)
    assert np.isfinite(take.frames.block(0, min(len(take.frames), 50))).all() and take.fps > 0
    if n % 4 == 0:
        make_plan(rig, msgspec.structs.replace(cheap("motion", budget=3), sequences=(str(path),)))


def through_settings(path: Path, n: int) -> None:
    """Settings give a plan; how it is made stays cheap."""
    rig, found = small_rig(path.parent), read_settings(path)
    layout = msgspec.structs.replace(found.landmarks, method=METHODS[n % len(METHODS)], number=None)
    expressions = msgspec.structs.replace(found.expressions, method="greedy")
    make_plan(rig, msgspec.structs.replace(found, landmarks=layout, expressions=expressions), folder=path.parent)


def through_rules(path: Path, n: int) -> None:
    """A rule file gives a plan."""
    expressions = msgspec.structs.replace(CHEAP, rules=str(path))
    make_plan(small_rig(path.parent), msgspec.structs.replace(cheap("cover"), expressions=expressions))


def through_cameras(path: Path, n: int) -> None:
    """Cameras give a plan."""
    make_plan(small_rig(path.parent), msgspec.structs.replace(cheap("cover"), cameras=str(path)))


def through_plan(path: Path, n: int) -> None:
    """A plan is checked, and edited."""
    plan = read_plan(path)
    rig = rig_of(plan, path)
    check_plan(plan, rig, folder=path.parent)
    if n % 3 == 0:
        edited_plan(plan, rig, Edits(dropped=NAMES[:1]), folder=path.parent)


Seed = tuple[str, Callable[[Path], Any], Callable[[Path, int], None]]
SEEDS: dict[str, Seed] = {
    "obj": ("rig", obj_folder, through_rig),
    "ply": ("rig", ply_folder, through_rig),
    "ply_text": ("rig", lambda path: ply_folder(path, text=True), through_rig),
    "csv": ("rig", csv_folder, through_rig),
    "target": ("rig", target_folder, through_rig),
    "zip": ("rig.zip", zip_of, through_rig),
    "npz": ("rig.npz", lambda path: np.savez(path, **small()), through_rig),
    "glb": ("rig.glb", gltf, through_rig),
    "gltf": ("rig.gltf", gltf, through_rig),
    "vrm": ("rig.vrm", gltf, through_rig),
    "fbx": ("rig.fbx", lambda path: path.write_bytes(binary(fbx_tree())), through_rig),
    "fbx_text": ("rig.fbx", lambda path: path.write_bytes(ascii_text(fbx_tree())), through_rig),
    "usda": ("rig.usda", usd, through_rig),
    "usdc": ("rig.usdc", usd, through_rig),
    "usdz": ("rig.usdz", usd, through_rig),
    "take_csv": ("take.csv", csv_take, through_take),
    "take_json": ("take.json", json_take, through_take),
    "take_npz": ("take.npz", npz_take, through_take),
    "settings": ("settings.toml", settings_toml, through_settings),
    "rules": ("rules.toml", rules_toml, through_rules),
    "cameras": ("cameras.toml", cameras_toml, through_cameras),
    "plan": ("plan.json", plan_json, through_plan),
}


def make_seed(kind: str, folder: Path) -> Path:
    """The whole input of a format, in an empty folder."""
    name, write, _ = SEEDS[kind]
    write(folder / name)
    return folder / name


def outcome(kind: str, path: Path, n: int) -> str:
    """'success', or the line of our error; any other error is the caller's."""
    try:
        SEEDS[kind][2](path, n)
    except CapturePlanError as error:
        said = str(error)
        assert said and len(said.splitlines()) == 1 and said.isprintable(), said
        return said
    return "success"
