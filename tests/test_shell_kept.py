"""An evaluation is found again, and only for the very same question."""

import os

import pytest

from capture_plan.cache import cache_dir
from capture_plan.layout.face import see_face
from capture_plan.layout.shell.kept import kept_evaluation
from capture_plan.layout.shell.take import face_take
from capture_plan.rig import sample_rig
from capture_plan.rig.sample.motion import sample_motion

SHELF = "evaluations"


@pytest.fixture(scope="module")
def asked():
    rig = sample_rig()
    return face_take(rig, sample_motion(frames=30)), see_face(rig, rig.names)


def kept():
    folder = cache_dir() / SHELF
    return set(os.listdir(folder)) if folder.is_dir() else set()


def test_what_was_evaluated_once_is_answered_from_disk_to_the_last_digit(asked):
    take, face = asked
    before = kept()
    first = kept_evaluation(take, face, (6,))
    after = kept()
    assert len(after - before) == 1
    assert kept_evaluation(take, face, (6,)) == first
    assert kept() == after


def test_another_take_or_number_is_another_question(asked):
    take, face = asked
    first = kept_evaluation(take, face, (6,))
    other = face_take(take.rig, sample_motion(seed=1, frames=30))
    assert kept_evaluation(take, face, (7,)).counts == (7,)
    assert kept_evaluation(other, face, (6,)).rest_mm != first.rest_mm
