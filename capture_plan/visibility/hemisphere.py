"""Rays over the hemisphere above a vertex: how much of the world sees it on one shape.

Share    l_i = share of rays over the hemisphere around the normal n_i of vertex i that leave the head

The rays are a Fibonacci spiral, cosine-weighted: a dot seen at a grazing angle is seen badly, so directions near the
skin count less (this is ambient occlusion). Directions are fixed, so the same mesh gives the same answer.
Error    a share of 64 rays is off that of 4,096 by 0.012 (root mean square), by more than 0.04 at 1 vertex in 100 and
         by 0.065 at most, and so is the least over all expressions: measured on the skin of four heads
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from capture_plan.progress import go_on, in_threads
from capture_plan.visibility.occluder import Occluder

GOLDEN_ANGLE = np.pi * (3 - np.sqrt(5))
RAYS_AT_ONCE = 1 << 16  # 0.8 MB of directions: stays in the cache of a core


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


@dataclass(frozen=True, eq=False)
class Hemispheres:
    """Rays above m vertices of one shape, `rays` each: where they start and the frames that turn them, in the centred
    frame of its occluder and float32."""

    origins: Float[np.ndarray, "m 3"]
    frames: Float[np.ndarray, "m 3 3"]
    rays: int

    def at(self, some: Int[np.ndarray, " n"]) -> "Hemispheres":
        """Those of some of the vertices."""
        return Hemispheres(self.origins[some], self.frames[some], self.rays)

    def directions(self) -> Float[np.ndarray, "q 3"]:
        """Unit directions of all rays, those of a vertex side by side (q = m rays)."""
        # a small product for each vertex: the same bits whoever is beside it, and no threads of the algebra's own
        return (fibonacci_hemisphere(self.rays).astype(np.float32) @ self.frames).reshape(-1, 3)

    def parts(self) -> list[slice]:
        """The vertices in portions of so many rays as are best traced at once."""
        step = max(1, RAYS_AT_ONCE // self.rays)
        return [slice(start, start + step) for start in range(0, len(self.origins), step)]


def hemispheres(
    occluder: Occluder, vertices: Float[np.ndarray, "v 3"], at: Int[np.ndarray, " m"], *, rays: int
) -> Hemispheres:
    """The rays above each vertex `at` of the shape that `occluder` was made from."""
    frames = tangent_frames(occluder.normals[at]).astype(np.float32)
    return Hemispheres(occluder.above_skin(vertices, at), frames, rays)


def blocked_rays(
    occluder: Occluder, above: Hemispheres, asked: Bool[np.ndarray, "m r"] | None = None
) -> Bool[np.ndarray, "m r"]:
    """Which of the `asked` rays hit something: of all, by a thread for each core, where none are named.

    Raises:
        StoppedError: somebody asked for the end of the work.
    """
    hit = np.zeros((len(above.origins), above.rays), dtype=bool)

    def trace(part: slice) -> None:
        go_on()
        one = Hemispheres(above.origins[part], above.frames[part], above.rays)
        if asked is None:
            found = occluder.blocked(np.repeat(one.origins, one.rays, axis=0), one.directions())
            hit[part] = found.reshape(-1, one.rays)
            return
        some = np.flatnonzero(asked[part])
        origins = np.repeat(one.origins, asked[part].sum(axis=1), axis=0)
        hit[part].reshape(-1)[some] = occluder.blocked(origins, one.directions()[some])

    if asked is None and len(above.parts()) > 1:
        list(in_threads(trace, above.parts()))  # embree lets go of the interpreter while it traces
    else:
        for part in above.parts():
            trace(part)
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
    occluder = Occluder(vertices, triangles)
    hit = blocked_rays(occluder, hemispheres(occluder, vertices, at, rays=rays))
    hit[~occluder.normals[at].any(axis=1)] = True
    return 1 - hit.mean(axis=1)
