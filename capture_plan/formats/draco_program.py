"""Unpacks meshes compressed with Draco, in a process of its own: run as a program, given two archives.

The first holds the packed meshes as bytes, arr_0, arr_1, ...; into the second it writes of mesh i the triangles,
"i/faces", and each attribute under its unique number, "i/n". It knows nothing of who starts it.
"""

import os
import sys

import DracoPy  # pyright: ignore[reportMissingImports]
import numpy as np

from capture_plan.formats.limits import limit_work

MEMORY_BYTES, MOST_MEMORY_BYTES = 3 << 29, 4 << 30  # address space, of which the libraries themselves take 1 GB
CPU_SECONDS = 5
MEMORY_EACH, BYTES_IN_A_SECOND = 200, 500_000  # memory for each packed byte; how slowly they may be unpacked


def unpack(source: str, target: str) -> None:
    """Writes what the packed meshes of the archive `source` hold to `target`."""
    arrays = {}
    with np.load(source, allow_pickle=False) as packed:
        for number in range(len(packed.files)):
            mesh = DracoPy.decode(packed[f"arr_{number}"].tobytes())
            arrays[f"{number}/faces"] = np.asarray(mesh.faces).astype(np.uint32)
            arrays |= {f"{number}/{one['unique_id']}": np.asarray(one["data"]) for one in mesh.attributes}
    np.savez(target, **arrays)


if __name__ == "__main__":
    size = os.path.getsize(sys.argv[1])
    memory = min(MEMORY_BYTES + MEMORY_EACH * size, MOST_MEMORY_BYTES)
    limit_work(memory=memory, seconds=CPU_SECONDS + size // BYTES_IN_A_SECOND)
    unpack(sys.argv[1], sys.argv[2])
