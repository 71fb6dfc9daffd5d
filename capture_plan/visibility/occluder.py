"""What a ray hits first: one mesh, prepared once for many shadow rays.

Data      vertices, triangles       the mesh, any unit
Question  blocked(origin o, direction d)   is there a t >= 0 with o + t d on a triangle?

Embree works in float32, so the mesh is centred first, and rays start a little above the skin.
"""

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene
from jaxtyping import Bool, Float, Int

from capture_plan.mesh import vertex_normals

SURFACE_OFFSET = 2e-5  # of the mesh's diagonal (0.006 mm on a head): float32 rays from closer by hit their own triangle
FARTHEST = 1e36  # embree says 1e37 where a ray meets nothing


class Occluder:
    """A mesh that blocks rays; may be asked from several threads at once."""

    def __init__(self, vertices: Float[np.ndarray, "v 3"], triangles: Int[np.ndarray, "f 3"]) -> None:
        low, high = vertices.min(axis=0), vertices.max(axis=0)
        self.centre = (low + high) / 2
        self.offset = SURFACE_OFFSET * float(np.linalg.norm(high - low))
        self.normals = vertex_normals(vertices, triangles)
        self.scene = EmbreeScene(robust=True)  # without it one in five rays aimed at a vertex leaks through
        corners = np.ascontiguousarray(vertices - self.centre, dtype=np.float32)
        TriangleMesh(self.scene, corners, np.ascontiguousarray(triangles, dtype=np.int32))
        self.blocked(np.zeros((1, 3), np.float32), np.ones((1, 3), np.float32))  # the first ray builds the scene

    def above_skin(self, vertices: Float[np.ndarray, "v 3"], at: Int[np.ndarray, " m"]) -> Float[np.ndarray, "m 3"]:
        """Where the rays of the vertices `at` start: a little along the normal, in the centred frame, float32."""
        return (vertices[at] - self.centre + self.offset * self.normals[at]).astype(np.float32)

    def blocked(
        self, origins: Float[np.ndarray, "r 3"], directions: Float[np.ndarray, "r 3"], *, extent: float = np.inf
    ) -> Bool[np.ndarray, " r"]:
        """Whether each ray o + t d, in the centred frame and float32, hits a triangle at 0 <= t <= reach."""
        far = np.full(len(origins), extent, dtype=np.float32)
        return self.scene.run(origins, directions, dists=far, query="OCCLUDED") >= 0

    def distance(
        self, origins: Float[np.ndarray, "r 3"], directions: Float[np.ndarray, "r 3"]
    ) -> Float[np.ndarray, " r"]:
        """How far each ray o + t d, d of length 1, goes to the first triangle, in the mesh's own frame and unit;
        infinite where it meets none."""
        o = np.ascontiguousarray(origins - self.centre, dtype=np.float32)
        found = self.scene.run(o, np.ascontiguousarray(directions, dtype=np.float32), query="DISTANCE")
        return np.where(found < FARTHEST, found, np.inf).astype(float)
