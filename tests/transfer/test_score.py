"""What an order of expressions is worth, and the faces on which it is tried."""

import dataclasses

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from capture_plan.curves.random_mixes import moment_of_mixes, random_mixes
from capture_plan.errors import RigError
from capture_plan.mesh.mirror import mirror_error, mirror_plane
from capture_plan.sample import sample_rig
from capture_plan.transfer.deformation import deformation_transfer
from capture_plan.transfer.score import Bench, score_orders, score_packing
from capture_plan.transfer.targets import (
    Target,
    all_targets,
    another_person,
    bent,
    habit,
    lower,
    random_field,
    wider,
)

SAMPLE = sample_rig()
NAMES = ("jawOpen", "eyeBlinkLeft", "browInnerUp", "mouthSmileLeft", "eyeLookUpLeft", "noseSneerRight")
ROWS = [SAMPLE.names.index(name) for name in NAMES]
RIG = dataclasses.replace(SAMPLE, names=NAMES, deltas=SAMPLE.deltas[ROWS])
ALONE = [{name: 1.0} for name in NAMES]


def test_a_packing_of_all_blendshapes_alone_ends_near_the_truth():
    target = lower(RIG, 0.6)
    none, all_of_them = score_packing(RIG, target.neutral, target.deltas, ALONE, counts=[0])
    assert (none.count, all_of_them.count) == (0, 6)
    assert all_of_them.rms_mm < 0.2 * none.rms_mm


def test_no_scan_is_deformation_transfer():
    target = wider(RIG, 0.25)
    score = score_packing(RIG, target.neutral, target.deltas, ALONE, counts=[0])[0]
    moved = deformation_transfer(RIG.neutral, RIG.triangles, RIG.deltas, target.neutral)
    wrong = np.linalg.norm(moved - target.deltas, axis=2)[:, RIG.skin]
    rms = np.sqrt(np.square(wrong).mean(axis=1))
    assert np.isclose(score.rms_mm, np.sqrt(np.square(wrong).mean()))
    assert np.isclose(score.mean_mm, rms.mean())
    assert (score.max_mm, score.worst) == (pytest.approx(rms.max()), NAMES[int(rms.argmax())])


def test_more_scans_of_single_blendshapes_are_never_worth_less():
    rows = score_orders(RIG, all_targets(RIG, people=1, seed=3), {"alone": ALONE}, counts=range(7))
    for target in {row.target for row in rows}:
        rms = [row.rms_mm for row in rows if row.target == target]
        assert (np.diff(rms) <= 0).all()


def test_the_order_of_scans_changes_nothing_once_all_are_there():
    bench = Bench(RIG, another_person(RIG, 1, name="other"))
    packed = [{"jawOpen": 1.0, "browInnerUp": 1.0}, {"eyeBlinkLeft": 1.0, "jawOpen": 0.5}, {"mouthSmileLeft": 1.0}]
    assert np.allclose(bench.errors(packed), bench.errors(packed[::-1]))


def test_scans_solved_in_groups_equal_scans_solved_together():
    bench = Bench(RIG, lower(RIG, 0.6))
    packed = [{"jawOpen": 1.0, "browInnerUp": 1.0}, {"eyeBlinkLeft": 1.0}, {"eyeBlinkLeft": 1.0, "mouthSmileLeft": 1.0}]
    W = np.array([[pose.get(name, 0) for name in NAMES] for pose in packed])
    assert np.allclose(bench.errors(packed), bench._rebuilt(W))


@pytest.mark.parametrize("k", [2, 5, 30])
def test_moments_of_mixes_are_those_of_many_random_mixes(k):
    w = random_mixes(k, frames=20_000, seed=1)
    assert np.abs(w.T @ w / len(w) - moment_of_mixes(k)).max() < 0.01
    assert np.isclose(np.trace(moment_of_mixes(k)), np.mean(np.square(w).sum(axis=1)), rtol=0.03)


