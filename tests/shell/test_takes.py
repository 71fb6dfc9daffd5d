"""Takes of one or several people: whose face it is, what each counts, and what a mirror image changes."""

from dataclasses import replace

import numpy as np
import pytest
from msgspec.structs import replace as changed
from typer.testing import CliRunner

from capture_plan.check.check import check_plan
from capture_plan.cli import app
from capture_plan.curves.frames import StoredFrames
from capture_plan.errors import PlanError, RigError
from capture_plan.layout.contact_pairs import paired
from capture_plan.layout.design import design_layout
from capture_plan.layout.motion_design import _place, fit_of
from capture_plan.layout.problem import task_of
from capture_plan.layout.settings import LayoutSettings
from capture_plan.plan.files import change_settings, read_plan, rig_of, write_plan
from capture_plan.plan.inputs import read_inputs
from capture_plan.plan.settings import Settings
from capture_plan.reader.vertex_weights import read_vertex_weights
from capture_plan.sample.motion import sample_motion
from capture_plan.sequence import Sequence
from capture_plan.sequence.head_stabilisation import stillness
from capture_plan.shell import take_basis as recordings
from capture_plan.shell.boundary import STILL_MM
from capture_plan.shell.identify_subjects import SAME_PERSON_MM, apart, by_person
from capture_plan.shell.moving_region import moved_triangles
from capture_plan.shell.take_basis import EXACT_MM, in_fewer_frames, record
from capture_plan.shell.takes import takes_of
from tests.tampering import answers_kept


def meshes(name, neutral, displacements, rig):
    frames = StoredFrames(neutral + displacements)
    return Sequence(name, neutral, rig.triangles, frames, 30.0, rig)


def moved(rig, seed=0, frames=20):
    return sample_motion(seed, frames=frames).frames.block(0, frames) - rig.neutral


def another_head(rig, by=1.08):
    """Wider and with a longer face, about its own middle."""
    middle = rig.neutral[rig.skin].mean(axis=0)
    return middle + (rig.neutral - middle) * np.array([by, 2 - by, 1.0])


@pytest.fixture(scope="module")
def anna(rig):
    return meshes("anna", rig.neutral, moved(rig), rig)


@pytest.fixture(scope="module")
def bert(rig):
    return meshes("bert", another_head(rig), moved(rig, 1), rig)


def markers_of(takes, step=150):
    return takes.first.at[takes.first.candidates][::step]


def test_skin_that_moves_by_exactly_the_least_that_counts_is_of_the_part_and_by_less_is_not(rig):
    jaw = rig.displacement[rig.names.index("jawOpen")]
    for far, moves in ((STILL_MM, True), (np.nextafter(STILL_MM, 0), False)):
        assert bool(len(moved_triangles(rig, np.where(jaw > 1, far, 0.0)))) == moves


def test_two_heads_are_two_people_and_a_note_says_so(rig, anna, bert):
    takes = takes_of(rig, [anna, bert, replace(anna, name="anna again")])
    assert [len(one.recordings) for one in takes.subjects] == [2, 1]
    assert any("bert is taken as another person than anna" in note for note in takes.notes)
    first, second = takes.subjects
    assert first.shell.vertices == pytest.approx(rig.neutral[first.at])
    assert second.shell.vertices == pytest.approx(another_head(rig)[first.at])
    assert np.array_equal(first.shell.fixed, second.shell.fixed)


def test_an_open_mouth_or_a_turned_head_is_no_other_person(rig, anna):
    still = stillness(rig.displacement.max(axis=0)) * rig.skin
    opened = rig.neutral + rig.deltas[rig.names.index("jawOpen")]
    a = 0.2
    turned = opened @ np.array([[np.cos(a), 0, np.sin(a)], [0, 1, 0], [-np.sin(a), 0, np.cos(a)]]) + 5
    assert apart(rig.neutral, turned, still) < SAME_PERSON_MM
    assert apart(rig.neutral, another_head(rig), still) > SAME_PERSON_MM
    take = replace(anna, name="opened", neutral=opened, frames=StoredFrames(np.stack([opened, rig.neutral])))
    takes = takes_of(rig, [anna, take])
    assert len(takes.subjects) == 1
    assert "opened is measured from the neutral of anna" in takes.notes
    assert takes.first.recordings[1].furthest.max() > 5


