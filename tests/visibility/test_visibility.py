"""Laws of the global visibility."""

import os

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from capture_plan.cache import cache_dir
from capture_plan.progress import StoppedError, show_progress, stop_work, stoppable
from capture_plan.sample import sample_rig
from capture_plan.visibility import all_sides, global_visibility, hemisphere_visibility
from capture_plan.visibility.hemisphere import blocked_rays, fibonacci_hemisphere, hemispheres, tangent_frames
from capture_plan.visibility.occluder import Occluder
from tests.solids import BOX, BOX_SIDES, patch, sphere, square, together


@pytest.fixture(autouse=True)
def own_cache(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))


def test_a_closed_convex_sphere_sees_everything_above_it():
    vertices, triangles = sphere()
    assert (hemisphere_visibility(vertices, triangles, np.arange(len(vertices))) == 1).all()


def test_nothing_is_seen_from_inside_a_box():
    vertices, triangles = together(patch(), (50 * BOX, BOX_SIDES))
    assert hemisphere_visibility(vertices, triangles, np.array([0]))[0] == 0


def test_no_ray_leaks_out_of_a_closed_surface_where_triangles_meet():
    vertices, triangles = sphere()
    a, b = vertices[triangles[:, 0]], vertices[triangles[:, 1]]
    aimed = np.concatenate([vertices, (a + b) / 2]).astype(np.float32)
    assert Occluder(vertices, triangles).blocked(np.zeros_like(aimed), aimed).all()


def test_an_endless_wall_hides_half():
    wall = square((1.5, 0, 0), (0, 0, 1e5), (0, 1e5, 0))
    share = hemisphere_visibility(*together(patch(), wall), np.array([0]), rays=1024)[0]
    assert share == pytest.approx(0.5, abs=0.01)


def test_a_lid_hides_its_form_factor():
    """A coaxial disc of radius R at height h above a point has the form factor R² / (R² + h²)."""
    angle = 2 * np.pi * np.arange(90) / 90
    rim = np.stack([3 * np.cos(angle), np.full(90, 4.0), 3 * np.sin(angle)], axis=1)
    lid = np.vstack([[[0.0, 4, 0]], rim]), np.array([[0, 1 + i, 1 + (i + 1) % 90] for i in range(90)])
    share = hemisphere_visibility(*together(patch(0.1), lid), np.array([0]), rays=4096)[0]
    assert share == pytest.approx(1 - 9 / 25, abs=0.005)


def test_visibility_does_not_depend_on_unit_or_place():
    vertices, triangles = together(patch(), square((1.5, 2, 0), (0, 0, 3), (0, 2, 0)))
    at = np.arange(5)
    here = hemisphere_visibility(vertices, triangles, at)
    assert np.array_equal(here, hemisphere_visibility(0.001 * vertices, triangles, at))
    assert np.abs(here - hemisphere_visibility(vertices + 500.0, triangles, at)).max() <= 1 / 64


def test_a_vertex_without_triangles_is_seen_from_nowhere():
    vertices, triangles = patch()
    assert hemisphere_visibility(np.vstack([vertices, [[9.0, 9, 9]]]), triangles, np.array([5]))[0] == 0


def test_directions_are_unit_and_cosine_weighted():
    directions = fibonacci_hemisphere(512)
    assert np.allclose(np.linalg.norm(directions, axis=1), 1)
    assert directions.mean(axis=0) == pytest.approx([0, 0, 2 / 3], abs=0.01)  # E[z] of a cosine-weighted hemisphere


@given(st.lists(st.floats(-1, 1), min_size=3, max_size=3).filter(lambda n: np.linalg.norm(n) > 0.1))
def test_frames_are_right_handed_and_end_with_the_normal(normal):
    n = np.array([normal]) / np.linalg.norm(normal)
    frame = tangent_frames(n)[0]
    assert np.allclose(frame @ frame.T, np.eye(3), atol=1e-9)
    assert np.linalg.det(frame) == pytest.approx(1)
    assert np.array_equal(frame[2], n[0])


