"""Where a glTF file's nodes place their meshes.

world    W[i] = W[parent] T R S, or the node's own matrix; a node of two parents or of its own line is refused.
         A node that lies nowhere, and what is below it, is at NaN: the rig hangs on it only where a mesh or a bone does
skin     v' = sum_j w_j W[j] B_j v: joints count, the mesh's own node does not. A quantised mesh is in real units
         only after B_j, an ordinary one in its bind pose mostly before it too

Sections are those of the glTF 2.0 specification.
"""

from typing import Any

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from capture_plan.errors import RigError
from capture_plan.formats.gltf_file import AGAIN, Gltf
from capture_plan.formats.naming import one_line

Worlds = dict[int, Float[np.ndarray, "4 4"]]


def world_matrices(gltf: Gltf) -> Worlds:
    """World matrix of every node of the file, parents first (3.5.2)."""
    nodes = gltf.document.get("nodes", [])
    children = [list(node.get("children", [])) for node in nodes]
    below = [child for row in children for child in row]
    if len(set(below)) < len(below):
        raise RigError(f"has a node with two parents: {AGAIN}")
    worlds: Worlds = {}
    waiting = [(root, np.eye(4)) for root in sorted(set(range(len(nodes))) - set(below), reverse=True)]
    while waiting:
        index, parent = waiting.pop()
        try:
            worlds[index] = parent @ _local_matrix(gltf.entry("nodes", index))
        except (TypeError, ValueError):  # a matrix of other than 16 numbers, a name in place of one
            worlds[index] = np.full((4, 4), np.nan)
        waiting += [(child, worlds[index]) for child in reversed(children[index])]
    if len(worlds) < len(nodes):
        raise RigError(f"has nodes that are children of themselves: {AGAIN}")
    return worlds


def scene_nodes(gltf: Gltf) -> list[int]:
    """Nodes of the scene that is shown, parents first; of a file without scenes all that have no parent."""
    nodes = gltf.document.get("nodes", [])
    below = {child for node in nodes for child in node.get("children", [])}
    roots = [index for index in range(len(nodes)) if index not in below]
    if gltf.document.get("scenes"):
        roots = gltf.entry("scenes", scene_shown(gltf)).get("nodes", [])
    waiting, found = list(reversed(roots)), []
    while waiting:
        found.append(waiting.pop())
        waiting += reversed(gltf.entry("nodes", found[-1]).get("children", []))
        if len(found) > len(nodes):
            raise RigError(f"has a scene that shows a node twice: {AGAIN}")
    return found


def scene_shown(gltf: Gltf) -> int:
    """The number of the file's default scene, or of the first that shows a mesh where that one shows none."""
    scenes, default = gltf.document.get("scenes", []), gltf.document.get("scene", 0)
    holders = mesh_holders(gltf)
    with_mesh = [number for number, scene in enumerate(scenes) if holders.intersection(scene.get("nodes", []))]
    shows = holders.intersection(gltf.entry("scenes", default).get("nodes", []))
    return default if shows or not with_mesh else with_mesh[0]


def scene_messages(gltf: Gltf) -> str:
    """The sentence that says which scene was taken, where it is not the default one."""
    if not gltf.document.get("scenes") or (shown := scene_shown(gltf)) == gltf.document.get("scene", 0):
        return ""
    name = one_line(gltf.entry("scenes", shown).get("name") or f"number {shown}")
    return f"the file's default scene shows no mesh: the first that shows one was taken, {name}"


def mesh_holders(gltf: Gltf) -> set[int]:
    """Nodes that have a mesh, and all nodes above them."""
    nodes = gltf.document.get("nodes", [])
    above = {child: index for index, node in enumerate(nodes) for child in node.get("children", [])}
    found: set[int] = set()
    for index in (index for index, node in enumerate(nodes) if "mesh" in node):
        at: int | None = index
        while at is not None and at not in found:
            found.add(at)
            at = above.get(at)
    return found


