"""The made-up take moves every blendshape, smoothly and a few at a time, and always the same way."""

import numpy as np

from capture_plan.anatomy.delta_relations import correctives
from capture_plan.sample import sample_rig
from capture_plan.sample.motion import FRAMES, LEAST_PEAK, random_weights, sample_motion


def test_the_same_seed_gives_the_same_take_and_another_another():
    take, again, other = sample_motion(), sample_motion(), sample_motion(1)
    assert np.array_equal(take.frames.weights, again.frames.weights)
    assert not np.array_equal(take.frames.weights, other.frames.weights)
    assert len(take) == FRAMES


def test_every_blendshape_is_performed_and_few_at_a_time():
    weights = random_weights(sample_rig(), 3, FRAMES)
    assert weights.max(axis=0).min() > 0.9 * LEAST_PEAK
    assert weights.min() == 0
    assert weights.max() <= 1
    assert (weights > 0.1).sum(axis=1).mean() < 10


def test_weights_change_little_from_frame_to_frame():
    assert abs(np.diff(random_weights(sample_rig(), 0, FRAMES), axis=0)).max() < 0.25


def test_a_corrective_never_goes_beyond_what_it_corrects():
    rig = sample_rig()
    weights = random_weights(rig, 0, FRAMES)
    found = correctives(rig, rig.names)
    assert found
    for finding in found:
        corrective, *corrected = (rig.names.index(name) for name in finding.blendshapes)
        assert all((weights[:, k] >= weights[:, corrective]).all() for k in corrected)
