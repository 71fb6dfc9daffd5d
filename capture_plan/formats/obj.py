"""Rigs as a folder of Wavefront OBJ files: the neutral, and one file for each blendshape, called after its file.

The vertex order is the file's own, and the neutral alone says what the faces are; the other files must agree with it.
Own code, because trimesh 5.2 renumbers: of ICT-FaceKit's 26,719 vertices in 12 materials it makes 28,911 in 12 meshes,
one for each pair of position and texture coordinate; with `maintain_order` 257,701 (right for one material only).

Letters: v vertices, p polygons, c corners of polygons, all in a row.
"""

import re

import numpy as np
from jaxtyping import Float

from capture_plan.errors import RigError
from capture_plan.formats.neutral_file import find_neutral
from capture_plan.formats.raw import RawRig
from capture_plan.formats.shapes import Faces, rig_of_whole_files
from capture_plan.formats.whole_files import OtherFacesError
from capture_plan.input.bounds import MOST_TEXT_BYTES, check_line_sizes, check_sides, content
from capture_plan.input.source import Source, is_kind

VERTEX = re.compile(rb"^[ \t]*v[ \t]+([^\n]*)", re.MULTILINE)
FACE = re.compile(rb"^[ \t]*f[ \t][^\n]*", re.MULTILINE)
STATEMENT = re.compile(rb"^[ \t]*(v|f|o|g|usemtl)(?:[ \t]+([^\n]*))?$", re.MULTILINE)
COMMA = re.compile(rb"(?<=\d),(?=\d)")


def read_obj_folder(folder: Source) -> RawRig:
    """The rig in `folder`; unit and axes are unknown. RigError when the files do not make one rig."""
    paths = sorted((p for p in folder.iterdir() if is_obj(p)), key=natural)
    neutral_path, chosen = find_neutral(folder, paths, read_obj_vertices)
    shapes = [path for path in paths if path != neutral_path]
    if not shapes:
        raise RigError(
            f"{folder.name} holds only a neutral, {neutral_path.name}: "
            "export one OBJ file for each blendshape into the same folder"
        )
    data = load_text(neutral_path)
    neutral, faces, face_text = parse_vertices(data, neutral_path), parse_faces(data, neutral_path), join_faces(data)
    if len(faces.sizes) == 0:
        raise RigError(f"{neutral_path.name} has vertices but no faces ('f' lines): export the neutral with its faces")

    def shape(path: Source) -> Float[np.ndarray, "v 3"]:
        data = load_text(path)
        vertices = parse_vertices(data, path)
        if len(vertices) != len(neutral):
            raise RigError(
                f"{path.name} has {len(vertices):,} vertices, the neutral {neutral_path.name} has {len(neutral):,}: "
                "export both from the same mesh with 'keep vertex order' on, or move it away if it is no blendshape"
            )
        check_faces(data, path)
        return vertices

    def check_faces(data: bytes, path: Source) -> None:
        text = join_faces(data)
        if text == face_text and b"-" not in text:  # negative numbers mean different vertices in different places
            return
        ended = text + b"\n" if text and data.endswith(b"\n") else text  # else its last line may be cut
        if len(text) < len(face_text) and face_text.startswith(ended):
            raise RigError(
                f"{path.name} has {text.count(b'f'):,} faces, the neutral {neutral_path.name} has "
                f"{len(faces.sizes):,}: if the file was cut off, export it again, else export both from the same mesh"
            )
        check_same_faces(faces, neutral_path, parse_faces(data, path), path)

    return rig_of_whole_files(folder, neutral, faces, shapes, shape, message=chosen)


def read_obj_vertices(path: Source) -> Float[np.ndarray, "v 3"]:
    """Places of all vertices, in the file's order."""
    return parse_vertices(load_text(path), path)


def is_obj(path: Source) -> bool:
    """Whether this is an OBJ file that a person would see (macOS leaves `._name.obj` files behind)."""
    return is_kind(path, ".obj")


def natural(path: Source) -> tuple[list[str | int], str]:
    """Sort key that puts morph_2 before morph_10: words and numbers take turns, so that like is compared with like."""
    return [int(piece) if at % 2 else piece for at, piece in enumerate(re.split(r"([0-9]+)", path.stem))], path.suffix


def load_text(path: Source) -> bytes:
    """The file's text with plain line ends and with continued lines joined."""
    try:
        data = content(path, MOST_TEXT_BYTES)
    except OSError as error:
        raise RigError(f"{path.name} cannot be read ({error.strerror}): check the file and its permissions") from error
    if not data.strip():
        raise RigError(f"{path.name} is empty: export it again")
    if b"\r" in data:
        data = data.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    data = data.replace(b"\\\n", b" ")
    check_line_sizes(data, path.name)
    return data