def hidden_nodes(gltf: Gltf) -> set[int]:
    """Nodes that KHR_node_visibility hides, by themselves or by a node above them."""
    nodes = gltf.document.get("nodes", [])
    waiting = [
        index
        for index, node in enumerate(nodes)
        if (node.get("extensions") or {}).get("KHR_node_visibility", {}).get("visible", True) is False
    ]
    found: set[int] = set()
    while waiting:
        index = waiting.pop()
        if index not in found:
            found.add(index)
            waiting += gltf.entry("nodes", index).get("children", [])
    return found


def titles(gltf: Gltf, shown: list[int]) -> dict[int, str]:
    """What people call each mesh that is shown: its node's name, the mesh's, or that of nodes that hold it alone."""
    nodes = gltf.document.get("nodes", [])
    holder = {row[0]: index for index, node in enumerate(nodes) if len(row := node.get("children", [])) == 1}
    found = {}
    for index in shown:
        number = nodes[index]["mesh"]
        name, above = nodes[index].get("name") or gltf.entry("meshes", number).get("name"), index
        while not name and (above := holder.get(above, -1)) >= 0:
            name = nodes[above].get("name")
        found[index] = str(name or f"mesh {number}")
    return found


def _local_matrix(node: dict[str, Any]) -> Float[np.ndarray, "4 4"]:
    """The node's matrix, which a file gives column by column, or T R S."""
    if "matrix" in node:
        return np.array(node["matrix"], dtype=np.float64).reshape(4, 4).T
    matrix = np.eye(4)
    q = np.array(node.get("rotation", [0, 0, 0, 1]), dtype=np.float64)
    R = Rotation.from_quat(q).as_matrix() if q.any() else np.eye(3)  # viewers take four zeros for no rotation
    matrix[:3, :3] = R * np.array(node.get("scale", [1, 1, 1]), dtype=np.float64)
    matrix[:3, 3] = node.get("translation", [0, 0, 0])
    return matrix


def placement(
    gltf: Gltf, node: dict[str, Any], attributes: dict[str, int], world: np.ndarray, worlds: Worlds, v: int
) -> Float[np.ndarray, "v 4 4"]:
    """Matrix that places each vertex: its node's, or of a skinned mesh the blend of its joints' (3.7.3.3)."""
    if "skin" not in node or "JOINTS_0" not in attributes:
        check_place(world)
        return np.broadcast_to(world, (v, 4, 4))
    skin = gltf.entry("skins", node["skin"])
    J = np.stack([worlds[joint] for joint in skin["joints"]])
    if "inverseBindMatrices" in skin:
        J = J @ gltf.accessor(skin["inverseBindMatrices"])[: len(J)].reshape(-1, 4, 4).transpose(0, 2, 1)
    sets = sorted(name.removeprefix("JOINTS_") for name in attributes if name.startswith("JOINTS_"))
    joints = np.concatenate([gltf.accessor(attributes[f"JOINTS_{number}"]) for number in sets], axis=1)
    weights = np.concatenate([gltf.accessor(attributes[f"WEIGHTS_{number}"]) for number in sets], axis=1)
    if joints.shape != weights.shape or len(joints) != v or joints.dtype.kind != "u" or joints.max(initial=0) >= len(J):
        raise RigError(f"has joints and weights that do not fit its vertices: {AGAIN}")
    total = weights.sum(axis=1, keepdims=True, dtype=np.float64)
    weights = np.where(total > 0, weights, np.arange(weights.shape[1]) == 0)  # without weights: the first joint
    nowhere = np.asarray(~np.isfinite(J).all(axis=(1, 2)))
    check_place(J[np.unique(joints[(weights > 0) & nowhere[joints]])])
    J[nowhere] = 0
    # M = sum_j w_j W_j B_j
    M = np.zeros((v, 4, 4))
    for column in range(joints.shape[1]):
        M += (weights[:, column] / np.where(total > 0, total, 1)[:, 0])[:, None, None] * J[joints[:, column]]
    return M


def check_place(worlds: Float[np.ndarray, "... 4 4"]) -> None:
    """RigError where one of these matrices places nothing."""
    if not np.isfinite(worlds).all():
        raise RigError(f"is placed by a node that holds NaN, infinity or no whole matrix: {AGAIN}")
