"""What blendshape names tell: ARKit's spelling, the side."""

import pytest

from capture_plan.names.arkit import arkit_name, side_of
from capture_plan.names.movements import movement_of
from capture_plan.sample import sample_rig

SPELLINGS = (
    "eyeBlinkLeft EyeBlinkLeft eyeBlink_L EyeBlink_L L_eyeBlink l_eyeBlink lf_eyeBlink eyeBlink.L eyeBlink_left "
    "eyeBlinkLt eyeBlinkL EYEBLINKLEFT head:eyeBlink_L CTRL_expressions_eyeBlinkL"
)


@pytest.mark.parametrize("name", SPELLINGS.split())
def test_every_house_spelling_of_the_left_blink_is_one_name(name):
    assert arkit_name(name) == "eyeBlinkLeft"
    assert side_of(name) == "left"


def test_the_sample_speaks_arkit():
    names = sample_rig().names
    assert tuple(arkit_name(name) for name in names) == names


@pytest.mark.parametrize("name", ["jawLeft", "mouthRight", "eyeLookLeft", "lookRight", "tongueLeft", "jaw_left"])
def test_where_something_moves_to_is_no_side(name):
    assert side_of(name) is None


@pytest.mark.parametrize(
    ("name", "side"),
    [
        ("eyeLookLeftL", "left"),
        ("eyeLookLeftR", "right"),
        ("mouthFunnelUR", "right"),
        ("eyeBrowLeftDown", "left"),
        ("smileRight", "right"),
        ("mouth_left_smile", "left"),
        ("browInnerUp_R", "right"),
        ("viseme_R", None),
        ("L", None),
        ("jawOpen", None),
        ("mouthRollLower", None),
    ],
)
def test_sides_are_read_from_words_not_letters(name, side):
    assert side_of(name) == side


def test_left_and_right_spellings_have_opposite_sides():
    for name in SPELLINGS.split():
        for left, right in (("Left", "Right"), ("left", "right"), ("LEFT", "RIGHT"), ("Lt", "Rt"), ("lf", "rt")):
            if left in name:
                assert side_of(name.replace(left, right)) == "right"


@pytest.mark.parametrize("name", ["", "shape_12", "happy", "jawOpen_mouthSmileLeft", "mouthFunnelUL", "eyeLookLeft"])
def test_other_names_are_not_taken_for_arkit(name):
    assert arkit_name(name) is None


def test_halves_of_undivided_blendshapes_keep_their_side():
    assert arkit_name("cheekPuff_R") == "cheekPuffRight"
    assert arkit_name("jawOpen.001") == "jawOpen"


@pytest.mark.parametrize(
    ("name", "arkit", "side"),
    [
        ("browDownLinks", "browDownLeft", "left"), ("eyeBlinkRechts", "eyeBlinkRight", "right"),
        ("mouthSmile_gauche", "mouthSmileLeft", "left"), ("mouthSmile_droite", "mouthSmileRight", "right"),
        ("eyeBlink_izq", "eyeBlinkLeft", "left"), ("eyeWideDerecha", "eyeWideRight", "right"),
        ("cheekSquintSinistra", "cheekSquintLeft", "left"), ("noseSneerDireita", "noseSneerRight", "right"),
    ],
)  # fmt: skip
def test_sides_are_read_in_the_languages_of_studios(name, arkit, side):
    assert (arkit_name(name), side_of(name)) == (arkit, side)


@pytest.mark.parametrize("onlooker", ["viewer", "Screen", "_camera_", "audience"])
def test_who_looks_at_a_face_has_its_right_side_on_the_left(onlooker):
    assert side_of(f"mouthSmile_{onlooker}Left") == "right"
    assert arkit_name(f"eyeBlink_{onlooker}Right") == "eyeBlinkLeft"
    assert arkit_name(f"jaw{onlooker}Left") == "jawRight"
    assert movement_of(f"blink_{onlooker}_l").side == "right"
    assert side_of(f"smile_{onlooker}Lens") is None


def test_the_left_of_a_stage_is_the_actors_own():
    assert side_of("smile_stageLeft") == "left"
