"""MakeHuman rigs as their program stores them: one OBJ base mesh, and below its folder one `.target` file for each
blendshape, called after its file, with a line `vertex dx dy dz` for every vertex that moves, in decimetres; also
compressed, `.target.gz`.

The base mesh is a whole body that also holds fitting shells and joint markers, which are never shown: they are left
out, or hair and clothes of nobody would hide the skin. What stays keeps its number in the base mesh (`source_index`).

Letters: v vertices, k blendshapes.
"""

import gzip
import re
import zlib

import numpy as np
from jaxtyping import Float, Int

from capture_plan.errors import RigError
from capture_plan.formats.naming import numbered
from capture_plan.formats.obj import is_obj, load_text, natural, parse_faces, parse_vertices, with_points
from capture_plan.formats.raw import RawRig, fan, vertex_parts
from capture_plan.input.bounds import check_line_sizes, check_size, content
from capture_plan.input.source import Source, folder_name, is_kind, walk
from capture_plan.progress import track

UNIT_MM = 100.0  # decimetres
MOST_BYTES = 64 << 20  # of one unpacked target: a line for each of a million vertices
MESHES = (".obj", ".ply", ".csv", ".npz", ".glb", ".gltf", ".vrm", ".fbx")
UNSEEN = re.compile(r"joint-|helper-(tights|skirt|hair|genital)")


def is_target(path: Source) -> bool:
    """Whether this is a blendshape's file."""
    name = path.name.lower()
    return name.endswith((".target", ".target.gz")) and not name.startswith(".") and not path.is_dir()


def holds_targets(folder: Source) -> bool:
    """Whether a folder has `.target` files somewhere below, and one OBJ mesh or no mesh at all."""
    meshes = [path for path in folder.iterdir() if any(is_kind(path, kind) for kind in MESHES)]
    return (not meshes or (len(meshes) == 1 and is_obj(meshes[0]))) and any(map(is_target, walk(folder)))


def read_target_folder(folder: Source) -> RawRig:
    """The rig in `folder`, decimetres, +y up, facing +z by the format. RigError when the files do not make one rig."""
    base = next((path for path in folder.iterdir() if is_obj(path)), None)
    if base is None:
        raise RigError(
            f"{folder_name(folder)} holds .target files but not the mesh that they move: "
            "put MakeHuman's base.obj into it"
        )
    data = load_text(base)
    vertices, faces = parse_vertices(data, base), parse_faces(data, base)
    paths = sorted((path for path in walk(folder) if is_target(path)), key=natural)
    check_size(folder_name(folder), len(paths), len(vertices))
    triangles, labels = fan(faces.corners, faces.sizes), np.repeat(faces.labels, faces.sizes - 2)
    seen = np.array([not UNSEEN.match(name) for name in faces.part_names] or [False])
    triangles, labels = triangles[seen[labels]], labels[seen[labels]]
    retained = np.unique(triangles)
    if len(retained) == 0:
        raise RigError(f"{base.name} has vertices but no faces: export the base mesh with its faces")
    deltas = np.zeros((len(paths), len(retained), 3), np.float32)
    for k, path in enumerate(track(paths, "Reading blendshapes")):
        index, moves = _read_target(path, len(vertices))
        whole = np.zeros_like(vertices)
        whole[index] = moves
        deltas[k] = whole[retained]
    triangles = np.searchsorted(retained, triangles).astype(np.int32)
    shown = tuple(name for name, shows in zip(faces.part_names, seen, strict=True) if shows)
    parts, part_names = vertex_parts(triangles, (np.cumsum(seen) - 1)[labels], shown, len(retained))
    names, message = numbered([re.sub(r"\.target(\.gz)?$", "", path.name, flags=re.IGNORECASE) for path in paths])
    return RawRig(
        name=folder_name(folder),
        neutral=vertices[retained],
        triangles=triangles,
        deltas=deltas,
        names=names,
        parts=parts,
        part_names=part_names,
        source_index=retained.astype(np.int32),
        unit_mm=UNIT_MM,
        up="+y",
        facing="+z",
        note=message,
    )


def _unpacked(path: Source) -> bytes:
    """The file's text. RigError when it was compressed and is damaged, or holds more than any target does."""
    if path.suffix.lower() != ".gz":
        return content(path, MOST_BYTES)
    try:
        with path.open("rb") as file, gzip.open(file) as text:
            data = text.read(MOST_BYTES + 1)
    except (OSError, EOFError, zlib.error) as error:
        raise RigError(f"{path.name} is no whole gzip file: copy it again, or unpack it") from error
    if len(data) > MOST_BYTES:
        raise RigError(
            f"{path.name} unpacks to more than {MOST_BYTES / 1e6:,.0f} MB, which no target does: copy it again"
        )
    return data


def _read_target(path: Source, v: int) -> tuple[Int[np.ndarray, " n"], Float[np.ndarray, "n 3"]]:
    """Vertices that move, and how."""
    text = _unpacked(path)
    check_line_sizes(text, path.name)
    lines = [line for row in text.splitlines() if (line := row.partition(b"#")[0].strip())]
    if not lines:
        return np.zeros(0, np.int64), np.zeros((0, 3))
    try:
        table = np.loadtxt(with_points(lines), ndmin=2, encoding="ascii")
    except ValueError as error:
        found = " ".join(str(error).split())[:100]
        raise RigError(f"{path.name} is not a table of 'vertex dx dy dz' ({found}): export it again") from error
    if table.shape[1] != 4 or not np.isfinite(table[:, 0]).all():
        raise RigError(f"{path.name} is not a table of 'vertex dx dy dz': export it again")
    index = table[:, 0]
    if (index != np.floor(index)).any() or index.min() < 0 or index.max() >= v:
        worst = index.max() if index.max() >= v else index.min()
        raise RigError(f"{path.name} moves vertex {worst:g} of {v:,}: it belongs to another base mesh")
    return index.astype(np.int64), table[:, 1:]
