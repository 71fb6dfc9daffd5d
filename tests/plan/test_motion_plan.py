"""Plans for a recorded take: constraints kept, claims that hold, lies that do not, files that move with the plan."""

import shutil

import numpy as np
import pytest
from msgspec.structs import replace

from capture_plan.anatomy.regions import REGIONS
from capture_plan.check.check import check_plan
from capture_plan.check.motion_claims import direct_error
from capture_plan.curves.frames import PosedFrames, StoredFrames
from capture_plan.errors import InfeasibleError, RigError
from capture_plan.evaluation.alternatives import alternatives
from capture_plan.evaluation.le2013.methods import METHODS, OURS, motion_error, score
from capture_plan.inspection.inspect import inspect_plan
from capture_plan.inspection.inspect_report import inspection_text
from capture_plan.layout.constraints import OTHER_SHARE
from capture_plan.layout.design import design_layout
from capture_plan.layout.motion_design import fit_of
from capture_plan.layout.settings import LayoutSettings
from capture_plan.mesh import geodesic_distance
from capture_plan.plan.files import (
    change_settings,
    inputs_of,
    read_plan,
    refer_to,
    settings_seen_from,
    write_plan,
)
from capture_plan.plan.inputs import read_inputs
from capture_plan.plan.make import make_plan
from capture_plan.plan.settings import Settings
from capture_plan.plan.summary import motion_words, summary
from capture_plan.sequence import Sequence, read_sequence
from capture_plan.shell.take import face_take
from capture_plan.shell.take_basis import EXACT_MM, record
from capture_plan.shell.takes import takes_of
from tests.tampering import answers_kept

NUMBER = 16
BY_MOTION = LayoutSettings(method="motion", number=NUMBER)


def recorded(rig, seed=0, frames=40):
    """A few blendshapes at a time; the tongue stays in."""
    rng = np.random.default_rng(seed)
    w = np.zeros((frames, len(rig.names)))
    for row in w:
        row[rng.choice(len(rig.names), 4, replace=False)] = rng.uniform(0, 1, 4)
    w[:, [name.startswith("brow") for name in rig.names]] = 0
    return w


def played(rig, w):
    return Sequence("played", rig.neutral, rig.triangles, PosedFrames(rig, w), 30.0, rig)


def taken(rig, *sessions):
    return takes_of(rig, [played(rig, w) for w in sessions])


def moving(takes):
    return takes.first.at[takes.first.candidates]


@pytest.fixture(scope="module")
def take(rig, used):
    return taken(rig, recorded(rig))


@pytest.fixture(scope="module")
def layout(face, take):
    return design_layout(face, BY_MOTION, takes=take)


@pytest.fixture(scope="module")
def session(rig, tmp_path_factory):
    """A plan in a folder, and the take in another one beside it."""
    folder = tmp_path_factory.mktemp("session") / "day"
    (folder / "takes").mkdir(parents=True)
    file = folder / "takes" / "speech.npz"
    np.savez(file, weights=recorded(rig), names=np.array(rig.names), fps=30.0)
    target = folder / "plans" / "plan.json"
    asked = change_settings(Settings(), {"sequences": [str(file)], "landmarks": {"method": "motion", "number": NUMBER}})
    settled = settings_seen_from(target.parent, asked)
    made = make_plan(read_inputs(rig, settled, target.parent), settled, reference=refer_to(rig, "sample", target))
    return write_plan(made, target)


def vertices_of(layout):
    return np.array([m.vertex for m in layout.landmarks])


def test_posed_frames_and_the_weights_behind_them_are_the_same_take(rig, used, take):
    w = recorded(rig)
    frames = np.stack([rig.pose(row) for row in w])
    meshes = Sequence("meshes", rig.neutral, rig.triangles, StoredFrames(frames), 30.0, rig)
    other = takes_of(rig, [meshes])
    assert other.missing(used) == take.missing(used)
    assert np.array_equal(other.first.at, take.first.at)
    for seed in range(3):
        markers = np.random.default_rng(seed).choice(moving(take), 9, replace=False)
        a, b = (fit_of(one, used, markers, ordered=False).rmse_mm for one in (take, other))
        assert a == pytest.approx(b, abs=1e-4)


