"""What a USD stage holds, in a process of its own: run as a program, given a file, it writes an archive.

A USD library meets what it cannot take by ending the process, and may be made to ask for any amount of memory; so this
program has a limit on both memory and time, and knows nothing of who starts it (`usd.py`).
Layers   every sublayer, reference and payload is looked at before the stage is opened: each has to lie in the folder
         of the file, inside the same archive if that is a .usdz; absolute paths, other hosts, expressions are refused
Output   an `.npz` on standard output: `scene`, JSON as bytes, and the arrays that it names; {"error": ...} in `scene`
         says in one line what is wrong
Rig      meshes and their blendshapes at rest
Take     after the word `take`: values at times s[t], one time code apart or as close as the samples are; of blendshape
         weights, where an animation has any, otherwise of points (t v 3) and places (t 4 4) of all meshes

USD multiplies rows by matrices, p M; the matrices written here are transposed, M p.
"""

import json
import os
import re
import sys
from collections.abc import Callable
from typing import Any

import numpy as np
from pxr import Sdf, Tf, Usd, UsdGeom, UsdSkel

from capture_plan.formats.limits import limit_work

# pyright: reportAttributeAccessIssue=false
# (the library fills its modules when they are loaded)

MEMORY_BYTES, MOST_MEMORY_BYTES = 3 << 29, 6 << 30  # address space, of which the libraries themselves take 1 GB
CPU_SECONDS, MOST_CPU_SECONDS = 4, 300  # after the libraries were loaded
MEMORY_EACH, BYTES_IN_A_SECOND = 40, 500_000  # memory for each byte of the layers; how slowly they may be read
MOST_LAYERS = 1000
MOST_BYTES = 2**30  # of a take, all of it in memory: 3,300 frames of 26,719 vertices in float32
MOST_FRAMES = 1_000_000  # 4.6 hours at 60 frames a second
MOST_FPS = 240.0  # finer time codes are ticks of a clock, not frames
MOST_PRIMS = 1_000_000  # of a stage: references of references may multiply without end
ELSEWHERE = re.compile(r"^[/\\]|[:`]")  # absolute, another host or drive, an expression


class UnusableError(Exception):
    """What is wrong with the file, in one line without its name."""


def limit_memory(size: int) -> None:
    """Bound this process's memory and time by the bytes of the layers that it opens, where the system can."""
    limit_work(
        memory=min(MEMORY_BYTES + MEMORY_EACH * size, MOST_MEMORY_BYTES),
        seconds=min(CPU_SECONDS + size // BYTES_IN_A_SECOND, MOST_CPU_SECONDS),
    )


def check_layers(path: str, seen_bytes: Callable[[int], None] = lambda size: None) -> None:
    """UnusableError unless all layers behind the file at `path` may be opened; `seen_bytes` is told their size."""
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
        seen_bytes(sum(os.path.getsize(file) for file in {one.partition("[")[0] for one in (*seen, *waiting)}))


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


def prims_of(stage: Any) -> list[Any]:
    """All objects of the stage."""
    prims = []
    for prim in Usd.PrimRange.Stage(stage, Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate)):
        prims.append(prim)
        if len(prims) > MOST_PRIMS:
            raise UnusableError(f"has more than {MOST_PRIMS:,} objects: export the face mesh alone")
    return prims


def meshes_of(prims: list[Any]) -> tuple[list[Any], list[str], list[str]]:
    """Meshes of the picture, what those left out are called, and what those that only had to be kept.

    Invisible ones, proxies and guides are left out, unless no other mesh has blendshapes, or there is none.
    """
    meshes = [prim for prim in prims if prim.IsA(UsdGeom.Mesh)]
    why = [hidden_as(prim) for prim in meshes]
    shown = [prim for prim, reason in zip(meshes, why, strict=True) if not reason]
    others = [f"{prim.GetName()} ({reason})" for prim, reason in zip(meshes, why, strict=True) if reason]
    if not any(map(binds_shapes, shown)) and (any(map(binds_shapes, meshes)) or not shown):
        return meshes, [], others
    return shown, others, []


