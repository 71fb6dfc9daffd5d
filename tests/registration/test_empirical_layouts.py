"""Empirical layouts on the sample head: every point is skin, sides mirror, and definitions hold by geometry."""

import numpy as np
import pytest

from capture_plan.anatomy.regions import face_regions
from capture_plan.errors import PlanError
from capture_plan.mesh.mirror import mirror_map
from capture_plan.registration.empirical_layouts import empirical_layout, place_ibug68, place_layout
from capture_plan.registration.known import EMPIRICAL
from capture_plan.sample import sample_rig

# subject's right and left of the 68 points, iBUG's order
MIRROR = [*range(16, -1, -1), *range(26, 16, -1), 27, 28, 29, 30, 35, 34, 33, 32, 31, 45, 44, 43, 42, 47, 46, 39, 38]
MIRROR += [37, 36, 41, 40, 54, 53, 52, 51, 50, 49, 48, 59, 58, 57, 56, 55, 64, 63, 62, 61, 60, 67, 66, 65]


def at(key):
    """Places by name, millimetres."""
    layout = empirical_layout(key)
    return {point.name: sample_rig().neutral[point.vertex] for point in layout.points}


def regions(key):
    found = face_regions(sample_rig())
    return {point.name: found.label(point.vertex) for point in empirical_layout(key).points}


@pytest.mark.parametrize("key", EMPIRICAL)
def test_points_are_skin_apart_and_told_where_they_are_from(key):
    layout = empirical_layout(key)
    names = [point.name for point in layout.points]
    assert len(set(names)) == len(names) == len(set(layout.vertices.tolist()))
    assert layout.title.split()[0] == str(len(names))
    assert sample_rig().skin[layout.vertices].all()
    assert layout.source
    assert layout.note
    assert all(point.definition for point in layout.points)


@pytest.mark.parametrize("key", EMPIRICAL)
def test_every_point_has_its_mirror_image_in_the_layout(key):
    rig, vertices = sample_rig(), empirical_layout(key).vertices
    mirror = mirror_map(rig.neutral)
    assert set(mirror[vertices].tolist()) == set(vertices.tolist())
    assert np.abs(rig.neutral[mirror[vertices]] - rig.neutral[vertices] * [-1, 1, 1]).max() < 0.1


@pytest.mark.parametrize("key", EMPIRICAL)
def test_left_is_the_subjects_own(key):
    """What a definition calls left, and not the left corner of a right eye, lies on +x."""
    for point in empirical_layout(key).points:
        words = point.definition.lower().replace("from the subject's right to the left", "")
        words = words.split(",")[0] if key.startswith("ibug") else words
        if key == "mpeg4" and " eye" in words and "eyebrow" in words + "brow":
            words = words.replace("left corner of right", "right").replace("right corner of left", "left")
        words = words.replace("left (inner) corner of right", "right").replace("right (inner) corner of left", "left")
        x = sample_rig().neutral[point.vertex, 0]
        if "left" in words and "right" not in words:
            assert x > 1, (point.name, point.definition)
        if "right" in words and "left" not in words:
            assert x < -1, (point.name, point.definition)


def test_the_68_mirror_in_the_order_of_ibug():
    place = sample_rig().neutral[empirical_layout("ibug68").vertices]
    assert np.abs(place[MIRROR] - place * [-1, 1, 1]).max() < 0.1
    assert (place[:8, 0] < 0).all()  # counted from the subject's right, which is -x


def test_features_follow_each_other_down_the_sample():
    y = sample_rig().neutral[empirical_layout("ibug68").vertices, 1]
    assert (np.diff(y[27:31]) < 0).all()  # bridge of the nose
    assert (np.diff(y[:9]) < 0).all()  # jaw, from the ear down
    brow, eye, tip, upper, lower, chin = y[19], y[36], y[30], y[51], y[57], y[8]
    assert brow > eye > tip > upper > lower > chin


def test_brows_lids_and_lips_run_from_corner_to_corner():
    x = sample_rig().neutral[empirical_layout("ibug68").vertices, 0]
    assert (np.diff(x[17:27]) > 0).all()
    assert (np.diff(x[[36, 37, 38, 39, 42, 43, 44, 45]]) > 0).all()
    assert (np.diff(x[48:55]) > 0).all()
    assert (np.diff(x[54:60]) < 0).all()


