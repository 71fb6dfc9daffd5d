"""A head as a scanner or a sculptor gives it: a mesh of any topology in any unit and pose, read with trimesh.

Unit     as a person states it, else each of UNITS_MM that makes the head as large as heads are, the likeliest first:
         where several do, whoever lays a face onto it finds out which fits
Ending   .obj, .ply, .stl, .3mf, .glb, .off; what hangs together is welded, triangles without area go
"""

import io
import math
import zipfile
import zlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import trimesh
from jaxtyping import Float, Int

from capture_plan.cache import digest
from capture_plan.errors import RigError
from capture_plan.input.bounds import content
from capture_plan.mesh.geometry import triangle_areas

HEAD_FORMATS = (".obj", ".ply", ".stl", ".3mf", ".glb", ".off")
MOST_BYTES = 1 << 28  # a PLY scan of 5 million triangles has 180 MB
MOST_TRIANGLES = 5_000_000
MASK_BYTES = 1 << 16  # at the beginning of a 3MF model, where the first object stands
LEAST_TRIANGLES = 200  # with fewer no nose has a shape
UNITS_MM = (1.0, 10.0, 1000.0, 25.4, 100.0)  # mm, cm, m, inch, dm: in this order where several are possible
HEAD_MM = (200.0, 1100.0)  # diagonal of the box around a face mask, and around a head with shoulders
MASK_BEGINS, PIECE = "Mask: ", "mask "  # a mask's STL; the names of its pieces in 3MF
FLAT = 1e-12  # area over the box's squared diagonal: such a triangle has no normal


@dataclass(frozen=True, eq=False)
class HeadScan:
    """A surface in the coordinates and the unit of its file; `units_mm` are what one unit may be, in millimetres."""

    name: str
    vertices: Float[np.ndarray, "s 3"]
    triangles: Int[np.ndarray, "g 3"]
    units_mm: tuple[float, ...]
    fingerprint: str


def read_head(path: Path | str, unit_mm: float | None = None) -> HeadScan:
    """The head in a file; one unit is `unit_mm` millimetres where a person says so.

    Raises:
        RigError: missing, too large, of another kind, without a surface, or of no unit in which it is a head.
    """
    path = Path(path)
    if unit_mm is not None and not 0 < unit_mm < math.inf:
        raise RigError(f"one unit of {path.name} cannot be {unit_mm:g} mm: give a length above 0, as --unit-mm 10")
    if path.suffix.lower() not in HEAD_FORMATS:
        raise RigError(f"{path.name} is no scan of a known kind: give one of {', '.join(HEAD_FORMATS)}")
    if not path.exists():
        raise RigError(f"{path} does not exist: give a file with the actor's head")
    data = content(path, MOST_BYTES)
    if is_mask(data):
        raise RigError(f"{path.name} is a mask that was made of a plan: give the scan of the actor's head instead")
    try:
        mesh = trimesh.load_mesh(io.BytesIO(data), file_type=path.suffix.lower()[1:], process=True, skip_materials=True)
        vertices, triangles = np.asarray(mesh.vertices, dtype=float), np.asarray(mesh.faces)
    except MemoryError:
        raise
    except Exception as error:
        if isinstance(error, ImportError) and path.suffix.lower() == ".3mf":
            raise RigError(f"{path.name}: pip install 'capture-plan[3mf]' to read 3MF, or export it as PLY") from None
        reason = " ".join(str(error).split())[:120] or type(error).__name__
        raise RigError(f"{path.name} cannot be read as a mesh ({reason}): export it again as PLY or OBJ") from None
    vertices, triangles = _sound(path.name, vertices, triangles)
    # the name of what was read, so that the same bytes are the same head
    return HeadScan(path.stem, vertices, triangles, _units(path.name, vertices, unit_mm), digest([data])[:16])


def is_mask(data: bytes) -> bool:
    """Whether a file holds a mask that we wrote (`mask/write.py`)."""
    if data.startswith(MASK_BEGINS.encode()):
        return True
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            return f'name="{PIECE}1"'.encode() in archive.open("3D/3dmodel.model").read(MASK_BYTES)
    except (zipfile.BadZipFile, KeyError, OSError, ValueError, NotImplementedError, RuntimeError, zlib.error, EOFError):
        return False


def _sound(
    name: str, vertices: Float[np.ndarray, "s 3"], triangles: Int[np.ndarray, "g 3"]
) -> tuple[Float[np.ndarray, "_ 3"], Int[np.ndarray, "_ 3"]]:
    """The surface that is left without triangles that have no area; RigError where that is too little or too much."""
    if triangles.ndim != 2 or len(triangles) == 0:
        raise RigError(f"{name} holds points without triangles: mesh the scan first and export it with its faces")
    if not np.isfinite(vertices[triangles]).all():
        raise RigError(f"{name} holds NaN or infinite coordinates: clean the mesh and export it again")
    box = float(np.square(np.ptp(vertices[triangles.ravel()], axis=0)).sum())
    solid = triangles[triangle_areas(vertices, triangles) > FLAT * box]
    if len(solid) < LEAST_TRIANGLES:
        raise RigError(
            f"{name} has {len(solid):,} triangles, expected {LEAST_TRIANGLES:,} or more: give the scan itself"
        )
    if len(solid) > MOST_TRIANGLES:
        raise RigError(f"{name} has {len(solid):,} triangles, expected at most {MOST_TRIANGLES:,}: make it coarser")
    at, local = np.unique(solid, return_inverse=True)
    return vertices[at], local.reshape(-1, 3)


def _units(name: str, vertices: Float[np.ndarray, "s 3"], unit_mm: float | None) -> tuple[float, ...]:
    """What one unit may be, millimetres."""
    diagonal = float(np.linalg.norm(np.ptp(vertices, axis=0)))
    if unit_mm is not None:
        return (unit_mm,)
    found = tuple(unit for unit in UNITS_MM if HEAD_MM[0] <= unit * diagonal <= HEAD_MM[1])
    if not found:
        raise RigError(
            f"{name} is {diagonal:g} units from corner to corner, which is a head of {HEAD_MM[0]:g} to "
            f"{HEAD_MM[1]:g} mm in no usual unit: cut it to head and shoulders, or say --unit-mm"
        )
    return found
