"""Left/right partners found from geometry."""

from dataclasses import replace

import numpy as np
import pytest

from capture_plan.anatomy.blendshape_pairs import blendshape_pairs, laterality, self_symmetry, unlikeness
from capture_plan.anatomy.symmetry import pair_disagreements, symmetry_report
from capture_plan.audit.sides import partners
from capture_plan.mesh.mirror import mirror_map
from capture_plan.rig import Rig
from capture_plan.sample import sample_rig


def grid_rig(deltas, names):
    """A flat mirror-symmetric face of 9 x 9 vertices, 10 mm apart."""
    x, y = np.meshgrid(np.arange(-4, 5) * 10.0, np.arange(-4, 5) * 10.0)
    neutral = np.stack([x.ravel(), y.ravel(), 0 * x.ravel()], axis=1)
    corner = np.array([9 * row + column for row in range(8) for column in range(8)])
    v = len(neutral)
    return Rig(
        name="grid",
        neutral=neutral,
        triangles=np.concatenate([corner[:, None] + [0, 1, 9], corner[:, None] + [1, 10, 9]]),
        deltas=np.array(deltas, dtype=np.float32),
        names=tuple(names),
        skin=np.ones(v, dtype=bool),
        parts=np.zeros(v, dtype=np.int32),
        part_names=("skin",),
        source_index=np.arange(v),
    )


def bump(x, y, way):
    """A soft movement of the grid around (x, y), millimetres."""
    grid = np.stack(np.meshgrid(np.arange(-4, 5) * 10.0, np.arange(-4, 5) * 10.0), axis=-1).reshape(-1, 2)
    return np.exp(-((grid - [x, y]) ** 2).sum(axis=1) / 200)[:, None] * np.array(way, dtype=float)


EYES = ["eyeBlink", "eyeLookDown", "eyeLookIn", "eyeLookOut", "eyeLookUp", "eyeSquint", "eyeWide"]
MOUTH = ["mouthDimple", "mouthFrown", "mouthLowerDown", "mouthPress", "mouthSmile", "mouthStretch", "mouthUpperUp"]
EXPECTED = {"browDown", "browOuterUp", "cheekSquint", "noseSneer", *EYES, *MOUTH}


def test_the_sample_pairs_are_those_an_artist_expects():
    pairs = blendshape_pairs(sample_rig())
    assert {(a, b) for a, b in pairs} == {(f"{base}Left", f"{base}Right") for base in EXPECTED}


def test_names_do_not_decide():
    rig = sample_rig()
    blind = replace(rig, names=tuple(f"shape{k}" for k in range(len(rig.names))))
    number = {f"shape{k}": name for k, name in enumerate(rig.names)}
    assert tuple((number[a], number[b]) for a, b in blendshape_pairs(blind)) == blendshape_pairs(rig)


def test_mirroring_the_face_exchanges_left_and_right():
    rig = sample_rig()
    flip = np.array([-1, 1, 1])
    mirrored = replace(
        rig,
        neutral=rig.neutral * flip,
        deltas=rig.deltas * flip.astype(np.float32),
        triangles=rig.triangles[:, ::-1].copy(),
    )
    assert {(b, a) for a, b in blendshape_pairs(mirrored)} == set(blendshape_pairs(rig))


def test_a_blendshape_and_its_mirror_image_are_alike_and_opposites_are_not():
    rig = grid_rig([bump(20, 0, [2, 3, 0]), bump(-20, 0, [-2, 3, 0]), bump(-20, 0, [2, -3, 0])], "abc")
    assert unlikeness(rig)[0] == pytest.approx([1, 0, 2], abs=0.1)
    assert blendshape_pairs(rig) == (("a", "b"),)


def test_what_moves_the_whole_face_sideways_has_no_partner():
    assert (
        blendshape_pairs(grid_rig([bump(0, -20, [5, 0, 0]), bump(0, -20, [-5, 0, 0])], ["jawLeft", "jawRight"])) == ()
    )


def test_a_blendshape_without_mirror_image_stays_single():
    rig = grid_rig([bump(20, 0, [0, 3, 0]), bump(-20, 30, [0, 3, 0])], ["smile_L", "smile_R"])
    assert blendshape_pairs(rig) == ()


