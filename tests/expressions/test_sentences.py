"""Sentences for the actor."""

import re
from dataclasses import replace

import numpy as np
import pytest

from capture_plan.expressions.compatibility import base_name
from capture_plan.expressions.groups import grouped, said_as_one
from capture_plan.expressions.movement import _Movement, _one_place, movements
from capture_plan.expressions.pack import pack
from capture_plan.expressions.sentences import from_rest, mistakes, movements_in_words, phrases, sentence, spoken
from capture_plan.expressions.settings import PackingSettings
from capture_plan.sample import sample_rig

RIG = sample_rig()


def unnamed(rig=RIG):
    return replace(rig, names=tuple(f"shape{k}" for k in range(len(rig.names))))


def unnamed_name(name):
    return f"shape{RIG.names.index(name)}"


def test_no_sentence_of_the_sample_names_a_blendshape_or_an_emotion():
    for expression in pack(RIG, RIG.names, PackingSettings()).expressions:
        assert re.fullmatch(r"[A-Z][a-z,. A-Z-]+\.", expression.sentence)
        assert not re.search(r"[a-z][A-Z]|frown|sad|angry|AU\d|pictur", expression.sentence), expression.sentence


@pytest.mark.parametrize("name", RIG.names)
def test_every_arkit_blendshape_has_words(name):
    assert sentence(RIG, (name,)).endswith(".")
    assert "icture" not in sentence(RIG, (name,))


@pytest.mark.parametrize("side", ["Left", "Right"])
def test_one_side_is_the_actors_own(side):
    assert sentence(RIG, (f"eyeBlink{side}",)) == f"Close your {side.lower()} eye."


def test_left_and_right_become_both():
    assert sentence(RIG, ("browDownLeft", "browDownRight")) == "Pull both eyebrows down."


def test_the_order_of_blendshapes_does_not_change_the_sentence():
    names = ("jawOpen", "eyeBlinkLeft", "browInnerUp", "eyeBlinkRight")
    assert sentence(RIG, names) == sentence(RIG, names[::-1])
    assert sentence(RIG, names) == "Raise the inner ends of your eyebrows, close your eyes and open your jaw wide."


def test_what_belongs_together_is_said_in_one_phrase():
    assert spoken(("eyeLookInRight", "eyeLookOutLeft")) == ("look to your left with your eyes only",)
    assert spoken(("mouthRollLower", "mouthRollUpper")) == ("roll both lips in over your teeth",)


def test_where_a_mouth_moves_is_no_side_of_the_face():
    assert spoken(("jawLeft",)) == ("slide your lower jaw to your left",)
    assert spoken(("mouthLeft", "jawRight")) == ("slide your lower jaw to your right", "slide your mouth to your left")


def test_many_clauses_become_two_sentences():
    names = ("browInnerUp", "eyeBlinkLeft", "eyeBlinkRight", "noseSneerLeft", "noseSneerRight", "jawOpen")
    assert sentence(RIG, names).count(".") == 2
    assert ". At the same time " in sentence(RIG, names)


def test_every_phrase_can_be_said_and_every_merged_name_is_known():
    table, together = phrases()
    assert all(phrase["both"][0].islower() and not phrase["both"].endswith(".") for phrase in table.values())
    assert all("{side}" in phrase["one"] for phrase in table.values() if "one" in phrase)
    assert all(name in RIG.names for names, _ in together for name in names)


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("jawOpen", r"your (chin|lower lip|jaw) down( and back)? by \d+ mm"),
        ("mouthSmileLeft", r"your left mouth corner up and outwards( and back)? by \d+ mm"),
        ("browOuterUpRight", r"your right brow up.* by \d+ mm"),
        ("browInnerUp", r"(both brows|your forehead) up.* by \d+ mm"),
    ],
)
def test_unknown_names_are_described_by_place_way_and_millimetres(name, said):
    text = sentence(unnamed(), (unnamed_name(name),))
    assert text.startswith("Match the picture: move ")
    assert re.search(said, text), text


def test_mirrored_halves_without_names_are_told_as_one():
    (message,) = movements(unnamed(), (unnamed_name("mouthSmileLeft"), unnamed_name("mouthSmileRight")))
    assert message.startswith("both mouth corners up")


