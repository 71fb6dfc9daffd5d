"""Which movement a name says: tables of names as the field's rigs have them, and words that only look alike."""

import time

import pytest

from capture_plan.names.movements import KINDS, _phrases, movement_of, movements_of
from capture_plan.names.tokens import split_words
from capture_plan.sample import sample_rig

TOLD = {
    "VRoid": """Fcl_ALL_Neutral=neutral Fcl_ALL_Joy=emotion Fcl_ALL_Surprised=emotion Fcl_BRW_Angry=brow_down
        Fcl_BRW_Joy=brow_up Fcl_EYE_Close=blink Fcl_EYE_Close_L=blink/left
        Fcl_EYE_Spread=eye_wide Fcl_EYE_Iris_Hide=hide_or_shrink Fcl_MTH_Close=mouth_close
        Fcl_MTH_Large=mouth_open Fcl_MTH_Small=mouth_narrow Fcl_MTH_A=mouth_open
        Fcl_MTH_I=mouth_wide Fcl_MTH_U=mouth_narrow Fcl_MTH_Sorrow=frown Fcl_MTH_Fun=smile
        Fcl_MTH_SkinFung_R=teeth/right Fcl_HA_Hide=hide_or_shrink Fcl_HA_Fung1_Low=teeth
        Fcl_HA_Short_Up=teeth""",
    "Reallusion": """Brow_Raise_Inner_L=brow_up/left Brow_Drop_R=brow_down/right Brow_Compress_L=brow_down/left
        Eye_Blink_L=blink/left Eyes_Blink=blink Eye_Wide_R=eye_wide/right
        Eye_Squint_L=eye_squint/left Eye_L_Look_R=gaze_right/left Eye_R_Look_Up=gaze_up/right
        Eyelash_Upper_Up_L=- Nose_Nostril_Raise_L=nose/left Cheek_Raise_L=cheek/left
        Mouth_Smile_Sharp_L=smile/left Mouth_Frown_R=frown/right Mouth_Pucker_Open=mouth_narrow
        Mouth_Roll_In_Upper_L=lip_roll/left Mouth_L=mouth_side Mouth_Upper_R=mouth_side
        Mouth_Up_Upper_L=lip_up/left Mouth_Down_Lower_R=lip_down/right Mouth_Chin_Up=mouth_other
        Mouth_Top_Lip_Under=lip_roll Jaw_Open=jaw_open Jaw_L=jaw_side Turn_Jaw_Down=jaw_open
        Merged_Open_Mouth=mouth_open Head_Turn_L=head_turn Neck_Swallow_Up=- V_Open=mouth_open
        V_Explosive=lip_press V_Tight_O=mouth_narrow V_Tongue_up=tongue
        A14_Eye_Blink_Left=blink/left""",
    "Daz": """eCTRLMouthSmile=smile PHMEyesClosedL=blink/left PHMMouthOpen=mouth_open eCTRLvAA=mouth_open
        eCTRLvEE=mouth_wide facs_bs_EyeBlinkLeft_div2=blink/left eJCMLeftShldrUp=body/left
        pJCMThighFwd=body Genesis8Female__eCTRLEyesClosedR=blink/right""",
    "MikuMikuDance": """まばたき=blink ウィンク=blink/left ウィンク右=blink/right
        ウィンク２=blink/left ｳｨﾝｸ２右=blink/right 笑い=blink
        びっくり=eye_wide じと目=eye_squint あ=mouth_open い=mouth_wide う=mouth_narrow お=mouth_open
        口角上げ=smile 口角下げ=frown にやり=smile 真面目=brow_down 困る=brow_up 怒り=brow_down 上=brow_up
        下=brow_down ぺろっ=tongue 照れ=emotion 瞳小=pupil 髪影消=hide_or_shrink""",
    "Chinese": """眨眼=blink 左眼闭=blink/left 张嘴=mouth_open 微笑=smile 愤怒=emotion 皱眉=brow_down 挑眉=brow_up
        嘟嘴=mouth_narrow 鼓腮=cheek 吐舌=tongue 嘴角上扬=smile""",
    "Korean": "눈감기=blink 미소=smile 윙크=blink 입벌리기=mouth_open 화남=emotion",
    "plain": """l_smile=smile/left brow_raise=brow_up puff=cheek MouthOpen=mouth_open EyesClosed=blink
        Happy=emotion blink_right=blink/right Smile.L=smile/left jawOpen.001=jaw_open
        mouthopen=mouth_open browup=brow_up Hide_hat=hide_or_shrink Shrink_body=hide_or_shrink
        kisekae_skirt=hide_or_shrink hat_up=hair_or_clothes Chest_expand=body breathe=body
        head_left=head_turn eyes_look_left=gaze_left""",
    "prefixed": """blendShape1.jawOpen=jaw_open head_geo:JawOpen=jaw_open Wolf3D_Head.mouthSmile=smile
        face.M_Smile_L=smile/left head__eyeBlink_L=blink/left
        head_lod0_mesh__brow_down_L=brow_down/left
        head_lod0_mesh__mouth_cornerPull_R=smile/right Beard.jawOpen=jaw_open""",
    "Mixamo": """Blink_Left=blink/left BrowsDown_Left=brow_down/left BrowsIn_Right=brow_down/right
        BrowsOuterLower_Left=brow_down/left EyesWide_Left=eye_wide/left Frown_Left=frown/left
        JawBackward=jaw_forward JawRotateY_Left=jaw_side Jaw_Down=jaw_open
        LowerLipDown_Left=lip_down/left LowerLipIn=lip_roll Midmouth_Left=mouth_side
        MouthNarrow_Left=mouth_narrow/left NoseScrunch_Left=nose/left
        Squint_Right=eye_squint/right TongueUp=tongue UpperLipUp_Left=lip_up/left""",
    "Ready Player Me": """eyesClosed=blink eyesLookUp=gaze_up
        eyesLookDown=gaze_down mouthOpen=mouth_open mouthSmile=smile
        viseme_sil=neutral viseme_PP=lip_press viseme_FF=lip_roll viseme_aa=mouth_open
        viseme_R=mouth_other viseme_U=mouth_narrow""",
    "Faceshift": """EyeBlink_L=blink/left BrowsD_L=brow_down/left BrowsU_C=brow_up BrowsU_R=brow_up/right
        EyeIn_L=gaze_in/left EyeUp_R=gaze_up/right EyeOpen_L=eye_wide/left
        ChinLowerRaise=mouth_other LipsFunnel=mouth_narrow LipsUpperOpen=mouth_open
        JawFwd=jaw_forward Sneer=nose Puff=cheek""",
    "VRChat": """vrc.v_aa=mouth_open vrc.v_ou=mouth_narrow vrc.v_pp=lip_press vrc.v_sil=neutral
        vrc.blink_left=blink/left Eye_Left_Blink=blink/left Eye_Left_Right=gaze_right/left
        Mouth_Sad_Left=frown/left Mouth_Upper_Inside=lip_roll EyeClosedRight=blink/right
        BrowLowererLeft=brow_down/left MouthCornerPullLeft=smile/left LipSuckUpper=lip_roll
        MouthTightenerLeft=lip_press/left CheekSuckLeft=cheek/left""",
    "MetaHuman": """CTRL_expressions_browRaiseInL=brow_up/left CTRL_expressions_eyeLookLeftL=gaze_left/left
        CTRL_expressions_eyeLookLeftR=gaze_left/right
        CTRL_expressions_mouthFunnelUL=mouth_narrow/left
        CTRL_expressions_jawChinRaiseDL=mouth_other/left CTRL_expressions_eyelashesUpINL=-
        CTRL_expressions_mouthUpperLipRaiseL=lip_up/left
        CTRL_expressions_mouthCornerDepressR=frown/right""",
    "MPEG-4": """open_jaw=jaw_open raise_l_cornerlip=smile/left close_t_l_eyelid=blink/left
        raise_l_i_eyebrow=brow_up/left puff_l_cheek=cheek/left
        stretch_r_cornerlip=mouth_wide/right""",
}


