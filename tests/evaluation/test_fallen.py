"""What to do when a dot falls off agrees with what is left of the layout."""

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest

from capture_plan.camera import cameras_for
from capture_plan.evaluation.fallen import falling
from capture_plan.evaluation.identifiability import shares
from capture_plan.layout.face import see_face
from capture_plan.sample import sample_rig
from capture_plan.sheets.care_card import PAIRS, instead_words, together_words, why_words
from tests.once import plan_of


@pytest.fixture(scope="module")
def layout():
    plan = plan_of()
    return plan.audit.used, plan.settings.landmarks, plan.layout.landmarks


@pytest.fixture(scope="module")
def found(layout):
    return falling(sample_rig(), *layout)


def test_a_dot_is_put_back_where_a_blendshape_or_a_tenth_of_the_error_hangs_on_it(layout, found):
    used, settings, landmarks = layout
    face, vertices = see_face(sample_rig(), used), np.array([m.vertex for m in landmarks])
    covers, seen = shares(face, settings, vertices) >= settings.epsilon, face.observation(settings.noise_mm)
    before = seen.error(seen.covariance(vertices))
    for m, one in enumerate(found.alone):
        rest = np.delete(np.arange(len(vertices)), m)
        gone = [used[k] for k in np.flatnonzero(covers.any(axis=1) & ~covers[:, rest].any(axis=1))]
        factor = seen.error(seen.covariance(vertices[rest])) / before
        assert list(one.unseen) == gone
        assert one.factor == pytest.approx(factor, rel=1e-6)
        assert one.carry_on == (not gone and factor <= 1.1)


def test_pairs_that_must_not_both_fall_are_of_dots_that_may_each_fall(layout, found):
    used, settings, landmarks = layout
    may = [m for m, one in enumerate(found.alone) if one.carry_on]
    face, vertices = see_face(sample_rig(), used), np.array([m.vertex for m in landmarks])
    covers, seen = shares(face, settings, vertices) >= settings.epsilon, face.observation(settings.noise_mm)
    before = seen.error(seen.covariance(vertices))
    bad = set()
    for a, b in combinations(may, 2):
        rest = np.delete(np.arange(len(vertices)), [a, b])
        gone = (covers.any(axis=1) & ~covers[:, rest].any(axis=1)).any()
        if gone or seen.error(seen.covariance(vertices[rest])) > 1.1 * before:
            bad.add((landmarks[a].name, landmarks[b].name))
    assert set(found.together) == bad


def test_a_new_dot_stands_clear_of_the_old_place(found):
    assert all(one.instead_mm is None or one.instead_mm >= 4 for one in found.alone)
    assert sum(one.instead_mm is not None for one in found.alone) > len(found.alone) / 2


def test_where_cameras_decide_a_new_place_is_one_that_they_read(layout):
    rig = sample_rig()
    used, settings, landmarks = layout
    below = replace(cameras_for("frontal", rig.neutral, rig.skin)[0], name="below")
    found = falling(rig, used, settings, landmarks, (below,))
    assert any(one.instead_mm is not None for one in found.alone)
    free = see_face(rig, used, (below,)).free(settings)
    assert not free[rig.skin & (rig.neutral[:, 2] < rig.neutral[rig.skin][:, 2].min() + 40)].any()


def test_the_card_says_it_in_words_that_a_make_up_artist_knows(found):
    one = next(one for one in found.alone if "eyeBlinkLeft" in one.unseen)
    assert why_words(one, {"eyeBlinkLeft": "eye closed (left)"}).startswith(
        "the only dot that shows: eye closed (left)"
    )
    carried = next(one for one in found.alone if one.carry_on)
    assert why_words(carried, {}) == ""
    assert instead_words(carried).split()[1] == "mm"
    assert "The worst pairs: " in together_words(tuple((f"M{i}", "M99") for i in range(PAIRS + 1)))
    assert together_words((("M01", "M02"),)) == "Never both off at once: M01 and M02."
    assert together_words(()) == ""
