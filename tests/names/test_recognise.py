"""Names in five standards, the user's own map, and what recorded weights drive by them."""

import re

import pytest

from capture_plan.errors import RigError
from capture_plan.names.name_map import NameMap, read_name_map
from capture_plan.names.recognise import _data, recognise, recognise_all, slider_pairs
from capture_plan.sample import sample_rig
from capture_plan.sequence import map_weights


@pytest.mark.parametrize(
    ("name", "standard", "called", "side", "words"),
    [
        ("eyeBlink_L", "ARKit", "eyeBlinkLeft", "left", "eye closed (left)"),
        ("JawOpen", "ARKit", "jawOpen", None, "jaw opened"),
        ("cheekPuff_R", "ARKit", "cheekPuffRight", "right", "cheeks puffed with air (right)"),
        ("AU12", "FACS", "AU12", None, "lip corner puller"),
        ("AU12L", "FACS", "AU12", "left", "lip corner puller (left)"),
        ("au_12_l", "FACS", "AU12", "left", "lip corner puller (left)"),
        ("face.AU_04_right", "FACS", "AU4", "right", "brow lowerer (right)"),
        ("L_AU6", "FACS", "AU6", "left", "cheek raiser (left)"),
        ("CTRL_expressions_mouthFunnelUL", "MetaHuman", "mouthFunnelUL", "left", "mouth funnel (upper left)"),
        ("CTRL_expressions_eyeLookLeftR", "MetaHuman", "eyeLookLeftR", "right", "eye look left (right)"),
        ("CTRL_expressions_mouthLeft", "MetaHuman", "mouthLeft", None, "mouth left"),
        ("CTRL_expressions_mouthStickyUINR", "MetaHuman", "mouthStickyUINR", "right", "(upper inner right)"),
        ("Blink_L", "VRM", "blinkLeft", "left", "left eye closed"),
        ("lookLeft", "VRM", "lookLeft", None, "both eyes look to the subject's left"),
        ("joy", "VRM", "happy", None, "happy face"),
        ("Expressions_mouthSmile_max", "MB-Lab", "mouthSmile_max", None, "mouth smile, upper end of its slider"),
        ("Fcl_EYE_Close_L", "VRoid", "Fcl_EYE_Close", "left", "eye closed (left)"),
        ("Face.Fcl_ALL_Joy", "VRoid", "Fcl_ALL_Joy", None, "happy face"),
        ("viseme_PP", "Visemes", "viseme_PP", None, "as in p"),
        ("vrc.v_ou", "Visemes", "viseme_ou", None, "lips puckered"),
        ("V_Open", "Reallusion", "V_Open", None, "mouth says ah"),
        ("Eye_L_Look_R", "Reallusion", "Eye_L_Look_R", "left", "towards the nose (left)"),
        ("Mouth_L", "Reallusion", "Mouth_L", None, "subject's left"),
        ("Brow_Raise_Inner_R", "Reallusion", "Brow_Raise_Inner", "right", "inner brow raised (right)"),
        ("PHMEyesClosedL", "Daz", "PHMEyesClosed", "left", "eye closed (left)"),
        ("ウィンク", "MikuMikuDance", "ウィンク", "left", "eye closed (left)"),
        ("ｳｨﾝｸ２右", "MikuMikuDance", "ウィンク2右", "right", "eye closed (right)"),
        ("口角上げ", "MikuMikuDance", "口角上げ", None, "corner pulled up"),
        ("BrowsD_R", "Faceshift", "BrowsD", "right", "brow lowered"),
        ("Eye_Right_Left", "Unified Expressions", "Eye_Right_Left", "right", "towards the nose"),
        ("l_smile", "plain words", "l_smile", "left", "corner pulled up (left)"),
        ("左目を閉じる", "plain words", "左目を閉じる", "left", "eye closed (left)"),
        ("puff", "plain words", "puff", None, "cheek moves"),
        ("Expressions_eyeClosedL_min", "MB-Lab", "eyeClosedL_min", "left", "eye closed (left), lower end"),
    ],
)
def test_a_name_is_told_in_its_standard_and_in_plain_words(name, standard, called, side, words):
    found = recognise(name)
    assert found is not None
    assert (found.standard, found.name, found.side) == (standard, called, side)
    assert words in found.words


