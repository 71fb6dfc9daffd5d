"""What is said of thin-shell layouts: errors measured a second way, simulations found again, frames kept apart."""

from dataclasses import replace

import msgspec
import numpy as np
import pytest

from capture_plan.errors import RigError
from capture_plan.layout.face import see_face
from capture_plan.layout.shell.boundary import STILL_MM
from capture_plan.layout.shell.evaluate import (
    METHODS,
    MIRRORED,
    OURS,
    RANDOM_NAME,
    held_or_loose,
    inside,
    motion_error,
    vertex_errors,
)
from capture_plan.layout.shell.evaluation import evaluate_take
from capture_plan.layout.shell.page import motion_text
from capture_plan.layout.shell.take import face_take
from capture_plan.layout.shell.validate import (
    FOLDS,
    OnFirst,
    descents,
    five_fold,
    leave_one_out,
    on_first,
    simulation_recovery,
)
from capture_plan.rig import sample_rig
from capture_plan.rig.audit import audit
from capture_plan.rig.sample.motion import random_weights, sample_motion
from capture_plan.rig.sequence import Sequence
from capture_plan.rig.sequence.frames import PosedFrames, StoredFrames


@pytest.fixture(scope="module")
def take():
    return face_take(sample_rig(), sample_motion(frames=60))


@pytest.fixture(scope="module")
def face():
    return see_face(sample_rig(), audit(sample_rig()).used)


def frames_of(take):
    return take.sequence.frames.block(0, len(take.sequence))[:, take.at] - take.shell.vertices


def test_the_error_is_that_of_the_frames_rebuilt_one_by_one(take):
    H = np.flatnonzero(take.candidates)[::150]
    X, W = frames_of(take), take.shell.weights(H)
    missed = np.linalg.norm(X - np.einsum("vm,tmx->tvx", W, X[:, H]), axis=2)
    assert motion_error(take.shell, take.motion, H) == pytest.approx(np.sqrt((missed**2).mean()), rel=1e-4)
    of_vertices = vertex_errors(take.shell, take.motion, H)
    assert of_vertices == pytest.approx(np.sqrt((missed**2).mean(axis=0)), rel=1e-3, abs=1e-4)
    assert of_vertices[H].max() < 1e-9


def test_what_is_held_is_still_and_what_moves_may_carry_a_marker(take):
    furthest = np.linalg.norm(frames_of(take), axis=2).max(axis=0)
    assert (furthest[take.shell.fixed] < STILL_MM).all()
    assert (furthest[take.candidates] >= STILL_MM).all()
    assert sample_rig().skin[take.at].all()
    assert take.shell.fixed.any()
    assert not take.loose.fixed.any()


def test_a_take_of_meshes_is_the_take_of_the_weights_that_posed_them(take):
    stored = StoredFrames(take.sequence.frames.block(0, len(take.sequence)))
    as_meshes = face_take(take.rig, replace(take.sequence, frames=stored))
    assert np.array_equal(as_meshes.at, take.at)
    H = np.flatnonzero(take.candidates)[5::200]
    assert motion_error(take.shell, as_meshes.motion, H) == pytest.approx(
        motion_error(take.shell, take.motion, H), rel=1e-4
    )


def test_ours_is_the_best_of_what_is_chosen_without_its_search(take):
    errors = {
        name: np.mean([motion_error(take.shell, take.motion, H) for H in METHODS[name](take, take.motion, 12)])
        for name in METHODS
        if name != MIRRORED
    }
    assert min(errors, key=lambda name: errors[name]) == OURS
    assert errors[RANDOM_NAME] > 1.2 * errors[OURS]


def test_every_method_gives_as_many_different_free_vertices(take):
    for choose in METHODS.values():
        for H in choose(take, take.motion, 10):
            assert len(set(H.tolist())) == 10
            assert take.candidates[H].all()


def test_nested_layouts_are_parts_of_the_next_and_cost_a_little(take, face):
    few, more = inside(take, face, (8, 14))
    assert set(few.vertices) < set(more.vertices)
    free = motion_error(take.shell, take.motion, METHODS[OURS](take, take.motion, 14)[0])
    assert free <= more.rmse_mm <= few.rmse_mm


def test_holding_the_rim_helps_where_the_rim_is_still(take):
    held, loose = held_or_loose(take, 12)
    assert held < loose


@pytest.mark.parametrize("seed", range(3))
def test_a_few_simulated_markers_are_found_again(take, seed):
    found = simulation_recovery(take.shell, 6, seed)
    assert found.hit == 6
    assert found.rmse_mm < 1e-6
    assert found.apart_mm == 0


def test_moving_neighbours_in_twos_finds_what_single_moves_miss(take):
    seed = next(n for n in range(20) if simulation_recovery(take.shell, 12, n).hit < 12)
    alone, in_twos = (simulation_recovery(take.shell, 12, seed, joint=joint) for joint in (False, True))
    assert in_twos.rmse_mm < alone.rmse_mm