def replaced(**sums):
    """The sample without names, and the first blendshapes replaced by weighted sums of its own, by new names."""
    deltas = RIG.deltas.copy()
    for k, weights in enumerate(sums.values()):
        deltas[k] = sum(w * RIG.deltas[RIG.names.index(name)] for name, w in weights.items())
    return replace(unnamed(), deltas=deltas, names=(*sums, *unnamed().names[len(sums) :]))


BROWS = {"browDownLeft": 1, "browDownRight": 1}


@pytest.mark.parametrize("share", [-0.5, 0.5, -2])
def test_what_moves_one_place_is_told_once_as_its_sum(share):
    rig = replaced(one=BROWS, two={name: share for name in BROWS}, both={name: 1 + share for name in BROWS})
    (message,) = movements(rig, ("one", "two"))
    assert message == movements(rig, ("two", "one"))[0] == movements(rig, ("both",))[0]
    assert movements(rig, ("shape9", "one")) == (*movements(rig, ("shape9",)), *movements(rig, ("one",)))


def test_movements_that_undo_each_other_are_no_movement():
    rig = replaced(one=BROWS, two={name: -1 for name in BROWS})
    assert movements(rig, ("one", "two")) == ()


def test_a_phrase_is_left_out_where_something_moves_its_place_the_other_way():
    rig = replaced(browDownLeft={"browDownLeft": 1}, browDownRight={"browDownRight": 1}, it=dict.fromkeys(BROWS, -0.3))
    assert sentence(rig, tuple(BROWS)) == "Pull both eyebrows down."
    text = sentence(rig, (*BROWS, "it"))
    assert not re.search(r"Pull| up", text), text
    assert text.count("brow") == 1
    assert " down" in text


def test_brows_are_told_by_their_motion_where_their_name_says_the_other_way():
    rig = replaced(brow_smile_2=BROWS)
    assert " down" in sentence(rig, ("brow_smile_2",))
    assert not re.search(r"[Rr]aise| up", sentence(rig, ("brow_smile_2",)))


def test_mirroring_the_face_exchanges_the_sides_of_a_description():
    flip = np.array([-1, 1, 1])
    mirrored = replace(
        unnamed(),
        neutral=RIG.neutral * flip,
        deltas=RIG.deltas * flip.astype(np.float32),
        triangles=RIG.triangles[:, ::-1].copy(),
    )
    name = (unnamed_name("mouthSmileLeft"),)
    assert movements(mirrored, name)[0] == movements(unnamed(), name)[0].replace("left", "right")


def test_twice_the_movement_is_twice_the_millimetres():
    name = (unnamed_name("mouthSmileLeft"),)
    far = [
        int(re.search(r"(\d+) mm", movements(rig, name)[0])[1])
        for rig in (unnamed(), replace(unnamed(), deltas=2 * RIG.deltas))
    ]
    assert far[1] == pytest.approx(2 * far[0], abs=1)


def test_what_moves_no_skin_is_left_to_the_picture():
    still = replace(unnamed(), deltas=RIG.deltas * ~RIG.skin[:, None])
    assert sentence(still, ("shape0",)) == "Match the picture."


def test_every_expression_starts_from_a_relaxed_face():
    assert from_rest("Close your eyes.") == "From a relaxed face: close your eyes."


def test_a_warning_never_forbids_what_the_expression_asks_for():
    table, _ = phrases()
    for base, entry in table.items():
        for other in entry.get("unless", ()):
            assert other in {base_name(name) for name in RIG.names}
            names = tuple(name for name in RIG.names if base_name(name) in (base, other))
            assert entry["mistake"] not in mistakes(RIG, names)
    assert mistakes(RIG, ("mouthUpperUpLeft", "mouthUpperUpRight")) == ("do not open the jaw",)


@pytest.mark.parametrize("name", RIG.names)
def test_every_movement_has_one_warning_at_most_and_is_told_once(name):
    assert len(mistakes(RIG, (name,))) <= 1
    assert len(movements_in_words(RIG, (name,))) == 1


