"""glTF meshes compressed with Draco (KHR_draco_mesh_compression), unpacked in a process of their own.

The library is native code that reads what a stranger wrote: a damaged file may end the process, or make it ask for any
amount of memory, so it gets its own, with a limit on both memory and time. Morph targets are never compressed; what is
unpacked takes the place of the accessors that the primitive names (`Gltf.decoded`), and must be as long as they say.

DracoPy is an extra, `capture-plan[draco]`. Letters: v vertices, f triangles.
"""

import importlib.util
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from capture_plan.errors import RigError
from capture_plan.formats.own_process import BrokenProcessError, arrays_from

if TYPE_CHECKING:
    from capture_plan.formats.gltf_file import Gltf

NAME = "KHR_draco_mesh_compression"
PROGRAM = Path(__file__).with_name("draco_program.py")
SECONDS = 120.0
ADVICE = "export it as .glb without compression"


def unpack_mesh(gltf: "Gltf") -> None:
    """Puts what is compressed with Draco into `gltf.decoded`, where the file has no other copy of it."""
    packed = [primitive for mesh in gltf.document.get("meshes", []) for primitive in mesh["primitives"]]
    packed = [
        primitive for primitive in packed if NAME in (primitive.get("extensions") or {}) and is_needed(gltf, primitive)
    ]
    if not packed:
        return
    if importlib.util.find_spec("DracoPy") is None:
        raise RigError(f"needs {NAME}: install it with pip install 'capture-plan[draco]', or {ADVICE}")
    arrays = _run([bytes(gltf.view(primitive["extensions"][NAME]["bufferView"])) for primitive in packed])
    for number, primitive in enumerate(packed):
        places = {index: f"{number}/{unique}" for index, unique in attributes(primitive)}
        if "indices" in primitive:
            places[primitive["indices"]] = f"{number}/faces"
        for index, name in places.items():
            if name not in arrays:
                raise RigError(f"has a mesh that Draco compression left without {name.partition('/')[2]}: {ADVICE}")
            gltf.decoded[index] = fitted(gltf, index, arrays[name])


def attributes(primitive: dict[str, Any]) -> list[tuple[int, int]]:
    """Accessor and Draco's own number of every attribute of a primitive that is compressed."""
    numbers = primitive["extensions"][NAME]["attributes"]
    return [(index, numbers[name]) for name, index in primitive["attributes"].items() if name in numbers]


def is_needed(gltf: "Gltf", primitive: dict[str, Any]) -> bool:
    """Whether a primitive has no uncompressed copy of its places and faces beside it, or the file allows none."""
    if NAME in gltf.document.get("extensionsRequired", []):
        return True
    needed = [primitive["attributes"].get("POSITION"), primitive.get("indices")]
    return any(index is not None and "bufferView" not in gltf.entry("accessors", index) for index in needed)


def fitted(gltf: "Gltf", index: int, values: np.ndarray) -> np.ndarray:
    """Values as the accessor has them. RigError when there are more or fewer than it says."""
    accessor, rows = gltf.entry("accessors", index), gltf.shape(index)
    values = values.reshape(-1, rows[1])
    if values.shape != rows:
        raise RigError(f"has {len(values):,} values in Draco compression, accessor {index} says {rows[0]:,}: {ADVICE}")
    return values.astype(gltf.dtype(accessor))


def _run(packed: list[bytes]) -> dict[str, np.ndarray]:
    """Arrays of all packed meshes: "0/faces", "0/1" for the attribute 1 of the first mesh, and so on."""
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder) / "packed.npz"
        np.savez(source, *(np.frombuffer(data, np.uint8) for data in packed))
        try:
            return arrays_from(PROGRAM, source, seconds=SECONDS)
        except BrokenProcessError as error:
            raise RigError(
                f"has a Draco compression that cannot be unpacked (it is damaged or too large): {ADVICE}"
            ) from error
