"""What is found wrong with blendshapes, sides and names: each planted, and quiet where it is not."""

import re
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from capture_plan.anatomy.delta_relations import motionless
from capture_plan.anatomy.symmetry import symmetry_report
from capture_plan.anatomy.zones import DOT_MM, MARGINS_MM, zone_mask
from capture_plan.audit.audit import audit_rig
from capture_plan.audit.exported import inverted, mirrored
from capture_plan.audit.other_order import other_order
from capture_plan.audit.report import audit_text, verdict
from capture_plan.face.anchors import face_anchors
from capture_plan.face.flying import flying
from capture_plan.face.sense import side_senses
from capture_plan.formats.raw import RawRig
from capture_plan.layout.face import see_face
from capture_plan.layout.problem import task_of
from capture_plan.layout.settings import LayoutSettings
from capture_plan.reader.read import rig_from_raw
from capture_plan.sample import sample_rig
from tests.light import light_sample

NAMES = ("browDownLeft", "browDownRight", "jawLeft", "jawOpen", "jawRight", "mouthLowerDownLeft", "mouthLowerDownRight")
NAMES += ("mouthSmileLeft", "mouthSmileRight")


@pytest.fixture(scope="module")
def rig():
    """The sample with a few of its blendshapes."""
    whole = sample_rig()
    return replace(whole, names=NAMES, deltas=whole.deltas[[whole.names.index(name) for name in NAMES]])


@pytest.fixture(scope="module")
def clean(rig):
    return audit_rig(rig)


def delta(rig, name):
    return rig.deltas[rig.names.index(name)]


def with_delta(rig, name, new):
    """The rig with another delta of one blendshape, or with one blendshape more."""
    names = rig.names if name in rig.names else (*rig.names, name)
    deltas = {other: delta(rig, other) for other in rig.names} | {name: new.astype(np.float32)}
    return replace(rig, names=names, deltas=np.stack([deltas[other] for other in names]))


def renamed(rig, names):
    return replace(rig, names=tuple(names.get(name, name) for name in rig.names))


def of_kind(found, kind):
    return [finding for finding in found.findings if finding.kind == kind]


def test_the_sample_is_free_of_faults(clean):
    assert {finding.kind for finding in clean.findings} == {"opposite", "overlap"}
    assert all(finding.urgency == "know" for finding in clean.findings)


def test_jaw_left_and_jaw_right_are_opposites_by_shape(clean, rig):
    assert [set(finding.blendshapes) for finding in of_kind(clean, "opposite")] == [{"jawLeft", "jawRight"}]
    nameless = audit_rig(renamed(rig, {"jawLeft": "a", "jawRight": "b"}))
    assert [set(finding.blendshapes) for finding in of_kind(nameless, "opposite")] == [{"a", "b"}]


def test_a_negated_copy_is_an_opposite_and_is_planned(rig):
    found = audit_rig(with_delta(rig, "shut", -delta(rig, "jawOpen")))
    assert any({"jawOpen", "shut"} <= set(finding.blendshapes) for finding in of_kind(found, "opposite"))
    assert "shut" in found.used


def test_halves_that_share_the_midline_are_told_and_no_others(clean):
    (finding,) = of_kind(clean, "overlap")
    assert finding.blendshapes == ("mouthLowerDownLeft", "mouthLowerDownRight")


def test_halves_cut_at_the_midline_share_nothing(rig):
    x = rig.neutral[:, :1]
    cut = with_delta(rig, "mouthLowerDownLeft", delta(rig, "mouthLowerDownLeft") * (x > 1e-3))
    cut = with_delta(cut, "mouthLowerDownRight", delta(rig, "mouthLowerDownRight") * (x < -1e-3))
    assert not of_kind(audit_rig(cut), "overlap")


@pytest.mark.parametrize(
    ("k", "says"), [(1, "the only blendshape is"), (2, "both blendshapes are"), (4, "all 4 blend")]
)
def test_a_rig_of_few_blendshapes_is_asked_for_the_others(rig, k, says):
    jaw = rig.names.index("jawOpen")
    chosen = sorted([jaw, *[row for row in range(len(rig.names)) if row != jaw][: k - 1]])
    few = replace(rig, names=tuple(rig.names[row] for row in chosen), deltas=rig.deltas[chosen])
    assert verdict(audit_rig(few)).startswith(f"Yes, but they are few: {says}")