def test_an_even_turn_and_scale_is_no_other_face():
    """Where phi turns and scales, truth and deformation transfer agree: neither is favoured by its making."""
    sR = 0.8 * Rotation.from_euler("y", 30, degrees=True).as_matrix()
    target = bent(RIG, "turned", lambda x: x @ sR.T)
    moved = deformation_transfer(RIG.neutral, RIG.triangles, RIG.deltas, target.neutral)
    assert np.abs(moved - target.deltas).max() < 1e-4


def test_scaling_one_axis_scales_the_deltas():
    target = lower(RIG, 0.6)
    assert np.allclose(target.deltas, RIG.deltas * np.array([1, 0.6, 1]), atol=1e-6)
    assert np.allclose(target.neutral, RIG.neutral * np.array([1, 0.6, 1]))


def test_wide_is_wider_and_narrow_is_narrower_in_the_middle_alone():
    at = np.argmax(np.where(RIG.skin, RIG.neutral[:, 0], -np.inf))
    wide, narrow = wider(RIG, 0.25), wider(RIG, -0.25)
    assert narrow.neutral[at, 0] < RIG.neutral[at, 0] < wide.neutral[at, 0]
    assert (wide.neutral[:, 1:] == RIG.neutral[:, 1:]).all()


@pytest.mark.parametrize("by", [0.25, -0.25])
def test_the_width_changes_by_its_share_at_half_the_height_and_by_little_at_the_chin_and_the_brow(by):
    x, y = RIG.neutral[RIG.skin, 0], RIG.neutral[RIG.skin, 1]
    c = mirror_plane(RIG.neutral)
    off = np.abs(x - c) > 5
    change = (wider(RIG, by).neutral[RIG.skin, 0] - x)[off] / (x - c)[off] / by
    height = (y[off] - y.min()) / np.ptp(y)
    for at, share in ((0.5, 1.0), (0.0, np.exp(-2)), (1.0, np.exp(-2))):
        nearest = np.abs(height - at).argmin()
        assert change[nearest] == pytest.approx(share, abs=0.05)


def test_a_person_has_a_face_and_habits_of_its_own_and_the_same_every_time():
    one, again, other = (another_person(RIG, seed, name="x") for seed in (1, 1, 2))
    assert (one.deltas == again.deltas).all()
    assert np.abs(one.neutral - other.neutral).max() > 1
    assert np.abs(one.deltas - RIG.deltas).max() > 1
    assert not one.deltas[:, np.linalg.norm(RIG.deltas, axis=2).max(axis=0) == 0].any()


def test_another_person_is_as_symmetric_as_the_rig():
    assert np.quantile(mirror_error(RIG.neutral), 0.95) < 0.1
    assert np.quantile(mirror_error(another_person(RIG, 1, name="x").neutral), 0.95) < 0.1


def test_habits_change_how_far_and_which_way():
    d = RIG.deltas[0].astype(float)
    length = np.linalg.norm(d, axis=1)
    moving = length > 0.1
    changed = habit(d, random_field(RIG.neutral, np.random.default_rng(0)))[moving] - d[moving]
    along = np.einsum("vx,vx->v", changed, d[moving]) / length[moving]
    across = np.sqrt(np.square(changed).sum(axis=1) - along**2)
    for part in (along, across):
        assert 0.05 < np.sqrt(np.mean(np.square(part / length[moving]))) < 0.6


def test_another_rig_and_unknown_names_are_refused():
    with pytest.raises(RigError, match=r"other has 5 blendshapes of 4,939 vertices, MakeHuman head 6 of 4,939"):
        Bench(RIG, Target("other", RIG.neutral, np.zeros((5, *RIG.neutral.shape))))
    with pytest.raises(RigError, match="MakeHuman head has no blendshape 'jawShut'"):
        score_packing(RIG, RIG.neutral, RIG.deltas.astype(float), [{"jawShut": 1.0}])
