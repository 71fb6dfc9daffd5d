"""What is an expression of the face and what is not: set apart by what moves, never in silence, and never wrongly."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from capture_plan.anatomy.kinds import expression_kinds, set_apart
from capture_plan.anatomy.motion_kinds import motion_kinds
from capture_plan.anatomy.whole_head import Sphere
from capture_plan.audit.audit import audit_rig
from capture_plan.audit.report import audit_text, verdict
from capture_plan.sample import sample_rig

SAMPLE = sample_rig()
FEW = ("browDownLeft", "browDownRight", "eyeBlinkLeft", "eyeBlinkRight", "jawForward", "jawLeft", "jawOpen", "jawRight")
FEW += ("mouthFunnel", "mouthLeft", "mouthSmileLeft", "mouthSmileRight", "noseSneerLeft", "noseSneerRight")
SKIN = SAMPLE.triangles[SAMPLE.skin[SAMPLE.triangles].all(axis=1)]


def with_only(names):
    return replace(SAMPLE, names=names, deltas=SAMPLE.deltas[[SAMPLE.names.index(name) for name in names]])


RIG = with_only(FEW)


def delta(name):
    return SAMPLE.deltas[SAMPLE.names.index(name)]


def with_blendshapes(rig, **more):
    deltas = np.concatenate([rig.deltas, np.stack(list(more.values())).astype(np.float32)])
    return replace(rig, names=(*rig.names, *more), deltas=deltas)


def kind_of(rig):
    return {one.name: one.kind for one in expression_kinds(rig)}


def head_motion(x, what, neck=0.25):
    """A whole head's motion that fades over `neck` of its height."""
    low, high = np.ptp(x[:, 1]), x[:, 1].min()
    fades = np.clip((x[:, 1] - high) / (neck * low + 1e-9), 0, 1)[:, None]
    pivot = np.array([0, x[:, 1].min(), x[:, 2].mean()])
    if what == "shift":
        return fades * np.array([0, 0, 15.0])
    if what == "scale":
        return fades * 0.1 * (x - pivot)
    axis, degrees = what
    return fades * ((x - pivot) @ Rotation.from_euler(axis, degrees, degrees=True).as_matrix().T - (x - pivot))


MOTIONS = [("y", 35), ("y", -35), ("x", 20), ("z", 15), "shift", "scale"]


def with_piece(rig, name, centre, size, motion):
    """The rig with a closed loose piece, and a blendshape that moves it alone."""
    corners = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]]) * size + centre
    faces = np.array([[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]])
    v, k = len(rig.neutral), len(rig.names)
    deltas = np.zeros((k + 1, v + 6, 3), dtype=np.float32)
    deltas[:k, :v] = rig.deltas
    deltas[k, v:] = motion
    return replace(
        rig,
        names=(*rig.names, name),
        neutral=np.concatenate([rig.neutral, corners]),
        triangles=np.concatenate([rig.triangles, faces + v]),
        deltas=deltas,
        skin=np.r_[rig.skin, np.zeros(6, dtype=bool)],
        parts=np.r_[rig.parts, np.full(6, len(rig.part_names))],
        part_names=(*rig.part_names, "loose"),
        source_index=np.r_[rig.source_index, np.arange(v, v + 6)],
    )


@pytest.mark.parametrize("motion", MOTIONS)
@pytest.mark.parametrize("neck", [0, 0.25])
@pytest.mark.parametrize("name", ["shape_9", "headTurn"])
def test_a_head_that_moves_as_one_is_a_head_movement(motion, neck, name):
    kinds = kind_of(with_blendshapes(RIG, **{name: head_motion(RIG.neutral, motion, neck)}))
    assert kinds.pop(name) == "head movement"
    assert set(kinds.values()) == {"face"}


def test_several_head_movements_beside_one_expression_are_told_from_it():
    turns = {f"shape{i}": head_motion(RIG.neutral, motion) for i, motion in enumerate(MOTIONS)}
    kinds = kind_of(with_blendshapes(with_only(("mouthSmileLeft",)), **turns))
    assert kinds.pop("mouthSmileLeft") == "face"
    assert set(kinds.values()) == {"head movement"}


