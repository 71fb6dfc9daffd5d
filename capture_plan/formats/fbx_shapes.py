"""Blendshapes of a mesh in an FBX file: channels of its deformers, or shapes that the mesh holds itself.

Name         the channel's, without that of its deformer, unless two deformers of the mesh share it
Weight       where the file leaves a channel (DeformPercent); the neutral is the mesh with all of them at 0
In-between   a channel may have several shapes, each with a full weight; the largest is the blendshape, the others are
             left out and reported
Inside       up to version 7.1 a mesh holds its shapes, and a property called after a shape is its weight

Letters: v vertices, i moved vertices.
"""

from dataclasses import dataclass

import numpy as np

from capture_plan.formats.fbx_file import Node
from capture_plan.formats.fbx_nodes import number_property, properties
from capture_plan.formats.fbx_scene import Scene
from capture_plan.formats.naming import listed, numbered
from capture_plan.formats.scene import Offsets, moved, plain_line


@dataclass(frozen=True, eq=False)
class Shapes:
    """Blendshapes of a mesh, in-betweens left out ("jawOpen at 50 %"), weights in the file, notes."""

    offsets: dict[str, Offsets]
    between: list[str]
    weights: dict[str, float]
    said: tuple[str, ...]


def read_blendshapes(scene: Scene, mesh: int, v: int) -> Shapes:
    """Blendshapes of a mesh of `v` vertices."""
    channels = [
        read_channel(scene, deformer, channel, v)
        for deformer in scene.of(mesh, "Deformer", "BlendShape")
        for channel in scene.of(deformer, "Deformer", "BlendShapeChannel")
        if scene.of(channel, "Geometry", "Shape")
    ] or inner_channels(scene.objects[mesh], v)
    names, said = channel_names(channels)
    return Shapes(
        offsets={name: channel.offsets for name, channel in zip(names, channels, strict=True)},
        between=[
            f"{name} at {weight:g} %"
            for name, channel in zip(names, channels, strict=True)
            for weight in channel.between
        ],
        weights={name: channel.weight for name, channel in zip(names, channels, strict=True)},
        said=said,
    )


@dataclass(frozen=True, eq=False)
class _Channel:
    """A blendshape as the file has it; `weight` is where it stands, 1 in full, `between` per cent of in-betweens."""

    deformer: str
    name: str
    offsets: Offsets
    weight: float
    between: tuple[float, ...] = ()


def channel_names(channels: list[_Channel]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Names that tell the channels of a mesh apart, with their deformer's where two deformers share one; and notes."""
    names = [channel.name or f"target_{i}" for i, channel in enumerate(channels)]
    deformers: dict[str, set[str]] = {}
    for name, channel in zip(names, channels, strict=True):
        deformers.setdefault(name, set()).add(channel.deformer)
    full = [
        f"{channel.deformer}.{name}" if len(deformers[name]) > 1 and channel.deformer else name
        for name, channel in zip(names, channels, strict=True)
    ]
    renamed = [new for new, old in zip(full, names, strict=True) if new != old]
    message = f"blendshapes of equal names keep that of their deformer: {listed(renamed)}" if renamed else ""
    unique, said = numbered(full)
    return unique, (message, said)


def read_channel(scene: Scene, deformer: int, channel: int, v: int) -> _Channel:
    """One channel of a deformer on a mesh of `v` vertices: its shape of the largest full weight."""
    node, shapes = scene.objects[channel], scene.of(channel, "Geometry", "Shape")
    name = channel_name(scene, deformer, channel) or scene.name(shapes[-1])
    weights = node.child("FullWeights").array()
    if len(weights) != len(shapes):  # Blender writes one weight for every vertex of a vertex group here
        weights = np.linspace(0, 100, len(shapes) + 1)[1:]
    full = int(np.argmax(weights))
    plain = next((float(x) for x in node.child("DeformPercent").array()), 0.0)
    stands = number_property(properties(node), "DeformPercent", plain) / (weights[full] if weights[full] > 0 else 100.0)
    between = tuple(float(weight) for i, weight in enumerate(weights) if i != full)
    offsets = read_shape(scene.objects[shapes[full]], v)
    return _Channel(scene.name(deformer), name, offsets, stands if np.isfinite(stands) else 0.0, between)


def inner_channels(mesh: Node, v: int) -> list[_Channel]:
    """Shapes that a mesh holds itself; a property of the shape's name is its weight, in per cent."""
    props = properties(mesh)
    shapes = [(plain_line(str(shape.values[0])) if shape.values else "", shape) for shape in mesh.all("Shape")]
    deformers = {name.partition(".")[0] for name, _ in shapes if "." in name}
    common = deformers.pop() if len(deformers) == 1 and all("." in name for name, _ in shapes) else ""
    return [
        _Channel("", name.removeprefix(f"{common}."), read_shape(shape, v), number_property(props, name, 0.0) / 100)
        for name, shape in shapes
    ]


def channel_name(scene: Scene, deformer: int, channel: int) -> str:
    """The channel's name; Maya puts that of its deformer and a dot before it."""
    return scene.name(channel).removeprefix(f"{scene.name(deformer)}.")


def read_shape(shape: Node, v: int) -> Offsets:
    """What a shape does to a mesh of `v` vertices."""
    values = shape.child("Vertices").array().reshape(-1, 3).astype(np.float64)
    indices = shape.child("Indexes").array().astype(np.int64)
    if len(indices) == 0 and len(values) == v:
        indices = np.arange(v)
    if len(values) == 0:  # its normals alone change
        indices = indices[:0]
    return moved(indices, values, v)


def shapes_note(between: list[str]) -> str:
    """A sentence about the in-betweens that were left out."""
    return f"in-between shapes were left out, so motion is a straight line here: {listed(between)}" if between else ""
