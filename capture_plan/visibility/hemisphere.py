"""Global visibility (Zell & McDonnell 2022, eq. 4): how much of the world above it sees a vertex, in every expression.

Data     v0, d_k        neutral and deltas: the shapes are v0 and v0 + d_k for every blendshape k at full weight
         n_i            normal of vertex i on that shape
Share    l_i(shape)     = share of rays over the hemisphere around n_i that leave the head
Answer   l_i            = min over the shapes of l_i(shape), absolute, 0 (hidden) to 1 (nothing in the way)

The rays are a Fibonacci spiral, cosine-weighted: a dot seen at a grazing angle is seen badly, so directions near the
skin count less (this is ambient occlusion). Directions are fixed, so the same mesh gives the same answer. Error of 64
rays against 4,096 random ones on the skin of the sample: 0.011 root mean square, 0.03 at most.

Saved    l_i falls on a shape only where more than b rays are blocked, b the most on any shape before: the R - b rays
         that were open there are cast first, and the others only where one of these is blocked. The answer is the same
"""

import os
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from threading import Lock

import numpy as np
from jaxtyping import Bool, Float, Int

from capture_plan.progress import track_in_threads
from capture_plan.visibility.occluder import Occluder
from capture_plan.visibility.shapes import remembered

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


class Hemispheres:
    """The rays of vertices `at` (m) of one shape; `blocked` may be asked from several threads at once."""

    def __init__(
        self,
        vertices: Float[np.ndarray, "v 3"],
        triangles: Int[np.ndarray, "f 3"],
        at: Int[np.ndarray, " m"],
        rays: int,
    ) -> None:
        self.occluder = Occluder(vertices, triangles)
        normals = self.occluder.normals[at]
        self.origins = self.occluder.above_skin(vertices, at)
        self.frames = tangent_frames(normals).astype(np.float32)
        self.nowhere = np.all(normals == 0, axis=1)  # without a normal: seen from no direction
        self.hemisphere = fibonacci_hemisphere(rays).astype(np.float32)

    def blocked(self, some: Int[np.ndarray, " s"], asked: Bool[np.ndarray, "s r"]) -> Bool[np.ndarray, "s r"]:
        """Which of the rays that are asked for, of some of the vertices, something blocks."""
        hit = np.logical_and(asked, self.nowhere[some, None])
        cast = asked & ~hit
        ways = (self.hemisphere @ self.frames[some])[cast]  # many small products: one large one has threads of its own
        hit[cast] = self.occluder.blocked(np.repeat(self.origins[some], cast.sum(axis=1), axis=0), ways)
        return hit


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
    return 1 - _blocked_at_once(vertices, triangles, at, rays).mean(axis=1)


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
    return remembered(
        lambda: 1 - most_blocked(neutral, deltas, triangles, at, rays=rays).mean(axis=1),
        "hemisphere",
        neutral,
        deltas,
        triangles,
        at,
        np.array(rays),
    )


def most_blocked(
    neutral: Float[np.ndarray, "v 3"],
    deltas: Float[np.ndarray, "k v 3"],
    triangles: Int[np.ndarray, "f 3"],
    at: Int[np.ndarray, " m"],
    *,
    rays: int,
) -> Bool[np.ndarray, "m r"]:
    """The rays of each vertex that are blocked on the shape that blocks most of them."""
    worst, lock = _blocked_at_once(neutral, triangles, at, rays), Lock()

    def look(delta: Float[np.ndarray, "v 3"]) -> None:
        of_shape = Hemispheres(neutral + delta, triangles, at, rays)
        for some in _portions(len(at), rays):
            before = worst[some]  # a copy; others may find worse meanwhile, and no ray is too few for that
            hit = of_shape.blocked(some, ~before)
            worse = np.flatnonzero(hit.any(axis=1))
            some, before, hit = some[worse], before[worse], hit[worse]
            hit |= of_shape.blocked(some, before)
            with lock:
                more = hit.sum(axis=1) > worst[some].sum(axis=1)
                worst[some[more]] = hit[more]

    for _ in track_in_threads(look, list(deltas), "Tracing visibility"):
        pass
    return worst


def _blocked_at_once(
    vertices: Float[np.ndarray, "v 3"], triangles: Int[np.ndarray, "f 3"], at: Int[np.ndarray, " m"], rays: int
) -> Bool[np.ndarray, "m r"]:
    """Which rays something blocks, by a thread for each core: embreex lets go of the interpreter while it traces."""
    of_shape = Hemispheres(vertices, triangles, at, rays)
    portions = list(_portions(len(at), rays))

    def trace(some: Int[np.ndarray, " s"]) -> Bool[np.ndarray, "s r"]:
        return of_shape.blocked(some, np.ones((len(some), rays), dtype=bool))

    if len(portions) < 2:
        return trace(np.arange(len(at)))
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        return np.concatenate(list(pool.map(trace, portions)))


def _portions(count: int, rays: int) -> Iterator[Int[np.ndarray, " s"]]:
    """Numbers of vertices, as many at a time as have `RAYS_AT_ONCE`."""
    step = max(1, RAYS_AT_ONCE // rays)
    for start in range(0, count, step):
        yield np.arange(start, min(start + step, count))