def test_shapes_hold_every_frame(rig):
    w = recorded(rig, 3)
    at = np.flatnonzero(rig.skin)
    x = np.einsum("tk,kvx->vtx", w, rig.deltas[:, at]).reshape(len(at), -1)
    frames = np.stack([rig.pose(row) for row in w])
    meshes = Sequence("meshes", rig.neutral, rig.triangles, StoredFrames(frames), 30.0, rig)
    every, all_ = np.arange(len(w)), np.arange(len(at))
    Y = record(rig, meshes).over(every, all_).rows
    power = np.square(x).sum() / len(w)
    assert np.square(record(rig, played(rig, w)).over(every, all_).rows).sum() == pytest.approx(power, rel=1e-6)
    assert np.square(Y).sum() == pytest.approx(power, abs=EXACT_MM**2 * len(at))


def test_a_session_of_the_same_take_twice_changes_nothing(rig, used, take):
    twice = taken(rig, recorded(rig), recorded(rig))
    markers = moving(take)[::150]
    assert twice.frames == 2 * take.frames
    once = fit_of(take, used, markers, ordered=False).rmse_mm
    assert fit_of(twice, used, markers, ordered=False).rmse_mm == pytest.approx(once, abs=1e-4)


def test_sessions_have_the_same_say_however_long(rig, used):
    short, long = recorded(rig, 1, 10), recorded(rig, 2, 90)
    both = taken(rig, short, long)
    markers = moving(both)[::150]
    H, one = both.first.places(markers), both.first
    alone = [one.over(part) for part in (np.arange(10), np.arange(10, 100))]
    a, b = (motion_error(one.shell, motion, H) for motion in alone)
    together = fit_of(both, used, markers, ordered=False).rmse_mm
    assert together == pytest.approx(np.sqrt((a**2 + b**2) / 2), abs=1e-4)


def test_what_the_take_does_not_show_is_named(rig, used, take):
    assert set(take.missing(used)) >= {name for name in used if name.startswith("brow")}
    assert "jawOpen" not in take.missing(used)


def test_the_layout_is_symmetric_apart_and_of_the_number(face, layout):
    vertices = vertices_of(layout)
    assert len(vertices) == NUMBER
    assert set(face.mirror[vertices].tolist()) == set(vertices.tolist())
    distance = geodesic_distance(face.graph, vertices)[:, vertices]
    np.fill_diagonal(distance, np.inf)
    assert distance.min() >= BY_MOTION.spacing_mm


def test_both_views_are_stated_and_the_order_is_monotone(layout):
    curve = np.array(layout.motion.curve_mm)
    assert len(curve) == len(layout.order) == len(layout.curve_mm) == NUMBER
    assert (np.diff(curve) <= 1e-4).all()
    assert curve[-1] == layout.motion.rmse_mm
    assert layout.information.rank > 1
    assert layout.programs == ()


def test_no_rig_designed_layout_of_the_number_loses_less_of_the_take(face, take, layout):
    by_rig = design_layout(face, LayoutSettings(method="budget", number=NUMBER), takes=take)
    assert by_rig.motion.rmse_mm > layout.motion.rmse_mm
    assert by_rig.information.error_mm < layout.information.error_mm


def test_pins_forbidden_caps_and_head_markers_are_kept(face, rig, take, layout):
    middle = vertices_of(layout)[face.mirror[vertices_of(layout)] != vertices_of(layout)]
    away = np.intersect1d(moving(take), np.flatnonzero(face.allowed(BY_MOTION) & (rig.neutral[:, 0] > 25)))
    pin = int(away[np.random.default_rng(0).integers(len(away))])
    asked = LayoutSettings(
        method="motion",
        number=NUMBER,
        pins=(int(rig.source_index[pin]),),
        forbidden=(int(rig.source_index[middle[0]]),),
        caps={"upper lip": 2},
        head_markers=3,
        keep_out={},
    )
    made = design_layout(face, asked, takes=take)
    vertices = vertices_of(made)
    assert {pin, int(face.mirror[pin])} <= set(vertices.tolist())
    assert middle[0] not in vertices
    assert (face.regions.of_vertex[vertices] == REGIONS.index("upper lip")).sum() <= 2
    assert len(made.head) == 3
    assert len(vertices) == NUMBER


