"""An evaluation is found again, and only for the very same question."""

import os
from dataclasses import replace

import numpy as np
import pytest

from capture_plan.cache import cache_dir
from capture_plan.curves.frames import PosedFrames
from capture_plan.evaluation.le2013.evaluation import People
from capture_plan.evaluation.le2013.evaluation_cache import cached_evaluation, name_of
from capture_plan.layout.face import see_face
from capture_plan.sample import sample_rig
from capture_plan.sample.motion import sample_motion
from capture_plan.shell.take import face_take

SHELF = "evaluations"


@pytest.fixture(scope="module")
def asked():
    rig = sample_rig()
    return face_take(rig, sample_motion(frames=30)), see_face(rig, rig.names)


def unmoved():
    folder = cache_dir() / SHELF
    return set(os.listdir(folder)) if folder.is_dir() else set()


def test_what_was_evaluated_once_is_answered_from_disk_to_the_last_digit(asked):
    take, face = asked
    before = unmoved()
    first = cached_evaluation(take, face, (6,))
    (new,) = unmoved() - before
    assert new == f"{name_of(take, face, (6,))}.npz"
    assert first.counts == (6,)
    assert cached_evaluation(take, face, (6,)) == first
    assert unmoved() == before | {new}


def test_the_same_question_has_one_name(asked):
    take, face = asked
    again = face_take(sample_rig(), sample_motion(frames=30)), see_face(sample_rig(), sample_rig().names)
    assert name_of(*again, (6,)) == name_of(take, face, (6,))


def test_another_take_number_or_person_is_another_question(asked):
    take, face = asked
    rig = take.rig
    names = [
        name_of(take, face, (6,)),
        name_of(take, face, (7,)),
        name_of(take, see_face(rig, rig.names[1:]), (6,)),
        name_of(face_take(rig, sample_motion(seed=1, frames=30)), face, (6,)),
        name_of(face_take(rig, replace(take.sequence, name="another")), face, (6,)),
        name_of(take, face, (6,), People((take,), "people")),
        name_of(take, face, (6,), People((take,), "other people")),
        name_of(take, face, (6,), People((take, take), "people")),
    ]
    assert len(set(names)) == len(names)


def test_the_same_frames_in_another_order_are_another_question(asked):
    """Their rows are the same to the last digit, but not the parts that one is rebuilt from the others."""
    take, face = asked
    exact = np.round(64 * take.sequence.frames.weights) / 64
    takes = [
        face_take(take.rig, replace(take.sequence, frames=PosedFrames(take.rig, weights)))
        for weights in (exact, exact[np.random.default_rng(0).permutation(len(exact))])
    ]
    assert np.array_equal(takes[0].motion.rows, takes[1].motion.rows)
    assert name_of(takes[0], face, (6,)) != name_of(takes[1], face, (6,))