def hidden_as(prim: Any) -> str:
    """Why a mesh is not for the picture: "invisible", "proxy" or "guide", by itself or by what it lies in; else ""."""
    image = UsdGeom.Imageable(prim)
    if image.ComputeVisibility(Usd.TimeCode.EarliestTime()) == UsdGeom.Tokens.invisible:
        return "invisible"
    purpose = str(image.ComputePurpose())
    return purpose if purpose in ("proxy", "guide") else ""


def binds_shapes(prim: Any) -> bool:
    """Whether a mesh has blendshapes."""
    return bool(UsdSkel.BindingAPI(prim).GetBlendShapeTargetsRel().GetTargets())


def read_stage(path: str) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """What the scene says, and the arrays that it names."""
    stage = Usd.Stage.Open(path)
    prims = prims_of(stage)
    scene, arrays = _read_scene(stage, *meshes_of(prims))
    return scene | {"weights": rest_weights(prims)}, arrays


def rest_weights(prims: list[Any]) -> dict[str, float]:
    """Weights of blendshapes that animations hold at all times, where they are not 0."""
    found: dict[str, float] = {}
    for one in (UsdSkel.Animation(prim) for prim in prims if prim.IsA(UsdSkel.Animation)):
        names, weights = value(one.GetBlendShapesAttr()) or [], value(one.GetBlendShapeWeightsAttr()) or []
        if not is_sampled(one.GetBlendShapeWeightsAttr()):
            found |= {str(name): float(weight) for name, weight in zip(names, weights, strict=False) if weight}
    return found


def _read_scene(
    stage: Any, meshes: list[Any], left_out: list[str], retained: list[str]
) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """The scene of these meshes at rest, and its arrays."""
    arrays: dict[str, np.ndarray] = {}
    places = UsdGeom.XformCache(Usd.TimeCode.EarliestTime())
    scene = {
        "unit_mm": 1000 * UsdGeom.GetStageMetersPerUnit(stage),
        "up": str(UsdGeom.GetStageUpAxis(stage)),
        "meshes": [_read_mesh(prim, places, arrays) for prim in meshes],
        "left_out": left_out,
        "retained": retained,
    }
    return scene, arrays


def _read_take(path: str) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """What the stage says over time, and the arrays that it names."""
    stage = Usd.Stage.Open(path)
    prims = prims_of(stage)
    meshes, left_out, retained = meshes_of(prims)
    moving = [prim for prim in meshes if is_sampled(UsdGeom.Mesh(prim).GetPointsAttr())]
    animations, notes = animations_of(prims)
    if animations:
        notes += ["the motion of its points is left out, since it has blendshape weights"] if moving else []
        return read_weights(stage, animations, notes)
    if moving:
        return read_motion(stage, meshes, left_out, retained)
    raise UnusableError("has no motion, neither of points nor of blendshape weights: export it with its animation")


def is_sampled(attribute: Any) -> bool:
    """Whether an attribute has values at several times."""
    return attribute.GetNumTimeSamples() > 1


def animations_of(prims: list[Any]) -> tuple[list[Any], list[str]]:
    """Animations of weights that skeletons play, else the first one; and a note on the others. None without motion."""
    found = [UsdSkel.Animation(prim) for prim in prims if prim.IsA(UsdSkel.Animation)]
    found = [one for one in found if value(one.GetBlendShapesAttr()) and value(one.GetBlendShapeWeightsAttr())]
    played = {path for prim in prims for path in UsdSkel.BindingAPI(prim).GetAnimationSourceRel().GetTargets()}
    bound = [one for one in found if one.GetPath() in played]
    if not any(is_sampled(one.GetBlendShapeWeightsAttr()) for one in bound):
        bound = [one for one in found if is_sampled(one.GetBlendShapeWeightsAttr())][:1]
    notes = (
        [f"of {len(found)} animations {bound[0].GetPrim().GetName()} is read"] if len(found) > len(bound) > 0 else []
    )
    return bound, notes