def test_a_simulation_that_is_missed_is_not_called_found(take):
    missed = [found for seed in range(4) if (found := simulation_recovery(take.shell, 40, seed)).hit < 40]
    assert all(found.rmse_mm > 1e-6 and found.apart_mm > 0 for found in missed)


def test_the_published_descent_starts_at_random_and_may_go_uphill(take):
    curves = descents(take, 8, starts=2)
    assert curves[:, -1].max() < curves[:, 0].min()
    rng = np.random.default_rng(1)
    H = rng.choice(np.flatnonzero(take.candidates), 8, replace=False)
    assert curves[1, 0] == pytest.approx(motion_error(take.shell, take.motion, H), rel=0.05)


def test_a_fold_is_measured_on_frames_that_it_was_not_chosen_from(take):
    found = five_fold(take, 8)
    parts = np.array_split(np.arange(len(take.sequence)), FOLDS)
    assert len(found.unseen_mm) == FOLDS
    training = take.over(np.concatenate(parts[:-1]))
    H = METHODS[OURS](take, training, 8)[0]
    assert found.unseen_mm[-1] == pytest.approx(motion_error(take.shell, take.over(parts[-1]), H))
    assert found.chosen_from_mm[-1] == pytest.approx(motion_error(take.shell, training, H))


def test_parts_of_a_take_add_up_to_it(take):
    whole = 60 * np.square(take.motion.rows).sum()
    parts = np.array_split(np.arange(len(take.sequence)), FOLDS)
    assert sum(np.square(take.over(part).rows).sum() * len(part) for part in parts) == pytest.approx(whole, rel=1e-6)


def test_a_subject_beside_itself_loses_little_by_being_left_out(take):
    own = OnFirst(take, np.arange(len(take.at)))
    for row in leave_one_out((own, own), 10):
        assert row.others_mm == pytest.approx(row.own_mm)
    with pytest.raises(RigError, match="1 subjects"):
        leave_one_out((own,), 10)


def test_a_head_laid_onto_itself_stays_where_it_is(take):
    assert np.mean(on_first(take, take).map == np.arange(len(take.at))) > 0.99


def test_another_take_of_the_same_face_is_rebuilt_worse_than_ones_own(take):
    other = face_take(sample_rig(), sample_motion(5, frames=60))
    both = np.intersect1d(take.at, other.at)
    number = np.searchsorted(other.at, both)
    onto = np.zeros(len(take.at), dtype=int)
    onto[np.searchsorted(take.at, both)] = number
    first, second = leave_one_out((OnFirst(take, np.arange(len(take.at))), OnFirst(other, onto)), 10)
    assert second.others_mm > second.own_mm
    assert first.subject == second.subject


def test_blendshapes_that_a_take_lacks_are_named():
    rig = sample_rig()
    weights = np.zeros((5, len(rig.names)))
    weights[2, rig.names.index("jawOpen")] = 0.8
    weights[3, rig.names.index("cheekPuff")] = 0.05
    sequence = Sequence("jaw", rig.neutral, rig.triangles, PosedFrames(rig, weights), 30.0, rig)
    lacks = set(rig.names) - {"jawOpen"}
    assert set(face_take(rig, sequence).missing(rig.names)) == lacks
    as_meshes = replace(sequence, frames=StoredFrames(sequence.frames.block(0, 5)))
    assert set(face_take(rig, as_meshes).missing(rig.names)) == lacks


def test_a_page_says_what_the_numbers_say(face):
    rig = sample_rig()
    weights = random_weights(rig, 0, 60)
    weights[:, rig.names.index("cheekPuff")] = 0
    sequence = replace(sample_motion(frames=60), frames=PosedFrames(rig, weights))
    found = evaluate_take(face_take(rig, sequence), face, (10, 6))
    assert found.counts == (6, 10)
    text = motion_text(found)
    assert f"{found.rmse_mm(OURS, 10):.3f}" in text
    assert "the take lacks 1 blendshapes" in text
    assert "cheekPuff" in text
    assert ("does not hold here: holding the rim" in text) == any(one.held_mm >= one.loose_mm for one in found.rims)
    assert ("holds here: more markers leave less" in text) == (found.rmse_mm(OURS, 6) > found.rmse_mm(OURS, 10))
    worse = msgspec.structs.replace(found, rims=(msgspec.structs.replace(found.rims[0], held_mm=99.0),))
    assert "does not hold here: holding the rim" in motion_text(worse)


def test_a_take_that_moves_nothing_is_refused():
    rig = sample_rig()
    still = Sequence("still", rig.neutral, rig.triangles, PosedFrames(rig, np.zeros((3, len(rig.names)))), 30.0, rig)
    with pytest.raises(RigError, match="moves no skin"):
        face_take(rig, still)
    other = Sequence("other", rig.neutral[:9], rig.triangles[:2] % 9, StoredFrames(rig.neutral[None, :9]), 30.0)
    with pytest.raises(RigError, match="read the take with this rig"):
        face_take(rig, other)
