"""A small whole head, take, settings, rules and cameras in every format that is read, for damage to start from."""

import base64
import json
import struct
import zipfile
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from capture_plan.camera import look_at
from capture_plan.mesh.decimate import decimate
from capture_plan.reader.read import read_raw, rig_from_raw
from capture_plan.rig import Rig
from tests.face_heads import cut, sample_head, visible_skin
from tests.fbx_files import HEAD, MESH, channel, deformer, mesh, model, scene
from tests.formats.test_gltf import Writer, primitive

NAMES = ("jawOpen", "browInnerUp", "mouthSmileLeft", "mouthSmileRight", "eyeBlinkLeft", "eyeBlinkRight", "mouthPucker")
CAMERA = '[[cameras]]\nname = "{}"\nwidth = 1536\nheight = 2048\nfx = 2100.0\nfy = 2100.0\n'
POSE = "position = [{}, 740.0, 500.0]\nlook_at = [0.0, 690.0, 140.0]\n"


@cache
def small() -> dict[str, Any]:
    """The skin of the bundled head in few vertices: arrays as an NPZ rig has them."""
    head = sample_head()
    head = cut(head, visible_skin(head) & (head.neutral[:, 1] > 630))
    retained, triangles = decimate(head.neutral, head.triangles, 600)
    rows = [head.names.index(name) for name in NAMES]
    names, deltas = np.array(NAMES), head.deltas[rows][:, retained]
    return {"vertices": head.neutral[retained], "faces": triangles, "deltas": deltas, "names": names, "units": "mm"}


@cache
def small_rig(folder: Path) -> Rig:
    """It as a rig, written into `folder`."""
    np.savez(folder / "small.npz", **small())
    return rig_from_raw(read_raw(folder / "small.npz"))


def shapes() -> dict[str, np.ndarray]:
    """Vertices of the neutral and of each blendshape, as folders of meshes have them."""
    x = small()["vertices"]
    return {"neutral": x} | {name: x + d for name, d in zip(NAMES[:4], small()["deltas"], strict=False)}


def obj_folder(path: Path, unit_mm: float = 1.0) -> None:
    """OBJ files."""
    path.mkdir()
    faces = "".join(f"f {a}/1/1 {b}//2 {c}\n" for a, b, c in small()["faces"] + 1)
    for name, x in shapes().items():
        (path / f"{name}.obj").write_text(
            "o head\n" + "".join("v {:.5f} {:.5f} {:.5f}\n".format(*p) for p in x / unit_mm) + faces
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
    """MakeHuman's files, in decimetres."""
    path.mkdir()
    obj_folder(path / "all", unit_mm=100.0)
    (path / "all" / "neutral.obj").rename(path / "base.obj")
    for file in (path / "all").iterdir():
        file.unlink()
    for name, d in zip(NAMES[:4], small()["deltas"], strict=False):
        rows = [(i, *d[i] / 100) for i in np.flatnonzero(d.any(axis=1))]
        (path / "all" / f"{name}.target").write_text("".join("{} {:.5f} {:.5f} {:.5f}\n".format(*row) for row in rows))


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
    return scene(body, deformer(20, MESH), *channels, UnitScaleFactor=1.0, UpAxis=1, FrontAxis=2, CoordAxis=0)


def usd(path: Path) -> None:
    """A stage of one mesh with blendshapes; USDZ is a package of it."""
    from tests.formats.test_usd import add_mesh, bind, new_stage

    head = small()
    inner = path.with_suffix(".usdc") if path.suffix == ".usdz" else path
    stage = new_stage(inner)
    moved = [np.flatnonzero(d.any(axis=1)) for d in head["deltas"][:4]]
    found = {n: (d[i] / 10, i) for n, d, i in zip(NAMES, head["deltas"], moved, strict=False)}
    bind(add_mesh(stage, "head", head["vertices"] / 10, head["faces"]), found)
    stage.Save()
    if inner != path:
        from pxr import UsdUtils

        UsdUtils.CreateNewUsdzPackage(str(inner), str(path))  # pyright: ignore[reportAttributeAccessIssue]


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
        'together = [["jawOpen", "browInnerUp"]]\n[session]\nminutes = 60\n[landmarks]\nepsilon = 0.5\n'
        "spacing_mm = 8.0\nnoise_mm = 1.0\nmin_visibility = 0.0\nrounds = 2\ndot_mm = 3.0\npins = [20]\n"
        "forbidden = [5, 7]\nsymmetric = true\n[landmarks.caps]\nnose = 3\n[landmarks.keep_out]\n"
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


def calibration_toml(path: Path) -> None:
    """The same two as a calibration program writes them, in metres."""
    lines = []
    for x in (-100, 100):
        eye, target = np.array([x, 740.0, 500.0]), np.array([0.0, 690.0, 140.0])
        turn = look_at(eye, target)
        lines += [
            f"[c{x}]",
            "size = [1536.0, 2048.0]",
            "matrix = [[2100.0, 0.0, 767.5], [0.0, 2100.0, 1023.5], [0.0, 0.0, 1.0]]",
            "distortions = [0.0, 0.0, 0.0, 0.0]",
            f"rotation = {Rotation.from_matrix(turn).as_rotvec().tolist()}",
            f"translation = {(-turn @ eye / 1000).tolist()}",
            "fisheye = false",
        ]
    path.write_text("\n".join([*lines, "[metadata]", "error = 0.0", ""]))