def test_exchanged_sides_go_back_to_the_rigger(rig):
    found = audit_rig(renamed(rig, {"browDownLeft": "browDownRight", "browDownRight": "browDownLeft"}))
    (finding,) = of_kind(found, "name")
    assert set(finding.blendshapes) == {"browDownLeft", "browDownRight"}
    assert finding.urgency == "rigger"
    assert "2 of 6 sided blendshapes move the other side" in finding.message
    assert verdict(found).startswith("Yes")


def test_a_name_map_of_the_user_silences_names_that_say_another_side(rig):
    exchanged = renamed(rig, {"browDownLeft": "browDownRight", "browDownRight": "browDownLeft"})
    mapped = replace(exchanged, meanings=(("browDownLeft", "browDownRight"), ("browDownRight", "browDownLeft")))
    found = audit_rig(mapped)
    assert of_kind(found, "name") == []
    assert found.reading.sides.disagree == ()
    assert "disagree" not in audit_text(found)


def test_what_moves_the_other_side_alone_is_counted_with_its_likes(rig):
    """One half of a pair is gone: the finding and the answer about sides tell of the same blendshapes."""
    some = replace(rig, names=rig.names[1:], deltas=rig.deltas[1:])
    found = audit_rig(renamed(some, {"browDownRight": "browDownLeft"}))
    (listing,) = [finding for finding in of_kind(found, "name") if "move the other side" in finding.message]
    assert listing.blendshapes == found.reading.sides.disagree == ("browDownLeft",)
    assert "1 of 5 sided" in listing.message


def test_where_as_many_names_err_as_agree_the_verdict_asks_to_look_first(rig):
    messages = [name for name in NAMES if not name.startswith("jaw")]
    two = replace(rig, names=tuple(messages[:4]), deltas=np.stack([delta(rig, name) for name in messages[:4]]))
    crossed = renamed(two, {"browDownLeft": "browDownRight", "browDownRight": "browDownLeft"})
    assert not all(sense.holds for sense in side_senses(crossed))
    assert not verdict(audit_rig(crossed)).startswith("Yes")


def test_exchanged_partners_are_told(rig):
    found = audit_rig(renamed(rig, {"browDownRight": "mouthSmileRight", "mouthSmileRight": "browDownRight"}))
    assert {name for finding in of_kind(found, "name") for name in finding.blendshapes} >= {"browDownLeft"}


@pytest.mark.parametrize("side", ["Left", "Right"])
def test_half_of_the_blendshapes_go_back_once(side):
    whole = sample_rig()
    names = tuple(name for name in whole.names if not name.endswith("Right" if side == "Left" else "Left"))
    half = replace(whole, names=names, deltas=whole.deltas[whole.rows(names)])
    found = [finding for finding in audit_rig(half).findings if finding.kind == "partner"]
    assert len(found) == 1
    assert f"are of the {side.lower()} (" in found[0].message
    assert len(found[0].blendshapes) == 17


def test_few_without_a_partner_are_no_half(rig):
    names = tuple(name for name in rig.names if not name.endswith("Right"))
    few = replace(rig, names=names, deltas=rig.deltas[rig.rows(names)])
    assert all("half a face" not in finding.message for finding in audit_rig(few).findings)


def test_a_pair_that_mirrors_poorly_goes_back_to_the_rigger(rig):
    found = audit_rig(with_delta(rig, "browDownLeft", delta(rig, "browDownLeft") * 0.6))
    (finding,) = of_kind(found, "partner")
    assert finding.blendshapes == ("browDownLeft", "browDownRight")
    assert finding.urgency == "rigger"


def test_a_blendshape_a_hundred_times_too_strong_stops_the_shoot(rig):
    found = audit_rig(with_delta(rig, "jawOpen", delta(rig, "jawOpen") * 100))
    (finding,) = of_kind(found, "size")
    assert finding.blendshapes == ("jawOpen",)
    assert verdict(found).startswith("Not yet: all 9 blendshapes are planned, but jawOpen")


def test_a_still_blendshape_is_asked_for_again(rig):
    found = audit_rig(with_delta(rig, "still", 0 * rig.deltas[0]))
    page = audit_text(found)
    assert verdict(found) == "Yes: 9 of 10 blendshapes are planned, without still (moves nothing)."
    assert page.index("SEND BACK") < page.index("still moves nothing") < page.index("still, as said above")


