"""Places on a face: anchors and regions of the sample, their symmetry, and a face without holes."""

from dataclasses import replace

import numpy as np
import pytest

from capture_plan.anatomy.eye_corners import eye_corners
from capture_plan.anatomy.regions import REGIONS, face_regions, region_label
from capture_plan.face.anchors import face_anchors, face_surface, interpupillary
from capture_plan.mesh.mirror import mirror_map
from capture_plan.sample import sample_rig


@pytest.fixture(scope="module")
def regions(rig):
    return face_regions(rig)


def active(rig, name, share=0.5):
    moved = rig.displacement[rig.names.index(name)] * rig.skin
    return moved >= share * moved.max()


def region_names(regions, vertices):
    return {regions.names[i] for i in regions.of_vertex[vertices]}


def test_anchors_stand_where_a_face_has_them(rig, regions):
    a = regions.anchors
    assert a.found == ("eyes", "mouth", "ears")
    assert a.eye_left[0] > 20 > -20 > a.eye_right[0]  # the subject's left is +x
    assert a.eye_left[1] > a.nose_tip[1] > a.mouth[1] > a.chin[1]
    assert a.nose_tip[2] == rig.neutral[rig.skin, 2].max()
    assert a.corner_left[0] > 0 > a.corner_right[0]
    assert a.ear_left[0] > 60 > -60 > a.ear_right[0]
    assert 54 < interpupillary(rig) < 74


def test_every_skin_vertex_has_a_region_and_nothing_else_has(rig, regions):
    assert (regions.of_vertex[rig.skin] >= 0).all()
    assert (regions.of_vertex[~rig.skin] == -1).all()
    assert region_names(regions, rig.skin) == set(REGIONS)


def test_regions_are_where_blendshapes_act(rig, regions):
    assert "upper eyelid" in region_names(regions, active(rig, "eyeBlinkLeft", 0.8))
    assert region_names(regions, active(rig, "browOuterUpLeft")) <= {"brow", "forehead", "temple", "upper eyelid"}
    assert "nose" in region_names(regions, active(rig, "noseSneerLeft", 0.3))
    assert "chin" in region_names(regions, active(rig, "jawForward", 0.8))
    assert "mouth corner" in region_names(regions, active(rig, "mouthSmileLeft", 0.8))


def test_sides_are_the_subjects_own(rig, regions):
    left = active(rig, "eyeBlinkLeft") & (regions.side != 0)
    assert (regions.side[left] == 1).all()
    assert regions.label(int(np.flatnonzero(left)[0])).startswith("left ")


def test_a_mirrored_face_has_mirrored_regions(rig, regions):
    flip = np.array([-1, 1, 1])
    mirrored = face_regions(
        replace(
            rig,
            neutral=rig.neutral * flip,
            deltas=rig.deltas * flip.astype(np.float32),
            triangles=rig.triangles[:, ::-1],
        )
    )
    assert (mirrored.of_vertex != regions.of_vertex).mean() < 0.02
    assert (mirrored.side == -regions.side).mean() > 0.99


def test_of_two_mirror_images_on_a_lopsided_face_one_lies_left_and_one_right_or_both_beside_the_middle(rig):
    x = rig.neutral[:, 0]
    bulged = rig.neutral + np.clip((x - 1) / 10, 0, 1)[:, None] * [1.5, 0.0, 0.0]
    regions, image = face_regions(replace(rig, neutral=bulged)), mirror_map(bulged)
    pair = rig.skin & (image[image] == np.arange(len(x))) & (image != np.arange(len(x)))
    assert pair.sum() > 1000
    assert (regions.side[pair] == -regions.side[image[pair]]).all()


def test_moving_the_head_moves_no_region(rig, regions):
    moved = face_regions(replace(rig, neutral=rig.neutral + np.array([30.0, -500.0, 12.0])))
    assert (moved.of_vertex != regions.of_vertex).mean() < 0.01


def test_upper_and_lower_lip_are_told_apart_where_they_touch(rig, regions):
    """Rims of the mouth: above the opening only the upper lip, below only the lower."""
    upper, lower = (regions.of_vertex == REGIONS.index(name) for name in ("upper lip", "lower lip"))
    shift = rig.deltas[rig.names.index("jawOpen"), :, 1]
    assert shift[upper].mean() > -5 > -15 > shift[lower].mean()


def test_beside_the_inner_corner_of_an_eye_what_is_higher_is_upper_lid_and_what_is_lower_is_lower_lid(rig, regions):
    """No opening lies between them there, so the way along the skin tells nothing."""
    upper, lower = (regions.of_vertex == REGIONS.index(name) for name in ("upper eyelid", "lower eyelid"))
    corners = eye_corners(rig, regions.anchors)
    for side, sign in (("left", 1), ("right", -1)):
        inner = rig.neutral[corners["inner", side]]
        beside = (sign * rig.neutral[:, 0] > 0) & (sign * rig.neutral[:, 0] < sign * inner[0] - 0.5)
        height = rig.neutral[:, 1] - inner[1]
        assert (beside & upper).any()
        assert (beside & lower).any()
        assert not (beside & lower & (height > 1)).any()
        assert not (beside & upper & (height < -1)).any()


def test_a_face_without_openings_still_gets_its_regions(rig, regions):
    """Only the skin, its openings hidden: proportions and movement place eyes and mouth."""
    bare = replace(rig, skin=np.isin(np.arange(len(rig.skin)), rig.triangles) & (rig.parts == 0))
    anchors = face_anchors(bare)
    assert np.linalg.norm(anchors.mouth - regions.anchors.mouth) < 20
    assert np.linalg.norm(anchors.eye_left - regions.anchors.eye_left) < 20
    assert np.linalg.norm(anchors.corner_left - regions.anchors.corner_left) < 20
    assert np.linalg.norm(anchors.corner_right - regions.anchors.corner_right) < 20
    same = face_regions(bare).of_vertex == regions.of_vertex
    assert same[rig.skin].mean() > 0.7


@pytest.mark.parametrize("cut", ["below the nose", "lips and lids", "right half"])
def test_a_narrowed_skin_moves_no_anchor(rig, regions, cut):
    """Eyes, mouth and ears are those of the face, whatever part of it a person allows markers on."""
    off = {
        "below the nose": rig.neutral[:, 1] < regions.anchors.nose_tip[1] - 10,
        "lips and lids": np.isin(
            regions.of_vertex, [i for i, name in enumerate(REGIONS) if "lip" in name or "lid" in name]
        ),
        "right half": rig.neutral[:, 0] < 0,
    }[cut]
    narrow = face_anchors(replace(rig, skin=rig.skin & ~off))
    for name in ("eye_left", "eye_right", "mouth", "corner_left", "corner_right", "nose_tip", "chin", "ear_left"):
        assert np.allclose(getattr(narrow, name), getattr(regions.anchors, name))


def test_a_skin_that_the_rig_contradicts_is_the_persons():
    """Where a person calls skin what the rig shows to be none, nothing is added to it."""
    rig = sample_rig()
    teeth = replace(rig, skin=rig.parts == rig.part_names.index(next(n for n in rig.part_names if "teeth" in n)))
    assert np.array_equal(face_surface(teeth), teeth.skin)


def test_labels_are_plain_words():
    assert region_label("brow", 1) == "left brow"
    assert region_label("mouth corner", -1) == "right mouth corner"
    assert region_label("nose", 0) == "nose"
    with pytest.raises(KeyError):
        region_label("nose", 2)


def test_a_vertex_that_is_no_skin_is_called_so(rig, regions):
    assert regions.label(int(np.flatnonzero(~rig.skin)[0])) == "not skin"