def casting_every_ray(vertices, deltas, triangles, at, rays):
    """Global visibility the long way: each ray of each vertex on each shape."""
    first, shares = Occluder(vertices, triangles), []
    for shape in (vertices, *(vertices + deltas)):
        occluder = Occluder(shape, triangles, like=first)
        hit = blocked_rays(occluder, hemispheres(occluder, shape, at, rays=rays))
        shares.append(np.where(occluder.normals[at].any(axis=1), 1 - hit.mean(axis=1), 0))
    return np.min(shares, axis=0)


@pytest.fixture
def count_rays(monkeypatch):
    """How many rays each call casts."""
    calls, blocked = [], Occluder.blocked

    def counted(self, origins, directions, **options):
        calls.append(len(origins))
        return blocked(self, origins, directions, **options)

    monkeypatch.setattr(Occluder, "blocked", counted)
    return calls


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_one_more_blendshape_never_raises_visibility(seed):
    vertices, triangles = sphere(8, 12, radius=1.0)
    deltas = 0.4 * np.random.default_rng(seed).normal(size=(3, len(vertices), 3))
    at = np.arange(len(vertices))
    two = global_visibility(vertices, deltas[:2], triangles, at, rays=16)
    three = global_visibility(vertices, deltas, triangles, at, rays=16)
    assert (three <= two).all()


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1), st.sampled_from([9, 16, 64]), st.sampled_from([0.01, 0.1, 0.5, 1.0]))
def test_visibility_equals_that_of_casting_every_ray(seed, rays, moving):
    """Crumpled spheres with flakes around them; on every shape a share of the vertices moves, near or far, the flakes
    before some skin or away from it."""
    rng = np.random.default_rng(seed)
    ball = sphere(8, 12, radius=1.0)
    flakes = [square(rng.normal(size=3), *(0.4 * rng.normal(size=(2, 3)))) for _ in range(6)]
    vertices, triangles = together((ball[0] * rng.uniform(0.6, 1.0, size=(len(ball[0]), 1)), ball[1]), *flakes)
    deltas = rng.normal(size=(6, len(vertices), 3)) * 10 ** rng.uniform(-6, 0.3, size=(6, 1, 1))
    deltas *= rng.random((6, len(vertices), 1)) < moving
    deltas[0, : len(ball[0])] = 0
    at = np.flatnonzero(rng.random(len(vertices)) < 0.8)
    found = global_visibility(vertices, deltas, triangles, at, rays=rays)
    assert np.array_equal(found, casting_every_ray(vertices, deltas, triangles, at, rays))


def test_visibility_of_a_head_equals_that_of_casting_every_ray_and_casts_two_thirds_of_them(count_rays):
    rig = sample_rig()
    at, deltas = np.flatnonzero(rig.skin)[::4], rig.deltas[::4].astype(float)
    count_rays.clear()
    found = global_visibility(rig.neutral, deltas, rig.triangles, at)
    assert sum(count_rays) < 0.7 * 64 * len(at) * (1 + len(deltas))
    assert np.array_equal(found, casting_every_ray(rig.neutral, deltas, rig.triangles, at, 64))
    each = [hemisphere_visibility(shape, rig.triangles, at) for shape in (rig.neutral, *(rig.neutral + deltas))]
    assert np.abs(found - np.min(each, axis=0)).max() <= 1 / 64


@pytest.mark.parametrize(("height", "asked"), [(-0.1, 0), (0.1, 64)])
def test_a_vertex_at_rest_is_asked_again_where_something_moved_above_its_skin(height, asked, count_rays):
    vertices, triangles = together(patch(), square((50.0, 0, 0), (1, 0, 0), (0, 0, 1)))
    deltas = np.zeros((1, len(vertices), 3))
    deltas[0, -4:, 1] = height
    global_visibility(vertices, deltas, triangles, np.array([0]))
    assert sum(count_rays) == 2 + 64 + asked  # and one for each scene


def test_visibility_that_is_stopped_midway_leaves_nothing(tmp_path):
    vertices, triangles = sphere(8, 12)
    deltas = np.random.default_rng(0).normal(size=(9, len(vertices), 3))

    def stop_after_three(label, done, total):
        if done == 3:
            stop_work()

    with pytest.raises(StoppedError), stoppable(), show_progress(stop_after_three):
        global_visibility(vertices, deltas, triangles, np.arange(9))
    assert not [path for path in tmp_path.rglob("*") if path.is_file()]


