"""Choosing cameras among places: against every choice there is, on small problems."""

from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from capture_plan.camera import cameras_for, candidates, own_text, read_cameras
from capture_plan.errors import InfeasibleError
from capture_plan.layout.camera_choice import GAP, CameraProblem, choose, fixed_by_cost, relax
from capture_plan.layout.camera_places import place_cameras, placement_lines
from capture_plan.layout.face import see_face
from tests.light import light_sample

K, C = 5, 9


def problem(seed, rows=0, views=1):
    rng = np.random.default_rng(seed)
    B = rng.normal(size=(C, 4, K)) * 10.0 ** rng.uniform(-1, 1, (C, 1, 1))
    root = rng.normal(size=(K, K))
    reads = rng.uniform(size=(rows, C)) < 0.5
    return CameraProblem.of(B.transpose(0, 2, 1) @ B, root @ root.T, reads, views)


def every(one, n):
    return {at: one.error2(at) for at in combinations(range(C), n) if one.keeps(at)}


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 6), st.sampled_from([0, 4]))
def test_no_choice_is_better_than_the_bound_and_ours_is_within_the_gap(seed, n, rows):
    one = problem(seed, rows)
    all_of_them = every(one, n)
    if not all_of_them:
        with pytest.raises(InfeasibleError):
            choose(one, n)
        return
    least = np.sqrt(min(all_of_them.values()))
    found = choose(one, n)
    assert one.keeps(found.at)
    assert len(found.at) == n
    assert found.error_mm == pytest.approx(np.sqrt(one.error2(found.at)))
    assert found.bound_mm <= least * (1 + 1e-9)
    assert found.error_mm <= least * (1 + GAP)


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(2, 5))
def test_the_relaxed_bound_holds_for_every_choice_and_what_is_fixed_is_in_the_best(seed, n):
    one = problem(seed)
    found, free = every(one, n), np.full(C, -1)
    best = min(found, key=lambda at: found[at])
    root = relax(one, n, free)
    assert root.bound <= found[best] * (1 + 1e-9)
    for at, error in found.items():
        y = np.isin(np.arange(C), at)
        assert root.base + root.slope @ y <= error * (1 + 1e-9)
    fixed = fixed_by_cost(free, root, n, found[best] * (1 + 1e-6))
    assert all(c in best for c in np.flatnonzero(fixed == 1))
    assert not any(c in best for c in np.flatnonzero(fixed == 0))


def test_rows_that_another_implies_are_left_out():
    reads = np.array([[1, 1, 0, 0], [1, 1, 1, 0], [0, 0, 1, 1], [1, 1, 0, 0]], dtype=bool)
    one = CameraProblem.of(np.tile(np.eye(2), (4, 1, 1)), np.eye(2), reads, 1)
    assert sorted(map(tuple, one.rows.astype(int).tolist())) == [(0, 0, 1, 1), (1, 1, 0, 0)]


def test_the_gradient_is_that_of_the_error():
    one, x, h = problem(3), np.full(C, 0.4), 1e-5
    _, g = one.look(x)
    numeric = [(one.look(x + h * e)[0] - one.look(x - h * e)[0]) / (2 * h) for e in np.eye(C)]
    np.testing.assert_allclose(g, numeric, rtol=1e-5)


@pytest.fixture(scope="module")
def placed():
    rig = light_sample()
    used = ("jawOpen", "mouthSmileLeft", "mouthSmileRight", "browInnerUp")
    face = rig.neutral[rig.skin]
    rng = np.random.default_rng(0)
    front = np.flatnonzero(rig.skin & (rig.neutral[:, 2] > np.quantile(face[:, 2], 0.8)))
    at = rng.choice(front, 8, replace=False)
    places = candidates("ring", 7, face)
    return rig, used, at, places, place_cameras(rig, used, at, places, [1, 2, 3], dot_mm=4.0, views=1)


def test_the_error_of_a_placement_is_that_of_a_plan_with_these_cameras(placed):
    rig, used, at, _, found = placed
    for one in found.best:
        observation = see_face(rig, used, one.cameras).observation(0.2, 4.0)
        assert one.error_mm == pytest.approx(observation.error(observation.covariance(at)), rel=1e-6)
    errors = [one.error_mm for one in found.best]
    assert errors == sorted(errors, reverse=True)


def test_lines_say_what_a_camera_more_buys_and_who_is_hidden(placed):
    lines = placement_lines(placed[-1], {})
    assert any("One more takes" in line for line in lines)
    assert all("proved within" in line or line.startswith(("Proved:", "Fewer than")) for line in lines)


@pytest.mark.parametrize("kind", ["ring", "dome", "boom"])
def test_places_look_at_the_face_and_come_back_from_their_file(kind, tmp_path):
    rig = light_sample()
    face = rig.neutral[rig.skin]
    places = candidates(kind, 8, face)
    assert all(one.in_image(face[face[:, 2] > np.quantile(face[:, 2], 0.7)]).mean() > 0.9 for one in places)
    (tmp_path / "c.toml").write_text(own_text(places, "eight"))
    for was, now in zip(places, read_cameras(tmp_path / "c.toml").cameras, strict=True):
        np.testing.assert_allclose(now.project(face), was.project(face), atol=1e-3, equal_nan=True)
    assert cameras_for(str(tmp_path / "c.toml"), rig.neutral, rig.skin)