def test_people_are_told_apart_in_any_order(rig, anna, bert):
    assert by_person(rig, [anna, bert, anna, bert])[0] == ((0, 2), (1, 3))
    assert by_person(rig, [bert, anna, anna, bert])[0] == ((0, 3), (1, 2))
    assert by_person(rig, [anna])[0] == ((0,),)


def test_the_total_is_the_weighed_mean_of_the_people(rig, used, anna, bert):
    takes = takes_of(rig, [anna, bert], shares=(1.0, 3.0))
    fit = fit_of(takes, used, markers_of(takes), ordered=False)
    a, b = (one.rmse_mm for one in fit.subjects)
    assert fit.rmse_mm == pytest.approx(np.sqrt((a**2 + 3 * b**2) / 4), abs=2e-5)
    assert [one.sequences for one in fit.subjects] == [("anna",), ("bert",)]


def test_shares_of_sessions_weigh_their_errors_and_their_scale_does_not_matter(rig, anna):
    other = meshes("late", rig.neutral, moved(rig, 2, 50), rig)
    one, three = (takes_of(rig, [anna, other], shares=g) for g in ((1.0, 3.0), (2.0, 6.0)))
    markers = markers_of(one)
    assert one.error(markers) == pytest.approx(three.error(markers), rel=1e-9)
    H, take = one.first.places(markers), one.first
    a, b = (
        take.over(np.arange(len(anna)) if first else np.arange(len(anna), take.frames)).rmse_mm(
            take.shell.weights(H), H
        )
        for first in (True, False)
    )
    assert one.error(markers) == pytest.approx(np.sqrt((a**2 + 3 * b**2) / 4), rel=1e-6)


def test_a_blendshape_is_missing_where_no_take_of_anyone_shows_it(rig):
    a, b = (
        meshes(str(n), head, np.stack([0 * rig.neutral, rig.deltas[rig.names.index(name)]]), rig)
        for n, (head, name) in enumerate(((rig.neutral, "jawOpen"), (another_head(rig), "browInnerUp")))
    )
    takes = takes_of(rig, [a, b])
    assert len(takes.subjects) == 2
    assert takes.missing(("jawOpen", "browInnerUp", "cheekPuff")) == ("cheekPuff",)


def test_no_marker_of_a_take_stands_where_its_dot_would_meet_a_pin_that_lies_where_nothing_moves(rig, face, anna):
    task, takes = task_of(face, LayoutSettings(method="motion", number=8, symmetric=False)), takes_of(rig, [anna])
    pin = int(np.flatnonzero(~np.isin(task.sites.vertices[:, 0], takes.first.at))[0])
    u, every = int(task.sites.vertices[pin, 0]), np.ones(len(task.sites.size), dtype=bool)
    others = np.setdiff1d(takes.first.at[takes.first.candidates], [u])
    beside = others[rig.neutral[others, 0] > 0]  # the left half of the face
    met = replace(task, met=paired(np.full(len(beside), u), beside, len(rig.neutral)))
    free, retained = (set(_place(one, takes, np.array([pin]), every).tolist()) for one in (task, met))
    assert free & set(beside.tolist())
    assert u in retained
    assert not retained & set(beside.tolist())


def test_a_layout_for_two_people_serves_both_better_than_one_for_either(rig, face):
    jaw, brow = (
        np.stack([w * rig.deltas[rig.names.index(name)] for w in (0.0, 0.5, 1.0)])
        for name in ("jawOpen", "browInnerUp")
    )
    a, b = meshes("a", rig.neutral, jaw, rig), meshes("b", another_head(rig), brow, rig)
    both, settings = (
        takes_of(rig, [a, b], shares=(1.0, 20.0)),
        LayoutSettings(method="motion", number=10, spacing_mm=0.0, symmetric=False),
    )
    error = {
        name: both.error(np.array([m.vertex for m in design_layout(face, settings, takes=takes).landmarks]))
        for name, takes in (("both", both), ("a", takes_of(rig, [a])), ("b", takes_of(rig, [b])))
    }
    assert error["both"] < min(error["a"], error["b"])


