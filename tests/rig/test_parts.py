"""What a part is by its name: names from the field, and that paper and page take each for the same."""

import re
from dataclasses import replace
from importlib.resources import files

import numpy as np
import pytest

from capture_plan.face.blocking import THIN, UNTOLD
from capture_plan.report.head import triangle_materials
from capture_plan.rig.parts import DRAWN, NOT_SKIN, PART_KINDS, PART_WORDS, WORN, part_kind
from capture_plan.sample import sample_rig
from capture_plan.sheets.head import BY_KIND, SKIN, make_head

FIELD = {
    "clear": """M_EyeOcclusion M_EyeBlend M_LacrimalFluid EyeShell EyeWetness EyeFluid eyeshell_lod0_mesh
        eyeEdge_lod0_mesh saliva_lod0_mesh cartilage_lod0_mesh CC_Base_TearLine CC_Base_EyeOcclusion Std_Cornea_L Cornea
        Tear EyeMoisture EyeReflection N00_000_00_EyeHighlight_00_EYE tearline_L eye_lens head/eye_trans""",
    "lash": "M_EyeLashes eyelashes_L eyelashes_lod0_mesh Std_Eyelash Eyelashes Eye_Cilia lashes",
    "eye line": "N00_000_00_FaceEyeline_00_FACE eye_liner EyeLine",
    "brow": "Eyebrows N00_000_00_FaceBrow_00_FACE Brow_Transparency brow_L eyebrow_brown",
    "hair": """Wolf3D_Hair Hair_Cards HairBack_00_HAIR hair_frontside Beard Wolf3D_Beard Moustache Mustache_Card stubble
        Goatee FuzzGroom Hair_Brown Facial_Hair hairband Hair_Cap""",
    "teeth": "M_Teeth helper-upper-teeth teeth_lod0_mesh Std_Upper_Teeth Wolf3D_Teeth upper_dentures lower_tooth_3",
    "tongue": "M_GumsTongue helper-tongue Std_Tongue tongue",
    "gums": "Gums gum_upper LowerGums",
    "inside": "MouthBag mouth_cavity Mouth_Inside M_MouthSocket oral_cavity EyeSocket palate",
    "iris": "M_IrisLeft iris_R N00_000_00_EyeIris_00_EYE Pupils pupil_L",
    "eye": "EyeLeft eyeRight_lod0_mesh M_ScleraLeft helper-l-eye Std_Eye_L N00_000_00_EyeWhite_00_EYE EYE_DEF head/eye",
    "glasses": "Wolf3D_Glasses glasses_lens eyeglasses wear/glass goggles eyewear",
    "clothes": """Wolf3D_Outfit_Top Wolf3D_Headwear T-shirt Headphones headset hat Baseball_Cap helmet Hoodie
        wear/backpack N00_010_01_Onepiece_00_CLOTH_01 Jacket_FR_new01 necklace pearl_earring helper-genital
        helper-tights Floral_Dress wear/armgear_plastic""",
    "skin": """M_Face M_BackHead Wolf3D_Head head_lod0_mesh N00_000_00_Face_00_SKIN Std_Skin_Head neck Lips Ears scalp
        eyelids upper-eyelid Eye_Lid face_mesh Heads""",
    "body": "body Wolf3D_Body Body/Body Full_Body",
    "other": "mesh Student identity accident 顔 tail MTH_DEF BLW_DEF Chest Torso/Main temporal base/",
}
NAMES = [(name, kind) for kind, names in FIELD.items() for name in names.split()]


@pytest.mark.parametrize(("name", "kind"), NAMES)
def test_a_name_from_the_field_is_what_it_says(name, kind):
    assert part_kind(name) == part_kind(name.lower()) == part_kind(name.upper()) == kind


def looks():
    """The kinds to which the page's viewer gives a look of their own."""
    script = files("capture_plan.report").joinpath("assets", "viewer.js").read_text(encoding="utf-8")
    table = script[script.index("CapturePlan.LOOK = {") :]
    return set(re.findall(r'^  "?([a-z ]+)"?: ', table[: table.index("\n};")], re.MULTILINE))


def test_paper_and_page_tell_the_same_kinds_from_clay():
    assert looks() == {"skin"} | set(BY_KIND)


@pytest.mark.parametrize("kind", PART_KINDS)
def test_the_same_name_is_the_same_thing_on_paper_and_on_the_page(kind):
    """An eye of the sample under names of the kind: its material on paper, its look on the page."""
    rig = replace(sample_rig(), part_names=("skin", *[FIELD[kind].split()[0]] * 2, *["face"] * 5))
    eyes = rig.triangles[np.isin(rig.parts, [1, 2])[rig.triangles[:, 0]]]
    names, of_triangle = triangle_materials(rig)
    assert {names[i] for i in of_triangle[np.isin(rig.triangles, eyes).all(axis=1)]} == {
        "inside" if kind == "skin" else kind
    }
    material = {v: piece.material for piece in make_head(rig).pieces for v in piece.vertices}
    assert {material.get(v) for v in eyes.ravel()} == {BY_KIND.get(kind, SKIN)}


def test_kinds_are_known_and_each_has_words():
    assert {kind for kind, _ in PART_WORDS} | {"other"} == set(PART_KINDS)
    assert NOT_SKIN | WORN | DRAWN | set(BY_KIND) | THIN | UNTOLD <= set(PART_KINDS)
    assert {"skin", "body", "other"}.isdisjoint(NOT_SKIN)
    assert np.all([kind in NOT_SKIN for kind in (*WORN, *DRAWN)])
