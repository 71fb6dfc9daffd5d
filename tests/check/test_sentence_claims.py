"""Sentences against shapes: the largest movement is said, and lips that stay open are not called closed."""

from dataclasses import replace

import numpy as np
import pytest
from msgspec.structs import replace as changed

from capture_plan.anatomy.meaning import arkit_by_motion
from capture_plan.audit.audit import audit_rig
from capture_plan.check.sentence_claims import largest_unsaid, open_lips_unsaid
from capture_plan.expressions.lips import lips_apart, open_jaw, stays_open
from capture_plan.expressions.pack import pack
from capture_plan.expressions.sentences import mistakes, sentence
from capture_plan.expressions.settings import PackingSettings
from capture_plan.sample import sample_rig

NAMES = ("browInnerUp", "eyeBlinkLeft", "eyeBlinkRight", "jawOpen", "mouthClose", "mouthSmileLeft", "mouthSmileRight")
WHOLE = sample_rig()
RIG = replace(WHOLE, names=NAMES, deltas=WHOLE.deltas[[WHOLE.names.index(name) for name in NAMES]])
NAMELESS = replace(RIG, names=tuple(f"shape{k}" for k in range(len(NAMES))))


def packed(rig):
    return pack(rig, audit_rig(rig).used, PackingSettings())


def leaving_lips_open(share):
    deltas = RIG.deltas.copy()
    deltas[NAMES.index("mouthClose")] *= np.float32(1 - share)
    return replace(RIG, deltas=deltas)


@pytest.mark.parametrize("rig", [RIG, NAMELESS], ids=["named", "nameless"])
def test_every_sentence_names_the_largest_movement(rig):
    packing = packed(rig)
    assert [largest_unsaid(rig, one, packing.drivers) for one in packing.expressions] == [None] * len(
        packing.expressions
    )


@pytest.mark.parametrize("rig", [RIG, NAMELESS], ids=["named", "nameless"])
def test_a_sentence_that_leaves_the_jaw_out_is_caught(rig):
    packing = packed(rig)
    jaw = rig.names[NAMES.index("jawOpen")]
    (shot,) = [one for one in packing.expressions if jaw in one.blendshapes]
    for said in ("Match the picture.", "Match the picture: move both brows up by 5 mm.", "Close your eyes."):
        assert f"39 mm ({jaw})" in (largest_unsaid(rig, changed(shot, sentence=said), packing.drivers) or "")


def test_a_phrase_for_one_eye_does_not_say_what_moves_both():
    deltas = RIG.deltas.copy()
    deltas[NAMES.index("eyeBlinkLeft")] += deltas[NAMES.index("eyeBlinkRight")]
    both = replace(RIG, deltas=deltas)
    (shot,) = [one for one in packed(RIG).expressions if "eyeBlinkLeft" in one.blendshapes]
    one = changed(shot, blendshapes=("eyeBlinkLeft",), sentence="Wink: close your left eye.")
    assert largest_unsaid(RIG, changed(one, sentence=sentence(RIG, ("eyeBlinkLeft",))), ()) is None
    text = sentence(both, ("eyeBlinkLeft",))
    assert "eyeBlinkLeft" in (largest_unsaid(both, changed(one, sentence=text), ()) or "")


def test_the_sum_at_one_place_is_the_largest_movement_and_other_millimetres_are_not():
    deltas = NAMELESS.deltas.copy()
    deltas[0] = -0.4 * deltas[3]
    rig = replace(NAMELESS, deltas=deltas)
    (shot, *_) = packed(rig).expressions
    names = (rig.names[0], rig.names[3])
    both = changed(shot, blendshapes=names, sentence=sentence(rig, names))
    assert " down and back by 23 mm" in both.sentence
    assert largest_unsaid(rig, both, ()) is None
    assert largest_unsaid(rig, changed(both, sentence=both.sentence.replace("23", "12")), ()) is not None


def test_a_jaw_without_a_name_is_told_with_its_millimetres_wherever_its_skin_is_counted():
    deltas = NAMELESS.deltas * np.float32(1)
    text = sentence(replace(NAMELESS, deltas=deltas), (NAMELESS.names[NAMES.index("jawOpen")],))
    assert text == "Match the picture: move your jaw down and back by 39 mm."


def test_a_corrective_without_a_name_is_told_as_it_is_performed():
    text = sentence(NAMELESS, (NAMELESS.names[NAMES.index("mouthClose")],))
    assert " down" in text
    assert " up" not in text


def test_lips_open_with_the_jaw_and_close_with_the_corrective_on_it():
    assert lips_apart(RIG, ("jawOpen",)) > 20
    assert lips_apart(RIG, ("jawOpen", "mouthClose")) == pytest.approx(0, abs=1)
    assert lips_apart(RIG, ("browInnerUp",)) == pytest.approx(0, abs=0.1)


@pytest.mark.parametrize("share", [0.3, 0.6])
def test_a_mouth_close_that_leaves_the_lips_open_says_so(share):
    rig = leaving_lips_open(share)
    gap = stays_open(rig, ("mouthClose",))
    assert gap == pytest.approx(share * lips_apart(RIG, ("jawOpen",)), rel=0.1)
    text = sentence(rig, ("mouthClose",))
    assert f"still {gap:.0f} mm apart" in text
    assert "closed" not in text
    assert "do not let the lips part" not in mistakes(rig, ("mouthClose",))


def test_a_mouth_close_that_closes_is_said_as_ever():
    assert stays_open(RIG, ("mouthClose",)) is None


def test_a_vowel_that_opens_the_jaw_too_is_not_added_to_it():
    vowel = 0.9 * RIG.deltas[[RIG.names.index("jawOpen")]]
    rig = replace(RIG, names=("viseme_aa", *RIG.names), deltas=np.concatenate([vowel, RIG.deltas]))
    assert arkit_by_motion(rig, "viseme_aa") == "jawOpen"
    assert rig.names[open_jaw(rig)] == "jawOpen"
    assert stays_open(rig, ("mouthClose",)) is None
    assert sentence(RIG, ("mouthClose",)) == "Lower your jaw but keep your lips closed."


def test_closed_lips_that_are_open_in_the_pose_are_caught():
    packing = packed(RIG)
    (shot,) = [one for one in packing.expressions if "mouthClose" in one.blendshapes]
    assert open_lips_unsaid(RIG, shot) is None
    assert "its pose they stand" in (open_lips_unsaid(leaving_lips_open(0.5), shot) or "")


def test_a_second_shape_that_parts_the_lips_opens_no_pose_that_it_has_no_part_in():
    parts = 0.25 * RIG.deltas[[RIG.names.index("jawOpen")]]
    rig = replace(RIG, names=("mouthOpen", *RIG.names), deltas=np.concatenate([parts, RIG.deltas]))
    (shot,) = [one for one in packed(RIG).expressions if "mouthClose" in one.blendshapes]
    assert arkit_by_motion(rig, "mouthOpen") == "jawOpen"
    assert open_lips_unsaid(rig, shot) is None
    half = leaving_lips_open(0.5)
    open_half = replace(half, names=rig.names, deltas=np.concatenate([parts, half.deltas]))
    assert "its pose they stand" in (open_lips_unsaid(open_half, changed(shot, drivers=())) or "")
