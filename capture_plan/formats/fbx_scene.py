"""Objects of an FBX file, how they are connected, and which of its nodes are shown.

Show           is the node's own
Visibility     is handed on to what is below a node, unless that has Visibility Inheritance off
Layer          a display layer that is off hides the nodes that it holds, and what is below them
Level          of a group of levels of detail the first is shown
"""

import re
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float

from capture_plan.formats.fbx_file import Node
from capture_plan.formats.fbx_nodes import ancestry, number_property, properties, world_matrix
from capture_plan.formats.scene import plain_line


@dataclass(frozen=True, eq=False)
class Scene:
    """Objects by their number, and those of each object's inputs, in the file's order."""

    objects: dict[int, Node]
    inputs: dict[int, list[int]]
    outputs: dict[int, list[int]]

    @cached_property
    def models(self) -> dict[int, Node]:
        """The nodes that place things."""
        return {number: node for number, node in self.objects.items() if node.name == "Model"}

    @cached_property
    def parent(self) -> dict[int, int]:
        """The node above each node that has one."""
        above = {n: [o for o in self.outputs.get(n, []) if o in self.models] for n in self.models}
        return {n: parents[0] for n, parents in above.items() if parents}

    def line(self, node: int) -> list[int]:
        """A node, the one above it, and so on. RigError when it is its own ancestor."""
        return ancestry(node, self.parent)

    def world(self, node: int) -> Float[np.ndarray, "4 4"]:
        """World matrix of a node, W of `fbx_nodes`."""
        return world_matrix(node, self.models, self.parent)

    def of(self, number: int, kind: str, sort: str | None = None) -> list[int]:
        """Inputs of an object that are of this kind (and sort: "Mesh", "Shape", "BlendShape", ...)."""
        return [i for i in self.inputs.get(number, []) if self.is_a(i, kind, sort)]

    def is_a(self, number: int, kind: str, sort: str | None = None) -> bool:
        """Whether an object is of this kind and sort."""
        node = self.objects.get(number)
        return node is not None and node.name == kind and (sort is None or node.values[2] == sort)

    def name(self, number: int) -> str:
        """What the file calls an object, without its class; FBX writes a dot as FBXASC046."""
        words = str(self.objects[number].values[1]).partition("::")
        return plain_line(re.sub(r"FBXASC(\d{3})", lambda code: chr(int(code[1])), words[2] if words[1] else words[0]))


def connect(root: Node) -> Scene:
    """Objects and who is connected to whom."""
    objects = {n.values[0]: n for n in root.child("Objects").children if len(n.values) > 2 and type(n.values[0]) is int}
    inputs: dict[int, list[int]] = {}
    outputs: dict[int, list[int]] = {}
    for link in root.child("Connections").all("C"):
        if len(link.values) > 2 and link.values[0] == "OO":
            source, target = link.values[1:3]
            inputs.setdefault(target, []).append(source)  # pyright: ignore[reportArgumentType]
            outputs.setdefault(source, []).append(target)  # pyright: ignore[reportArgumentType]
    return Scene(objects, inputs, outputs)  # pyright: ignore[reportArgumentType]


def is_hidden(scene: Scene, node: int) -> bool:
    """Whether a node is not shown.

    Show is the node's own; Visibility, display layers and levels of detail are handed on to what is below a node.
    """
    if number_property(properties(scene.models[node]), "Show", 1.0) == 0:
        return True
    inherits = True
    for above in scene.line(node):
        props = properties(scene.models[above])
        if inherits and number_property(props, "Visibility", 1.0) == 0:
            return True
        inherits = inherits and number_property(props, "Visibility Inheritance", 1.0) != 0
        if in_hidden_layer(scene, above) or is_further_level(scene, above):
            return True
    return False


def in_hidden_layer(scene: Scene, node: int) -> bool:
    """Whether a display layer that is off holds the node."""
    layers = (scene.objects[o] for o in scene.outputs.get(node, []) if scene.is_a(o, "CollectionExclusive"))
    return any(number_property(properties(layer), "Show", 1.0) == 0 for layer in layers)


def is_further_level(scene: Scene, node: int) -> bool:
    """Whether the node is a level of detail after the first of its group."""
    parent = scene.parent.get(node)
    if parent is None or not scene.is_a(parent, "Model", "LodGroup"):
        return False
    return node != next(i for i in scene.inputs[parent] if i in scene.models)
