"""Rings around dots: the growth of the error is exact, crews within them keep it, and they are no smaller than that."""

import numpy as np
import pytest
from msgspec import structs

from capture_plan.evaluation.rings import EXACT_MM, LEAST_MM, MOST_MM, STEP_MM, axes_alike, placing_of, rings, rings_of
from capture_plan.layout.face import Face
from capture_plan.layout.observation import PRIOR_SD
from capture_plan.layout.settings import LayoutSettings
from capture_plan.sample import sample_rig
from tests.once import plan_of


@pytest.fixture(scope="module")
def placing():
    rig, plan = sample_rig(), plan_of()
    face = Face(rig, plan.audit.used, np.zeros(len(rig.neutral)))
    return placing_of(face, LayoutSettings(), np.array([m.vertex for m in plan.layout.landmarks]))


@pytest.fixture(scope="module")
def found(placing):
    return rings(placing)


def test_the_growth_is_that_of_a_solver_who_takes_moved_dots_for_right_ones(placing):
    """By its definition: answers A ((B + D) w + noise) to weights w, as an error of the skin."""
    seen = placing.observation
    B, C = seen.response(placing.vertices), seen.covariance(placing.vertices)
    D = np.random.default_rng(0).normal(scale=0.3, size=(3, *B.shape))
    A = C @ B.T / seen.noise_mm**2
    for change, grown in zip(D, placing.growth(D), strict=True):
        off = A @ (B + change) - np.eye(len(C))
        squared = PRIOR_SD**2 * np.trace(off.T @ seen.gram @ off) + seen.noise_mm**2 * np.trace(A.T @ seen.gram @ A)
        assert grown == pytest.approx(np.sqrt(squared) / seen.error(C), rel=1e-9)


def test_dots_at_their_places_cost_nothing(placing):
    assert placing.moved[:, :, 0] == pytest.approx(0, abs=1e-4)
    assert placing.growth(np.zeros((1, 3 * len(placing.vertices), len(placing.observation.deltas)))) == pytest.approx(1)


def test_of_other_crews_within_the_rings_as_many_keep_the_error_as_is_promised(placing, found):
    for seed in (1, 2):
        assert 0.93 <= placing.kept(found, crews=1000, seed=seed) <= 0.97


def test_wider_rings_keep_fewer_crews(placing, found):
    assert placing.kept(1.5 * found, crews=500, seed=1) < 0.7
    assert placing.kept(0.5 * found, crews=500, seed=1) == 1.0


def test_rings_are_lengths_that_a_person_can_keep_and_alike_on_both_sides(found):
    assert ((found >= LEAST_MM - 1e-9) & (found <= MOST_MM)).all()
    assert found / EXACT_MM == pytest.approx(np.round(found / EXACT_MM))
    ring = dict(zip([m.label for m in plan_of().layout.landmarks], found, strict=True))
    for label, mm in ring.items():
        if label.startswith("left"):
            assert ring[label.replace("left", "right", 1)] == pytest.approx(mm, abs=0.3)


def test_a_dot_alone_costs_the_more_the_wider_its_ring(placing):
    assert (np.diff(placing.alone()[:, 1:], axis=1) > -1e-9).mean() > 0.97


def test_two_dots_never_touch_wherever_they_stand_in_their_rings():
    rig, plan = sample_rig(), plan_of()
    wide = structs.replace(LayoutSettings(), dot_mm=9.0)  # the nearest two stand 9.5 mm apart
    landmarks = plan.layout.landmarks
    found = rings_of(rig, plan.audit.used, wide, landmarks)
    places = rig.neutral[[m.vertex for m in landmarks]]
    apart = np.linalg.norm(places[:, None] - places, axis=2) + 1e9 * np.eye(len(places))
    mm = np.array([found.mm[m.name] for m in landmarks])
    room = apart - mm[:, None] - mm[None] - wide.dot_mm
    assert room[(mm[:, None] > LEAST_MM) & (mm[None] > LEAST_MM)].min() >= -1e-6
    assert (mm <= LEAST_MM + 1e-9).sum() >= 2  # the nearest two, which no ring of any width fits between


def test_a_dot_costs_most_along_its_strict_axis(placing, found):
    """By the definition: rows at the ring on either side, one dot moved at a time."""
    axes, growth = placing.strictest(found), placing.along(found)
    strict = np.flatnonzero(axes.any(axis=1))
    assert 0.2 < len(strict) / len(found) < 0.9
    assert np.linalg.norm(axes[strict], axis=1) == pytest.approx(1)
    at = np.rint(found / STEP_MM).astype(int)
    for m in strict[:6]:
        by_direction = []
        for d in range(growth.shape[1]):
            D = np.zeros((len(found), *placing.moved.shape[3:]))
            D[m] = placing.moved[m, d, at[m]]
            by_direction.append(placing.growth(D.reshape(1, -1, D.shape[-1]))[0])
        both = np.add(by_direction[:8], by_direction[8:])
        angle = np.pi * both.argmax() / 8
        assert abs((np.array([np.cos(angle), np.sin(angle)]) @ placing.axes[m]) @ axes[m]) == pytest.approx(1)


def test_strict_axes_are_mirrored_on_the_other_side(placing, found):
    landmarks = plan_of().layout.landmarks
    axes = dict(zip([m.label for m in landmarks], placing.strictest(found), strict=True))
    pairs = [(axes[label], axes[label.replace("left", "right", 1)]) for label in axes if label.startswith("left")]
    both = [(a, b) for a, b in pairs if a.any() and b.any()]
    assert len(both) > 4
    alike = [abs((a * [-1, 1, 1]) @ b) for a, b in both]
    assert np.median(alike) == pytest.approx(1, abs=1e-3)


def test_where_only_one_of_two_mirror_images_has_a_strict_axis_both_get_it_and_middles_get_one_that_is_its_own_image():
    axis = np.array([0.6, 0.8, 0.0])
    found = axes_alike(
        np.array([axis, [0, 0, 0], axis, [-0.8, 0.6, 0], [0.28, 0.96, 0], [0, 0, 0]]),
        ["left brow 1", "right brow 1", "left cheek", "right cheek", "chin", "nose"],
    )
    assert found[0] == pytest.approx(axis)
    assert found[1] == pytest.approx(axis * [-1, 1, 1])
    assert abs(found[2] * [-1, 1, 1] @ found[3]) == pytest.approx(1)
    assert found[4] == pytest.approx([0, 1, 0])
    assert not found[5].any()


def test_rings_are_remembered_and_are_those_that_were_found():
    rig, plan = sample_rig(), plan_of()
    asked = (rig, plan.audit.used, plan.settings.landmarks, plan.layout.landmarks)
    first, again = rings_of(*asked), rings_of(*asked)
    assert first == again
    assert first.kept >= 0.95
    assert set(first.strict) <= set(first.mm)
    for marker in plan.layout.landmarks:
        twin = marker.label.replace("left", "?").replace("right", "left").replace("?", "right")
        other = next((m for m in plan.layout.landmarks if m.label == twin), marker)
        assert first.mm[marker.name] == first.mm[other.name]