def parse_vertices(data: bytes, path: Source) -> Float[np.ndarray, "v 3"]:
    """The first three numbers of every 'v' line; a weight or a colour may follow them."""
    lines = VERTEX.findall(data)
    if not any(map(bytes.strip, lines)):
        raise RigError(f"{path.name} has no vertices ('v' lines): it is not a Wavefront OBJ mesh, or it was cut off")
    try:
        vertices = np.loadtxt(with_points(lines), ndmin=2, encoding="ascii")
    except ValueError as error:
        number, line = first_bad_vertex(lines)
        raise RigError(
            f"{path.name}: vertex {number:,} reads 'v {line}', expected three numbers as in the others: "
            "the file may be cut off, export it again"
        ) from error
    if vertices.shape[1] < 3 or len(vertices) != len(lines):
        raise RigError(f"{path.name} has vertices with fewer than three coordinates: export it again")
    return vertices[:, :3].copy()


def with_points(lines: list[bytes]) -> list[bytes]:
    """Lines of numbers with points for decimal commas, which some programs write in some countries."""
    if any(b"." in line for line in lines) or not any(b"," in line for line in lines):
        return lines
    return [COMMA.sub(b".", line) for line in lines]


def first_bad_vertex(lines: list[bytes]) -> tuple[int, str]:
    """Number from 1 and text of the first 'v' line that does not hold as many numbers as the first line."""
    width = len(lines[0].split())
    for number, line in enumerate(lines, start=1):
        try:
            fits = len([float(word) for word in line.split()]) == width
        except ValueError:
            fits = False
        if not fits:
            return number, line.decode(errors="replace").strip()[:60]
    return 1, lines[0].decode(errors="replace").strip()[:60]


def join_faces(data: bytes) -> bytes:
    """All 'f' lines: equal text, equal faces."""
    return b"\n".join(FACE.findall(data))


def parse_faces(data: bytes, path: Source) -> Faces:
    """Polygons, with what the file's 'o', 'g' and 'usemtl' lines say of them."""
    corners, sizes, keys, v = [], [], [], 0
    current = {b"o": "", b"g": "", b"usemtl": ""}
    for kind, rest in STATEMENT.findall(data):
        if kind == b"v":
            v += 1
        elif kind == b"f":
            try:
                polygon = [int(corner.split(b"/")[0]) for corner in rest.split(b"#")[0].split()]
            except ValueError as error:
                raise RigError(
                    f"{path.name}: the face 'f {rest[:60].decode(errors='replace')}' does not read: export again"
                ) from error
            if len(polygon) < 3 or 0 in polygon:
                raise RigError(
                    f"{path.name}: the face 'f {rest[:60].decode(errors='replace')}' needs three or more vertices, "
                    "counted from 1: the file may be cut off, export it again"
                )
            check_sides(path.name, len(polygon))
            corners += [i - 1 if i > 0 else v + i for i in polygon]  # -1 is the last vertex so far
            sizes.append(len(polygon))
            keys.append(tuple(current.values()))
        else:
            current[kind] = rest.decode(errors="replace").strip()
    if corners and not 0 <= min(corners) <= max(corners) < v:
        worst = max(corners) if max(corners) >= v else min(corners)
        raise RigError(
            f"{path.name}: a face uses vertex {worst + 1:,} of {v:,}: the file may be cut off, export it again"
        )
    numbers = {key: number for number, key in enumerate(dict.fromkeys(keys))}
    return Faces(
        np.array(corners, dtype=np.int32),
        np.array(sizes, dtype=np.int32),
        np.array([numbers[key] for key in keys], dtype=np.int32),
        name_parts(list(numbers)),
    )


def name_parts(keys: list[tuple[str, ...]]) -> tuple[str, ...]:
    """Short names for (object, group, material): of these, the ones that tell parts apart, joined by '/'."""
    telling = [column for column in range(3) if len({key[column] for key in keys}) > 1]
    if not telling:
        return tuple(next((word for word in reversed(key) if word), "mesh") for key in keys)
    return tuple("/".join(key[column] for column in telling if key[column]) or "mesh" for key in keys)


def check_same_faces(neutral: Faces, neutral_path: Source, faces: Faces, path: Source) -> None:
    """RigError unless both files have the same polygons, wherever each starts and in whatever order they come."""
    if len(faces.sizes) != len(neutral.sizes):
        raise RigError(
            f"{path.name} has {len(faces.sizes):,} faces, the neutral {neutral_path.name} has {len(neutral.sizes):,}: "
            "export both from the same mesh; if the file was cut off, export it again"
        )
    if cycles(faces) != cycles(neutral):
        raise OtherFacesError(
            f"{path.name} joins its vertices into other faces than the neutral {neutral_path.name}: "
            "export both from the same mesh with 'keep vertex order' on"
        )


def cycles(faces: Faces) -> list[list[int]]:
    """Every polygon from its smallest vertex on, in sorted order."""
    polygons = [c.tolist() for c in np.split(faces.corners, np.cumsum(faces.sizes)[:-1])]
    starts = [polygon.index(min(polygon)) for polygon in polygons]
    return sorted(polygon[start:] + polygon[:start] for polygon, start in zip(polygons, starts, strict=True))