def frame_times(stage: Any, attributes: list[Any]) -> tuple[np.ndarray, float]:
    """s[t] in time codes, from the first sample to the last one of these attributes; frames in a second."""
    samples = [np.array(attribute.GetTimeSamples()) for attribute in attributes]
    rate = float(stage.GetTimeCodesPerSecond())
    first, last = min(one[0] for one in samples), max(one[-1] for one in samples)
    if not (np.isfinite(rate) and rate > 0 and np.isfinite(last - first)):
        raise UnusableError(f"has times {first:g} to {last:g} at {rate:g} time codes in a second: export it again")
    gap = float(np.median(np.diff(max(samples, key=len))))
    step = gap if gap < 1 or rate > MOST_FPS else 1.0
    if not (last - first) / step < MOST_FRAMES:
        raise UnusableError(f"lasts {(last - first) / step:,.0f} frames, more than {MOST_FRAMES:,}: cut the take")
    return first + step * np.arange(round((last - first) / step) + 1), rate / step


def _check_room(size: int) -> None:
    """UnusableError when so many bytes are more than a take may have."""
    if size > MOST_BYTES:
        raise UnusableError(f"holds {size / 1e9:,.1f} GB of motion, more than {MOST_BYTES / 1e9:.1f} GB: cut the take")


def read_weights(stage: Any, animations: list[Any], notes: list[str]) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """Weights (t k) of all these animations, side by side; of those of one name the first."""
    sampled = [one.GetBlendShapeWeightsAttr() for one in animations if is_sampled(one.GetBlendShapeWeightsAttr())]
    times, fps = frame_times(stage, sampled)
    columns: dict[str, np.ndarray] = {}
    for one in animations:
        name, names = one.GetPrim().GetName(), [str(token) for token in value(one.GetBlendShapesAttr())]
        if len(set(names)) < len(names):
            raise UnusableError(f"has an animation {name} that names a blendshape twice: give each its own name")
        _check_room(8 * len(times) * (len(columns) + len(names)))
        weights = np.empty((len(times), len(names)))
        for t, time in enumerate(times):
            row = one.GetBlendShapeWeightsAttr().Get(time)
            if len(row) != len(names):
                raise UnusableError(
                    f"has {len(row)} weights for the {len(names)} blendshapes of {name} in frame {t}: export it again"
                )
            weights[t] = row
        columns |= {column: w for column, w in zip(names, weights.T, strict=True) if column not in columns}
    scene = {"names": list(columns), "fps": fps, "notes": notes}
    return scene, {"weights": np.stack(list(columns.values()), axis=1)}


def read_motion(
    stage: Any, meshes: list[Any], left_out: list[str], retained: list[str]
) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """The scene at rest; with the points (t v 3) of meshes that change, and the places (t 4 4) of all."""
    moving = [is_sampled(UsdGeom.Mesh(prim).GetPointsAttr()) for prim in meshes]
    sampled = [UsdGeom.Mesh(prim).GetPointsAttr() for prim, moves in zip(meshes, moving, strict=True) if moves]
    times, fps = frame_times(stage, sampled)
    scene, arrays = _read_scene(stage, meshes, left_out, retained)
    counts = [len(arrays[mesh["points"]]) for mesh in scene["meshes"]]
    _check_room(len(times) * (12 * int(np.dot(counts, moving)) + 128 * len(meshes)))
    places = UsdGeom.XformCache()
    for number, (prim, mesh, count) in enumerate(zip(meshes, scene["meshes"], counts, strict=True)):
        if moving[number]:
            _check_faces(UsdGeom.Mesh(prim), mesh["name"])
            mesh["moving"], arrays[f"x{number}"] = f"x{number}", sampled_points(prim, times, count)
        mesh["places"], arrays[f"m{number}"] = f"m{number}", np.empty((len(times), 4, 4))
    for t, time in enumerate(times):
        places.SetTime(time)
        for number, prim in enumerate(meshes):
            arrays[f"m{number}"][t] = _place(prim, places)
    return scene | {"fps": fps}, arrays


