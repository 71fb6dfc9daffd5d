"""Rays per second of the global visibility, beside what embree alone does with the same rays in the same run.

`pytest tests/benchmarks --benchmark-enable` measures on a head of 13,000 vertices and prints the ratio; without it, one
round on a small head shows that the benchmark still runs.
"""

import time

import numpy as np
import pytest

from capture_plan.sample import sample_rig
from capture_plan.visibility import hemisphere_visibility
from capture_plan.visibility.hemisphere import fibonacci_hemisphere, tangent_frames
from capture_plan.visibility.occluder import Occluder
from capture_plan.visibility.shapes import least_over_shapes

RAYS = 64


def subdivided(vertices, triangles):
    """Every triangle split into four; vertices stay where they are."""
    sides = np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1)
    edge, number = np.unique(sides, axis=0, return_inverse=True)
    ab, bc, ca = len(vertices) + number.reshape(3, -1)
    a, b, c = triangles.T
    split = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    return edge, np.concatenate([np.stack(corners, axis=1) for corners in split])


def head(large):
    """The sample's skin with its deltas; subdivided once it is about the size of a studio rig."""
    rig = sample_rig()
    keep = rig.skin[rig.triangles].all(axis=1)
    number = np.cumsum(rig.skin) - 1
    vertices, deltas, triangles = (
        rig.neutral[rig.skin],
        rig.deltas[:, rig.skin].astype(float),
        number[rig.triangles[keep]],
    )
    if large:
        edge, triangles = subdivided(vertices, triangles)
        vertices = np.concatenate([vertices, vertices[edge].mean(axis=1)])
        deltas = np.concatenate([deltas, deltas[:, edge].mean(axis=2)], axis=1)
    return vertices, deltas, triangles


def raw_rate(vertices, triangles):
    """Rays per second of embree in one thread, on rays made beforehand: the best of three."""
    occluder = Occluder(vertices, triangles)
    at = np.arange(len(vertices))
    origins = np.repeat(occluder.above_skin(vertices, at), RAYS, axis=0)
    directions = np.einsum("ra,max->mrx", fibonacci_hemisphere(RAYS), tangent_frames(occluder.normals))
    directions = directions.reshape(-1, 3).astype(np.float32)
    best = np.inf
    for _ in range(3):
        start = time.perf_counter()
        occluder.blocked(origins, directions)
        best = min(best, time.perf_counter() - start)
    return len(origins) / best


@pytest.mark.benchmark(group="visibility")
def test_visibility_traces_at_embrees_own_rate(benchmark):
    large = benchmark.enabled
    vertices, deltas, triangles = head(large)
    deltas = deltas if large else deltas[:2]
    at = np.arange(len(vertices))
    raw = raw_rate(vertices, triangles)
    traced = []

    def share(shape, some):
        traced.append(RAYS * len(some))
        return hemisphere_visibility(shape, triangles, some, rays=RAYS)

    least = benchmark.pedantic(least_over_shapes, args=(share, vertices, deltas, at), rounds=1)
    assert least.shape == at.shape
    if large:
        rate = sum(traced) / benchmark.stats.stats.min
        benchmark.extra_info |= {"rays_per_second": rate, "embree_one_thread": raw, "ratio": rate / raw}
        print(f"\n{len(vertices):,} vertices: {rate / 1e6:.1f} million rays/s, {rate / raw:.2f} times one raw thread")
        assert rate > 0.3 * raw  # low: other work on the machine slows the two threads more than the one
