"""Meshes and blendshapes of a USD stage, in a process of its own: run as a program, given a file, it writes an archive.

A USD library meets what it cannot take by ending the process, and may be made to ask for any amount of memory; so this
program has a limit on both memory and time, and knows nothing of the package that starts it (`usd.py`).
Layers   every sublayer, reference and payload is looked at before the stage is opened: each has to lie in the folder
         of the file, inside the same archive if that is a .usdz; absolute paths, other hosts, expressions are refused
Output   an `.npz` on standard output: `scene`, JSON as bytes, and the arrays that it names; {"error": ...} in `scene`
         says in one line what is wrong

USD multiplies rows by matrices, p M; the matrices written here are transposed, M p.
"""

import io
import json
import os
import re
import sys
from typing import Any

import numpy as np
from pxr import Sdf, Tf, Usd, UsdGeom, UsdSkel

# pyright: reportAttributeAccessIssue=false
# (the library fills its modules when they are loaded)

MEMORY_BYTES = 6 * 2**30  # address space, of which the libraries themselves take about 1 GB
CPU_SECONDS = 300
MOST_LAYERS = 1000
MOST_PRIMS = 1_000_000  # of a stage: references of references may multiply without end
ELSEWHERE = re.compile(r"^[/\\]|[:`]")  # absolute, another host or drive, an expression


class UnusableError(Exception):
    """What is wrong with the file, in one line without its name."""


def limit() -> None:
    """Bound this process's memory and time, where the system can."""
    try:
        import resource  # not on Windows
    except ImportError:
        return
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY_BYTES, MEMORY_BYTES))
    resource.setrlimit(resource.RLIMIT_CPU, (CPU_SECONDS, CPU_SECONDS))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def check_layers(path: str) -> None:
    """UnusableError unless all layers behind the file at `path` may be opened."""
    waiting, seen = [path], set()
    while waiting:
        identifier = waiting.pop()
        if identifier in seen:
            continue
        seen.add(identifier)
        if len(seen) > MOST_LAYERS:
            raise UnusableError(f"is made of more than {MOST_LAYERS:,} layers: flatten it into one")
        layer = Sdf.Layer.FindOrOpen(identifier)
        if layer is None:
            raise UnusableError("cannot be opened: export it again")
        clips: list[str] = []
        layer.Traverse("/", lambda spec, layer=layer, clips=clips: note_clips(layer, spec, clips))
        if clips:
            raise UnusableError(f"takes the values of {clips[0]} from other files (value clips): flatten it into one")
        assets = [asset for asset in layer.GetCompositionAssetDependencies() if asset]
        waiting += [allowed(asset, Sdf.ComputeAssetPathRelativeToLayer(layer, asset), path) for asset in assets]


def note_clips(layer: Any, spec: Any, clips: list[str]) -> None:
    """Remember a prim that has value clips."""
    if spec.IsPrimPath() and layer.GetPrimAtPath(spec).HasInfo("clips"):
        clips.append(str(spec))


def allowed(asset: str, anchored: str, root: str) -> str:
    """The place `anchored` of what a layer calls `asset`. UnusableError when it is not beside or inside `root`."""
    outer, bracket, inner = anchored.partition("[")
    outer = os.path.realpath(outer)
    folder = os.path.dirname(root)
    inside = outer == root if root.lower().endswith(".usdz") else os.path.commonpath([folder, outer]) == folder
    if ELSEWHERE.search(asset) or ".." in re.split(r"[/\\\[\]]", inner) or not inside:
        raise UnusableError(f"refers to '{asset}', which lies outside its folder or archive: export one file")
    if not os.path.isfile(outer):
        raise UnusableError(f"needs the file '{asset}', which is not beside it: copy it there, or export one file")
    return outer + bracket + inner


def read_stage(path: str) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """What the scene says, and the arrays that it names."""
    stage = Usd.Stage.Open(path)
    arrays: dict[str, np.ndarray] = {}
    places = UsdGeom.XformCache(Usd.TimeCode.EarliestTime())
    meshes, left_out = [], []
    for count, prim in enumerate(Usd.PrimRange.Stage(stage, Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate))):
        if count > MOST_PRIMS:
            raise UnusableError(f"has more than {MOST_PRIMS:,} objects: export the face mesh alone")
        if not prim.IsA(UsdGeom.Mesh):
            continue
        purpose = str(UsdGeom.Imageable(prim).ComputePurpose())
        if purpose in ("proxy", "guide"):
            left_out.append(f"{prim.GetName()} ({purpose})")
            continue
        meshes.append(read_mesh(prim, places, arrays))
    scene = {
        "unit_mm": 1000 * UsdGeom.GetStageMetersPerUnit(stage),
        "up": str(UsdGeom.GetStageUpAxis(stage)),
        "meshes": meshes,
        "left_out": left_out,
    }
    return scene, arrays