def sampled_points(prim: Any, times: np.ndarray, count: int) -> np.ndarray:
    """Points (t v 3) of a mesh of `count` points."""
    points = np.empty((len(times), count, 3), np.float32)
    for t, time in enumerate(times):
        found = UsdGeom.Mesh(prim).GetPointsAttr().Get(time)
        if len(found) != count:
            raise UnusableError(
                f"has a mesh {prim.GetName()} of {count:,} points, in frame {t:,} of {len(found):,}: "
                "every frame must be of the same mesh"
            )
        points[t] = found
        if not np.isfinite(points[t]).all():
            raise UnusableError(
                f"has a mesh {prim.GetName()} with points that are no numbers in frame {t:,}: export it again"
            )
    return points


def _check_faces(mesh: Any, name: str) -> None:
    """UnusableError when the mesh's faces change over time."""
    for attribute in (mesh.GetFaceVertexCountsAttr(), mesh.GetFaceVertexIndicesAttr()):
        first = attribute.Get(Usd.TimeCode.EarliestTime())
        if any(attribute.Get(time) != first for time in attribute.GetTimeSamples()):
            raise UnusableError(f"has a mesh {name} whose faces change: every frame must be of the same mesh")


def _read_mesh(prim: Any, places: Any, arrays: dict[str, np.ndarray]) -> dict[str, Any]:
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
        "matrix": _place(prim, places).tolist(),
        "subsets": [[s.GetPrim().GetName(), keep(value(s.GetIndicesAttr()), "i8", 1)] for s in subsets],
        "blendshapes": list(_read_blendshapes(prim, keep)),
    }


def _read_blendshapes(prim: Any, keep: Any) -> Any:
    """Blendshapes bound to a mesh: name, names of their arrays, weights of their in-betweens."""
    binding = UsdSkel.BindingAPI(prim)
    names, targets = value(binding.GetBlendShapesAttr()) or [], binding.GetBlendShapeTargetsRel().GetTargets()
    fits = len(names) == len(targets)
    for number, target in enumerate(targets):
        shape = UsdSkel.BlendShape(prim.GetStage().GetPrimAtPath(target))
        offsets, indices = (value(shape.GetOffsetsAttr()), value(shape.GetPointIndicesAttr())) if shape else ([], [])
        yield {
            "name": str(names[number]) if fits else target.name,
            "offsets": keep(offsets, "f8", 3),
            "indices": keep(indices, "i8", 1) if indices else None,
            "between": [float(between.GetWeight() or 0) for between in shape.GetInbetweens()] if shape else [],
            "gone": not shape,
            "names": len(names),
        }


def _place(prim: Any, places: Any) -> np.ndarray:
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


def write_archive(path: str, what: str, target: str) -> None:
    """What this program writes to `target` for the file at `path`, read as a "rig" or as a "take"."""
    arrays: dict[str, np.ndarray] = {}
    try:
        check_layers(path, limit_memory if __name__ == "__main__" else lambda size: None)
        scene, arrays = _read_take(path) if what == "take" else read_stage(path)
    except UnusableError as error:
        scene: dict[str, Any] = {"error": str(error)}
    except (Tf.ErrorException, RuntimeError, ValueError, TypeError, MemoryError) as error:
        scene = {"error": f"is no whole USD file ({type(error).__name__}): copy or export it again"}
    np.savez(target, scene=np.frombuffer(json.dumps(scene).encode(), np.uint8), **arrays)  # pyright: ignore[reportArgumentType]


if __name__ == "__main__":
    limit_memory(os.path.getsize(sys.argv[1]))
    write_archive(os.path.realpath(sys.argv[1]), sys.argv[2], sys.argv[3])