def test_names_are_told_by_their_standard(rig):
    page = audit_text(audit_rig(renamed(rig, {"jawOpen": "CTRL_expressions_jawOpen", "jawLeft": "zxq_3"})))
    flat = " ".join(page.split())
    assert "1 by no known standard: zxq_3" in flat
    assert "7 of 9 by ARKit; 1 of 9 by MetaHuman" in flat


def test_the_users_own_names_win(rig):
    found = audit_rig(replace(renamed(rig, {"jawOpen": "zxq_3"}), meanings=(("zxq_3", "jawOpen"),)))
    fact = next(fact for fact in found.details if fact.name == "zxq_3")
    assert (fact.meaning, fact.confidence) == ("jawOpen", 1.0)


def test_details_tell_movement_and_mirror_image_of_every_blendshape(rig, clean):
    assert tuple(fact.name for fact in clean.details) == rig.names
    facts = {fact.name: fact for fact in clean.details}
    assert facts["browDownLeft"].mirror == "browDownRight"
    assert facts["jawOpen"].mirror == "jawOpen"
    assert facts["jawOpen"].skin_mm == pytest.approx(rig.displacement[3, rig.skin].max(), abs=1e-3)


def test_a_stretched_half_makes_the_neutral_crooked(rig):
    stretched = np.where(rig.neutral[:, :1] > 0, rig.neutral * [1.2, 1, 1], rig.neutral)
    found = audit_rig(replace(rig, neutral=stretched))
    assert any("not symmetric" in finding.message for finding in of_kind(found, "geometry"))
    assert found.symmetry.p95_mm > 2


def test_what_shares_a_fault_is_told_in_one_sentence_that_names_all():
    rig = sample_rig()
    still = rig.deltas.copy()
    still[:5] = 0
    (found,) = [one for one in motionless(replace(rig, deltas=still)) if one.kind == "static"]
    assert found.blendshapes == rig.names[:5]
    assert found.message.startswith("5 blendshapes move nothing")
    assert all(name in found.message for name in rig.names[:5])


@pytest.mark.parametrize("metres", [1, 10, 100])
def test_a_vertex_that_flies_off_decides_about_nothing_and_goes_back(rig, metres):
    k, v = rig.names.index("jawOpen"), int(np.flatnonzero(rig.skin)[500])
    deltas = rig.deltas.copy()
    deltas[k, v] += np.array([300, -200, 933]) * metres
    arrays = (rig.names, rig.parts, rig.part_names, rig.source_index)
    whole, torn = (rig_from_raw(RawRig("rig", rig.neutral, rig.triangles, d, *arrays)) for d in (rig.deltas, deltas))
    assert (torn.unit_mm, torn.up, torn.facing) == (whole.unit_mm, whole.up, whole.facing)
    assert (torn.skin != whole.skin).mean() < 0.05
    found = audit_rig(torn)
    assert "jawOpen" not in found.used
    assert "jawOpen cannot be right" in verdict(found)


def test_a_strong_tongue_or_a_far_whole_does_not_fly_off():
    rig = sample_rig()
    assert not flying(rig.neutral, rig.triangles, rig.deltas).any()
    assert not flying(rig.neutral, rig.triangles, 4 * rig.deltas).any()
    assert not flying(rig.neutral, rig.triangles, rig.deltas + 1e4).any()


TURN = Rotation.from_rotvec([0.01, 0.02, -0.01]).as_matrix()


@pytest.mark.parametrize(
    "moved", [lambda x: x + np.array([0, 1.5, 1.5]), lambda x: (x - [0, 650, 30]) @ TURN.T + [2, 650, 31]]
)
def test_a_face_whose_head_slipped_goes_back(rig, moved):
    """Every marker seems to move with it, even on the back of the head."""
    slipped = with_delta(rig, "jawOpen", moved(rig.neutral + delta(rig, "jawOpen")) - rig.neutral)
    found = audit_rig(slipped)
    (finding,) = of_kind(found, "export")
    assert (finding.blendshapes, finding.urgency, finding.left_out) == (("jawOpen",), "stop", False)
    assert finding.message.startswith("the whole head goes along in jawOpen (")
    assert "jawOpen cannot be right" in verdict(found)