@pytest.mark.parametrize("name", ["", "shape_12", "AU99", "au4_au7", "target_43", "上", "browser", "gaugeau12x"])
def test_what_no_standard_knows_is_not_recognised(name):
    assert recognise(name) is None


def test_left_and_right_names_mean_the_same_on_other_sides():
    for name in ("eyeBlink_L", "AU12L", "CTRL_expressions_mouthPressUL", "Blink_L", "Expressions_eyeClosedL_max"):
        left, right = recognise(name), recognise(re.sub("L(?=_max|$)", "R", name))
        assert left is not None
        assert right is not None
        assert (left.side, right.side) == ("left", "right")
        assert left.words.replace("left", "right") == right.words


def test_a_standards_own_spelling_is_surer_than_a_house_spelling_than_a_shared_word():
    sure = [found.confidence for name in ("AU12L", "au_12_l", "happy", "brow_max") if (found := recognise(name))]
    assert sure == sorted(sure, reverse=True)
    assert len(set(sure)) == 4


def test_the_eye_that_looks_left_looks_out_on_the_left_and_in_on_the_right():
    named = [recognise(f"CTRL_expressions_eyeLook{way}{side}") for way in ("Left", "Right") for side in "LR"]
    near = [found.arkit[0] for found in named if found]
    assert near == ["eyeLookOutLeft", "eyeLookInRight", "eyeLookInLeft", "eyeLookOutRight"]


def test_names_of_houses_and_words_drive_and_are_driven_by_their_nearest():
    assert shares(["eyeBlinkLeft", "jawOpen"], ["Fcl_EYE_Close_L", "Fcl_EYE_Close_R", "Fcl_MTH_A"]) == {
        ("eyeBlinkLeft", "Fcl_EYE_Close_L"): 1.0,
        ("jawOpen", "Fcl_MTH_A"): 1.0,
    }
    assert shares(["mouthSmileLeft", "mouthSmileRight"], ["口角上げ"]) == {
        ("mouthSmileLeft", "口角上げ"): 0.5,
        ("mouthSmileRight", "口角上げ"): 0.5,
    }


def test_two_names_of_one_movement_are_not_both_driven():
    assert shares(["jawOpen"], ["mouthOpen", "あ", "Merged_Open_Mouth"]) == {("jawOpen", "mouthOpen"): 1.0}


def test_every_name_of_a_house_is_told_and_its_nearest_is_arkits():
    for names in _data("houses").values():
        for own in names:
            found = recognise_all([*names])[own]
            assert found is not None
            assert found.standard in (*_data("houses"), "ARKit", "VRM") or len(own) == 1
            assert set(found.arkit) <= set(sample_rig().names) | {"browInnerUpLeft", "browInnerUpRight"}


def test_letters_are_visemes_only_beside_their_family():
    assert recognise("A") == recognise_all(["A", "B"])["A"]
    message = recognise_all(list("AIUEO"))
    assert all(one and one.words.startswith("mouth") for one in message.values())


def test_openface_writes_r_for_regressed_unless_there_is_an_l():
    alone, beside = recognise_all(["AU12_r"]), recognise_all(["AU12_r", "AU12_l"])
    assert [found["AU12_r"].side for found in (alone, beside) if found["AU12_r"]] == [None, "right"]


def test_the_ends_of_a_slider_are_paired():
    names = ["Expressions_mouthSmile_max", "Expressions_mouthSmile_min", "Expressions_tongueTipUp_max"]
    assert slider_pairs(names) == (("Expressions_mouthSmile_min", "Expressions_mouthSmile_max"),)


