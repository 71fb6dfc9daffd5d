"""Signs and doubts of a face: what one sign may decide, what several decide, and what stays open."""

import dataclasses

import numpy as np
import pytest

from capture_plan.face.axes import PAIRS, Vote, axes_matrix, decide, likelihood, vector
from capture_plan.face.candidate import Candidate
from capture_plan.face.channels import find_channels, moves_rigidly
from capture_plan.face.eyes import eye_candidates
from capture_plan.face.of_rig import rig_points
from capture_plan.face.points import Found, choose
from capture_plan.face.reading import eyes_hold, face_reading
from capture_plan.face.shape import Shape
from capture_plan.face.unit import find_unit
from capture_plan.face.votes import all_votes
from capture_plan.rig.read_options import AXES, ReadOptions
from capture_plan.rig.understood import Sign
from capture_plan.sample import sample_rig

UP = (Vote("eyes above mouth", "up", vector("+z"), 8.0, 0.02), Vote("brows rise", "up", vector("+z"), 6.0, 0.03))
FORWARD = (Vote("skin", "facing", vector("-y"), 6.0, 0.03), Vote("nose", "facing", vector("-y"), 5.0, 0.1))


def decided(*votes, sides=0, stated=None, up=None, facing=None, speaking=20):
    mirror = np.where(np.arange(3) == sides, 0.0, -4.0)
    return decide(votes, mirror, stated=stated, given=ReadOptions(up=up, facing=facing), speaking=speaking)


# ---------------------------------------------------------------- axes
@pytest.mark.parametrize("pair", PAIRS)
def test_signs_that_agree_decide_wherever_they_point(pair):
    R = axes_matrix(*pair)
    ours = {"up": R[1], "facing": R[2]}
    votes = [dataclasses.replace(vote, direction=ours[vote.role]) for vote in UP + FORWARD]
    found = decided(*votes, sides=int(np.argmax(np.abs(R[0]))))
    assert (found.up, found.facing, found.sure) == (*pair, True)


def test_a_vote_favours_its_own_axis_and_its_opposite_least():
    scores = likelihood(UP[0], None)
    assert AXES[int(np.argmax(scores))] == "+z"
    assert AXES[int(np.argmin(scores))] == "-z"


def test_a_part_across_the_face_says_nothing_of_up():
    aslant = dataclasses.replace(UP[0], direction=vector("+z") + 5 * vector("+x"))
    np.testing.assert_allclose(likelihood(aslant, 0), likelihood(UP[0], 0))


def test_one_sign_a_question_is_not_enough():
    weak = [dataclasses.replace(vote, kappa=3.0, eps=0.2) for vote in (UP[0], FORWARD[0])]
    assert not decided(*weak).sure


def test_signs_that_contradict_each_other_leave_a_doubt():
    against = dataclasses.replace(UP[0], direction=vector("-z"))
    assert not decided(UP[0], against, *FORWARD).sure


def test_the_format_stands_against_one_sign_and_falls_to_several():
    assert decided(UP[0], stated=("+y", "+z")).up == "+y"
    found = decided(*UP, *FORWARD, stated=("+y", "+z"))
    assert (found.up, found.facing) == ("+z", "-y")
    assert any(sign.name == "the format" and sign.weight < 0 for sign in found.signs)


def test_what_a_person_gives_is_not_voted_on():
    found = decided(*UP, *FORWARD, up="-x", facing="+z")
    assert (found.up, found.facing, found.sure) == ("-x", "+z", True)


@pytest.mark.parametrize("named", [True, False])
def test_every_sign_of_the_sample_points_where_it_should(named):
    """The sample's blink drags its throat along, and its jaw swings back as it drops: both still tell up from down."""
    rig = sample_rig()
    names = rig.names if named else tuple(f"shape_{k:02d}" for k in range(len(rig.names)))
    channels = find_channels(rig.neutral, rig.triangles, rig.deltas, names)
    shape = Shape(rig.neutral, rig.triangles, rig.deltas, channels, rig.parts, rig.part_names)
    truth = {"left": vector("+x"), "up": vector("+y"), "facing": vector("+z")}
    votes = all_votes(shape, 0)
    assert [vote.name for vote in votes if vote.direction @ truth[vote.role] <= 0] == []
    assert {"the lower lip moves more than the upper", "lids lie before the eyeballs"} <= {vote.name for vote in votes}
    assert "something small beside the middle closes towards the mouth" in {vote.name for vote in votes}


