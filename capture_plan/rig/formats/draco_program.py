"""Unpacks meshes compressed with Draco, in a process of its own: run as a program, given two archives.

The first holds the packed meshes as bytes, arr_0, arr_1, ...; into the second it writes of mesh i the triangles,
"i/faces", and each attribute under its unique number, "i/n". It knows nothing of the package that starts it.
"""

import sys

import DracoPy  # pyright: ignore[reportMissingImports]
import numpy as np

MEMORY_BYTES = 4 * 2**30  # address space, of which the libraries themselves take about 1 GB
CPU_SECONDS = 100


def limit() -> None:
    """Bound this process's memory and time, where the system can."""
    try:
        import resource  # not on Windows
    except ImportError:
        return
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY_BYTES, MEMORY_BYTES))
    resource.setrlimit(resource.RLIMIT_CPU, (CPU_SECONDS, CPU_SECONDS))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


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
    limit()
    unpack(sys.argv[1], sys.argv[2])