ALIKE = """browser eyelash Tearing earing Hatch target_43 target.43 shape_12 A L R exp_001 Chinese Nosedive handle Earth
    Armor headset Cheeky liposuction Bodyguard 0 _ あい マウス"""


def wanted(table):
    """(name, kind, side) of every entry of a table."""
    for entry in table.split():
        name, _, message = entry.partition("=")
        kind, _, side = message.replace("_", " ").partition("/")
        yield name, None if kind == "-" else kind, side or None


@pytest.mark.parametrize("standard", TOLD)
def test_names_of_every_standard_say_their_movement_and_side(standard):
    names = [name for name, _, _ in wanted(TOLD[standard])]
    found = movements_of(names)
    messages = [(name, one and one.kind, one.side if one else None) for name, one in zip(names, found, strict=True)]
    assert messages == list(wanted(TOLD[standard]))


def test_arkits_own_names_are_surest_and_none_is_unknown():
    found = movements_of(sample_rig().names)
    assert all(one and one.confidence == 1 for one in found)
    assert {one.kind for one in found if one} >= {"blink", "jaw open", "smile", "brow up", "mouth side", "tongue"}


@pytest.mark.parametrize(
    "name",
    ALIKE.split(),
)
def test_words_that_only_look_alike_say_nothing(name):
    assert movement_of(name) is None