def test_everything_on_four_kinds_of_sets_is_the_face():
    assert set(kind_of(replace(SAMPLE)).values()) == {"face", "not of the face"}  # the tongue moves no skin
    for names in (("jawOpen",), ("jawOpen", "jawLeft", "jawRight", "jawForward"), ("mouthLeft", "mouthRight"), FEW):
        assert set(kind_of(with_only(names)).values()) == {"face"}


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 10_000), st.integers(1, 8), st.sampled_from([0.0, 3.0]))
def test_a_few_big_emotions_are_the_face_even_where_the_head_slipped(seed, count, slip_mm):
    random = np.random.default_rng(seed)
    weights = random.uniform(0, 1, (count, len(SAMPLE.names))) * (random.random((count, len(SAMPLE.names))) < 0.2)
    weights[:, SAMPLE.names.index("mouthSmileLeft")] = 1.0
    emotions = np.einsum("ek,kvx->evx", weights, SAMPLE.deltas) + slip_mm * random.normal(size=(count, 1, 3))
    assert set(motion_kinds(SAMPLE.neutral, SKIN, emotions).kinds) == {"face"}


@settings(max_examples=40, deadline=None)
@given(st.sets(st.sampled_from(SAMPLE.names), min_size=1, max_size=9))
def test_any_few_blendshapes_of_the_face_are_the_face(names):
    some = with_only(tuple(sorted(names - {"tongueOut"})) or ("jawOpen",))
    assert set(motion_kinds(some.neutral, SKIN, some.deltas).kinds) == {"face"}


@pytest.mark.parametrize("scale", [1e-3, 1.0, 40.0])
def test_the_answer_depends_on_no_unit_no_axes_and_no_order(scale):
    rig = with_blendshapes(RIG, turn=head_motion(RIG.neutral, ("y", 30)), joy=delta("jawOpen") + delta("mouthLeft"))
    R = Rotation.random(random_state=3).as_matrix()
    order = np.random.default_rng(1).permutation(len(rig.names))
    turned = motion_kinds(scale * (rig.neutral @ R.T + 50), SKIN, scale * rig.deltas[order] @ R.T).kinds
    plain = motion_kinds(rig.neutral, SKIN, rig.deltas).kinds
    assert turned == tuple(plain[i] for i in order)
    assert plain[-2:] == ("head movement", "calls others")


def test_what_moves_a_chest_alone_is_not_of_the_face():
    x = np.random.default_rng(0).normal(size=(400, 3)) * [60, 20, 10] + [0, RIG.neutral[:, 1].min() - 150, 60]
    v, k = len(RIG.neutral), len(RIG.names)
    body = np.arange(v, v + 399).reshape(-1, 3)
    deltas = np.zeros((k + 1, v + 400, 3))
    deltas[:k, :v], deltas[k, v:] = RIG.deltas, [0, 2, 6]
    neutral, triangles = np.concatenate([RIG.neutral, x]), np.concatenate([SKIN, body])
    face = Sphere(RIG.neutral[RIG.skin].mean(axis=0), 160.0)
    named = (None,) * k + ("not of the face",)
    apart = ("face",) * k + ("not of the face",)
    assert motion_kinds(neutral, triangles, deltas, face=face).kinds == apart
    assert motion_kinds(neutral, triangles, deltas, called=named).kinds == apart
    assert motion_kinds(neutral, triangles, deltas).kinds == ("face",) * (k + 1)  # in doubt: nothing is set apart


def test_a_name_alone_sets_nothing_apart():
    for said in ("head movement", "not of the face"):
        assert set(motion_kinds(RIG.neutral, SKIN, RIG.deltas, called=(said,) * len(FEW)).kinds) == {"face"}
    some = (None,) * (len(FEW) - 1) + ("not of the face",)
    assert set(motion_kinds(RIG.neutral, SKIN, RIG.deltas, called=some).kinds) == {"face"}


@pytest.mark.parametrize(
    ("name", "at"),
    [("Hide_hat", (0, 160, 0)), ("fang", (0, -60, 20)), ("shape_7", (0, 160, 0)), ("pupil", (30, 0, 60))],
)
def test_hats_and_fangs_move_no_skin_and_are_set_apart(name, at):
    rig = with_piece(RIG, name, np.array(at) + RIG.neutral.mean(axis=0), 8.0, [0, -20, 0])
    kinds = kind_of(rig)
    assert kinds.pop(name) == "not of the face"
    assert set(kinds.values()) == {"face"}


def test_a_hat_that_draws_some_scalp_along_is_set_apart_where_its_name_says_hat():
    rig = with_piece(RIG, "Hide_hat", RIG.neutral.mean(axis=0) + np.array([0, 160, 0]), 8.0, [0, -60, 0])
    top = RIG.neutral[:, 1] > np.quantile(RIG.neutral[:, 1], 0.9)
    deltas = rig.deltas.copy()
    deltas[-1, : len(top)][top] = [0, -4, 0]
    assert kind_of(replace(rig, deltas=deltas))["Hide_hat"] == "not of the face"
    assert kind_of(replace(rig, deltas=deltas, names=(*RIG.names, "shape_7")))["shape_7"] == "face"


