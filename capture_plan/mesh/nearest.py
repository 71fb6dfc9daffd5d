"""The nearest point of a surface, exactly, for a few points.

Bound      no triangle is nearer than its middle less its radius, none further than its middle: only those are asked
           whose least distance is below the least of the greatest (Guéziec 2001)
"""

import numpy as np
import trimesh
from jaxtyping import Float, Int


def nearest_on_surface(
    points: Float[np.ndarray, "m 3"], vertices: Float[np.ndarray, "v 3"], triangles: Int[np.ndarray, "f 3"]
) -> Float[np.ndarray, "m 3"]:
    """For each point the nearest one of the surface.

    Example:
        >>> corner = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
        >>> nearest_on_surface(np.array([[0.2, 0.3, 5]]), corner, np.array([[0, 1, 2]])).tolist()
        [[0.2, 0.3, 0.0]]
    """
    corners = vertices[triangles]
    middle = corners.mean(axis=1)
    radius = np.linalg.norm(corners - middle[:, None], axis=2).max(axis=1)
    found = np.empty_like(points)
    for i, point in enumerate(points):
        away = np.linalg.norm(middle - point, axis=1)
        near = np.flatnonzero(away - radius <= away.min())
        feet = trimesh.triangles.closest_point(corners[near], np.repeat(point[None], len(near), axis=0))
        found[i] = feet[np.linalg.norm(feet - point, axis=1).argmin()]
    return found
