"""Global visibility (Zell & McDonnell 2022, eq. 4): how much of the world above it sees a vertex, in every expression.

Data     v0, d_k        neutral and deltas: the shapes are v0 and v0 + d_k for every blendshape k at full weight
         n_i            normal of vertex i on that shape
Share    l_i(shape)     = share of rays over the hemisphere around n_i that leave the head
Answer   l_i            = min over the shapes of l_i(shape), absolute, 0 (hidden) to 1 (nothing in the way)

The rays are a Fibonacci spiral, cosine-weighted: a dot seen at a grazing angle is seen badly, so directions near the
skin count less (this is ambient occlusion). Directions are fixed, so the same mesh gives the same answer.
"""

import os
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from jaxtyping import Float, Int

from capture_plan.visibility.occluder import Occluder
from capture_plan.visibility.shapes import least_over_shapes, remembered

GOLDEN_ANGLE = np.pi * (3 - np.sqrt(5))
RAYS_AT_ONCE = 1 << 18  # 3 MB of directions: stays in the processor's cache


def fibonacci_hemisphere(rays: int) -> Float[np.ndarray, "r 3"]:
    """Unit directions around +z with density proportional to the cosine: a sunflower on the unit disc, lifted."""
    radius2 = (np.arange(rays) + 0.5) / rays
    angle = GOLDEN_ANGLE * np.arange(rays)
    radius = np.sqrt(radius2)
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), np.sqrt(1 - radius2)], axis=1)


def tangent_frames(normals: Float[np.ndarray, "m 3"]) -> Float[np.ndarray, "m 3 3"]:
    """Rows t, b, n of a right-handed frame for each unit normal n, without a pole (Duff et al. 2017, listing 3)."""
    x, y, z = normals.T
    sign = np.copysign(1.0, z)
    a = -1 / (sign + z)
    b = x * y * a
    tangent = np.stack([1 + sign * x * x * a, sign * b, -sign * x], axis=1)
    bitangent = np.stack([b, sign + y * y * a, -y], axis=1)
    return np.stack([tangent, bitangent, normals], axis=1)


def hemisphere_visibility(
    vertices: Float[np.ndarray, "v 3"],
    triangles: Int[np.ndarray, "f 3"],
    at: Int[np.ndarray, " m"],
    *,
    rays: int = 64,
) -> Float[np.ndarray, " m"]:
    """Cosine-weighted share of the hemisphere above each vertex `at` from which it can be seen, 0 to 1.

    A vertex without a normal (no triangle with an area) is seen from nowhere. Units do not matter.
    """
    occluder = Occluder(vertices, triangles)
    origins = occluder.above_skin(vertices, at)
    frames = tangent_frames(occluder.normals[at]).reshape(-1, 9).astype(np.float32)
    # direction[i, r, x] = sum_a hemisphere[r, a] frame[i, a, x], as one product (m 9) (9 3r)
    spread = np.kron(fibonacci_hemisphere(rays).T, np.eye(3)).astype(np.float32)
    share = np.empty(len(at))
    step = max(1, RAYS_AT_ONCE // rays)

    def trace(start: int) -> None:
        some = slice(start, start + step)
        hit = occluder.blocked(np.repeat(origins[some], rays, axis=0), (frames[some] @ spread).reshape(-1, 3))
        share[some] = 1 - hit.reshape(-1, rays).mean(axis=1)

    if len(at) <= step:
        trace(0)
    else:
        with ThreadPoolExecutor(os.cpu_count()) as pool:  # embreex lets go of the interpreter while it traces
            list(pool.map(trace, range(0, len(at), step)))
    share[~occluder.normals[at].any(axis=1)] = 0
    return share


def global_visibility(
    neutral: Float[np.ndarray, "v 3"],
    deltas: Float[np.ndarray, "k v 3"],
    triangles: Int[np.ndarray, "f 3"],
    at: Int[np.ndarray, " m"],
    *,
    rays: int = 64,
) -> Float[np.ndarray, " m"]:
    """The least `hemisphere_visibility` of each vertex `at` over the neutral and every blendshape at full weight.

    Cached on disk by content, so that the same rig is traced once.
    """

    def share(vertices: Float[np.ndarray, "v 3"], some: Int[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
        return hemisphere_visibility(vertices, triangles, some, rays=rays)

    return remembered(
        lambda: least_over_shapes(share, neutral, deltas, at),
        "hemisphere",
        neutral,
        deltas,
        triangles,
        at,
        np.array(rays),
    )