def test_51_points_are_the_68_without_the_jaw():
    assert empirical_layout("ibug51").points == empirical_layout("ibug68").points[17:]


def test_mpeg4_definitions_hold_by_geometry():
    """Extremes, middles and orders that the words name; x from the midline, y up, z forward, millimetres."""
    p, rig = at("mpeg4"), sample_rig()
    y, z = rig.neutral[rig.skin, 1], rig.neutral[rig.skin, 2]
    assert p["9.3"][2] == z.max()  # tip of the nose
    assert p["11.4"][1] == y.max()  # top of the skull
    assert p["11.6"][2] == pytest.approx(z.min(), abs=0.1)  # back of the skull
    assert p["2.1"][1] == min(place[1] for place in p.values())  # bottom of the chin
    assert p["2.10"][2] > max(p["2.1"][2], p["2.11"][2])  # the boss is the front of the chin
    for middle, a, b in (("2.6", "2.2", "2.4"), ("2.8", "2.3", "2.4"), ("8.5", "8.3", "8.1"), ("8.7", "8.3", "8.2")):
        assert p[middle][0] == pytest.approx((p[a][0] + p[b][0]) / 2, abs=2)
    assert p["8.10"][1] >= max(p["8.1"][1], p["8.5"][1])  # the high point of Cupid's bow
    assert p["3.11"][0] < p["3.1"][0] < p["3.7"][0]  # from the nose outwards
    assert p["3.13"][1] > p["3.1"][1] > p["3.3"][1] > p["3.9"][1]  # fold, edge, edge, fold
    assert p["4.3"][1] > max(p["4.1"][1], p["4.5"][1])  # uppermost point of the brow
    assert p["4.1"][0] < p["4.3"][0] < p["4.5"][0]
    assert p["9.7"][1] > p["9.12"][1] > p["9.3"][1] > p["9.15"][1]  # down the nose
    assert p["10.1"][1] > p["10.9"][1] > p["10.7"][1] > p["10.5"][1]  # down the ear
    assert p["10.3"][2] < min(p[name][2] for name in ("10.1", "10.5", "10.7", "10.9"))  # back of the ear
    assert p["2.13"][0] > p["8.3"][0]  # the corner of the jaw lies further out and back than that of the mouth
    assert p["2.13"][2] < p["2.11"][2]


def test_mpeg4_and_ibug_agree_where_their_definitions_do():
    """The 68's own definitions name the point of MPEG-4 that is the same."""
    mpeg4 = {point.name: point.vertex for point in empirical_layout("mpeg4").points}
    same = [point for point in empirical_layout("ibug68").points if "MPEG-4 " in point.definition]
    assert len(same) == 25
    assert all(mpeg4[point.definition.split("MPEG-4 ")[1]] == point.vertex for point in same)


@pytest.mark.parametrize(
    ("key", "start", "region"),
    [
        ("iemocap53", "LBRO", "left brow"),
        ("iemocap53", "RC", "right cheek"),
        ("iemocap53", "CH", "chin"),
        ("iemocap53", "FH", "forehead"),
        ("iemocap53", "TNOSE", "nose"),
        ("iemocap53", "LLID", "left upper eyelid"),
        ("motionbuilder17", "Right mouth", "right mouth corner"),
        ("motionbuilder17", "Left upper eye", "left upper eyelid"),
        ("motionbuilder17", "Right lower eye", "right lower eyelid"),
        ("motionbuilder17", "Left nostril", "left nose"),
        ("faceware30", "BROW_MIDDLE_LEFT", "left brow"),
        ("faceware30", "EYE_BOTTOM_RIGHT", "right lower eyelid"),
        ("faceware30", "MOUTH_LIP_OUTER_BOTTOM", "lower lip"),
    ],
)
def test_names_stand_in_their_region(key, start, region):
    found = {name: label for name, label in regions(key).items() if name.startswith(start)}
    assert found
    assert all(label.endswith(region) for label in found.values()), found


def test_same_rig_same_points():
    rig = sample_rig()
    assert np.array_equal(place_layout(rig, "ibug68").vertices, place_ibug68(rig))


def test_an_unknown_layout_is_refused_with_those_that_are_known():
    with pytest.raises(PlanError, match="layout 'ibug' is not known: choose one of ibug68, ibug51"):
        place_layout(sample_rig(), "ibug")