def test_a_take_and_its_mirror_image_ask_for_the_same_symmetric_layout(rig, face):
    """Every frame and its mirror image are seen, whichever of them was recorded."""
    smile = np.stack([w * rig.deltas[rig.names.index("mouthSmileLeft")] for w in (0.0, 0.3, 1.0)])
    frown = np.stack([w * rig.deltas[rig.names.index("mouthFrownLeft")] for w in (0.2, 0.9)])
    left = np.concatenate([smile, frown]).astype(float)
    right = left[:, face.mirror] * np.array([-1.0, 1.0, 1.0])
    settings = LayoutSettings(method="motion", number=10)
    layouts = [
        design_layout(face, settings, takes=takes_of(rig, [meshes("side", rig.neutral, d, rig)])) for d in (left, right)
    ]
    vertices = [{m.vertex for m in layout.landmarks} for layout in layouts]
    assert vertices[0] == vertices[1]
    assert all(set(face.mirror[list(some)].tolist()) == some for some in vertices)


def test_mirrored_takes_have_the_error_of_both_sides(rig, face, anna):
    takes = takes_of(rig, [anna])
    both = takes.mirrored(face.mirror)
    markers = markers_of(takes, 300)
    pairs = np.union1d(markers, face.mirror[markers])
    one, two = both.first, replace(anna, frames=StoredFrames(rig.neutral + mirror_image(rig, face, anna)))
    again = takes_of(rig, [anna, two])
    assert np.mean(np.isin(again.first.at, one.at)) > 0.98
    assert both.error(pairs) == pytest.approx(again.error(pairs), rel=0.02)
    assert np.mean(both.first.candidates[both.first.mirror] == both.first.candidates) > 0.98


def mirror_image(rig, face, take):
    return (take.frames.block(0, len(take)) - rig.neutral)[:, face.mirror] * np.array([-1.0, 1.0, 1.0])


def test_fewer_frames_hold_the_motion_and_stay_x_y_z(rig, anna):
    motion = takes_of(rig, [anna]).first.motion
    fewer = in_fewer_frames(motion, 0.05)
    assert fewer.in_threes
    assert fewer.rows.shape[1] < motion.rows.shape[1]
    lost = np.square(motion.rows).sum() - np.square(fewer.rows).sum()
    assert -1e-9 <= lost <= 0.05**2 * len(motion.rows)
    # a product of x with y of the same frames is kept as well
    cross = [m.rows[:, 0::3].ravel() @ m.rows[:, 1::3].ravel() for m in (motion, fewer)]
    assert cross[0] == pytest.approx(cross[1], abs=0.05**2 * len(motion.rows))


def test_a_take_read_in_small_pieces_is_the_same_and_noise_is_bounded(rig, anna, monkeypatch):
    whole = record(rig, anna)
    monkeypatch.setattr("capture_plan.sequence.record.CHUNK_BYTES", 24 * len(rig.neutral) * 3)
    parts = record(rig, replace(anna))
    X = [np.einsum("tr,rvx->tvx", one.weights, one.shapes) for one in (whole, parts)]
    truth = moved(rig)[:, whole.at]
    for each in X:
        assert np.sqrt(np.square(each - truth).sum(axis=2).mean()) < 1.01 * EXACT_MM
    monkeypatch.setattr(recordings, "MOST_SHAPES", 5)
    noisy = record(rig, replace(anna))
    assert len(noisy.shapes) == 5
    missed = X[0] - np.einsum("tr,rvx->tvx", noisy.weights, noisy.shapes)
    assert noisy.lost_mm == pytest.approx(np.sqrt(np.square(missed).sum(axis=2).mean()), rel=0.05)


def test_vertex_weights_are_read_in_the_artists_numbering(rig, tmp_path):
    count = int(rig.source_index.max()) + 1
    w = np.random.default_rng(0).uniform(0, 2, count)
    np.savetxt(tmp_path / "w.txt", w)
    np.savez(tmp_path / "w.npz", weights=w)
    for name in ("w.txt", "w.npz"):
        assert read_vertex_weights(tmp_path / name, rig) == pytest.approx(w[rig.source_index])


