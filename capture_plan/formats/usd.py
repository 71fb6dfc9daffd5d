"""Rigs as USD (`.usd`, `.usda`, `.usdc`, `.usdz`): every mesh of the stage with the UsdSkel blendshapes bound to it.

The stage is opened by `usd_scene.py` in a process of its own, since a damaged file ends the process that opens it.
Mesh         points, faces, its transform stack (with joints: the skeleton's, and the pose when bound), subsets as parts
Hidden       invisible meshes, proxies and guides are left out and reported
Blendshape   offsets, of all points or of those in pointIndices; in-betweens are left out and reported
Unit, axes   metersPerUnit and upAxis; a face looks along +z where +y is up and along -y where +z is up, by habit

usd-core is an extra, `capture-plan[usd]`. Letters: v vertices, f triangles, p polygons, c corners of polygons.
"""

import importlib.util
import json
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Int

from capture_plan.errors import RigError
from capture_plan.formats.naming import left_on, listed, numbered, sentences
from capture_plan.formats.own_process import BrokenProcessError, arrays_from
from capture_plan.formats.raw import RawRig, fan
from capture_plan.formats.scene import (
    Offsets,
    PlacedMesh,
    broken_words,
    check_corners,
    join_meshes,
    moved,
    place_mesh,
    plain_line,
    whole_or_none,
)
from capture_plan.input.bounds import check_plain, check_sides
from capture_plan.input.source import Source

SUFFIXES = (".usd", ".usda", ".usdc", ".usdz")
PROGRAM = Path(__file__).with_name("usd_scene.py")
SECONDS = 600.0
FACING = {"Y": ("+y", "+z"), "Z": ("+z", "-y")}


def read_usd(path: Source) -> RawRig:
    """The rig in the file at `path`. RigError when it holds none, or when usd-core is missing."""
    if not isinstance(path, Path):
        raise RigError(f"{path.name} cannot be read inside a .zip: unpack it, or give a .usdz")
    try:
        with np.errstate(all="ignore"):
            return build_rig(path.stem, *run(path, "rig"))
    except RigError as error:
        raise RigError(f"{path.name} {error}".replace(f"{path.name} {path.stem}:", f"{path.name}:")) from error


def run(path: Path, what: str) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """The scene and its arrays, read as a "rig" or as a "take" by the program that opens the stage."""
    if importlib.util.find_spec("pxr") is None:
        raise RigError("needs the library for USD: install it with pip install 'capture-plan[usd]'")
    check_plain(path)
    with path.open("rb"):  # an OSError here says why it cannot be read
        pass
    try:
        return opened(arrays_from(PROGRAM, path.resolve(), what, seconds=SECONDS))
    except (BrokenProcessError, ValueError, KeyError) as error:
        raise RigError("cannot be read: it is damaged, or too large: export the face mesh alone") from error


def opened(arrays: dict[str, np.ndarray]) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """The scene that the program describes, and its arrays. RigError when it only says what is wrong."""
    scene = json.loads(arrays.pop("scene").tobytes())
    if "error" in scene:
        raise RigError(plain_line(scene["error"]))
    return scene, arrays


def build_rig(name: str, scene: dict[str, Any], arrays: dict[str, np.ndarray]) -> RawRig:
    """The rig of a scene."""
    up, facing = FACING.get(scene["up"], (None, None))
    said: list[str] = []
    broken: list[str] = []
    still = not any(mesh["blendshapes"] for mesh in scene["meshes"])
    meshes, gone, first = [], [], 0
    for mesh in scene["meshes"]:
        title, read = plain_line(mesh["name"]), partial(_read_mesh, mesh, arrays, first, said)
        found = whole_or_none(title, still or bool(mesh["blendshapes"]), read, broken)
        meshes += [] if found is None else [found]
        gone += [title] if found is None else []
        first += len(arrays[mesh["points"]])
    weights = left_on({plain_line(name): w for name, w in scene["weights"].items()})
    message = sentences(scene_note(scene), *said, weights, broken_words(broken))
    rig = join_meshes(name, meshes, unit_mm=unit(scene), up=up, facing=facing, note=message)
    return replace(rig, left_out=(*(plain_line(name.rpartition(" (")[0]) for name in scene["left_out"]), *gone))


def unit(scene: dict[str, Any]) -> float | None:
    """Millimetres in the scene's unit, None where what it says is no length."""
    return scene["unit_mm"] if np.isfinite(scene["unit_mm"]) and scene["unit_mm"] > 0 else None