def test_64_rays_are_off_4096_by_what_is_stated():
    rig = sample_rig()
    at = np.flatnonzero(rig.skin)[::4]
    few, many = (hemisphere_visibility(rig.neutral, rig.triangles, at, rays=rays) for rays in (64, 4096))
    assert np.sqrt(np.mean((few - many) ** 2)) < 0.0125
    assert np.quantile(np.abs(few - many), 0.99) < 0.045
    assert np.abs(few - many).max() < 0.065


def test_an_answer_from_the_cache_equals_a_computed_one_and_is_not_traced_again(monkeypatch):
    vertices, triangles = sphere(8, 12)
    deltas = np.random.default_rng(0).normal(size=(2, len(vertices), 3))
    at = np.arange(0, len(vertices), 3)
    first = global_visibility(vertices, deltas, triangles, at)
    entry = next((cache_dir() / "visibility").glob("*.npz"))
    monkeypatch.setattr(all_sides, "most_blocked", None)
    assert np.array_equal(global_visibility(vertices, deltas, triangles, at), first)
    monkeypatch.undo()
    entry.unlink()
    assert np.array_equal(global_visibility(vertices, deltas, triangles, at), first)


def test_the_cache_knows_every_input_by_content(tmp_path):
    vertices, triangles = sphere(6, 8)
    deltas = np.zeros((1, len(vertices), 3))
    at = np.arange(4)
    moved = deltas.copy()
    moved[0, 7, 2] = 1e-6
    calls = [
        (vertices, deltas, triangles, at, 8),
        (vertices, deltas.copy(), triangles, at, 8),
        (vertices, moved, triangles, at, 8),
        (2 * vertices, deltas, triangles, at, 8),
        (vertices, deltas, triangles[::-1], at, 8),
        (vertices, deltas, triangles, at[::-1], 8),
        (vertices, deltas, triangles, at, 9),
    ]
    for *arrays, rays in calls:
        global_visibility(*arrays, rays=rays)
    assert len(list(tmp_path.rglob("*.npz"))) == len(calls) - 1


@pytest.mark.parametrize("damage", [b"", b"not an array", b"\x93NUMPY\x01\x00"])
def test_a_broken_cache_entry_is_computed_again(damage):
    vertices, triangles = sphere(6, 8)
    arguments = (vertices, np.zeros((1, len(vertices), 3)), triangles, np.arange(5))
    answer = global_visibility(*arguments)
    entry = next((cache_dir() / "visibility").glob("*.npz"))
    entry.write_bytes(damage)
    assert np.array_equal(global_visibility(*arguments), answer)
    assert np.array_equal(np.load(entry)["share"], answer)


def test_the_cache_drops_its_oldest_entries(monkeypatch):
    monkeypatch.setattr("capture_plan.visibility.shapes.ENTRIES", 3)
    vertices, triangles = sphere(6, 8)
    stored = []
    for rays in range(1, 7):
        global_visibility(vertices, np.zeros((1, len(vertices), 3)), triangles, np.arange(2), rays=rays)
        stored += [entry for entry in (cache_dir() / "visibility").iterdir() if entry not in stored]
        os.utime(stored[-1], ns=(rays, rays))
    assert set((cache_dir() / "visibility").iterdir()) == set(stored[-3:])


def test_a_folder_that_cannot_be_written_costs_only_the_cache(tmp_path, monkeypatch):
    (tmp_path / "file").touch()
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    vertices, triangles = sphere(6, 8)
    assert (global_visibility(vertices, np.zeros((1, len(vertices), 3)), triangles, np.arange(5)) == 1).all()


def test_every_blendshape_is_reported_as_progress():
    vertices, triangles = sphere(6, 8)
    seen = []
    with show_progress(lambda label, done, total: seen.append((done, total))):
        global_visibility(vertices, np.zeros((3, len(vertices), 3)), triangles, np.arange(5))
    assert seen == [(0, 3), (1, 3), (2, 3), (3, 3)]
