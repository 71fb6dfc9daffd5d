"""An evaluation is found again, and only for the very same question."""

import os
from dataclasses import replace

import numpy as np
import pytest

from capture_plan.cache import cache_dir
from capture_plan.layout.face import see_face
from capture_plan.layout.shell.kept import kept_evaluation
from capture_plan.layout.shell.take import face_take
from capture_plan.rig import sample_rig
from capture_plan.rig.sample.motion import sample_motion
from capture_plan.rig.sequence.frames import PosedFrames

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


def test_the_same_frames_in_another_order_are_another_question(asked):
    """Their rows are the same to the last digit, but not the parts that one is rebuilt from the others."""
    take, face = asked
    exact = np.round(64 * take.sequence.frames.weights) / 64
    takes = [
        face_take(take.rig, replace(take.sequence, frames=PosedFrames(take.rig, weights)))
        for weights in (exact, exact[np.random.default_rng(0).permutation(len(exact))])
    ]
    assert np.array_equal(takes[0].motion.rows, takes[1].motion.rows)
    first, other = (kept_evaluation(one, face, (6,)) for one in takes)
    assert first.folds != other.folds