def test_rounding_and_exaggeration_are_no_slip(rig):
    noise = np.random.default_rng(0).normal(scale=0.1, size=rig.deltas.shape)
    for deltas in (3 * rig.deltas, rig.deltas + noise + [0, 0.3, 0]):
        assert not of_kind(audit_rig(replace(rig, deltas=deltas.astype(np.float32))), "export")


def test_heads_that_move_on_purpose_have_not_slipped(rig):
    found = audit_rig(with_delta(rig, "head_up", np.broadcast_to([0, 8.0, 0], rig.neutral.shape)))
    assert not of_kind(found, "export")


def test_half_a_face_is_said_to_be_one_and_asked_for_no_partners():
    whole = sample_rig()
    left = whole.neutral[:, 0] > -0.5
    triangles = whole.triangles[left[whole.triangles].all(axis=1)]
    at = np.unique(triangles)
    arrays = (whole.neutral[at], np.searchsorted(at, triangles), whole.deltas[:, at], whole.names)
    half = rig_from_raw(RawRig("half", *arrays, whole.parts[at], whole.part_names, np.arange(len(at)), 1.0, "+y", "+z"))
    found = audit_rig(half).findings
    assert [finding.urgency for finding in found if "this may be half a face" in finding.message] == ["rigger"]
    assert not [finding for finding in found if finding.kind == "partner"]
    assert not [finding for finding in found if "are partners by name" in finding.message]


def test_a_whole_head_of_which_one_side_is_skin_is_no_half_face():
    whole = sample_rig()
    arrays = (whole.neutral, whole.triangles, whole.deltas[whole.rows(["eyeBlinkLeft"])], ("eyeBlinkLeft",))
    rig = rig_from_raw(RawRig("one", *arrays, whole.parts, whole.part_names, whole.source_index, 1.0, "+y", "+z"))
    assert symmetry_report(rig).neutral_p95_mm > 30
    assert all("half a face" not in finding.message for finding in audit_rig(rig).findings)


@pytest.fixture(scope="module")
def with_narrow_blink(rig):
    """The rig with two blinks that move the lash line alone, as a cartoon's lids do, and one that moves beyond it."""
    lash = zone_mask(rig, "lash line", MARGINS_MM["lash line"] + DOT_MM / 2)
    left = rig.neutral[:, 0] > 0
    wide = np.exp(-(np.linalg.norm(rig.neutral - rig.neutral[lash & left].mean(axis=0), axis=1) ** 2) / 1800)
    down = np.array([0, -9, 0])
    shapes = {"lashLeft": lash & left, "lashRight": lash & ~left, "lidLeft": wide * rig.skin}
    for name, share in shapes.items():
        rig = with_delta(rig, name, share[:, None] * down)
    return rig


def test_what_moves_only_where_no_dot_holds_is_said_and_named_in_the_verdict(with_narrow_blink):
    found = audit_rig(with_narrow_blink)
    (one,) = of_kind(found, "bare")
    assert one.blendshapes == ("lashLeft", "lashRight")
    assert "lashLeft (9.0 mm, 0.0 mm where dots hold)" in one.message
    assert one.message.endswith("lash line")
    assert "no marker can stand for lashLeft, lashRight" in verdict(found)
    assert not one.left_out


def test_the_audit_and_the_plan_agree_on_what_has_no_marker(with_narrow_blink):
    (one,) = of_kind(audit_rig(with_narrow_blink), "bare")
    task = task_of(see_face(with_narrow_blink), LayoutSettings())
    assert {task.face.used[k] for k in task.reachable} == set(task.face.used) - set(one.blendshapes)


def test_what_is_named_for_the_jaw_and_turns_the_whole_head_was_exported_wrongly(rig):
    about = Rotation.from_euler("x", 90, degrees=True).as_matrix()
    turned = with_delta(rig, "jawOpen", rig.neutral @ about.T - rig.neutral)
    turned = with_delta(turned, "headNod", rig.neutral @ about.T - rig.neutral + np.array([0, 1, 0]))
    (finding,) = [one for one in of_kind(audit_rig(turned), "export") if "jawOpen" in one.blendshapes]
    assert "though it is named for a movement of the face" in finding.message
    assert finding.left_out
    assert finding.urgency == "stop"


