"""Visibility from known cameras (Zell & McDonnell 2022, section 3.1.2, head-mounted cameras).

A camera c at o_c sees vertex i with normal n_i on a shape if
          (o_c - v_i) · n_i > 0                  the skin faces it
          v_i projects into its image
          nothing lies between v_i and o_c
Answer   l_i = min over the shapes of (cameras that see i) / (cameras), 0 to 1
"""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float, Int

from capture_plan.camera import Camera
from capture_plan.visibility.occluder import Occluder
from capture_plan.visibility.shapes import least_over_shapes, remembered


def seen_by(
    camera: Camera, occluder: Occluder, vertices: Float[np.ndarray, "v 3"], at: Int[np.ndarray, " m"]
) -> Bool[np.ndarray, " m"]:
    """Whether the camera sees each vertex `at` of the shape that `occluder` was made from."""
    way = camera.position - vertices[at]
    seen = (np.einsum("mx,mx->m", way, occluder.normals[at]) > 0) & camera.in_image(vertices[at])
    origins = occluder.above_skin(vertices, at[seen])
    ends = (camera.position - occluder.centre).astype(np.float32)
    seen[seen] = ~occluder.blocked(origins, ends - origins, extent=1.0)
    return seen


def camera_visibility(
    neutral: Float[np.ndarray, "v 3"],
    deltas: Float[np.ndarray, "k v 3"],
    triangles: Int[np.ndarray, "f 3"],
    at: Int[np.ndarray, " m"],
    cameras: Sequence[Camera],
) -> Float[np.ndarray, " m"]:
    """Share of the cameras that see each vertex `at`, the least over the neutral and every blendshape at full weight.

    Cached on disk by content, like the global visibility.
    """

    def share(vertices: Float[np.ndarray, "v 3"], some: Int[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
        occluder = Occluder(vertices, triangles)
        return np.mean([seen_by(camera, occluder, vertices, some) for camera in cameras], axis=0)

    lenses = [camera.numbers for camera in cameras]
    return remembered(
        lambda: least_over_shapes(share, neutral, deltas, at), "cameras", neutral, deltas, triangles, at, *lenses
    )
