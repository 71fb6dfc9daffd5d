"""VRM avatars, 0.x and 1.0: glTF files whose expressions say what their morph targets mean.

Blendshapes   the morph targets: they are what the artist made, and what a scan can show one by one.
Expressions   (joy, blink, aa ...) pose one or several of them with weights. As blendshapes of their own they would be
              sums of others, and a plan would record them twice; so they are told in a note, and one that poses one
              target of a mesh fully gives that target its name where the file has none.
Axes          metres, +y up; a 0.x avatar faces -z, a 1.0 avatar +z.

Sources: VRM 0.0, `blendShapeMaster.blendShapeGroups` (mesh, index, weight in per cent); VRMC_vrm-1.0, `expressions`
(node, index, weight from 0 to 1), both of the VRM Consortium.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

from capture_plan.formats.gltf_file import Gltf

FULL = 0.999
LONGEST_NOTE = 600  # characters
Bind = tuple[int, int, float]  # mesh, morph target, weight


@dataclass(frozen=True)
class _Expression:
    """A named pose of morph targets."""

    name: str
    binds: tuple[Bind, ...]


def extension(gltf: Gltf, name: str) -> dict[str, Any] | None:
    """What the file says under one of VRM's names."""
    return gltf.document.get("extensions", {}).get(name)


def facing(gltf: Gltf) -> str:
    """The axis along which the format has its subject look."""
    return "-z" if extension(gltf, "VRM") is not None and extension(gltf, "VRMC_vrm") is None else "+z"


def read_expressions(gltf: Gltf) -> tuple[_Expression, ...]:
    """All expressions that move morph targets, in the file's order; none when this is no VRM file."""
    if (vrm := extension(gltf, "VRMC_vrm")) is not None:
        found = list(expressions_1(gltf, vrm.get("expressions", {})))
    else:
        groups = (extension(gltf, "VRM") or {}).get("blendShapeMaster", {}).get("blendShapeGroups", [])
        found = [expression_0(group) for group in groups]
    return tuple(expression for expression in found if expression.binds)


def expressions_1(gltf: Gltf, groups: dict[str, Any]) -> Iterator[_Expression]:
    """Expressions of a 1.0 avatar: presets first, then the artist's own."""
    for name, group in [*groups.get("preset", {}).items(), *groups.get("custom", {}).items()]:
        binds = group.get("morphTargetBinds") or []
        yield _Expression(
            str(name),
            tuple((gltf.entry("nodes", b["node"])["mesh"], int(b["index"]), float(b.get("weight", 1))) for b in binds),
        )


def expression_0(group: dict[str, Any]) -> _Expression:
    """An expression of a 0.x avatar, called by its preset unless that is unknown."""
    preset = group.get("presetName") or "unknown"
    name = group.get("name") if preset.lower() == "unknown" else preset
    binds = group.get("binds") or []
    return _Expression(str(name), tuple((int(b["mesh"]), int(b["index"]), float(b["weight"]) / 100) for b in binds))


def given_names(expressions: tuple[_Expression, ...]) -> dict[tuple[int, int], str]:
    """(mesh, target) -> the first expression that poses it fully and no other target of that mesh."""
    names: dict[tuple[int, int], str] = {}
    for expression in expressions:
        meshes = [mesh for mesh, _, _ in expression.binds]
        if len(set(meshes)) == len(meshes) and all(weight >= FULL for _, _, weight in expression.binds):
            for mesh, target, _ in expression.binds:
                names.setdefault((mesh, target), expression.name)
    return names


def expression_note(expressions: tuple[_Expression, ...], blendshape: Callable[[int, int], str | None]) -> str:
    """What the expressions pose, in one line; `blendshape` tells what a (mesh, target) is called in the rig."""
    lines = []
    for expression in expressions:
        terms = {}
        for mesh, target, weight in expression.binds:
            name = blendshape(mesh, target)
            if name is not None:
                terms[name] = max(weight, terms.get(name, 0))
        if list(terms) != [expression.name]:
            parts = [name if weight >= FULL else f"{weight:.2g} {name}" for name, weight in terms.items()]
            lines.append(f"{expression.name} = {' + '.join(parts) or 'nothing'}")
    if not lines:
        return ""
    text = f"VRM expressions are poses of the blendshapes: {', '.join(lines)}"
    return text if len(text) <= LONGEST_NOTE else text[: LONGEST_NOTE - 4].rpartition(",")[0] + " ..."