def test_a_rough_mirror_image_is_still_a_partner():
    rig = grid_rig([bump(20, 0, [0, 4, 0]), bump(-20, 0, [0, 4, 1.36])], "ab")  # 34 % of the length off
    assert blendshape_pairs(rig) == (("a", "b"),)


def test_names_break_ties():
    left, right = bump(20, 0, [0, 3, 0]), bump(-20, 0, [0, 3, 0])
    names = ["smile_L", "grin_L", "grin_R", "smile_R"]
    assert blendshape_pairs(grid_rig([left, left, right, right], names)) == (
        ("smile_L", "smile_R"),
        ("grin_L", "grin_R"),
    )


def test_sides_are_the_subjects_own():
    side = laterality(grid_rig([bump(30, 0, [0, 1, 0]), bump(-30, 0, [0, 1, 0]), bump(0, 0, [0, 1, 0])], "lrm"))
    assert side[0] > 0.9
    assert side[1] < -0.9
    assert side[2] == pytest.approx(0, abs=1e-6)


def test_self_symmetry_is_the_overlap_with_the_mirror_image():
    rig = grid_rig([bump(0, 0, [0, 1, 0]), bump(40, 0, [0, 1, 0])], "ms")
    assert self_symmetry(rig).tolist() == [1, 0]
    assert (mirror_map(rig.neutral).reshape(9, 9) == np.arange(81).reshape(9, 9)[:, ::-1]).all()


def test_a_blendshape_that_does_not_move_has_no_partner():
    rig = grid_rig([bump(20, 0, [0, 1, 0]), np.zeros((81, 3))], "ab")
    assert blendshape_pairs(rig) == ()


@pytest.mark.parametrize("leaning", [0, 5, 10])
def test_movements_against_each_other_are_no_halves_however_lopsided(leaning):
    pull = [bump(leaning, -20, [5, 0, 0]), bump(-leaning, -20, [-5, 0, 0])]
    assert blendshape_pairs(grid_rig(pull, ["mouthLeft", "mouthRight"])) == ()


def test_halves_that_meet_on_the_midline_and_go_down_together_are_partners():
    rig = grid_rig([bump(10, -20, [1, -5, 0]), bump(-10, -20, [-1, -5, 0])], ["lowerDown_L", "lowerDown_R"])
    assert blendshape_pairs(rig) == (("lowerDown_L", "lowerDown_R"),)


def pulled_mouth():
    """A smile of either side and a mouth pulled to either side: each pull is not unlike the other side's smile."""
    smile, pull = bump(25, 0, [3, 2, 0]), bump(22, 0, [3, 1.4, 0]) + bump(0, 0, [1.6, 0, 0])
    image = mirror_map(grid_rig([smile], ["smile"]).neutral)
    deltas = [smile, (smile * [-1, 1, 1])[image], pull, (pull * [-1, 1, 1])[image]]
    return grid_rig(deltas, ["mouthSmileLeft", "mouthSmileRight", "mouthPullLeft", "mouthPullRight"])


def test_no_half_is_paired_with_what_is_much_less_its_mirror_image_than_another():
    assert blendshape_pairs(pulled_mouth()) == (("mouthSmileLeft", "mouthSmileRight"),)


def test_every_statement_of_the_audit_about_mirror_images_says_what_its_table_says():
    rig = pulled_mouth()
    symmetry = symmetry_report(rig)
    table = {image.blendshape: image for image in symmetry.blendshapes}
    assert {name: image.partner for name, image in table.items()} == {
        "mouthSmileLeft": "mouthSmileRight", "mouthSmileRight": "mouthSmileLeft",
        "mouthPullLeft": "mouthPullRight", "mouthPullRight": "mouthPullLeft",
    }  # fmt: skip
    assert partners(rig, rig.names, symmetry) == []
    messages = [one.words for one in pair_disagreements(rig, symmetry.blendshapes)]
    assert all("they mirror each other" in words for words in messages)
    assert [words.split()[0] for words in messages] == ["mouthPullLeft", "mouthPullRight"]
