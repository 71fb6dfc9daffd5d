"""What a scan of each blendshape is expected to be worth."""

import dataclasses

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from capture_plan.errors import RigError
from capture_plan.sample import sample_rig
from capture_plan.transfer.deformation import deformation_transfer
from capture_plan.transfer.importance import local_maps, transfer_importance
from capture_plan.transfer.targets import HABIT_SQUARE, another_person, lower, wider

SAMPLE = sample_rig()
NAMES = ("jawOpen", "eyeBlinkLeft", "browInnerUp", "mouthSmileLeft", "noseSneerRight", "mouthPucker")
RIG = dataclasses.replace(
    SAMPLE, names=NAMES, deltas=SAMPLE.deltas[[SAMPLE.names.index(name) for name in NAMES]].astype(np.float32)
)
ENERGY = np.square(RIG.displacement[:, RIG.skin]).mean(axis=1)


def test_without_a_target_it_is_the_habit_of_the_movement():
    assert np.allclose(transfer_importance(RIG), HABIT_SQUARE * ENERGY)


def test_a_persons_habits_are_as_large_as_expected():
    people = [another_person(RIG, seed, name="person") for seed in range(4)]
    found = [
        np.square(p.deltas - deformation_transfer(RIG.neutral, RIG.triangles, RIG.deltas, p.neutral)) for p in people
    ]
    true = np.mean([each[:, RIG.skin].sum(axis=2).mean(axis=1).sum() for each in found])
    expected = np.mean([transfer_importance(RIG, p.neutral).sum() for p in people])
    assert 0.6 < expected / true < 1.6  # with the habit of one axis in place of three: 0.5


def test_the_rigs_own_face_and_a_turned_one_add_nothing():
    R = Rotation.from_euler("xyz", [10, 40, -20], degrees=True).as_matrix()
    for target in (RIG.neutral, RIG.neutral @ R.T + 5):
        assert np.allclose(transfer_importance(RIG, target), transfer_importance(RIG), rtol=1e-6)


def test_scaling_the_target_scales_the_error():
    target = RIG.neutral * [1, 0.6, 1]
    assert np.allclose(transfer_importance(RIG, 2 * target), 4 * transfer_importance(RIG, target), rtol=1e-2)


def test_doubling_the_movement_of_a_blendshape_quadruples_its_worth():
    deltas = RIG.deltas.copy()
    deltas[2] *= 2
    twice = transfer_importance(dataclasses.replace(RIG, deltas=deltas))
    assert np.allclose(twice / transfer_importance(RIG), [1, 1, 4, 1, 1, 1])


@pytest.mark.parametrize("target", [lower(RIG, 0.6), wider(RIG, 0.25)], ids=lambda target: target.name)
def test_it_foretells_the_true_error_better_than_movement_alone(target):
    moved = deformation_transfer(RIG.neutral, RIG.triangles, RIG.deltas, target.neutral)
    true = np.square((moved - target.deltas)[:, RIG.skin]).sum(axis=2).mean(axis=1)

    def likeness(importance):
        return np.corrcoef(np.log(importance), np.log(true))[0, 1]

    assert likeness(transfer_importance(RIG, target.neutral)) > max(0.9, likeness(ENERGY))


def test_an_affine_map_is_found_where_space_is_filled():
    rng = np.random.default_rng(0)
    cloud, A = rng.uniform(-40, 40, (2000, 3)), np.eye(3) + rng.normal(0, 0.2, (3, 3))
    assert np.abs(local_maps(cloud, cloud @ A.T, cloud[:50]) - A).max() < 0.02


def test_another_mesh_is_refused():
    with pytest.raises(RigError, match="the target neutral has 10 vertices, the rig has 4,939"):
        transfer_importance(RIG, np.zeros((10, 3)))
