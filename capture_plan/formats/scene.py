"""Several meshes that a scene file places in one space, as one rig: parts and blendshapes of equal name are one.

Data     vertices[v], triangles[f] of each mesh, and per blendshape only the vertices that it moves
Result   `RawRig`, whose vertices are those of the meshes in a row, none joined and none left out

Letters: v vertices, f triangles, k blendshapes, i moved vertices.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from jaxtyping import Float, Int

from capture_plan.errors import RigError
from capture_plan.formats.naming import listed, one_line
from capture_plan.formats.raw import RawRig, vertex_parts

MOST_BYTES = 2**31  # of all deltas: 2 GB hold 300 blendshapes of 590,000 vertices; a lying file may ask for anything


@dataclass(frozen=True, eq=False)
class Offsets:
    """What one blendshape does to a mesh: vertex `indices[i]` moves by `values[i]`, the others stay."""

    indices: Int[np.ndarray, " i"]
    values: Float[np.ndarray, "i 3"]


@dataclass(frozen=True, eq=False)
class PlacedMesh:
    """A mesh in the scene's space; `labels` says of which of `part_names` a triangle is.

    `first` is the number of its first vertex, with all vertices of the file counted in a row.
    """

    vertices: Float[np.ndarray, "v 3"]
    triangles: Int[np.ndarray, "f 3"]
    labels: Int[np.ndarray, " f"]
    part_names: tuple[str, ...]
    first: int
    blendshapes: dict[str, Offsets] = field(default_factory=dict)


def _place(points: Float[np.ndarray, "v 3"], M: Float[np.ndarray, "4 4"]) -> Float[np.ndarray, "v 3"]:
    """Points under the affine map of columns M: M p."""
    return points @ M[:3, :3].T + M[:3, 3]


def place_mesh(mesh: PlacedMesh, M: Float[np.ndarray, "4 4"]) -> PlacedMesh:
    """The mesh under the affine map M; a delta is turned and scaled but not moved, a mirrored triangle turned over."""
    mirrored = np.linalg.det(M[:3, :3]) < 0
    return PlacedMesh(
        vertices=_place(mesh.vertices, M),
        triangles=mesh.triangles[:, ::-1] if mirrored else mesh.triangles,
        labels=mesh.labels,
        part_names=mesh.part_names,
        first=mesh.first,
        blendshapes={name: Offsets(o.indices, o.values @ M[:3, :3].T) for name, o in mesh.blendshapes.items()},
    )


def place_vertices(mesh: PlacedMesh, M: Float[np.ndarray, "v 4 4"]) -> PlacedMesh:
    """The mesh with each vertex under an affine map of its own, as bones place a skin."""
    mirrored = len(M) > 0 and np.median(np.linalg.det(M[:, :3, :3])) < 0
    shapes = {
        name: Offsets(o.indices, np.einsum("iab,ib->ia", M[o.indices, :3, :3], o.values))
        for name, o in mesh.blendshapes.items()
    }
    vertices = np.einsum("vab,vb->va", M[:, :3, :3], mesh.vertices) + M[:, :3, 3]
    triangles = mesh.triangles[:, ::-1] if mirrored else mesh.triangles
    return replace(mesh, vertices=vertices, triangles=triangles, blendshapes=shapes)


def check_room(k: int, v: int) -> None:
    """RigError when the deltas of k blendshapes of v vertices would not fit in memory."""
    if 12 * k * v > MOST_BYTES:
        raise RigError(
            f"has {k:,} blendshapes of {v:,} vertices, which is more than {MOST_BYTES // 2**30} GB: "
            "export the face mesh alone"
        )


def join_meshes(name: str, meshes: list[PlacedMesh], **promises: float | str | None) -> RawRig:
    """One rig of the meshes; `promises` are the format's `unit_mm`, `up`, `facing`, `note`. RigError without faces."""
    if not any(len(mesh.triangles) for mesh in meshes):
        raise RigError("has no mesh with faces: export the face mesh")
    names = tuple(dict.fromkeys(name for mesh in meshes for name in mesh.blendshapes))
    part_names = tuple(dict.fromkeys(name for mesh in meshes for name in mesh.part_names))
    starts = np.cumsum([0] + [len(mesh.vertices) for mesh in meshes])
    check_room(len(names), int(starts[-1]))
    row, part = {name: k for k, name in enumerate(names)}, {name: p for p, name in enumerate(part_names)}
    deltas = np.zeros((len(names), starts[-1], 3), dtype=np.float32)
    for mesh, start in zip(meshes, starts[:-1], strict=True):
        for blendshape, offsets in mesh.blendshapes.items():
            deltas[row[blendshape], start + offsets.indices] = offsets.values
    triangles = np.concatenate([mesh.triangles + start for mesh, start in zip(meshes, starts[:-1], strict=True)])
    labels = np.concatenate([np.array([part[n] for n in mesh.part_names])[mesh.labels] for mesh in meshes])
    parts, part_names = vertex_parts(triangles, labels, part_names, int(starts[-1]))
    return RawRig(
        name=name,
        neutral=np.concatenate([mesh.vertices for mesh in meshes]),
        triangles=triangles.astype(np.int32),
        deltas=deltas,
        names=names,
        parts=parts,
        part_names=part_names,
        source_index=np.concatenate([mesh.first + np.arange(len(mesh.vertices)) for mesh in meshes]).astype(np.int32),
        meshes=np.repeat(np.arange(len(meshes), dtype=np.int32), np.diff(starts)),
        **promises,  # pyright: ignore[reportArgumentType]
    )


def whole_or_none(title: str, needed: bool, read: Callable[[], PlacedMesh], broken: list[str]) -> PlacedMesh | None:
    """The mesh that `read` gives; None, with a reason added to `broken`, where it is broken.

    RigError where it is `needed`, since blendshapes move it or none move any.
    """
    try:
        mesh = read()
        if not needed and not np.isfinite(mesh.vertices).all():
            raise RigError("holds NaN or infinite coordinates: clean the mesh")
        return mesh
    except RigError as error:
        if needed:
            raise
        broken.append(f"{title} {str(error).rpartition(': ')[0] or error}")
        return None


def broken_words(broken: Sequence[str]) -> str:
    """The sentence about meshes that were left out because they are broken."""
    return f"broken meshes were left out, clean them and export again: {listed(broken)}" if broken else ""


def plain_line(name: str) -> str:
    """A name as one line of text that can be shown, without spaces around it."""
    return one_line(name).strip()


def check_corners(corners: Int[np.ndarray, " c"], v: int) -> None:
    """RigError when a face uses a vertex that is not there."""
    if len(corners) and (corners.min() < 0 or corners.max() >= v):
        worst = corners.max() if corners.max() >= v else corners.min()
        raise RigError(f"has a face that uses vertex {worst:,} of {v:,}, counted from 0: export it again")


def moved(indices: Int[np.ndarray, " i"], values: Float[np.ndarray, "n 3"], v: int) -> Offsets:
    """The offsets of a blendshape on a mesh of `v` vertices. Where they do not fit it they are nowhere (NaN), so that
    `raw.finite` leaves the blendshape out and names it."""
    fits = len(indices) == len(values) and (len(indices) == 0 or 0 <= indices.min() <= indices.max() < v)
    return Offsets(indices, values) if fits else Offsets(np.zeros(1, dtype=np.int64), np.full((1, 3), np.nan))
