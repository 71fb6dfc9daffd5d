"""The recorded weights of a glTF file: its animation of morph weights, at a steady frame rate.

Data    t[i], w[i, k]   keys in seconds and the weights of one mesh's blendshapes (glTF 2.0, 3.11)
Frames  every 1 / fps seconds, with fps from the usual distance of the keys; between keys as the file says: as before
        (STEP), in a straight line (LINEAR), or by a cubic with the tangents of the file (CUBICSPLINE, appendix C.5)
The nodes' own movement is left out: the head is held still. Meshes that name the same blendshape follow the first.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

from capture_plan.curves.clock import usual
from capture_plan.curves.clock_steps import usual_step
from capture_plan.curves.weights import WeightTable
from capture_plan.errors import RigError
from capture_plan.formats import vrm
from capture_plan.formats.gltf import DAMAGE, target_names, titles
from capture_plan.formats.gltf_file import Gltf, load_gltf
from capture_plan.formats.gltf_scene import scene_nodes

MOST_FRAMES = 1_000_000  # 4.6 hours at 60 frames a second
SPARSE_S, USUAL_FPS = 0.2, 30.0  # keys further apart are poses, between which the face moves on


@dataclass(frozen=True, eq=False)
class Channel:
    """Keys of one mesh's weights; `tangents` (in, out) of a cubic, in weights per second."""

    names: tuple[str, ...]
    times: Float[np.ndarray, " i"]
    weights: Float[np.ndarray, "i k"]
    step: bool
    tangents: tuple[Float[np.ndarray, "i k"], Float[np.ndarray, "i k"]] | None


def read_animation(path: Path) -> WeightTable:
    """The weights of the first animation that has any. RigError where there is none."""
    try:
        with np.errstate(all="ignore"):
            return animation(load_gltf(path))
    except RigError:
        raise
    except DAMAGE as error:
        found = " ".join(f"{type(error).__name__}: {error}".split())[:160]
        raise RigError(f"does not follow glTF 2.0 ({found}): export it again as .glb") from error


def animation(gltf: Gltf) -> WeightTable:
    """The table of a document."""
    nodes = [index for index in scene_nodes(gltf) if "mesh" in gltf.entry("nodes", index)]
    named, _ = target_names(gltf, titles(gltf, nodes), vrm.given_names(vrm.read_expressions(gltf)))
    takes = gltf.document.get("animations", [])
    for take in takes:
        channels = [
            channel(gltf, take["samplers"][one["sampler"]], named[gltf.entry("nodes", one["target"]["node"])["mesh"]])
            for one in take["channels"]
            if one["target"]["path"] == "weights" and one["target"].get("node") in nodes
        ]
        if channels:
            others = [str(other.get("name", "without a name")) for other in takes if other is not take]
            moved = any(one["target"]["path"] != "weights" for one in take["channels"])
            notes = [f"of {len(takes)} animations the first with weights is read"] if others else []
            notes += ["the movement of its nodes (head, eyes, jaw bones) is left out"] if moved else []
            return _table(channels, notes)
    raise RigError("has no animation of blendshape weights: export the take with its shape keys")


def channel(gltf: Gltf, sampler: dict, names: tuple[str, ...]) -> Channel:
    """One channel's keys (3.11: outputs of all blendshapes of a key in a row; of a cubic in three such rows)."""
    times = gltf.accessor(sampler["input"])[:, 0].astype(np.float64)
    values = gltf.accessor(sampler["output"])[:, 0].astype(np.float64)
    how, i, k = sampler.get("interpolation", "LINEAR"), len(times), len(names)
    cubic = how == "CUBICSPLINE"
    if len(values) != i * k * (3 if cubic else 1) or i == 0 or k == 0:
        raise RigError(f"has {len(values):,} weights for {i:,} keys of {k} blendshapes: export it again")
    if not np.isfinite(times).all() or (np.diff(times) <= 0).any():
        raise RigError("has keys that do not follow each other in time: export it again")
    if cubic:
        before, weights, after = values.reshape(i, 3, k).transpose(1, 0, 2)
        return Channel(names, times, weights, False, (before, after))
    return Channel(names, times, values.reshape(i, k), how == "STEP", None)


def _table(channels: list[Channel], notes: list[str]) -> WeightTable:
    """All channels at the frames of the one with the most keys."""
    main = max(channels, key=lambda one: len(one.times))
    step = usual_step(main.times)
    fps = usual(1 / step) if 0 < step < SPARSE_S else USUAL_FPS
    count = round(float(main.times[-1] - main.times[0]) * fps) + 1
    if count > MOST_FRAMES:
        raise RigError(f"lasts {count:,} frames, more than {MOST_FRAMES:,}: cut the take")
    at = main.times[0] + np.arange(count) / fps
    columns: dict[str, np.ndarray] = {}
    for one in channels:
        for name, weights in zip(one.names, sample(one, at).T, strict=True):
            columns.setdefault(name, weights)
    return WeightTable(tuple(columns), np.stack(list(columns.values()), axis=1), fps, (), tuple(notes))


def sample(one: Channel, at: Float[np.ndarray, " t"]) -> Float[np.ndarray, "t k"]:
    """Weights at times `at`; before the first key and after the last one those keys'."""
    t, w = one.times, one.weights
    if len(t) == 1:
        return np.repeat(w, len(at), axis=0)
    at = np.clip(at, t[0], t[-1])
    i = np.clip(np.searchsorted(t, at, side="right") - 1, 0, len(t) - 2)
    d = (t[i + 1] - t[i])[:, None]
    s = ((at - t[i]) / d[:, 0])[:, None]
    if one.step:
        return np.where(s < 1, w[i], w[i + 1])
    if one.tangents is None:
        return (1 - s) * w[i] + s * w[i + 1]
    before, after = one.tangents
    return (
        (2 * s**3 - 3 * s**2 + 1) * w[i]
        + d * (s**3 - 2 * s**2 + s) * after[i]
        + (3 * s**2 - 2 * s**3) * w[i + 1]
        + d * (s**3 - s**2) * before[i + 1]
    )
