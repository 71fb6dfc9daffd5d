"""Markers as points that Faceform Wrap loads on the artist's own mesh: `wrap_points.json`.

File     {name: [t, u, v]}, names as in the plan
Point    P = A u + B v + C (1 - u - v) on triangle t = (A, B, C), counted from 0 over all groups of the artist's file,
         every polygon p0 ... pn cut into the fan (p0, pk, pk+1)
Never    numbers of our own triangles: parts that no expression needs are left out of these

Letters: m markers, t triangles of the artist's file.
"""

import json
from pathlib import Path

import numpy as np
from jaxtyping import Int

from capture_plan.errors import PlanError, RigError
from capture_plan.exports.delivery import Delivery
from capture_plan.exports.marker_names import distinct_names
from capture_plan.formats.raw import fan
from capture_plan.output import write_whole
from capture_plan.reader.artist_mesh import artist_mesh

LONGEST = 200  # letters of a name

Corners = dict[int, float]  # weights by vertex number of the artist's file, without those that are 0


def write(of: Delivery, folder: Path) -> list[Path]:
    """Write the points.

    Raises:
        PlanError: the artist's polygons cannot be had.
    """
    try:
        faces = artist_mesh(of.rig_file).faces
    except RigError as error:
        raise PlanError(f"no points for Wrap, which stand on triangles of the artist's own file: {error}") from None
    points = wrap_points(marker_corners(of), fan(faces.corners, faces.sizes))
    names = distinct_names(of.names, longest=LONGEST)
    lines = [f"{json.dumps(name)}: {json.dumps(point)}" for name, point in zip(names, points, strict=True)]
    path = of.place(folder, "wrap_points", ".json")
    write_whole(path, ("{\n" + ",\n".join(lines) + "\n}\n").encode())
    return [path]


def marker_corners(of: Delivery) -> list[Corners]:
    """On which vertices of the artist's file every marker stands, and how much on each."""
    rig = of.inputs.rig
    found = []
    for marker in of.plan.layout.markers:
        corners = rig.source_index[rig.triangles[marker.triangle]].tolist()
        found.append({v: weight for v, weight in zip(corners, marker.barycentric, strict=True) if weight})
    return found


def wrap_points(markers: list[Corners], triangles: Int[np.ndarray, "t 3"]) -> list[tuple[int, float, float]]:
    """Triangle, u and v of every marker, on the first triangle that has all the corners it stands on.

    Raises:
        PlanError: a marker's corners are no triangle of these.
    """
    return [_point(corners, triangles) for corners in markers]


def _point(corners: Corners, triangles: Int[np.ndarray, "t 3"]) -> tuple[int, float, float]:
    has = np.stack([(triangles == v).sum(axis=1) == 1 for v in corners]).all(axis=0)
    if not has.any():
        raise PlanError(
            f"the artist's file has no triangle at vertices {', '.join(map(str, corners))}: it is another mesh than "
            "the plan's, give that with --rig"
        )
    t = int(np.flatnonzero(has)[0])
    u, v, _ = (corners.get(vertex, 0.0) for vertex in triangles[t].tolist())
    return t, u, v