def test_both_lips_rolled_in_are_one_movement_and_others_are_not():
    assert said_as_one(RIG, ("mouthRollLower", "mouthRollUpper"))
    assert not said_as_one(RIG, ("mouthRollLower", "mouthShrugUpper"))
    assert not said_as_one(RIG, ("eyeBlinkLeft", "eyeBlinkRight"))


def test_movements_keep_partners_and_one_phrase_together_in_any_order():
    names = ("mouthRollUpper", "jawOpen", "browDownRight", "mouthRollLower", "browDownLeft")
    groups = grouped(RIG, names)
    assert groups == (("mouthRollUpper", "mouthRollLower"), ("jawOpen",), ("browDownRight", "browDownLeft"))
    assert {frozenset(group) for group in grouped(RIG, names[::-1])} == {frozenset(group) for group in groups}


def mixed(**weights):
    """The sample with one nameless blendshape more, a sum of its own."""
    rig = sample_rig()
    delta = sum(w * rig.deltas[rig.names.index(name)] for name, w in weights.items())
    return replace(
        rig, names=(*rig.names, "shape"), deltas=np.concatenate([rig.deltas, delta[None]]).astype(np.float32)
    )


@pytest.mark.parametrize(("sign", "inner", "outer"), [(1, "up", "down"), (-1, "down", "up")])
def test_brows_whose_ends_go_opposite_ways_are_told_by_their_ends(sign, inner, outer):
    tilted = mixed(browInnerUp=0.7 * sign, browOuterUpLeft=-sign, browOuterUpRight=-sign)
    (message,) = movements(tilted, ("shape",))
    assert message.startswith(f"both brows {inner} at the inner end and {outer} at the outer end by ")


def test_lips_that_part_while_no_jaw_goes_down_are_told():
    parted = mixed(mouthUpperUpLeft=1.5, mouthUpperUpRight=1.5)
    message = movements(parted, ("shape",))
    assert any(words.startswith("your lips apart by ") for words in message)
    assert not any("apart" in words for words in movements(parted, ("jawOpen",)))


@pytest.mark.parametrize(
    ("one", "other", "same"),
    [
        (("brow", 0, "up"), ("brow", 1, "down"), True),
        (("brow", -1, "up"), ("brow", 1, "up"), False),
        (("jaw", 0, "down"), ("lower lip", 0, "up"), True),
        (("jaw", 0, "down"), ("chin", 1, "up"), True),
        (("jaw", 0, "down"), ("lower lip", 0, "down"), False),
        (("jaw", 0, "down"), ("upper lip", 0, "up"), False),
        (("chin", 0, "down"), ("lower lip", 0, "up"), False),
        (("brow", 0, "up"), ("cheek", 0, "down"), False),
    ],
)
def test_movements_are_seen_at_one_place_where_region_and_side_are_shared_or_a_lip_goes_against_the_jaw(
    one, other, same
):
    a, b = (_Movement(region, side, (way,), 5.0) for region, side, way in (one, other))
    assert _one_place(a, b) == _one_place(b, a) == same


def test_lips_that_part_are_told_without_a_jaw_that_has_a_name():
    parts = {"mouthUpperUpLeft": 1.5, "mouthUpperUpRight": 1.5, "mouthLowerDownLeft": 1.5, "mouthLowerDownRight": 1.5}
    parted = mixed(**parts)
    rows = [k for k, name in enumerate(parted.names) if not name.startswith("jaw")]
    nameless = replace(
        parted, names=tuple("shape" if k == rows[-1] else f"t{k}" for k in rows), deltas=parted.deltas[rows]
    )
    for rig in (parted, nameless):
        assert any(words.startswith("your lips apart by ") for words in movements(rig, ("shape",)))


def test_no_movement_of_the_lips_is_measured_by_teeth_that_the_picture_may_not_show():
    """Rigs have teeth or none, and lips that bare them or do not: the actor is told how far by the picture."""
    lips = [f"mouth{way}{side}" for way in ("UpperUp", "LowerDown") for side in ("Left", "Right")]
    for names in (lips[:2], lips[2:], lips):
        assert "teeth" not in " ".join(spoken(tuple(names)))