# ---------------------------------------------------------------- unit
@pytest.mark.parametrize(("mm", "sure"), [(1.0, True), (10.0, True), (1000.0, True), (25.4, True), (100.0, False)])
def test_a_human_face_tells_its_unit_and_is_sure_where_no_doll_is_as_large_in_its_file(mm, sure):
    found = find_unit(None, 62 / mm, 52 / mm, 300 / mm, drop=65 / mm, few=False)
    assert (found.mm, found.sure) == (mm, sure)
    assert find_unit(mm, 62 / mm, 52 / mm, 300 / mm, drop=65 / mm, few=False).sure


def test_the_format_s_unit_stands_for_a_mascot_and_is_not_sure():
    found = find_unit(1000.0, 0.29, 0.2, 0.9, drop=0.2, few=False)
    assert (found.mm, found.sure) == (1000.0, False)


@pytest.mark.parametrize("stated", [None, 10.0])
@pytest.mark.parametrize("doll", [0.2, 0.35, 0.46, 0.5])
def test_a_doll_in_centimetres_of_no_usual_adult_s_size_is_never_surely_a_person_in_inches(stated, doll):
    found = find_unit(stated, doll * 62 / 10, doll * 52 / 10, doll * 300 / 10, drop=doll * 65 / 10, few=False)
    assert not found.sure
    assert stated is None or found.mm == stated


@pytest.mark.parametrize("mm", [20.0, 22.0, 28.0, 30.0, 33.0])
def test_a_file_of_any_scale_is_never_surely_in_inches_where_it_is_a_tenth_off(mm):
    assert not find_unit(None, 62 / mm, 52 / mm, 300 / mm, drop=65 / mm, few=False).sure


@pytest.mark.parametrize("doll", [0.08, 0.1, 0.12])
def test_a_doll_in_metres_is_never_surely_a_person_in_decimetres(doll):
    assert not find_unit(None, doll * 0.062, doll * 0.052, doll * 0.3, drop=doll * 0.065, few=False).sure


def test_the_format_s_unit_falls_where_no_face_can_be_so_large():
    assert find_unit(1000.0, 62.0, 52.0, 300.0, drop=65.0, few=False).mm == 1.0


@pytest.mark.parametrize(("true", "stated"), [(25.4, 10.0), (10.0, 25.4)])
@pytest.mark.parametrize("drop", [65.0, 40.0, None])
def test_the_format_s_unit_falls_where_a_face_built_like_a_person_s_has_a_person_s_size_in_another(true, stated, drop):
    found = find_unit(stated, 62 / true, 52 / true, 300 / true, drop=drop and drop / true, few=False)
    assert (found.mm, found.sure) == ((true, True) if drop == 65.0 else (stated, False))


def test_a_face_of_no_usual_unit_is_scaled_and_not_sure():
    found = find_unit(None, 63 / 5.0, 54 / 5.0, 300 / 5.0, drop=65 / 5.0, few=False)
    assert found.mm in (5.0, 10.0)
    assert not found.sure


# ---------------------------------------------------------------- channels
def with_one_more(name, delta):
    """The sample with one more blendshape."""
    rig = sample_rig()
    deltas = np.concatenate([rig.deltas, delta[None].astype(np.float32)])
    return rig.neutral, rig.triangles, deltas, (*rig.names, name)


def test_every_movement_of_the_sample_is_the_face_s():
    rig = sample_rig()
    assert find_channels(rig.neutral, rig.triangles, rig.deltas, rig.names).facial.all()


