"""The neutral as the artist's own file has it: all of its vertices and polygons, in its order, unit and axes.

Which    of a folder of OBJ or PLY files the neutral's, of MakeHuman's folder the base mesh; also inside a zip archive
Not      other formats: their vertices are split, welded or grouped by who reads them, so that no two programs number
         them alike

Letters: n vertices of the file.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

from capture_plan.errors import RigError
from capture_plan.formats.neutral_file import find_neutral
from capture_plan.formats.obj import is_obj, load_text, natural, parse_faces, parse_vertices, read_obj_vertices
from capture_plan.formats.ply import read_faces, read_vertices
from capture_plan.formats.shapes import Faces
from capture_plan.formats.target import holds_targets
from capture_plan.input.source import Source, is_kind
from capture_plan.input.zipped import find_rig, open_zip
from capture_plan.reader.read import is_rig


@dataclass(frozen=True, eq=False)
class ArtistMesh:
    """Name, vertices and polygons of the file; `obj` is its text where it is an OBJ file, with plain line ends."""

    name: str
    vertices: Float[np.ndarray, "n 3"]
    faces: Faces
    obj: bytes | None


def artist_mesh(rig_file: Path | None) -> ArtistMesh:
    """The neutral in the file or folder that a rig was read from.

    Raises:
        RigError: there is none, or its format has no vertex numbers of its own.
    """
    if rig_file is None:
        raise RigError("the bundled head and rigs made in Python have none: plan on a folder of OBJ files")
    if rig_file.suffix.lower() == ".zip" and not rig_file.is_dir():
        with open_zip(rig_file) as root:
            return _mesh_in(find_rig(root, is_rig))
    return _mesh_in(rig_file)


def _mesh_in(source: Source) -> ArtistMesh:
    inside = [*source.iterdir()] if source.is_dir() else []
    if any(map(is_obj, inside)):
        path = _neutral(source, list(filter(is_obj, inside)), read_obj_vertices)
        text = load_text(path)
        return ArtistMesh(path.name, parse_vertices(text, path), parse_faces(text, path), text)
    if plys := [path for path in inside if is_kind(path, ".ply")]:
        path = _neutral(source, plys, read_vertices)
        return ArtistMesh(path.name, read_vertices(path), read_faces(path), None)
    raise RigError(
        f"{source.name} is no folder of OBJ or PLY files, the formats whose vertices and polygons every program "
        "numbers alike: export the rig as OBJ files and plan on these"
    )


def _neutral(folder: Source, paths: list[Source], read: Callable[[Source], Float[np.ndarray, "n 3"]]) -> Source:
    return paths[0] if holds_targets(folder) else find_neutral(folder, sorted(paths, key=natural), read)[0]