def read_mesh(prim: Any, places: Any, arrays: dict[str, np.ndarray]) -> dict[str, Any]:
    """One mesh: its arrays and the names under which they were put into `arrays`."""
    mesh = UsdGeom.Mesh(prim)

    def keep(values: Any, dtype: str, width: int) -> str:
        arrays[f"a{len(arrays)}"] = np.array([] if values is None else values, dtype).reshape(-1, width)
        return f"a{len(arrays) - 1}"

    subsets = [s for s in UsdGeom.Subset.GetAllGeomSubsets(mesh) if value(s.GetElementTypeAttr()) == "face"]
    return {
        "name": prim.GetName(),
        "points": keep(value(mesh.GetPointsAttr()), "f8", 3),
        "sizes": keep(value(mesh.GetFaceVertexCountsAttr()), "i8", 1),
        "corners": keep(value(mesh.GetFaceVertexIndicesAttr()), "i8", 1),
        "left_handed": value(mesh.GetOrientationAttr()) == "leftHanded",
        "matrix": place(prim, places).tolist(),
        "subsets": [[s.GetPrim().GetName(), keep(value(s.GetIndicesAttr()), "i8", 1)] for s in subsets],
        "blendshapes": list(read_blendshapes(prim, keep)),
    }


def read_blendshapes(prim: Any, keep: Any) -> Any:
    """Blendshapes bound to a mesh: name, names of their arrays, weights of their in-betweens."""
    binding = UsdSkel.BindingAPI(prim)
    names, targets = value(binding.GetBlendShapesAttr()) or [], binding.GetBlendShapeTargetsRel().GetTargets()
    if len(names) != len(targets):
        raise UnusableError(
            f"binds {len(targets)} blendshapes to {prim.GetName()} but names {len(names)}: export it again"
        )
    for name, target in zip(names, targets, strict=True):
        shape = UsdSkel.BlendShape(prim.GetStage().GetPrimAtPath(target))
        if not shape:
            raise UnusableError(f"has no blendshape at {target}, which {prim.GetName()} needs: export it again")
        indices = value(shape.GetPointIndicesAttr())
        yield {
            "name": str(name),
            "offsets": keep(value(shape.GetOffsetsAttr()), "f8", 3),
            "indices": keep(indices, "i8", 1) if indices else None,
            "between": [float(between.GetWeight() or 0) for between in shape.GetInbetweens()],
        }


def place(prim: Any, places: Any) -> np.ndarray:
    """World matrix (4 4): of a mesh with joints that of its skeleton and its pose when bound, else its own."""
    binding = UsdSkel.BindingAPI(prim)
    skeleton = binding.GetInheritedSkeleton()
    if skeleton and value(UsdSkel.BindingAPI(prim).GetJointIndicesAttr()):
        bind = value(binding.GetGeomBindTransformAttr())
        world = np.array(places.GetLocalToWorldTransform(skeleton.GetPrim()))
        return ((np.eye(4) if bind is None else np.array(bind)) @ world).T
    return np.array(places.GetLocalToWorldTransform(prim)).T


def value(attribute: Any) -> Any:
    """An attribute's own value, or its first over time; None without one."""
    found = attribute.Get(Usd.TimeCode.Default())
    return attribute.Get(Usd.TimeCode.EarliestTime()) if found is None else found


def archive(path: str) -> bytes:
    """What this program writes for the file at `path`."""
    arrays: dict[str, np.ndarray] = {}
    try:
        check_layers(path)
        scene, arrays = read_stage(path)
    except UnusableError as error:
        scene: dict[str, Any] = {"error": str(error)}
    except (Tf.ErrorException, RuntimeError, ValueError, TypeError, MemoryError) as error:
        scene = {"error": f"is no whole USD file ({type(error).__name__}): copy or export it again"}
    packed = io.BytesIO()
    np.savez(packed, scene=np.frombuffer(json.dumps(scene).encode(), np.uint8), **arrays)  # pyright: ignore[reportArgumentType]
    return packed.getvalue()


if __name__ == "__main__":
    limit()
    with os.fdopen(os.dup(1), "wb") as output:
        os.dup2(2, 1)  # whatever the library prints goes to standard error
        output.write(archive(os.path.realpath(sys.argv[1])))
