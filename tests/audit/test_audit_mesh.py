"""What is found wrong with a mesh and before it: each planted in the sample, and quiet where it is not."""

from dataclasses import replace

import numpy as np
import pytest

from capture_plan.audit.mesh import holes, open_lips, sheets, shut_lids, sizes, untidy, weak, windings
from capture_plan.audit.occluders import covers
from capture_plan.face.anchors import face_anchors
from capture_plan.sample import sample_rig
from tests.solids import sphere, together


@pytest.fixture(scope="module")
def rig():
    whole = sample_rig()
    names = ("jawOpen", "eyeBlinkLeft", "eyeBlinkRight")
    return replace(whole, names=names, deltas=whole.deltas[[whole.names.index(name) for name in names]])


@pytest.fixture(scope="module")
def cheek(rig):
    """Numbers of the triangles around a vertex of the left cheek."""
    at = face_anchors(rig)
    spot = (at.eye_left + at.corner_left) / 2 + [15, 0, 0]
    vertex = np.linalg.norm(np.where(rig.skin[:, None], rig.neutral, np.inf) - spot, axis=1).argmin()
    return np.flatnonzero((rig.triangles == vertex).any(axis=1))


def reversed_at(rig, some):
    triangles = rig.triangles.copy()
    triangles[some] = triangles[some, ::-1]
    return replace(rig, triangles=triangles)


def with_part(rig, name, vertices, triangles):
    """The rig with a further part that holds no skin and stays still."""
    v, n = len(rig.neutral), len(vertices)
    return replace(
        rig,
        neutral=np.concatenate([rig.neutral, vertices]),
        triangles=np.concatenate([rig.triangles, np.array(triangles) + v]),
        deltas=np.concatenate([rig.deltas, np.zeros((len(rig.deltas), n, 3), np.float32)], axis=1),
        skin=np.concatenate([rig.skin, np.zeros(n, dtype=bool)]),
        parts=np.concatenate([rig.parts, np.full(n, len(rig.part_names))]),
        part_names=(*rig.part_names, name),
        source_index=np.arange(v + n),
    )


def test_a_sound_mesh_has_nothing_to_report(rig):
    anchors = face_anchors(rig)
    assert windings(rig) == holes(rig, anchors) == untidy(rig) == sizes(rig, 60.0, rig.names, 60.0) == []


@pytest.mark.parametrize("seed", range(3))
def test_turned_triangles_are_told_from_the_others(seed):
    _, triangles = together(sphere(), sphere(rings=6, around=8))
    some = np.random.default_rng(seed).random(len(triangles)) < 0.2
    triangles[some] = triangles[some, ::-1]
    sheet, against = sheets(triangles)
    assert sheet.max() == 1
    assert (against == some).all()


def test_a_strip_with_one_side_turns_nothing_over():
    strip = np.array([[0, 1, 2], [1, 3, 2], [2, 3, 4], [3, 5, 4], [4, 5, 1], [5, 0, 1]])  # ends joined with a twist
    assert not sheets(strip)[1].any()


def test_some_turned_triangles_go_back_to_the_rigger(rig, cheek):
    (finding,) = windings(reversed_at(rig, cheek))
    assert f"{len(cheek):,} of" in finding.message
    assert finding.urgency == "rigger"


def test_a_skin_inside_out_stops_the_shoot(rig):
    (finding,) = windings(reversed_at(rig, np.arange(len(rig.triangles))))
    assert finding.urgency == "stop"
    assert "100 % of its area" in finding.message


def test_a_hole_in_the_cheek_is_found_and_mouth_eyes_and_neck_are_none(rig, cheek):
    torn = replace(rig, triangles=np.delete(rig.triangles, cheek, axis=0))
    (finding,) = holes(torn, face_anchors(torn))
    assert finding.message.startswith("1 hole in the skin: left cheek")


def test_a_seam_is_no_hole(rig):
    """Border vertices on the same spot close it: two halves of a head that were cut along the midline."""
    left = rig.neutral[rig.triangles].mean(axis=1)[:, 0] > 0
    v = len(rig.neutral)
    cut = replace(
        rig,
        neutral=np.tile(rig.neutral, (2, 1)),
        triangles=np.concatenate([rig.triangles[left], rig.triangles[~left] + v]),
        deltas=np.tile(rig.deltas, (1, 2, 1)),
        skin=np.tile(rig.skin, 2),
        parts=np.tile(rig.parts, 2),
        source_index=np.arange(2 * v),
    )
    assert holes(cut, face_anchors(rig)) == []
    assert windings(cut) == []


def test_an_edge_of_three_triangles_goes_back_to_the_rigger(rig, cheek):
    a, b = rig.triangles[cheek[0], :2]
    far = np.flatnonzero(rig.skin)[rig.neutral[rig.skin, 2].argmin()]
    findings = untidy(replace(rig, triangles=np.concatenate([rig.triangles, [[a, b, far]]])))
    assert [finding.urgency for finding in findings] == ["rigger"]
    assert findings[0].message.startswith("1 of ")