def test_the_users_map_wins(tmp_path):
    path = tmp_path / "names.toml"
    path.write_text('[names]\n"jawOpen" = "AU12L"\n"x" = "left ear up"\n[weights]\n"AU25_r" = "jawOpen"\n"b" = ""\n')
    mine = read_name_map(path)
    messages = [recognise(name, mine=mine) for name in ("jawOpen", "x")]
    assert [(found.standard, found.side, found.confidence) for found in messages if found] == [
        ("FACS", "left", 1.0),
        ("yours", "left", 1.0),
    ]
    mapping = map_weights(["AU25_r", "b", "jawOpen"], ["jawOpen"], mine=mine)
    assert [(one.column, one.how, one.share) for one in mapping.drives] == [("AU25_r", "by your name map", 0.2)]
    assert mapping.left_out == (
        ("b", "your name map says so"),
        ("jawOpen", "jawOpen is driven by another column already"),
    )


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("x", "is not TOML"),
        ("[other]", "has 'other', expected"),
        ("names = 3", "'names' is no table"),
        ("[names]\na = 3", "'a' is 3, expected a name in quotes"),
        ('[weights]\na = ["b"]', "expected a blendshape in quotes"),
        ("[weights]\na = { b = nan }", "expected a blendshape in quotes"),
    ],
)
def test_a_map_that_is_none_is_refused(tmp_path, text, says):
    (tmp_path / "names.toml").write_text(text)
    with pytest.raises(RigError, match=says):
        read_name_map(tmp_path / "names.toml")


def shares(columns, names):
    return {(one.column, one.blendshape): round(one.share, 3) for one in map_weights(columns, names).drives}


def test_every_spelling_of_the_52_drives_the_52():
    names = sample_rig().names
    live_link = [name[0].upper() + name[1:] for name in names]
    assert shares(live_link, names) == {(a, b): 1.0 for a, b in zip(live_link, names, strict=True)}


def test_a_whole_drives_both_halves_and_halves_drive_the_whole_by_half():
    assert shares(["CheekPuff"], ["cheekPuff_L", "cheekPuff_R"]) == {
        ("CheekPuff", "cheekPuff_L"): 1.0,
        ("CheekPuff", "cheekPuff_R"): 1.0,
    }
    assert set(shares(["cheekPuff_L", "cheekPuff_R"], ["cheekPuff"]).values()) == {0.5}
    lips = [f"CTRL_expressions_mouthFunnel{quadrant}" for quadrant in ("UL", "UR", "DL", "DR")]
    assert shares(lips, ["mouthFunnel"]) == {(name, "mouthFunnel"): 0.25 for name in lips}


def test_action_units_drive_their_own_before_the_nearest():
    assert shares(["AU12_r"], ["AU12L", "AU12R", "mouthSmileLeft"]) == {
        ("AU12_r", "AU12L"): 0.2,
        ("AU12_r", "AU12R"): 0.2,
    }
    assert shares(["AU12_r"], ["mouthSmile_L", "mouthSmile_R"]) == {
        ("AU12_r", "mouthSmile_L"): 0.2,
        ("AU12_r", "mouthSmile_R"): 0.2,
    }


def test_sides_are_never_crossed():
    assert shares(["eyeBlinkLeft", "AU12L"], ["eyeBlink_R", "eyeBlink_L", "AU12R", "AU12L"]) == {
        ("eyeBlinkLeft", "eyeBlink_L"): 1.0,
        ("AU12L", "AU12L"): 1.0,
    }


def test_every_column_is_told_and_every_idle_blendshape():
    mapping = map_weights(["JawOpen", "HeadYaw", "AU25_r", "q"], ["jawOpen", "tongueOut"])
    assert {column for column, _ in mapping.left_out} == {"HeadYaw", "AU25_r", "q"}
    assert mapping.idle == ("tongueOut",)
    for message in ("JawOpen  drives jawOpen", "HeadYaw is left out", "lips part", "nothing drives tongueOut"):
        assert message in mapping.text()


def test_a_map_to_a_blendshape_that_is_not_there_is_refused():
    with pytest.raises(RigError, match="lets 'a' drive 'b', which the rig does not have"):
        map_weights(["a"], ["jawOpen"], mine=NameMap(weights={"a": {"b": 1.0}}))
