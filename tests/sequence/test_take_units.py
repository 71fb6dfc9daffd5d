"""Action units in words, as trackers write them, drive ARKit's nearest; parts of one movement never sum above 1."""

from collections import defaultdict

import pytest

from capture_plan.sample import sample_rig
from capture_plan.sequence import map_weights

NAMES = sample_rig().names
UNITS = """inner_brow_raiser=browInnerUp outer_brow_raiser=browOuterUp brow_lowerer=browDown upper_lid_raiser=eyeWide
    lid_tightener=eyeSquint cheek_raiser=cheekSquint nose_wrinkler=noseSneer upper_lip_raiser=mouthUpperUp
    lip_corner_puller=mouthSmile dimpler=mouthDimple lip_corner_depressor=mouthFrown lip_stretcher=mouthStretch
    lower_lip_depressor=mouthLowerDown lip_pucker=mouthPucker lip_funneler=mouthFunnel lip_pressor=mouthPress
    jaw_drop=jawOpen jaw_thrust=jawForward cheek_puff=cheekPuff eyes_closed=eyeBlink eyes_look_up=eyeLookUp"""
QUARTERS = [f"_{side}{lip}" for side in "LR" for lip in "TB"]
SPELLINGS = [
    lambda words, end: "_".join(word.capitalize() for word in words) + end,
    lambda words, end: "".join(word.capitalize() for word in words) + end,
    lambda words, end: "_".join(words) + end.lower(),
    lambda words, end: "face." + "_".join(words) + end,
]


def driven(columns):
    found = defaultdict(dict)
    for one in map_weights(columns, NAMES).drives:
        found[one.blendshape][one.column] = one.share
    return dict(found)


@pytest.mark.parametrize("spelled", SPELLINGS)
@pytest.mark.parametrize("unit", UNITS.split())
def test_a_unit_in_words_drives_its_nearest_on_its_own_side(unit, spelled):
    words, _, base = unit.partition("=")
    for side, end in (("Left", "_L"), ("Right", "_R")):
        (one,) = driven([spelled(words.split("_"), end), "jawOpen" if base != "jawOpen" else "jawLeft"]).keys() - {
            "jawOpen" if base != "jawOpen" else "jawLeft"
        }
        assert one in (base, base + side)


def test_jaw_mouth_and_eyes_go_to_the_subjects_own_side():
    assert {*driven(["Jaw_Sideways_Left", "Mouth_Right"])} == {"jawLeft", "mouthRight"}
    assert {*driven(["Eyes_Look_Left_L", "Eyes_Look_Left_R"])} == {"eyeLookOutLeft", "eyeLookInRight"}


def test_ends_of_names_say_the_lip_where_the_other_end_is_there():
    found = driven([f"Lip_Suck{end}" for end in QUARTERS] + ["Chin_Raiser_B", "Chin_Raiser_T"])
    assert found == {
        "mouthRollUpper": {"Lip_Suck_LT": 0.5, "Lip_Suck_RT": 0.5},
        "mouthRollLower": {"Lip_Suck_LB": 0.5, "Lip_Suck_RB": 0.5},
        "mouthShrugLower": {"Chin_Raiser_B": 1},
        "mouthShrugUpper": {"Chin_Raiser_T": 1},
    }
    assert {*driven(["smile_lt", "smile_rt"])} == {"mouthSmileLeft", "mouthSmileRight"}


@pytest.mark.parametrize(
    "columns",
    [
        [f"Lip_Funneler{end}" for end in QUARTERS],
        ["Lip_Funneler", *(f"Lip_Funneler{end}" for end in QUARTERS)],
        ["Lip_Pucker_L", "Lip_Pucker_R", "kiss", "mouth_pucker_L"],
        ["Cheek_Puff_L", "Cheek_Puff_R", "cheekPuff"],
        ["AU1", "Inner_Brow_Raiser_L", "Inner_Brow_Raiser_R", "brows_midBrows_up"],
        [f"CTRL_expressions_mouthFunnel{q}" for q in ("UL", "UR", "DL", "DR")] + ["funnel_L"],
        [unit.partition("=")[0] + end for unit in UNITS.split() for end in ("", "_L", "_R", *QUARTERS)],
    ],
)
def test_columns_of_one_movement_never_sum_above_a_full_weight(columns):
    for several in (columns, columns[::-1]):
        for shares in driven(several).values():
            assert sum(shares.values()) <= 1 + 1e-9


def test_four_quarters_of_one_movement_drive_it_by_their_mean():
    assert driven([f"Lip_Funneler{end}" for end in QUARTERS])["mouthFunnel"] == {
        f"Lip_Funneler{end}": 0.25 for end in QUARTERS
    }


def test_what_the_rig_has_no_shape_for_is_named_as_driving_nothing():
    mapping = map_weights([*"AIUEO", "Blink_L", "Blink_R"], NAMES)
    assert {column for column, _ in mapping.left_out} == set("AIUEO")
