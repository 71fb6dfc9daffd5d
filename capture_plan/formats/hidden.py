"""Which meshes of a scene are shown: hidden ones are left out, unless no other mesh has blendshapes."""

from collections.abc import Sequence
from dataclasses import dataclass

from capture_plan.formats.naming import listed


@dataclass(frozen=True)
class SceneMesh:
    """A mesh of a scene: what it is called, whether the file hides it, and how many blendshapes it has."""

    title: str
    hidden: bool
    blendshapes: int


def choose_shown(meshes: Sequence[SceneMesh]) -> tuple[list[bool], tuple[str, ...], str]:
    """Which meshes belong to the rig, what the others are called, and the sentence that says so."""
    hidden = [mesh for mesh in meshes if mesh.hidden]
    if not any(mesh.blendshapes for mesh in meshes if not mesh.hidden) and any(mesh.blendshapes for mesh in hidden):
        names = listed(mesh.title for mesh in hidden)
        message = f"meshes that the file hides were kept, since no other mesh has blendshapes: {names}"
        return [True] * len(meshes), (), message
    names = tuple(dict.fromkeys(mesh.title for mesh in hidden))
    message = f"meshes that the file hides were left out: {listed(map(with_count, hidden))}" if hidden else ""
    return [not mesh.hidden for mesh in meshes], names, message


def with_count(mesh: SceneMesh) -> str:
    """The mesh's name, and how many blendshapes go with it."""
    return f"{mesh.title} ({mesh.blendshapes} blendshapes)" if mesh.blendshapes else mesh.title