def read_meshes(scene: dict[str, Any], arrays: dict[str, np.ndarray]) -> list[PlacedMesh]:
    """All meshes of a scene, placed. RigError where one is broken."""
    meshes, first = [], 0
    for mesh in scene["meshes"]:
        meshes.append(_read_mesh(mesh, arrays, first, []))
        first += len(meshes[-1].vertices)
    return meshes


def _read_mesh(mesh: dict[str, Any], arrays: dict[str, np.ndarray], first: int, said: list[str]) -> PlacedMesh:
    """One mesh of a scene, placed; sentences about its blendshapes go to `said`."""
    points, sizes, corners = arrays[mesh["points"]], arrays[mesh["sizes"]][:, 0], arrays[mesh["corners"]][:, 0]
    title = plain_line(mesh["name"])
    if (sizes < 0).any() or sizes.sum() != len(corners):
        raise RigError(
            f"has a mesh {title} whose faces need {sizes.sum():,} corners of {len(corners):,}: export it again"
        )
    check_sides("", int(sizes.max(initial=0)))
    check_corners(corners, len(points))
    labels, part_names = face_parts(mesh, title, arrays, len(sizes))
    retained = sizes >= 3
    triangles = fan(corners[np.repeat(retained, sizes)], sizes[retained])
    placed = PlacedMesh(
        vertices=points,
        triangles=triangles[:, ::-1] if mesh["left_handed"] else triangles,
        labels=np.repeat(labels[retained], sizes[retained] - 2),
        part_names=part_names,
        first=first,
        blendshapes=_read_blendshapes(mesh, title, arrays, len(points), said),
    )
    return place_mesh(placed, np.array(mesh["matrix"]))


def _read_blendshapes(
    mesh: dict[str, Any], title: str, arrays: dict[str, np.ndarray], v: int, said: list[str]
) -> dict[str, Offsets]:
    """Blendshapes of a mesh of `v` points; without offsets (normals alone) one moves nothing."""
    shapes = [shape for shape in mesh["blendshapes"] if not shape["gone"]]
    if gone := len(mesh["blendshapes"]) - len(shapes):
        said.append(f"{gone} of {len(mesh['blendshapes'])} blendshapes that {title} is bound to are not in the file")
    if shapes and shapes[0]["names"] != len(mesh["blendshapes"]):
        message = f"{shapes[0]['names']} names for {len(mesh['blendshapes'])} blendshapes"
        said.append(f"{title} has {message}, so those of the blendshapes themselves are used")
    names, message = numbered([plain_line(shape["name"]) for shape in shapes])
    said.append(message)
    found: dict[str, Offsets] = {}
    for name, shape in zip(names, shapes, strict=True):
        offsets = arrays[shape["offsets"]]
        indices = np.arange(len(offsets)) if shape["indices"] is None else arrays[shape["indices"]][:, 0]
        indices = indices if len(offsets) else indices[:0]
        found[name] = moved(indices, offsets, v)
    return found


def face_parts(
    mesh: dict[str, Any], title: str, arrays: dict[str, np.ndarray], p: int
) -> tuple[Int[np.ndarray, " p"], tuple[str, ...]]:
    """Part of each of the mesh's `p` polygons: its subset, or what is in none."""
    labels = np.zeros(p, dtype=np.int64)
    for number, (_, key) in enumerate(mesh["subsets"], start=1):
        faces = arrays[key][:, 0]
        labels[faces[(faces >= 0) & (faces < p)]] = number
    names = (title, *(f"{title}/{plain_line(subset)}" for subset, _ in mesh["subsets"]))
    used, labels = np.unique(labels, return_inverse=True)
    return labels.reshape(p), tuple(names[number] for number in used)


def scene_note(scene: dict[str, Any]) -> str:
    """A sentence about what was left out: in-betweens, and meshes that only stand for others."""
    between = {
        f"{plain_line(shape['name'])} at {100 * weight:g} %": None
        for mesh in scene["meshes"]
        for shape in mesh["blendshapes"]
        for weight in shape["between"]
    }
    said = []
    if between:
        said.append(f"in-between shapes were left out, so motion is a straight line here: {listed(list(between))}")
    if scene["left_out"]:
        said.append(f"meshes not for the picture were left out: {listed(map(plain_line, scene['left_out']))}")
    if scene["retained"]:
        names = listed(map(plain_line, scene["retained"]))
        said.append(f"meshes not for the picture were kept, since no other mesh has blendshapes: {names}")
    return "; ".join(said)