def test_loose_vertices_and_flat_triangles_are_told(rig):
    loose = with_part(rig, "loose", np.zeros((3, 3)), np.zeros((1, 3), dtype=int))
    messages = [finding.message for finding in untidy(loose)]
    assert messages == [
        f"2 of {len(rig.neutral) + 3:,} vertices belong to no face",
        f"1 of {len(rig.triangles) + 1:,} triangles have no area",
    ]


def test_a_head_without_eyes_is_measured_by_what_moves(rig):
    assert sizes(rig, None, rig.names, 60.0) == []
    for times in (0.1, 10):
        scaled = replace(rig, neutral=rig.neutral * times, deltas=rig.deltas * times)
        (finding,) = sizes(scaled, None, rig.names, 60.0 * times)
        assert finding.urgency == "stop"
        assert "no eyes were found" in finding.message


def plate(at, half):
    corners = np.array([[-half, -half, 0], [half, -half, 0], [half, half, 0], [-half, half, 0]]) + at
    return corners, [[0, 1, 2], [0, 2, 3]]


def test_a_plate_before_the_mouth_hides_skin_and_one_behind_the_head_none(rig):
    mouth = face_anchors(rig).mouth
    before = with_part(rig, "microphone", *plate(mouth + np.array([0, 0, 10]), 25))
    behind = with_part(rig, "panel", *plate(mouth - np.array([0, 0, 300]), 25))
    assert not any("panel" in finding.message for finding in covers(behind))
    (finding,) = covers(before)
    assert "microphone" in finding.message
    assert finding.urgency == "rigger"


def test_lashes_and_eyeballs_are_no_cover(rig):
    assert covers(rig) == []


def cards(rig, number):
    """Open sheets side by side before the face, as hair hangs into it."""
    before = face_anchors(rig).mouth + np.array([0, 0, 15.0])
    sheets = [plate(before + np.array([x, 0, 0]), 25) for x in np.linspace(-30, 30, number)]
    corners = np.concatenate([corners for corners, _ in sheets])
    return corners, np.concatenate([np.array(faces) + 4 * i for i, (_, faces) in enumerate(sheets)])


def test_hair_of_cards_is_told_as_looked_through_and_a_cap_of_hair_as_hiding(rig):
    (thin,) = covers(with_part(rig, "hair_cards", *cards(rig, 12)))
    assert "hair_cards" in thin.message
    assert "looks through" in thin.message
    (cap,) = covers(with_part(rig, "hair_cap", *cards(rig, 3)))
    assert "still seen past it" in cap.message


def opened(rig, share):
    """The rig as it was exported with its jaw open by a share."""
    return replace(rig, neutral=rig.neutral + share * rig.deltas[rig.names.index("jawOpen")])


def test_a_mouth_that_stands_open_in_the_neutral_is_said_with_how_far():
    rig = sample_rig()
    assert open_lips(face_anchors(rig)) == []
    (finding,) = open_lips(face_anchors(opened(rig, 0.5)))
    apart = 0.5 * np.linalg.norm(rig.deltas[rig.names.index("jawOpen")], axis=1)[face_anchors(rig).lips].max()
    (said,) = [float(word) for word in finding.message.split() if word.isdigit()]
    assert abs(said - apart) < 4
    assert finding.urgency == "rigger"


def test_the_chin_of_a_gaping_mouth_is_not_sure_for_the_lip_stands_before_it(rig):
    whole = sample_rig()
    assert face_anchors(opened(whole, 0.5)).chin_sure
    gaping = face_anchors(opened(whole, 1.3))
    chin = face_anchors(whole).chin + 1.3 * whole.deltas[whole.names.index("jawOpen")].min(axis=0) * [0, 1, 0]
    assert np.abs((gaping.chin - chin)[1]) > 10  # it is off indeed
    assert not gaping.chin_sure


def shut(rig, names, share):
    """The rig as it was exported with these blinks on."""
    return replace(rig, neutral=rig.neutral + share * sum(rig.deltas[rig.names.index(name)] for name in names))


@pytest.mark.parametrize(
    ("names", "says"),
    [(("eyeBlinkLeft", "eyeBlinkRight"), "the eyes are shut"), (("eyeBlinkLeft",), "the left eye is shut")],
)
def test_a_neutral_with_closed_eyes_is_sent_back(rig, names, says):
    assert shut_lids(rig, face_anchors(rig)) == []
    closed = shut(rig, names, 0.9)
    (finding,) = shut_lids(closed, face_anchors(rig))
    assert finding.message.startswith(says)
    assert finding.urgency == "rigger"


@pytest.mark.parametrize(("by", "named"), [(0.1, 3), (0.3, 3), (0.7, 0), (1.0, 0)])
def test_jaws_and_lids_that_hardly_move_cannot_be_right(by, named):
    whole = sample_rig()
    small = replace(whole, deltas=np.float32(by) * whole.deltas)
    found = weak(small, small.names, 60.0)
    assert sum(len(finding.blendshapes) for finding in found) == named
    assert all(finding.urgency == "stop" for finding in found)