@pytest.mark.parametrize("name", ["shape_53", "head_turn_left"])
def test_a_head_that_turns_as_a_whole_is_set_aside_with_or_without_its_name(name):
    v = sample_rig().neutral
    turned = np.stack([0.2 * (v[:, 2] - 30), 0 * v[:, 0], -0.2 * v[:, 0]], axis=1)
    channels = find_channels(*with_one_more(name, turned))
    assert not channels.facial[-1]
    assert channels.facial[:-1].all()


def test_what_folds_into_a_point_is_hidden_and_set_aside():
    v = sample_rig().neutral
    top = v[:, 1] > np.percentile(v[:, 1], 90)
    fold = np.where(top[:, None], v[top].mean(axis=0) - v, 0)
    assert not find_channels(*with_one_more("shape_53", fold)).facial[-1]


def test_turning_is_rigid_and_bending_is_not():
    points = np.random.default_rng(0).normal(size=(200, 3))
    turn = np.cross([0.1, 0.2, 0.3], points) + np.array([1.0, 0, 0])
    bend = np.stack([np.zeros(200), points[:, 0] ** 2 + 1, np.zeros(200)], axis=1)
    areas = np.ones(200)
    assert moves_rigidly(points, areas, turn)
    assert not moves_rigidly(points, areas, bend)


# ---------------------------------------------------------------- eyes and mouth
def test_lids_are_known_by_how_they_close():
    rig = sample_rig()
    names = tuple(f"shape_{k:02d}" for k in range(len(rig.names)))
    channels = find_channels(rig.neutral, rig.triangles, rig.deltas, names)
    shape = Shape(rig.neutral, rig.triangles, rig.deltas, channels, rig.parts, rig.part_names)
    lids = [one for one in eye_candidates(shape, 0.0, named=False) if one.kind == "lids"]
    right = rig_points(rig).eyes.places
    assert len(lids) == 1
    assert np.linalg.norm(lids[0].places - right, axis=1).max() < 8


def pair(kind, trust, half, y):
    return Candidate(kind, kind, trust, np.array([[half, y, 0.0], [-half, y, 0.0]]))


def spot(kind, trust, y):
    return Candidate(kind, kind, trust, np.array([[0.0, y, 0.0]]))


def test_wider_openings_do_not_win_over_eyes_that_several_signs_agree_on():
    eyes, _ = choose(
        [pair("rim", 0.3, 80, 0), pair("rim", 0.3, 30, 60), pair("ball", 1.5, 31, 61)], [spot("tear", 1.8, 0)]
    )
    assert eyes.sure
    assert eyes.places[0, 0] == pytest.approx(31, abs=1)


def test_a_neck_below_is_no_mouth_where_skin_parts_above_it():
    _, mouth = choose([pair("ball", 1.5, 30, 60)], [spot("rim", 0.7, -70), spot("tear", 1.8, 0)])
    assert mouth.places[0, 1] == 0


@pytest.mark.parametrize(("before", "sure"), [(-10.0, True), (0.0, True), (8.0, False)])
def test_a_mouth_before_which_something_is_named_for_it_leaves_a_doubt(before, sure):
    named = Candidate("name", "name", 2.0, np.array([[0.0, 0.0, before]]))
    _, mouth = choose([pair("ball", 1.5, 30, 60), pair("blink", 2.5, 30, 60)], [spot("tear", 1.8, 0), named])
    assert mouth.places[0].tolist() == [0.0, 0.0, 0.0]
    assert mouth.sure == sure


def test_two_places_of_equal_trust_leave_a_doubt():
    eyes, _ = choose([pair("ball", 1.5, 30, 60), pair("part", 1.5, 31, 90)], [])
    assert not eyes.sure


@pytest.mark.parametrize(("kind", "trust", "sure"), [("rim", 0.3, False), ("tear", 0.7, True)])
def test_the_two_weakest_signs_of_eyes_are_not_enough(kind, trust, sure):
    """In a coarse head brows move sharply, and seams beside them leave two openings."""
    eyes, _ = choose([pair("motion", 0.5, 30, 60), pair(kind, trust, 32, 62)], [spot("tear", 1.8, 0)])
    assert eyes.sure == sure


