"""What the finished mask measures, from its triangles and the skin alone, whatever it was designed to be.

Wall    from the middle and the corners of every triangle that lies over the skin: the length of the ray through the
        plastic, against the triangle's normal, to where it leaves it
Open    from points along an opening, forward (of a nostril forward and down): the share of rays that meet no plastic
Gap     from every vertex of the skin beneath the mask: the ray along its normal to the plastic

Letters: f triangles, n points of the skin; millimetres.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from capture_plan.mask.record import LEAST_WALL_MM, Mesh
from capture_plan.mask.skin import Skin
from capture_plan.mesh.geometry import triangle_cross
from capture_plan.visibility.occluder import Occluder

CORNERS = np.array([[1, 1, 1], [8, 1, 1], [1, 8, 1], [1, 1, 8]]) / np.array([[3], [10], [10], [10]])
START_MM = 1e-2  # of a ray below the surface: float32 rays from closer by hit their own triangle
OVER_MM = 0.35  # how much nearer or further than the gap the inside may lie, where skin is bent
AGAINST = -0.8  # cosine between the normals of the inside and of the skin below it
LEAST_MM2 = 1e-4  # of a triangle: slivers that the cutting leaves have no direction of their own


@dataclass(frozen=True)
class Wall:
    """Thickness of the plastic over the skin, millimetres: the least and where that is, the 1st percentile and the
    median by area; how many of all rays are shorter than `LEAST_WALL_MM`."""

    least_mm: float
    percentile_mm: float
    median_mm: float
    rays: int
    thin: int
    least_at: tuple[float, float, float]


def wall_of(mesh: Mesh, skin: Skin, gap: Float[np.ndarray, " n"]) -> Wall:
    """How thick the mask is where it lies over the skin."""
    corners, cross = mesh.vertices[mesh.triangles], triangle_cross(mesh.vertices, mesh.triangles)
    area = np.linalg.norm(cross, axis=1) / 2
    normal = cross / np.maximum(2 * area, 1e-12)[:, None]
    away, at = skin.tree.query(corners.mean(axis=1), workers=-1)
    inside = np.einsum("fx,fx->f", normal, skin.normals[at]) < AGAINST
    inside &= (np.abs(away - gap[at]) < OVER_MM) & (area > LEAST_MM2)
    into = -np.repeat(normal[inside], len(CORNERS), axis=0)
    start = np.einsum("rc,fcx->frx", CORNERS, corners[inside]).reshape(-1, 3)
    thick = START_MM + Occluder(mesh.vertices, mesh.triangles).distance(start + START_MM * into, into)
    order = np.argsort(thick)
    x, y, z = start[order[0]]
    share = np.cumsum(np.repeat(area[inside], len(CORNERS))[order])
    first, middle = np.searchsorted(share, [0.01 * share[-1], 0.5 * share[-1]])
    return Wall(
        float(thick.min()),
        float(thick[order][first]),
        float(thick[order][middle]),
        len(thick),
        int((thick < LEAST_WALL_MM).sum()),
        (float(x), float(y), float(z)),
    )


def open_share(mesh: Mesh, core: Float[np.ndarray, "n 3"], way: Float[np.ndarray, " 3"]) -> float:
    """Share of the points of an opening from which one sees out along a way, as one does through no plastic."""
    free = Occluder(mesh.vertices, mesh.triangles).distance(core, np.tile(way / np.linalg.norm(way), (len(core), 1)))
    return float(np.isinf(free).mean())


def gap_of(
    mesh: Mesh, points: Float[np.ndarray, "n 3"], normals: Float[np.ndarray, "n 3"], *, furthest: float = 2.0
) -> Float[np.ndarray, " 3"]:
    """5th percentile, median and 95th percentile of the way from points of the skin to the mask above, millimetres;
    what lies under a hole meets nothing as near as `furthest`."""
    way = Occluder(mesh.vertices, mesh.triangles).distance(points + START_MM * normals, normals) + START_MM
    return np.percentile(way[way < furthest], [5, 50, 95])
