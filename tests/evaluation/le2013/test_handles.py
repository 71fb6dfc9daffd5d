"""Laws of markers as handles."""

import numpy as np
import pytest

from capture_plan.errors import RigError
from capture_plan.evaluation.le2013.handles import drag
from capture_plan.sample import sample_rig
from capture_plan.sample.motion import sample_motion
from capture_plan.shell.optimise import MarkerProblem, optimise
from capture_plan.shell.take import face_take

FRAME = 7


@pytest.fixture(scope="module")
def take():
    return face_take(sample_rig(), sample_motion())


@pytest.fixture(scope="module")
def markers(take):
    return np.array(optimise(MarkerProblem([(take.shell, take.motion)], candidates=take.candidates), 12).markers)


def change(take, markers, dragged):
    return drag(take, markers, dragged, FRAME) - take.sequence.frame(FRAME)


def test_a_marker_goes_where_it_is_dragged_and_the_others_stay(take, markers):
    dragged = np.zeros((12, 3))
    dragged[3] = 4, -2, 1
    moved = change(take, markers, dragged)
    assert moved[take.at[markers]] == pytest.approx(dragged, abs=1e-8)


def test_what_is_no_part_of_the_moving_skin_stays(take, markers):
    moved = change(take, markers, np.full((12, 3), 5.0))
    still = np.setdiff1d(np.arange(len(moved)), take.at[~take.shell.fixed])
    assert not moved[still].any()


def test_two_drags_add_up(take, markers):
    a, b = np.random.default_rng(0).normal(0, 3, (2, 12, 3))
    both = change(take, markers, a) + change(take, markers, b)
    assert change(take, markers, a + b) == pytest.approx(both, abs=1e-8)


def test_all_markers_back_to_their_rest_leave_what_the_layout_misses(take, markers):
    X = take.sequence.frame(FRAME) - take.sequence.neutral
    left = drag(take, markers, -X[take.at[markers]], FRAME) - take.sequence.neutral
    missed = X[take.at] - take.shell.weights(markers) @ X[take.at[markers]]
    assert left[take.at] == pytest.approx(missed, abs=1e-5)


def test_a_frame_that_the_take_lacks_is_refused(take, markers):
    with pytest.raises(RigError, match="frame 9,999 was asked for"):
        drag(take, markers, np.zeros((12, 3)), 9999)