def test_a_letter_is_a_viseme_only_beside_its_family():
    kinds = [one and one.kind for one in movements_of(["A", "I", "U", "E", "O", "Blink"])]
    assert kinds == ["mouth open", "mouth wide", "mouth narrow", "mouth wide", "mouth narrow", "blink"]
    assert movements_of(["A", "I", "Blink"])[:2] == (None, None)
    assert movements_of(list("ABCDEFGHIOU")) == (None,) * 11


def test_a_shared_prefix_says_nothing():
    names = ("jawOpen", "A", "I", "U", "E", "O", "smile_L")
    kinds = [one and one.kind for one in movements_of([f"hat_{name}" for name in names])]
    assert kinds == [one and one.kind for one in movements_of(names)]
    assert movements_of([f"target_{k}" for k in range(50)]) == (None,) * 50


@pytest.mark.parametrize(
    "names", ["Key,Key 1,Key 2", "smile,smile.001,smile.002", "Blink,Blink_L,Blink_R", "viseme,viseme_aa,viseme_oh"]
)
def test_a_name_that_is_the_shared_prefix_alone_says_what_it_says_by_itself(names):
    first, *_ = names = names.split(",")
    assert movements_of(names)[0] == movement_of(first)


def test_the_other_side_is_the_same_movement():
    for table in TOLD.values():
        for name, kind, side in wanted(table):
            if side == "left" and "_L" in name and "Look" not in name:
                other = movement_of(name.replace("_Left", "_Right").replace("_L", "_R"))
                assert other is not None
                assert (other.kind, other.side) == (kind, "right")


def test_where_a_jaw_goes_is_told_as_a_direction():
    found = [movement_of(name) for name in ("jawLeft", "Mouth_R", "Head_Turn_L")]
    assert [(one.side, one.towards) for one in found if one] == [(None, "left"), (None, "right"), (None, "left")]


def test_confidence_falls_with_what_is_not_explained():
    sure = [one.confidence for name in ("jawOpen", "Jaw_Down", "Jaw_Down_Zorp") if (one := movement_of(name))]
    assert sure == sorted(sure, reverse=True)
    assert len(set(sure)) == 3


def test_every_kind_is_one_of_the_list():
    found = movements_of([name for table in TOLD.values() for name, _, _ in wanted(table)])
    assert {one.kind for one in found if one} <= set(KINDS)


def test_a_thousand_names_take_a_fraction_of_a_second():
    started = time.process_time()
    movements_of([f"head_lod0__{k}_mouth_corner_pull_{k % 7}L" for k in range(1000)])
    assert time.process_time() - started < 2


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("head__eyeBlink_L", "head eye blink l"),
        ("mouthopen", "mouth open"),
        ("browser", "browser"),
        ("ｳｨﾝｸ２右", "ウィンク 2 右"),
        ("左目を閉じる", "左 目 を 閉じる"),
        ("eCTRLMouthSmile", "e ctrl mouth smile"),
    ],
)
def test_names_are_split_into_whole_words(name, words):
    assert " ".join(split_words(name)) == words


def test_every_phrase_weighs_a_number_with_a_fraction():
    assert all(type(weight) is float for weight, _, _ in _phrases())


@pytest.mark.parametrize(
    "names",
    [
        ("Key", "Key 1", "Key 2"),
        ("smile", "smile.001", "smile.002"),
        ("Blink", "Blink_L", "Blink_R"),
        ("viseme", "viseme_aa", "viseme_oh", "viseme_ee"),
        ("target", "target_1", "target_2", "target_3"),
    ],
)
def test_a_name_that_is_the_first_word_of_all_others_is_a_name_like_them(names):
    assert len(movements_of(names)) == len(names)
