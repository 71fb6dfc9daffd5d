"""A zone that a person marked: a list of vertex numbers, or a painted mesh.

Text   vertex numbers as in `--skin`: numbered in the artist's own file, counted from 0, ranges a-b allowed
PLY    the neutral with a colour at every vertex, in the artist's vertex order; painted is what has a hue:
       max(r, g, b) - min(r, g, b) > HUE of the full range, whatever the hue; white, grey and black stay free
Check  the distances of the painted mesh's vertices from their middle are those of the rig, up to a scale
"""

from bisect import bisect_left
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float

from capture_plan.anatomy.zones import Zone
from capture_plan.errors import RigError
from capture_plan.formats.ply import read_ply, read_vertices
from capture_plan.reader.read import in_ranges, vertex_ranges
from capture_plan.rig.record import Rig

HUE = 0.2  # of full range: half of what the palest crayons of painting programs have; shading baked in grey has none
SAME = 0.01  # of the mesh's size: rounding of text files stays below, another vertex order does not
FULL = (1.0, 255.0, 65535.0)  # brightest white of numbers with a point, of bytes and of 16 bits
CHANNELS = (("red", "green", "blue"), ("r", "g", "b"), ("diffuse_red", "diffuse_green", "diffuse_blue"))


def painted_zone(path: str | Path, rig: Rig) -> Zone:
    """The zone of a text file of vertex numbers or of a PLY file with vertex colours, named after its file.

    Raises:
        RigError: the file cannot be read, does not fit the rig, or marks nothing.
    """
    path = Path(path)
    try:
        mask = _coloured(path, rig) if path.suffix.lower() == ".ply" else _listed(path, rig)
    except OSError as error:
        raise RigError(f"{path}: cannot be read as a keep-out zone: {error.strerror}") from error
    if not mask.any():
        how = "paint it in a hue, not white or grey" if path.suffix.lower() == ".ply" else "list its vertex numbers"
        raise RigError(f"{path.name} marks no vertex of {rig.name}: {how}")
    return Zone(path.stem, mask, f"marked by hand in {path.name}")


def _listed(path: Path, rig: Rig) -> Bool[np.ndarray, " v"]:
    ranges, known = vertex_ranges(path), np.sort(rig.source_index)
    for low, high in ranges:
        at = bisect_left(known, low)
        if at == len(known) or known[at] > high:
            named = f"{low}-{high}" if high != low else low
            raise RigError(
                f"{path.name} names vertex {named}, which {rig.name} does not have: "
                f"give its file's own numbers, of which the rig keeps {len(known):,} between 0 and {known[-1]:,} "
                "(in an NPZ those of 'source_index' where it has them)"
            )
    return in_ranges(rig.source_index, ranges)


def _coloured(path: Path, rig: Rig) -> Bool[np.ndarray, " v"]:
    vertices, table = read_vertices(path), read_ply(path)["vertex"]
    needed = int(rig.source_index.max()) + 1
    if len(vertices) < needed:
        raise RigError(
            f"{path.name} has {len(vertices):,} vertices, {rig.name} has {needed:,} in its file: "
            "paint the neutral itself and export it with 'keep vertex order' on"
        )
    if not _same_shape(vertices[rig.source_index], rig.neutral):
        raise RigError(
            f"{path.name} does not have the shape of {rig.name}'s neutral, vertex by vertex: "
            "paint the neutral itself and export it with 'keep vertex order' on"
        )
    names = next((names for names in CHANNELS if set(names) <= set(table)), None)
    if names is None:
        raise RigError(f"{path.name} has no vertex colours: export it with vertex colours (red, green, blue)")
    rgb = np.stack([table[name][1] for name in names], axis=1)
    largest, levels = float(rgb.max()), FULL if rgb.dtype.kind == "f" else FULL[1:]
    full = next((level for level in levels if largest <= level), largest)
    return (np.ptp(rgb.astype(np.float64) / full, axis=1) > HUE)[rig.source_index]


def _same_shape(a: Float[np.ndarray, "v 3"], b: Float[np.ndarray, "v 3"]) -> bool:
    """Whether the distances from the middle agree, up to the unit of length."""
    from_a, from_b = (np.linalg.norm(x - x.mean(axis=0), axis=1) for x in (a, b))
    size = np.linalg.norm(from_a)
    return bool(size > 0 and np.abs(from_a * (np.linalg.norm(from_b) / size) - from_b).max() <= SAME * from_b.max())
