"""What is said of thin-shell layouts: errors measured a second way, simulations found again, frames kept apart."""

from dataclasses import replace

import msgspec
import numpy as np
import pytest

from capture_plan.curves.frames import PosedFrames, StoredFrames
from capture_plan.errors import RigError
from capture_plan.evaluation.le2013.evaluation import evaluate_take, uneven
from capture_plan.evaluation.le2013.methods import (
    METHODS,
    MIRRORED,
    OURS,
    RANDOM_NAME,
    inside,
    motion_error,
    optimised,
    vertex_errors,
)
from capture_plan.evaluation.le2013.report import motion_text
from capture_plan.evaluation.le2013.validation import (
    FOLDS,
    descents,
    five_fold,
    recovery_as_published,
    simulation_recovery,
)
from capture_plan.sample import sample_rig
from capture_plan.sample.motion import random_weights, sample_motion
from capture_plan.sequence import Sequence
from capture_plan.shell.boundary import STILL_MM
from capture_plan.shell.motion import motion_of
from capture_plan.shell.take import face_take


@pytest.fixture(scope="module")
def take():
    return face_take(sample_rig(), sample_motion(frames=60))


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
    held, loose = (optimised(shell, take, 12) for shell in (take.shell, take.loose))
    assert held.rmse_mm < loose.rmse_mm


def test_a_few_simulated_markers_are_found_again_nearly_always(take):
    found = [simulation_recovery(take.shell, 6, seed) for seed in range(6)]
    all_hit = [one for one in found if one.hit == 6]
    assert len(all_hit) >= 5
    assert all(one.rmse_mm < 1e-6 and one.apart_mm == 0 for one in all_hit)


def test_moving_neighbours_in_twos_finds_what_single_moves_miss(take):
    seed = next(n for n in range(20) if simulation_recovery(take.shell, 12, n).hit < 12)
    alone, in_twos = (simulation_recovery(take.shell, 12, seed, joint=joint) for joint in (False, True))
    assert in_twos.rmse_mm < alone.rmse_mm


def test_a_simulation_that_is_missed_is_not_called_found(take):
    missed = [found for seed in range(4) if (found := simulation_recovery(take.shell, 40, seed)).hit < 40]
    assert all(found.rmse_mm > 1e-6 and found.apart_mm > 0 for found in missed)


def test_the_published_algorithm_finds_less_of_a_simulation_than_ours(take):
    ours, published = (find(take.shell, 12, 0) for find in (simulation_recovery, recovery_as_published))
    assert published.planted == ours.planted
    assert published.rmse_mm >= ours.rmse_mm
    assert published.hit <= ours.hit


def test_the_published_descent_starts_at_random_and_may_go_uphill(take):
    found = descents(take, 8, starts=2)
    first, second = np.array(found.by_iteration_mm)
    assert max(first[-1], second[-1]) < min(first[0], second[0])
    rng = np.random.default_rng(1)
    H = rng.choice(np.flatnonzero(take.candidates), 8, replace=False)
    assert second[0] == pytest.approx(motion_error(take.shell, take.motion, H), rel=0.05)
    for mm, vertices in zip(first, found.layouts, strict=True):
        there = take.places(np.array(vertices))
        assert mm == pytest.approx(motion_error(take.shell, take.motion, there), rel=0.05)


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
    assert "the take hardly or never moves 1 of the rig" in text
    assert "cheekPuff" in text
    assert "no other people" in text
    worse = msgspec.structs.replace(found, rims=(msgspec.structs.replace(found.rims[0], held_mm=99.0), *found.rims[1:]))
    assert "does not hold here: holding the rim" in motion_text(worse)


def test_a_take_is_even_where_both_sides_do_the_same_and_uneven_where_they_do_the_opposite(take):
    mirror, flip = take.mirror, np.array([-1.0, 1.0, 1.0])
    own = mirror[mirror] == np.arange(len(mirror))
    pushed = np.where(own, take.shell.vertices[:, 2], 0)[:, None] * np.array([0.0, 0.0, 1.0])
    pushed = pushed + (pushed * flip)[mirror]
    turned = np.where(own & (mirror != np.arange(len(mirror))), np.sign(take.shell.vertices[:, 0]), 0)
    opposite = (turned - turned[mirror])[:, None] * np.array([0.0, 0.0, 1.0])
    even, odd = (replace(take, motion=motion_of(moved[None])) for moved in (pushed, opposite))
    assert uneven(even) < 0.05
    assert uneven(odd) > 0.95


def test_a_take_that_moves_nothing_is_refused():
    rig = sample_rig()
    still = Sequence("still", rig.neutral, rig.triangles, PosedFrames(rig, np.zeros((3, len(rig.names)))), 30.0, rig)
    with pytest.raises(RigError, match="moves no skin"):
        face_take(rig, still)
    other = Sequence("other", rig.neutral[:9], rig.triangles[:2] % 9, StoredFrames(rig.neutral[None, :9]), 30.0)
    with pytest.raises(RigError, match="read the take with this rig"):
        face_take(rig, other)