def test_what_could_not_be_read_goes_back_to_the_rigger(rig):
    note = "blendshapes that hold NaN were left out, clean them and export again: smile"
    (finding,) = of_kind(audit_rig(replace(rig, note=f"its unit is assumed; {note}")), "export")
    assert finding.message == note
    assert finding.urgency == "rigger"


def test_of_steps_of_one_movement_the_strongest_is_planned_and_of_equal_ones_that_with_a_known_name(rig):
    half = with_delta(rig, "jaw_step_50", 0.5 * delta(rig, "jawOpen"))
    assert "jawOpen" in audit_rig(half).used
    assert "jaw_step_50" not in audit_rig(half).used
    names = ("aaa", *rig.names)
    twice = replace(rig, names=names, deltas=np.concatenate([delta(rig, "jawOpen")[None], rig.deltas]))
    assert "aaa" not in audit_rig(twice).used
    more = replace(rig, names=names, deltas=np.concatenate([1.5 * delta(rig, "jawOpen")[None], rig.deltas]))
    assert {"aaa", "jawOpen"} & set(audit_rig(more).used) == {"aaa"}


@pytest.mark.parametrize("named", [True, False])
def test_movements_that_go_the_other_way_are_seen_whatever_they_are_called(rig, named):
    whole = sample_rig()
    names = whole.names if named else tuple(f"shape_{k:02}" for k in range(len(whole.names)))
    right = replace(whole, names=names)
    assert inverted(right, names, face_anchors(right)) == []
    wrong = replace(right, deltas=-right.deltas)
    (finding,) = inverted(wrong, names, face_anchors(right))
    assert finding.urgency == "stop"
    assert finding.blendshapes[0] == names[whole.names.index("jawOpen")]


@pytest.mark.parametrize("of", ["offsets", "neutral", "names", "nothing"])
def test_what_is_mirrored_against_the_neutral_is_told_from_exchanged_names(of):
    rig = light_sample()
    over = np.array([-1, 1, 1])
    other = {"Left": "Right", "Right": "Left"}
    names = tuple(re.sub("Left|Right", lambda match: other[match[0]], name) for name in rig.names)
    wrong = {
        "offsets": replace(rig, deltas=rig.deltas * over),
        "neutral": replace(rig, neutral=rig.neutral * over),
        "names": replace(rig, names=names),
        "nothing": rig,
    }[of]
    found = mirrored(wrong, wrong.names, face_anchors(wrong))
    assert [finding.urgency for finding in found] == ["stop"] * (of in ("offsets", "neutral"))
    if found:
        assert ("jawLeft" in found[0].blendshapes, "eyeBlinkLeft" in found[0].blendshapes) == (
            of == "offsets",
            of == "neutral",
        )
        assert of_kind(audit_rig(wrong), "export") == found
        assert not any("exchange" in one.advice.lower() for one in of_kind(audit_rig(wrong), "name"))


@pytest.mark.parametrize(
    ("by", "says"), [(1, "fits the blendshape behind its own"), (-1, "fits the blendshape before its own"), (7, None)]
)
def test_names_of_other_shapes_are_told_and_no_exchange_is_advised(by, says):
    rig = sample_rig()
    wrong = replace(rig, names=rig.names[by:] + rig.names[:by])
    found = audit_rig(wrong)
    (one,) = of_kind(found, "name")
    assert one.urgency == "stop"
    assert "do not belong together" in one.message
    assert (says or "in the order of the shapes. Until") in one.advice
    assert other_order(rig, rig.names) == []


@pytest.mark.parametrize("some", [2, None])
def test_positions_are_told_from_offsets(some):
    """All of them are subtracted from; of single ones the audit says so."""
    rig = light_sample()
    deltas = rig.deltas.copy()
    deltas[:some] += rig.neutral.astype(np.float32)
    raw = RawRig("r", rig.neutral, rig.triangles, deltas, rig.names, rig.parts, rig.part_names, rig.source_index)
    given = rig_from_raw(raw)
    if some is None:
        assert "all deltas hold positions" in given.note
        assert np.allclose(given.deltas, rig.deltas, atol=1e-4)
        return
    (one,) = [finding for finding in of_kind(audit_rig(given), "export") if "positions" in finding.message]
    assert (one.blendshapes, one.urgency) == (rig.names[:2], "stop")