def test_a_shape_that_calls_others_is_set_apart_and_its_parts_are_not():
    joy = 0.8 * delta("mouthSmileLeft") + 0.8 * delta("mouthSmileRight") + 0.5 * delta("eyeBlinkLeft")
    found = expression_kinds(with_blendshapes(RIG, Fcl_ALL_Joy=joy, Fcl_ALL_Neutral=0 * joy))
    kinds = {one.name: one for one in found}
    assert kinds["Fcl_ALL_Neutral"].kind == "moves nothing"
    assert kinds["Fcl_ALL_Joy"].kind == "calls others"
    assert "0.80 mouthSmileLeft" in kinds["Fcl_ALL_Joy"].why
    assert [one.name for one in set_apart(found)] == ["Fcl_ALL_Joy", "Fcl_ALL_Neutral"]


def test_weights_are_never_negative_nor_above_full():
    rig = with_only(("jawOpen", "mouthSmileLeft", "browDownLeft"))
    for sum_ in (
        -delta("jawOpen"),
        delta("jawOpen") - delta("mouthSmileLeft"),
        1.5 * delta("jawOpen") + 0.5 * delta("browDownLeft"),
    ):
        assert set(kind_of(with_blendshapes(rig, other=sum_)).values()) == {"face"}


def test_both_halves_at_once_are_a_movement_of_the_face():
    both = delta("browDownLeft") + delta("browDownRight")
    assert set(kind_of(with_blendshapes(RIG, browDown=both)).values()) == {"face"}


def test_what_is_apart_is_listed_with_its_reason_and_planned_for_nowhere():
    joy = delta("mouthSmileLeft") + delta("jawOpen")
    rig = with_blendshapes(RIG, turn=head_motion(RIG.neutral, ("y", 30)), joy=joy, still=0 * joy)
    found = audit_rig(rig)
    assert found.used == RIG.names
    assert {one.name: one.kind for one in found.apart} == {
        "turn": "head movement",
        "joy": "calls others",
        "still": "moves nothing",
    }
    page = " ".join(audit_text(found).split())
    assert "Head movements turn moves the whole head as one" in page
    assert "turn (moves the whole head)" in verdict(found)
    assert found.rank == audit_rig(RIG).rank


def test_opposites_and_differences_are_planned_and_are_no_mix_of_others():
    rig = with_only(("jawOpen", "mouthSmileLeft", "browDownLeft"))
    found = audit_rig(with_blendshapes(rig, shut=-delta("jawOpen")))
    assert found.used == (*rig.names, "shut")
    assert not [one for one in found.findings if one.kind == "dependent"]
    less = audit_rig(with_blendshapes(rig, less=delta("jawOpen") - delta("mouthSmileLeft")))
    assert less.used == (*rig.names, "less")
    (same,) = [one for one in less.findings if one.kind == "dependent"]
    assert same.message.startswith("1.00 less + 1.00 mouthSmileLeft is the same movement as 1.00 jawOpen")


def test_a_sum_names_no_part_that_explains_nothing():
    smiles = delta("mouthSmileLeft") + delta("mouthSmileRight")
    for tiny in (1e-3, 1e-6):
        rig = with_blendshapes(RIG, look=tiny * delta("eyeWideLeft"), both=smiles + tiny * delta("eyeWideLeft"))
        assert kind_of(rig)["both"] == "face"  # the halves of one movement, and nothing else


def test_a_sum_of_what_no_marker_sees_is_planned_itself():
    weak = 0.009 * delta("jawForward")
    seen = with_blendshapes(RIG, part=20 * weak, mix=20 * weak + 0.6 * delta("browDownLeft"))
    unseen = with_blendshapes(RIG, part=weak, mix=weak + 0.03 * delta("browDownLeft"))
    assert kind_of(seen)["mix"] == "calls others"
    assert kind_of(unseen)["mix"] == "face"


def test_a_sum_of_sums_is_told_by_what_is_planned():
    inner = 0.5 * delta("jawOpen") + 0.5 * delta("browDownLeft")
    outer = inner + 0.8 * delta("mouthFunnel") + 0.4 * delta("browDownLeft")
    found = {one.name: one for one in expression_kinds(with_blendshapes(RIG, inner=inner, outer=outer))}
    assert found["inner"].kind == found["outer"].kind == "calls others"
    assert "inner" not in found["outer"].why
    for part in ("0.50 jawOpen", "0.90 browDownLeft", "0.80 mouthFunnel"):
        assert part in found["outer"].why