def test_an_error_solved_directly_is_that_of_the_shell(take):
    rng = np.random.default_rng(5)
    for count in (1, 6):
        markers = rng.choice(moving(take), count, replace=False)
        assert direct_error(take, markers) == pytest.approx(take.errors(markers, [count])[0], abs=1e-6)


def test_a_plan_and_an_evaluation_state_the_same_error_of_the_same_vertices(session, face, rig):
    """What `plan --sequence` says of its landmarks and what `motion --take` says of them."""
    plan, file = read_plan(session), session.parents[1] / "takes" / "speech.npz"
    take = face_take(rig, read_sequence(file, rig=rig))
    message = score(take, face, "planned", [take.places(vertices_of(plan.layout))])
    assert message.rmse_mm == pytest.approx(plan.layout.motion.rmse_mm, abs=1e-5)
    (markers,) = METHODS[OURS](take, take.motion, 9)
    fit = fit_of(takes_of(rig, [take.sequence]), face.used, take.at[markers], ordered=False)
    assert score(take, face, OURS, [markers]).rmse_mm == pytest.approx(fit.rmse_mm, abs=1e-5)


def test_a_plan_says_whether_the_take_chose_its_landmarks(session):
    plan = read_plan(session)
    measured = replace(plan, layout=replace(plan.layout, method="studio"))
    assert motion_words(plan)[0].startswith("The take chose the landmarks")
    assert motion_words(measured)[0].startswith("The take did not choose the landmarks (--method motion does)")
    assert motion_words(plan)[1:] == motion_words(measured)[1:]


def test_a_marker_where_nothing_moves_tells_nothing(rig, used, take):
    inside = moving(take)[::120]
    outside = np.setdiff1d(np.flatnonzero(rig.skin), take.first.at)[:3]
    held = take.first.at[take.first.shell.fixed][:2]
    more = np.concatenate([inside, outside, held])
    a, b = (fit_of(take, used, some, ordered=False).rmse_mm for some in (inside, more))
    assert a == b
    assert direct_error(take, more) == pytest.approx(b, abs=1e-5)


def test_without_a_take_the_method_is_refused(face):
    with pytest.raises(InfeasibleError, match="needs a recorded take"):
        design_layout(face, BY_MOTION)


def test_a_take_that_stands_still_is_refused(rig):
    with pytest.raises(RigError, match="moves no skin"):
        taken(rig, 0 * recorded(rig))


def test_the_method_needs_a_number():
    with pytest.raises(ValueError, match="'motion' needs a budget"):
        LayoutSettings(method="motion")


def broken(session, rig=None):
    plan = read_plan(session)
    given = read_inputs(rig, plan.settings, session.parent) if rig else inputs_of(plan, session)
    return [c.what for c in check_plan(plan, given) if not c.holds]


def test_every_claim_holds_from_any_folder_and_after_a_move(session, tmp_path, monkeypatch):
    moved = shutil.copytree(session.parents[1], tmp_path / "elsewhere") / "plans" / "plan.json"
    monkeypatch.chdir(tmp_path)
    assert read_plan(moved).settings.sequences == ("../takes/speech.npz",)
    assert broken(moved) == []


def test_the_summary_says_what_the_take_loses(session):
    message = " ".join(summary(read_plan(session)))
    assert "bent between these landmarks is" in message
    assert "The take hardly or never moves" in message
    assert message.count("mm left of the take") == len(read_plan(session).layout.references)


def better(fit):
    return replace(fit, rmse_mm=fit.rmse_mm - 0.001)


def steeper(fit):
    half = len(fit.curve_mm) // 2
    curve = [*fit.curve_mm]
    curve[half - 1] -= 0.001
    return replace(fit, curve_mm=tuple(curve))


def shorter(fit):
    return replace(fit, curve_mm=(fit.curve_mm[0], fit.rmse_mm - 0.01, *fit.curve_mm[2:]))


def complete(fit):
    return replace(fit, missing=())


def flattering(fit):
    return replace(fit, references_mm={name: 2 * error for name, error in fit.references_mm.items()})


def longer(fit):
    return replace(fit, frames=fit.frames + 1)


@pytest.mark.parametrize("lie", [better, steeper, shorter, complete, flattering, longer])
def test_a_plan_that_lies_about_its_take_is_caught(session, tmp_path, rig, lie):
    folder = shutil.copytree(session.parents[1], tmp_path / "day")
    plan = read_plan(folder / "plans" / "plan.json")
    message = replace(plan, layout=replace(plan.layout, motion=lie(plan.layout.motion)))
    with answers_kept():
        assert broken(write_plan(message, folder / "plans" / "plan.json"), rig)


