"""Reads the meshes of an Alembic file over time, in a process of its own: run as a program, given file and archive.

Into the archive it writes of mesh i, in the order of the file: points over time "i/points" (t v 3) or (1 v 3), its
place in the scene "i/places" (t 4 4), polygons "i/sizes" and "i/corners"; and "times" (t) in seconds. Where a mesh
changes its polygons it writes "changing" instead. It knows nothing of who starts it.

Polygons of Alembic run clockwise; they are written the other way round. Matrices there act on rows, here on columns.
"""

import os
import sys

import numpy as np
from alembic3d.Abc import IArchive, ISampleSelector  # pyright: ignore[reportMissingImports]
from alembic3d.AbcGeom import IPolyMesh, IXform  # pyright: ignore[reportMissingImports]

from capture_plan.formats.limits import limit_work

MEMORY_BYTES, MOST_MEMORY_BYTES = 3 << 29, 6 << 30  # address space; the libraries themselves take a part of it
CPU_SECONDS, BYTES_IN_A_SECOND, MEMORY_EACH = 20, 2_000_000, 8
MOST_MOTION = 1 << 30  # bytes of points


def meshes_in(parent, above=()):
    """Every mesh below an object, with the transforms above it, the nearest last."""
    for number in range(parent.getNumChildren()):
        child = parent.getChild(number)
        if IPolyMesh.matches(child.getHeader()):
            yield IPolyMesh(parent, child.getName()).getSchema(), above
        own = (IXform(parent, child.getName()).getSchema(),) if IXform.matches(child.getHeader()) else ()
        yield from meshes_in(child, (*above, *own))


def times_of(schemas):
    """Seconds of the samples of the schema that has most of them."""
    longest = max(schemas, key=lambda schema: schema.getNumSamples())
    sampling = longest.getTimeSampling()
    return np.array([sampling.getSampleTime(t) for t in range(longest.getNumSamples())], dtype=np.float64)


def placed(above, time):
    """The matrix of a mesh's place at a time, acting on columns."""
    whole = np.eye(4)
    for schema in above:
        sample = schema.getValue(ISampleSelector(float(time)))
        own = np.array([[sample.getMatrix()[i][j] for j in range(4)] for i in range(4)]).T
        whole = whole @ own if sample.getInheritsXforms() else own
    return whole


def read(source, target):
    """Writes the meshes of the Alembic file `source` to the archive `target`."""
    archive = IArchive(source)
    meshes = [(schema, above) for schema, above in meshes_in(archive.getTop()) if schema.getNumSamples()]
    if not meshes:
        np.savez(target, times=np.empty(0))
        return
    times = times_of([schema for schema, above in meshes] + [one for _, above in meshes for one in above])
    arrays = {"times": times}
    for number, (schema, above) in enumerate(meshes):
        first = schema.getValue(ISampleSelector(float(times[0])))
        sizes, corners = np.array(first.getFaceCounts()), np.array(first.getFaceIndices())
        moves = schema.getNumSamples() > 1
        points = []
        for time in times if moves else times[:1]:
            sample = schema.getValue(ISampleSelector(float(time)))
            points.append(np.array(sample.getPositions(), dtype=np.float32))
            if len(points[-1]) != len(points[0]) or len(np.array(sample.getFaceIndices())) != len(corners):
                np.savez(target, changing=np.array(1))
                return
            if len(points) * points[0].nbytes > MOST_MOTION:
                raise MemoryError
        starts = np.repeat(np.cumsum(sizes) - sizes, sizes)
        turned = starts + np.repeat(sizes, sizes) - 1 - (np.arange(len(corners)) - starts)
        arrays |= {
            f"{number}/points": np.stack(points),
            f"{number}/places": np.stack([placed(above, time) for time in times]),
            f"{number}/sizes": sizes,
            f"{number}/corners": corners[turned],
        }
    np.savez(target, **arrays)  # pyright: ignore[reportArgumentType]


if __name__ == "__main__":
    size = os.path.getsize(sys.argv[1])
    memory = min(MEMORY_BYTES + MEMORY_EACH * size, MOST_MEMORY_BYTES)
    limit_work(memory=memory, seconds=CPU_SECONDS + size // BYTES_IN_A_SECOND)
    read(sys.argv[1], sys.argv[2])