def test_eyes_below_the_mouth_are_never_sure():
    eyes, mouth = choose([pair("ball", 1.5, 30, -60), pair("rim", 0.3, 30, -60)], [spot("tear", 1.8, 0)])
    assert not eyes.sure
    assert not mouth.sure


@pytest.mark.parametrize(("trust", "against", "sure"), [(1.5, True, False), (1.5, False, True), (2.5, True, True)])
def test_eyes_fall_with_the_mouth_that_they_were_chosen_for_unless_one_sign_is_enough(trust, against, sure):
    """Seed-san without names: skin that parts inside the head looked like a mouth, and brows like eyes above it."""
    eyes = Found(np.zeros((2, 3)), True, (Sign("what closes", "here", trust), Sign("balls", "elsewhere", -2.0)))
    assert eyes_hold(eyes, (Sign("the skin around the mouth, which lies before it", "", -1.0),) * against) == sure


def test_nothing_found_is_said():
    eyes, mouth = choose([], [])
    assert (eyes.places, eyes.sure, mouth.places, mouth.sure) == (None, False, None, False)


def test_one_group_of_signs_that_contradicts_the_others_leaves_a_doubt():
    votes = [Vote(f"place {i}", "up", vector("+y"), 8.0, 0.02, "named place") for i in range(2)]
    votes += [Vote(f"motion {i}", "up", vector("-y"), 6.0, 0.03, "named motion") for i in range(6)]
    votes += [Vote(f"facing {i}", "facing", vector("+z"), 6.0, 0.03) for i in range(2)]
    sides = np.array([0.0, -4, -4])
    ask = {"stated": None, "speaking": 20}
    assert not decide(votes, sides, **ask).sure
    assert decide([vote for vote in votes if vote.group != "named place"], sides, **ask).sure


@pytest.mark.parametrize(("signs", "stated", "sure"), [(1, None, False), (2, None, True), (1, ("+y", "+z"), True)])
def test_up_rests_on_two_signs_at_least_or_on_one_and_the_format(signs, stated, sure):
    votes = [Vote(f"up {i}", "up", vector("+y"), 30.0, 0.01) for i in range(signs)]
    votes += [Vote(f"facing {i}", "facing", vector("+z"), 6.0, 0.03) for i in range(3)]
    assert decided(*votes, stated=stated).sure == sure


# ---------------------------------------------------------------- sides
def test_names_that_say_the_other_side_are_told():
    rig = sample_rig()
    swap = {"Left": "Right", "Right": "Left"}
    names = tuple(next((n.removesuffix(a) + b for a, b in swap.items() if n.endswith(a)), n) for n in rig.names)
    sides = face_reading(dataclasses.replace(rig, names=names)).sides
    assert not sides.sure
    assert "eyeBlinkRight" in sides.disagree
    assert face_reading(rig).sides.sure


@pytest.mark.parametrize(
    ("one", "other"),
    [("jawLeft", "jawRight"), ("mouthLeft", "mouthRight"), ("LookIn", "LookOut"), ("LookUp", "LookDown")],
)
def test_names_that_say_the_other_way_are_told(one, other):
    rig = sample_rig()
    names = tuple(n.replace(one, "@").replace(other, one).replace("@", other) for n in rig.names)
    wrong = {new for new, old in zip(names, rig.names, strict=True) if new != old}
    assert set(face_reading(dataclasses.replace(rig, names=names)).sides.disagree) == wrong
    assert face_reading(rig).sides.disagree == ()


def test_shuffled_names_are_not_believed_and_the_eyes_are_found_all_the_same():
    rig = sample_rig()
    shuffled = tuple(np.random.default_rng(3).permutation(rig.names).tolist())
    found, right = rig_points(dataclasses.replace(rig, names=shuffled)).eyes, rig_points(rig).eyes
    assert np.linalg.norm(found.places - right.places, axis=1).max() < 8