@pytest.mark.parametrize(
    ("text", "said"),
    [("1 2 3", "3 weights"), ("a b", "no vertex weights"), (None, "cannot be read"), ("neg", "below 0")],
)
def test_unusable_vertex_weights_are_refused(rig, tmp_path, text, said):
    file = tmp_path / "w.txt"
    if text is not None:
        file.write_text("-1 " * len(rig.neutral) if text == "neg" else text)
    with pytest.raises(RigError, match=said):
        read_vertex_weights(file, rig)


def test_errors_count_where_weights_say(rig, anna):
    plain = takes_of(rig, [anna])
    markers = markers_of(plain)
    s = np.where(rig.neutral[:, 1] < np.median(rig.neutral[rig.skin, 1]), 5.0, 0.5)
    weighed = takes_of(rig, [anna], s=s)
    take, H = plain.first, plain.first.places(markers)
    R = take.motion.rows - take.shell.weights(H) @ take.motion.rows[H]
    by_hand = np.sqrt(np.square(R).sum(axis=1) @ s[take.at] / s[take.at].sum())
    assert weighed.error(markers) == pytest.approx(by_hand)
    assert takes_of(rig, [anna], s=7.0).error(markers) == pytest.approx(plain.error(markers))


def test_sequence_weights_must_be_as_many_as_sequences():
    with pytest.raises(PlanError, match="1 sequence weights for 2 sequences"):
        change_settings(Settings(), {"sequences": ["a", "b"], "sequence_weights": [1.0]})
    with pytest.raises(PlanError, match="give sequences"):
        change_settings(Settings(), {"vertex_weights": "w.txt"})
    with pytest.raises(PlanError, match="sequence_weights"):
        change_settings(Settings(), {"sequences": ["a"], "sequence_weights": [0.0]})


@pytest.fixture(scope="module")
def planned(rig, anna, bert, tmp_path_factory):
    """A plan made from the command line for two people, weighed."""
    folder = tmp_path_factory.mktemp("people")
    for take in (anna, bert):
        np.savez(
            folder / f"{take.name}.npz",
            frames=take.frames.array,
            faces=rig.triangles,
            neutral=take.neutral,
            units=np.array("mm"),
            fps=30.0,
        )
    np.savetxt(folder / "w.txt", np.where(np.arange(int(rig.source_index.max()) + 1) % 2, 1.0, 2.0))
    options = ["--method", "motion", "--number", "12", "--expressions", "greedy"]
    options += ["-o", str(folder / "plans" / "plan.json")]
    for take, weight in ((anna, "1"), (bert, "2")):
        options += ["--sequence", str(folder / f"{take.name}.npz"), "--sequence-weight", weight]
    ended = CliRunner().invoke(app, ["plan", "sample", *options, "--vertex-weights", str(folder / "w.txt")])
    assert ended.exit_code == 0, ended.output
    assert "anna: 20 frames, 30 in a second" in ended.stderr
    return folder / "plans" / "plan.json"


def broken(plan, rig, folder):
    return [c.what for c in check_plan(plan, read_inputs(rig, plan.settings, folder)) if not c.holds]


def test_a_plan_for_two_people_holds_and_says_so(planned):
    plan = read_plan(planned)
    assert plan.settings.sequence_weights == (1.0, 2.0)
    assert plan.settings.vertex_weights == "../w.txt"
    assert [one.sequences for one in plan.layout.motion.subjects] == [("anna",), ("bert",)]
    assert broken(plan, rig_of(plan, planned), planned.parent) == []


def test_lies_about_people_are_caught(planned):
    plan = read_plan(planned)
    fit = plan.layout.motion
    first, second = fit.subjects
    rig, folder = rig_of(plan, planned), planned.parent
    with answers_kept():
        for lie in ((changed(first, rmse_mm=first.rmse_mm - 0.001), second), (second, first), (first,), ()):
            message = changed(plan, layout=changed(plan.layout, motion=changed(fit, subjects=lie)))
            assert broken(read_plan(write_plan(message, planned.with_name("lie.json"))), rig, folder)
