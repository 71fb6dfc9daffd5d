"""Global visibility (Zell & McDonnell 2022, eq. 4): how much of the world above it sees a vertex, in every expression.

Data     v0, d_k       neutral and deltas: the shapes are v0 and v0 + d_k for every blendshape k at full weight
         R             rays above every vertex, the same on every shape but for where its normal turns them
Answer   l_i           = min over the shapes of the share of the R rays of vertex i that leave the head, absolute, 0
                       (hidden) to 1 (nothing in the way)

Only rays that can lower the answer are cast, and it equals that of casting all. With b_i the most rays of vertex i
that were blocked on any shape so far:
Witness  on shape k the first R - b_i rays that left on the neutral are cast. Where all of them leave, at most b_i are
         blocked: the answer stays. Where one does not, the rest are cast too, and the number of the blocked is exact.
Still    a vertex whose rays are bit for bit those of the neutral, with no moved triangle above its tangent plane, is
         not asked: its rays meet only what they met on the neutral, so no more of them are blocked.
"""

import numpy as np
from jaxtyping import Bool, Float, Int

from capture_plan.progress import track_in_threads
from capture_plan.visibility.hemisphere import Hemispheres, blocked_rays, hemispheres
from capture_plan.visibility.occluder import Occluder
from capture_plan.visibility.shapes import remembered


def global_visibility(
    neutral: Float[np.ndarray, "v 3"],
    deltas: Float[np.ndarray, "k v 3"],
    triangles: Int[np.ndarray, "f 3"],
    at: Int[np.ndarray, " m"],
    *,
    rays: int = 64,
) -> Float[np.ndarray, " m"]:
    """The least share of the hemisphere that sees each vertex `at`, over the neutral and every blendshape at full
    weight: `hemisphere_visibility` with its rays in the frame of the neutral.

    Cached on disk by content, so that the same rig is traced once.
    """
    return remembered(
        lambda: 1 - most_blocked(neutral, deltas, triangles, at, rays=rays) / rays,
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
) -> Int[np.ndarray, " m"]:
    """The most rays of each vertex `at` that are blocked on any one shape (b)."""
    first = Occluder(neutral, triangles)
    before = hemispheres(first, neutral, at, rays=rays)
    left = ~blocked_rays(first, before)
    left[~first.normals[at].any(axis=1)] = False
    nth = left.cumsum(axis=1, dtype=np.int32)
    most = rays - nth[:, -1]

    def blocked_on(delta: Float[np.ndarray, "v 3"]) -> Int[np.ndarray, " m"]:
        shape, found = neutral + delta, most.copy()
        occluder = Occluder(shape, triangles, like=first)
        now = hemispheres(occluder, shape, at, rays=rays)
        some = np.flatnonzero((found < rays) & _may_lose(first, before, occluder, now, triangles))
        witness = left[some] & (nth[some] <= rays - found[some, None])
        lost = blocked_rays(occluder, now.at(some), witness)
        fewer = lost.any(axis=1)
        some, lost, rest = some[fewer], lost[fewer], ~witness[fewer]
        found[some] = (lost | blocked_rays(occluder, now.at(some), rest)).sum(axis=1, dtype=found.dtype)
        found[~occluder.normals[at].any(axis=1)] = rays
        return found

    # `most` grows while other shapes are traced: a witness of less than the final number is one all the same
    for blocked in track_in_threads(blocked_on, list(deltas), "Tracing visibility"):
        np.maximum(most, blocked, out=most)
    return most


def _may_lose(
    first: Occluder, before: Hemispheres, occluder: Occluder, now: Hemispheres, triangles: Int[np.ndarray, "f 3"]
) -> Bool[np.ndarray, " m"]:
    """Where rays changed, or a triangle that moved may stand in their way: above the tangent plane of their vertex."""
    changed = (now.origins != before.origins).any(axis=1) | (now.frames != before.frames).any(axis=(1, 2))
    moved = triangles[(occluder.corners != first.corners).any(axis=1)[triangles].any(axis=1)]
    if len(moved) == 0 or changed.all():
        return changed
    corners, n = occluder.corners[np.unique(moved)], now.frames[:, 2].astype(float)
    # max over the corners c of n (c - o), bounded by that over the box around them
    highest = np.maximum(n * corners.min(axis=0), n * corners.max(axis=0)).sum(axis=1)
    return changed | (highest - (n * now.origins).sum(axis=1) > -first.offset)
