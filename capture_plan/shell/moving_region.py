"""The part of a face that takes move, as a shell is built on it.

Data     x_v, triangles, skin of a rig; r_v the furthest that vertex v gets from rest in any take, millimetres
Part     triangles of skin with a vertex of r_v >= `STILL_MM`. Left out are loose pieces that nothing holds, but for
         the largest, and crumbs
Held     points of its rim, which is still (`boundary.py`); markers stand on what moves
Subjects of one topology have one part: a marker is the same vertex on all.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from capture_plan.errors import RigError
from capture_plan.mesh import pieces, with_area
from capture_plan.rig import Rig
from capture_plan.shell.boundary import STILL_MM, find_boundary

CRUMB = 0.01  # of the largest piece: a smaller one is a fold or noise, and asks for a marker where nothing is held


@dataclass(frozen=True, eq=False)
class MovingPart:
    """`at` are the rig's vertices of the part, ascending; the rest is numbered within them."""

    at: Int[np.ndarray, " v"]
    triangles: Int[np.ndarray, "f 3"]
    fixed: Bool[np.ndarray, " v"]
    moving: Bool[np.ndarray, " v"]


def part_of(rig: Rig, furthest: Float[np.ndarray, " n"], name: str) -> MovingPart:
    """The part that takes of this `name` move, from r.

    Raises:
        RigError: they move nothing.
    """
    triangles = moved_triangles(rig, furthest)
    if not len(triangles):
        raise RigError(f"{name} moves no skin by {STILL_MM:g} mm: check its unit and names, or record more of the face")
    at, inside = np.unique(triangles, return_inverse=True)
    within = inside.reshape(-1, 3)
    rim = find_boundary(rig.neutral[at], within, furthest[at])
    return MovingPart(at, within, rim.fixed, rim.moving)


def moved_triangles(rig: Rig, furthest: Float[np.ndarray, " n"]) -> Int[np.ndarray, "f 3"]:
    """The triangles of the part that moves."""
    moved = rig.skin & (furthest >= STILL_MM)
    triangles = rig.triangles[rig.skin[rig.triangles].all(axis=1) & moved[rig.triangles].any(axis=1)]
    triangles = with_area(rig.neutral, triangles)
    if not len(triangles):
        return triangles
    piece, inside = pieces(triangles, len(rig.neutral)), np.unique(triangles)
    size = np.bincount(piece[inside])
    held = np.bincount(piece[inside], weights=find_boundary(rig.neutral, triangles, furthest).fixed[inside]) > 0
    retained = held & (size >= CRUMB * size.max())
    retained[size.argmax()] = True
    return triangles[retained[piece[triangles[:, 0]]]]