def test_another_take_behind_the_plan_is_caught(session, tmp_path, rig):
    folder = shutil.copytree(session.parents[1], tmp_path / "day")
    np.savez(folder / "takes" / "speech.npz", weights=recorded(rig, 9), names=np.array(rig.names), fps=30.0)
    assert any("frames" in what for what in broken(folder / "plans" / "plan.json"))


@pytest.fixture(scope="module")
def others(face, take, layout):
    return alternatives(face, BY_MOTION, layout, count=1, takes=take)


def test_another_layout_for_a_take_leaves_a_fifth_of_the_places_and_is_measured_by_the_take(face, take, others):
    (other,) = others
    assert len(other.takes) >= round(OTHER_SHARE * NUMBER)
    assert len(other.vertices) == NUMBER
    assert set(face.mirror[list(other.vertices)].tolist()) == set(other.vertices)
    assert other.lost_mm == pytest.approx(take.error(np.array(other.vertices)), abs=1e-4)
    assert 0 < other.lost_mm < 2 * take.error(np.array(other.vertices)[:4])


def test_a_layout_unlike_two_others_is_unlike_both(face, take, layout, others):
    known = [vertices_of(layout).tolist(), list(others[0].vertices)]
    third = vertices_of(design_layout(face, BY_MOTION, takes=take, unlike=known))
    for vertices in known:
        away = ~face.around(np.array(vertices), BY_MOTION.spacing_mm)[third]
        assert away.sum() >= round(OTHER_SHARE * NUMBER)


def test_an_inspection_says_what_the_take_loses_and_what_could_be_had_instead(session):
    plan = read_plan(session)
    found = inspect_plan(plan, inputs_of(plan, session))
    text = inspection_text(found)
    assert found.take.fit == plan.layout.motion
    assert min(found.take.without_mm) >= plan.layout.motion.rmse_mm - 1e-4
    assert f"{plan.layout.motion.rmse_mm:.2f} mm" in text
    assert "mm left of the take" in text
    assert f"rank {plan.layout.information.rank} of" in text


WISHES = {
    "few on the nose, side by side": {"spacing_mm": 0.0, "caps": {"nose": 1, "mouth corner": 2}},
    "far apart, for two cameras": {"spacing_mm": 16.0, "number": 10, "min_views": 2},
    "an odd number off the zones": {
        "number": 15,
        "keep_out": {"lash line": 6.0, "wet lip": 6.0, "nostril rim": 6.0},
    },
    "not mirrored, with a head": {"symmetric": False, "head_markers": 5},
}


@pytest.mark.parametrize("asked", WISHES.values(), ids=WISHES)
def test_wishes_are_kept_as_a_check_without_a_solver_finds(rig, tmp_path, asked):
    file = tmp_path / "speech.npz"
    np.savez(file, weights=recorded(rig), names=np.array(rig.names), fps=30.0)
    landmarks = {"method": "motion", "number": NUMBER} | asked
    places = {"sequences": [str(file)]} | ({"cameras": "head-mounted-pair"} if "min_views" in asked else {})
    settings = change_settings(Settings(), places | {"landmarks": landmarks, "expressions": {"method": "greedy"}})
    given = read_inputs(rig, settings)
    plan = make_plan(given, settings)
    assert len(plan.layout.landmarks) == landmarks["number"]
    assert [claim.what for claim in check_plan(plan, given) if not claim.holds] == []


@pytest.mark.parametrize(
    ("asked", "says"),
    [
        ({"spacing_mm": 60.0}, "16"),
        ({"caps": {"beard": 1}}, "there is no region 'beard'"),
        ({"pins": (10**7,)}, "is not in the rig"),
        ({"keep_out": {"wet lip": 400.0}}, "."),
    ],
)
def test_wishes_that_cannot_be_kept_for_a_take_are_refused_in_one_line(face, take, asked, says):
    with pytest.raises(InfeasibleError, match=says) as refused:
        design_layout(face, replace(BY_MOTION, **asked), takes=take)
    assert "\n" not in str(refused.value)
