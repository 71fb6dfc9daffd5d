"""A rig of one file per blendshape, whatever the files' kind: the neutral's faces, and vertices that follow its order.

Letters: v vertices, p polygons, c corners of polygons, all in a row.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from capture_plan.errors import RigError
from capture_plan.formats.naming import numbered, sentences
from capture_plan.formats.raw import RawRig, fan, vertex_parts
from capture_plan.formats.whole_files import whole_deltas
from capture_plan.input.bounds import check_sides
from capture_plan.input.source import Source, folder_name


@dataclass(frozen=True, eq=False)
class Faces:
    """Polygons of one file: vertex numbers from 0, corner counts, and the part that each belongs to."""

    corners: Int[np.ndarray, " c"]
    sizes: Int[np.ndarray, " p"]
    labels: Int[np.ndarray, " p"]
    part_names: tuple[str, ...]


def rig_of_shapes(
    folder: Source,
    neutral: Source,
    shapes: list[Source],
    faces: Faces,
    read_vertices: Callable[[Source], Float[np.ndarray, "v 3"]],
    check_faces: Callable[[Faces, Source, Source], None] | None = None,
    *,
    message: str = "",
) -> RawRig:
    """The rig of a neutral and its blendshapes, called after their files; unit and axes are unknown.

    `check_faces(faces, neutral, shape)` refuses a blendshape whose file joins its vertices into other faces;
    `message` is what has to be said of how the files were read.
    """
    if not shapes:
        raise RigError(
            f"{folder_name(folder)} holds only a neutral, {neutral.name}: "
            "export one file for each blendshape into the same folder"
        )
    vertices = read_vertices(neutral)
    if len(faces.sizes) == 0:
        raise RigError(f"{neutral.name} has vertices but no faces: export the neutral with its faces")
    check_sides(neutral.name, int(faces.sizes.max()))
    if faces.sizes.min() < 3 or not 0 <= faces.corners.min() <= faces.corners.max() < len(vertices):
        raise RigError(
            f"{neutral.name} has faces of fewer than three corners or of vertices beyond its {len(vertices):,}: "
            "the file may be cut off, export it again"
        )

    def read_shape(path: Source) -> Float[np.ndarray, "v 3"]:
        shape = read_vertices(path)
        if len(shape) != len(vertices):
            raise RigError(
                f"{path.name} has {len(shape):,} vertices, the neutral {neutral.name} has {len(vertices):,}: "
                "export both from the same mesh with its vertex order kept, or move it away if it is no blendshape"
            )
        if check_faces:
            check_faces(faces, neutral, path)
        return shape

    return rig_of_whole_files(folder, vertices, faces, shapes, read_shape, message=message)


def rig_of_whole_files(
    folder: Source,
    vertices: Float[np.ndarray, "v 3"],
    faces: Faces,
    shapes: list[Source],
    read_shape: Callable[[Source], Float[np.ndarray, "v 3"]],
    *,
    message: str,
) -> RawRig:
    """The rig of a neutral's vertices and faces and of the shapes that can be read; of the others it is said why."""
    shapes, deltas, broken = whole_deltas(vertices, shapes, read_shape)
    triangles = fan(faces.corners, faces.sizes)
    parts, part_names = vertex_parts(
        triangles, np.repeat(faces.labels, faces.sizes - 2), faces.part_names, len(vertices)
    )
    names, twice = numbered([path.stem for path in shapes])
    return RawRig(
        name=folder_name(folder),
        neutral=vertices,
        triangles=triangles,
        deltas=deltas,
        names=names,
        parts=parts,
        part_names=part_names,
        source_index=np.arange(len(vertices), dtype=np.int32),
        note=sentences(message, twice, broken),
    )
