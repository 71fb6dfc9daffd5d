"""Layouts pass between people: each bends a shell of their own, whatever their mesh."""

from dataclasses import replace

import numpy as np
import pytest

from capture_plan.curves.frames import PosedFrames
from capture_plan.errors import RigError
from capture_plan.evaluation.le2013.cross_subject import (
    cross_subject,
    laid,
    layout_of,
    on_first,
    renumbered,
    sites_of_all,
)
from capture_plan.evaluation.le2013.methods import METHODS, OURS, motion_error
from capture_plan.evaluation.le2013.other_subjects import made_up, people_of
from capture_plan.sample import sample_rig
from capture_plan.sample.motion import sample_motion
from capture_plan.sample.people import made_up_people, reshaped
from capture_plan.sequence import Sequence
from capture_plan.shell.take import face_take


@pytest.fixture(scope="module")
def take():
    return face_take(sample_rig(), sample_motion(frames=60))


@pytest.fixture(scope="module")
def person(take):
    """Somebody else in a take of their own."""
    return made_up(sample_rig(), frames=60).takes[0]


def shuffled(rig):
    """The same head, its vertices in another order: another mesh, as far as numbers tell."""
    order = np.random.default_rng(0).permutation(len(rig.neutral))
    number = np.argsort(order)
    return replace(
        rig,
        name="shuffled",
        neutral=rig.neutral[order],
        triangles=number[rig.triangles].astype(np.int32),
        deltas=rig.deltas[:, order],
        skin=rig.skin[order],
        parts=rig.parts[order],
        source_index=rig.source_index[order],
    )


def test_renumbered_and_filled_up_a_shell_rebuilds_as_before(take):
    leading = np.flatnonzero(take.candidates)[::7]
    shell, motion = renumbered(take, leading, len(take.at) + 50)
    H = np.arange(0, len(leading), 20)
    assert motion.rmse_mm(shell.weights(H), H) == pytest.approx(motion_error(take.shell, take.motion, leading[H]))


def test_subjects_that_are_one_person_have_the_layout_of_one(take):
    own = on_first(take, take)
    assert np.array_equal(own.map, np.arange(len(take.at)))
    both, rmse_mm = layout_of([own, own], 10)
    assert set(both.tolist()) == set(METHODS[OURS](take, take.motion, 10)[0].tolist())
    assert rmse_mm == pytest.approx(motion_error(take.shell, take.motion, both))


def test_a_layout_for_two_is_measured_on_the_shell_of_each(take, person):
    subjects = [on_first(take, take), on_first(take, person)]

    def together(H):
        squares = [motion_error(one.take.shell, one.take.motion, one.map[H]) ** 2 for one in subjects]
        return np.sqrt(np.mean(squares))

    both, rmse_mm = layout_of(subjects, 12)
    assert rmse_mm == pytest.approx(together(both))
    sites = sites_of_all(subjects)
    for moved in range(3):
        elsewhere = both.copy()
        elsewhere[moved] = np.setdiff1d(sites, both)[100 * moved]
        assert together(elsewhere) > rmse_mm


def test_a_person_is_rebuilt_best_by_an_own_layout_and_worst_by_chance(take, person):
    found = cross_subject((take, person), (12,))
    for row in found.left_out:
        assert row.own_mm < row.others_mm < row.random_mm
        assert row.all_mm < row.random_mm
    (shared,) = found.shared
    assert len(set(shared.vertices)) == 12
    assert [row.subject for row in found.left_out] == [take.rig.name, person.rig.name]


def test_sites_stand_for_one_vertex_of_every_subject_that_moves(take, person):
    subjects = [on_first(take, take), on_first(take, person)]
    sites = sites_of_all(subjects)
    for one in subjects:
        assert len(set(one.map[sites].tolist())) == len(sites)
        assert one.take.candidates[one.map[sites]].all()


def test_a_head_on_another_mesh_is_laid_onto_it(take):
    other = shuffled(sample_rig())
    weights = sample_motion(frames=60).frames.weights
    there = face_take(
        other, Sequence("other", other.neutral, other.triangles, PosedFrames(other, weights), 30.0, other)
    )
    assert np.linalg.norm(laid(take, there) - take.shell.vertices, axis=1).mean() < 0.1
    layout, _ = layout_of([on_first(take, there)], 10)
    assert len(layout) == 10


def test_one_subject_cannot_be_left_out(take):
    with pytest.raises(RigError, match="1 subject: give at least two"):
        cross_subject((take,), (10,))


def test_a_take_of_meshes_is_nobody_elses(tmp_path):
    np.savez(tmp_path / "meshes.npz", frames=np.repeat(sample_rig().neutral[None], 3, axis=0), units="mm")
    with pytest.raises(RigError):
        people_of([str(tmp_path / "nobody.glb")], tmp_path / "meshes.npz")


def test_made_up_people_differ_and_come_back_from_their_seed():
    rig = sample_rig()
    first, second = made_up_people(rig, 2)
    again = made_up_people(rig, 2)[0]
    assert first.fingerprint == again.fingerprint
    assert len({rig.fingerprint, first.fingerprint, second.fingerprint}) == 3
    apart = np.linalg.norm(first.neutral - rig.neutral, axis=1)
    assert 1 < apart[rig.skin].mean() < 20


def test_a_made_up_persons_movements_follow_the_bent_skin():
    rng = np.random.default_rng(3)
    x, step = rng.uniform(-60, 60, (20, 3)), 1e-4 * rng.standard_normal((20, 3))
    given = np.array([1.1, 0.9, 1.0]), rng.uniform(-60, 60, (5, 3)), rng.normal(0, 4, (5, 3))
    there, jacobian = reshaped(x, *given)
    moved = reshaped(x + step, *given)[0] - there
    assert moved == pytest.approx(np.einsum("vxy,vy->vx", jacobian, step), abs=1e-8)
    assert (np.linalg.det(jacobian) > 0).all()


def test_no_skin_of_a_made_up_person_folds_over():
    rig = sample_rig()
    for person in made_up_people(rig, 3):
        corners = [one.neutral[one.triangles] for one in (rig, person)]
        before, after = (np.cross(c[:, 1] - c[:, 0], c[:, 2] - c[:, 0]) for c in corners)
        assert (np.einsum("fx,fx->f", before, after) > 0).mean() > 0.999
