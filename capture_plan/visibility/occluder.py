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
    """A mesh that blocks rays; may be asked from several threads at once.

    `like` is one of another shape of the same triangles, whose centre and offset this one then has: what did not move
    has the same float32 coordinates in both.
    """

    def __init__(
        self, vertices: Float[np.ndarray, "v 3"], triangles: Int[np.ndarray, "f 3"], *, like: "Occluder | None" = None
    ) -> None:
        low, high = vertices.min(axis=0), vertices.max(axis=0)
        self.centre = like.centre if like else (low + high) / 2
        self.offset = like.offset if like else SURFACE_OFFSET * float(np.linalg.norm(high - low))
        self.normals = vertex_normals(vertices, triangles)
        self.corners = np.ascontiguousarray(vertices - self.centre, dtype=np.float32)
        self.rows = like.rows if like else _rows(triangles)
        self.scene = EmbreeScene(robust=True)  # without it one in five rays aimed at a vertex leaks through
        TriangleMesh(self.scene, self.corners, self.rows)
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


def _rows(triangles: Int[np.ndarray, "f 3"]) -> np.ndarray:
    """The triangles as an array of tuples: embreex reads it twice as fast as rows of numbers."""
    rows = np.empty(len(triangles), dtype=object)
    rows[:] = list(zip(*triangles.T.tolist(), strict=True))
    return rows
