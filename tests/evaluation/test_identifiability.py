"""What a layout sees: mixes, angles, blind spots, reasons, the one more dot."""

import numpy as np
import pytest

from capture_plan.evaluation.identifiability import (
    angles,
    blind_spots,
    confusable,
    reasons,
    separators,
    sights,
    weakest_mixes,
)
from capture_plan.layout.face import Face
from capture_plan.layout.observation import Observation
from capture_plan.layout.settings import LayoutSettings
from capture_plan.rig import Rig

SETTINGS = LayoutSettings(symmetric=False, spacing_mm=1.0, noise_mm=0.1)
NAMES = ("a", "b", "c")


@pytest.fixture
def face():
    """A strip of 2 x 6 vertices, 10 mm apart: a and b move vertices 0 and 1 alike, b vertex 4 too, c only vertex 8."""
    v = 12
    neutral = np.array([[10.0 * (n // 2), 10.0 * (n % 2), 0.0] for n in range(v)])
    triangles = np.array([[n, n + 2, n + 1] if n % 2 == 0 else [n, n + 1, n + 2] for n in range(v - 2)])
    deltas = np.zeros((3, v, 3), dtype=np.float32)
    deltas[0, :2, 2] = 2
    deltas[1, :2, 2] = 2
    deltas[1, 4, 2] = 1.5
    deltas[2, 8, 1] = 3
    rig = Rig("strip", neutral, triangles, deltas, NAMES, np.ones(v, bool), np.zeros(v, int), ("all",), np.arange(v))
    return Face(rig, NAMES, np.ones(v))


def test_the_angle_between_responses_is_that_of_their_directions():
    B = np.array([[1.0, 1.0, -2.0, 0.0], [0.0, 1.0, 0.0, 0.0]])
    between = angles(B.T @ B)
    assert between[0, 1] == pytest.approx(45)
    assert between[0, 2] == pytest.approx(180)  # opposites are distinguished
    assert between[0, 3] == 180  # nothing is like a response that is none
    assert (np.diagonal(between) == 180).all()


def test_a_blendshape_that_moves_landmarks_twice_as_far_is_twice_above_the_noise():
    deltas = np.random.default_rng(0).normal(size=(4, 30, 3)).astype(np.float32)
    deltas[3] = 2 * deltas[2]
    seen = sights(Observation(deltas, np.ones(30, bool), 0.2), np.arange(9), ("a", "b", "c", "d"))
    assert seen[3].signal_to_noise == pytest.approx(2 * seen[2].signal_to_noise)
    assert (seen[2].partner, seen[3].partner) == ("d", "c")
    assert seen[2].angle_degrees == pytest.approx(0, abs=1e-3)
    assert confusable(seen) == (("c", "d"),)


def test_the_weakest_mix_is_the_one_that_landmarks_do_not_see():
    deltas = np.random.default_rng(1).normal(size=(3, 30, 3)).astype(np.float32)
    deltas[2, :9] = deltas[1, :9]
    mix = weakest_mixes(Observation(deltas, np.ones(30, bool), 0.2), np.arange(9), NAMES, count=1)[0]
    assert mix.response_mm == pytest.approx(0, abs=1e-5)
    assert {name: abs(part) for name, part in mix.parts} == pytest.approx({"b": 0.707, "c": 0.707}, abs=1e-3)
    assert np.prod([part for _, part in mix.parts]) < 0
    assert mix.skin_mm > 0.1


def test_a_layout_is_blind_to_what_moves_none_of_its_landmarks_by_epsilon(face):
    assert blind_spots(face, SETTINGS, np.array([0])) == ("c",)
    assert blind_spots(face, SETTINGS, np.array([4, 8])) == ("a",)
    assert blind_spots(face, SETTINGS, np.array([0, 8])) == ()


def test_a_landmark_that_alone_sees_a_blendshape_is_there_for_it(face):
    why = reasons(face, SETTINGS, np.array([0, 1, 8]))
    assert [reason.only_one for reason in why] == [(), (), ("c",)]


def test_the_reason_of_a_landmark_is_the_pair_whose_angle_it_opens(face):
    vertices = np.array([0, 4, 8])
    reason = reasons(face, SETTINGS, vertices)[1]
    observation = face.observation(0.1)
    B = observation.response(np.array([0, 8]))
    assert reason.pair == ("a", "b")
    assert reason.angle_degrees == pytest.approx(np.degrees(np.arctan2(1.5, 2)))
    assert reason.angle_without_degrees == pytest.approx(angles(B.T @ B)[0, 1], abs=1e-5)


def test_one_more_dot_is_put_where_recomputing_finds_the_widest_angle(face):
    vertices = np.array([0, 8])
    (one,) = separators(face, SETTINGS, vertices, (("a", "b"),))
    observation = face.observation(0.1)
    tried = {}
    for vertex in (1, 4):
        B = observation.response(np.append(vertices, vertex))
        tried[vertex] = angles(B.T @ B)[0, 1]
    assert one.vertex == max(tried, key=tried.__getitem__) == 4
    assert one.angle_then_degrees == pytest.approx(tried[4])
    assert (one.nearest, one.nearest_mm) == (0, pytest.approx(20))
