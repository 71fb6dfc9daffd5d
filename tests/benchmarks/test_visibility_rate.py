"""Rays per second of the global visibility, beside what embree alone does with the same rays in the same run.

`pytest tests/benchmarks --benchmark-enable` measures on a head of 13,000 vertices in 51 blendshapes, and asks 25,000
vertices of one of 51,000 in 237 with 128 rays; it prints the ratios. Without it, one round on a small head shows that
the benchmark still runs. Both compare with every ray cast.
"""

import time

import numpy as np
import pytest

from capture_plan.sample import sample_rig
from capture_plan.visibility import hemisphere_visibility
from capture_plan.visibility.hemisphere import fibonacci_hemisphere, most_blocked, tangent_frames
from capture_plan.visibility.occluder import Occluder


def subdivided(vertices, triangles):
    """Every triangle split into four; vertices stay where they are."""
    sides = np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1)
    edge, number = np.unique(sides, axis=0, return_inverse=True)
    ab, bc, ca = len(vertices) + number.reshape(3, -1)
    a, b, c = triangles.T
    split = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    return edge, np.concatenate([np.stack(corners, axis=1) for corners in split])


def head(times):
    """The sample's skin with its deltas, subdivided so many times: once it is about the size of a studio rig."""
    rig = sample_rig()
    keep = rig.skin[rig.triangles].all(axis=1)
    number = np.cumsum(rig.skin) - 1
    vertices, deltas, triangles = rig.neutral[rig.skin], rig.deltas[:, rig.skin], number[rig.triangles[keep]]
    for _ in range(times):
        edge, triangles = subdivided(vertices, triangles)
        vertices = np.concatenate([vertices, vertices[edge].mean(axis=1)])
        deltas = np.concatenate([deltas, deltas[:, edge].mean(axis=2)], axis=1)
    return vertices, deltas, triangles


def more_of(deltas, count, seed=0):
    """So many deltas: those there are, and sums of two of them in part."""
    rng = np.random.default_rng(seed)
    a, b = rng.integers(len(deltas), size=(2, count - len(deltas)))
    s, t = rng.uniform(0.3, 0.8, size=(2, count - len(deltas), 1, 1)).astype(np.float32)
    return np.concatenate([deltas, s * deltas[a] + t * deltas[b]])


def every_ray(vertices, deltas, triangles, at, rays):
    """The least share with all rays of all shapes cast."""
    shapes = [vertices, *(vertices + delta for delta in deltas)]
    return np.min([hemisphere_visibility(shape, triangles, at, rays=rays) for shape in shapes], axis=0)


def raw_rate(vertices, triangles, at, rays):
    """Rays per second of embree in one thread, on rays made beforehand: the best of three."""
    occluder = Occluder(vertices, triangles)
    at = at[: 1_000_000 // rays]
    origins = np.repeat(occluder.above_skin(vertices, at), rays, axis=0)
    directions = fibonacci_hemisphere(rays) @ tangent_frames(occluder.normals[at])
    directions = directions.reshape(-1, 3).astype(np.float32)
    best = np.inf
    for _ in range(3):
        start = time.perf_counter()
        occluder.blocked(origins, directions)
        best = min(best, time.perf_counter() - start)
    return len(origins) / best


@pytest.mark.benchmark(group="visibility")
@pytest.mark.parametrize(("k", "n", "rays", "times"), [(51, 13_000, 64, 1), (237, 25_000, 128, 2)])
def test_visibility_traces_at_embrees_own_rate(benchmark, monkeypatch, k, n, rays, times):
    large = benchmark.enabled
    vertices, deltas, triangles = head(times if large else 0)
    deltas = more_of(deltas, k) if large and k > len(deltas) else deltas[: k if large else 2]
    at = np.unique(np.linspace(0, len(vertices) - 1, n if large else 500).astype(int))
    raw, cast, blocked = raw_rate(vertices, triangles, at, rays), [], Occluder.blocked
    monkeypatch.setattr(Occluder, "blocked", lambda self, o, d: (cast.append(len(o)), blocked(self, o, d))[1])
    worst = benchmark.pedantic(most_blocked, args=(vertices, deltas, triangles, at), kwargs={"rays": rays}, rounds=1)
    monkeypatch.undo()
    assert np.array_equal(1 - worst.mean(axis=1), every_ray(vertices, deltas, triangles, at, rays))
    asked = rays * len(at) * (len(deltas) + 1)
    assert sum(cast) < asked
    if large:
        seconds, saved = benchmark.stats.stats.min, 1 - sum(cast) / asked
        ratio, as_all = sum(cast) / seconds / raw, asked / seconds / raw
        benchmark.extra_info |= {"saved": saved, "ratio": ratio, "as_if_all_were_cast": as_all}
        print(
            f"\n{len(at):,} vertices, {len(deltas)} blendshapes, {rays} rays: {seconds:.1f} s, {saved:.0%} of the rays "
            f"saved, {ratio:.2f} times one raw thread, {as_all:.2f} times as if all were cast"
        )
        assert sum(cast) > 0.6 * raw * seconds  # low: other work on the machine slows two threads more than one
