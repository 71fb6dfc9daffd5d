"""What is not on a mesh is not found, and what stands beside a face is none of it."""

import warnings

import numpy as np
import pytest

from capture_plan.face.anchors import _eyes as eyes_of
from capture_plan.face.anchors import are_ears
from capture_plan.face.candidate import Candidate
from capture_plan.face.edge import outer_edge
from capture_plan.face.islands import off_face, variety
from capture_plan.face.lids import against_eyes, before_the_balls
from capture_plan.face.of_rig import rig_channels, rig_points, rig_shape
from capture_plan.face.points import choose
from capture_plan.face.reading import face_reading
from capture_plan.mesh import vertex_areas
from capture_plan.reader.read import rig_from_raw
from capture_plan.sample import sample_rig
from tests.face.test_face_decoys import raw_of, with_more
from tests.face_heads import cut, sample_head

HEAD = sample_head()
PUPILS = float(HEAD.eye_left[0] - HEAD.eye_right[0])
EYES = (HEAD.eye_left + HEAD.eye_right) / 2
ACROSS, DOWN = np.meshgrid(np.linspace(-1, 1, 8), np.linspace(-1, 1, 8))


def with_card(place, words, *, named=True, amplitude=0.2):
    """The sample with a square that flaps about its middle in every blendshape that is called by one of these words."""
    square = 0.35 * PUPILS * np.stack([ACROSS.ravel(), DOWN.ravel(), np.zeros(64)], axis=1)
    corner = np.array([row * 8 + column for row in range(7) for column in range(7)])
    triangles = np.concatenate([corner[:, None] + [0, 1, 8], corner[:, None] + [1, 9, 8]])
    deltas = np.zeros((len(HEAD.names), 64, 3))
    rows = [k for k, name in enumerate(HEAD.names) if any(word in name for word in words)]
    deltas[rows, :, 1] = amplitude * PUPILS * np.sign(square[:, 1])
    head = with_more(HEAD, square + place, triangles, deltas)
    if named:
        return raw_of(head)
    object.__setattr__(head, "names", tuple(f"shape_{k}" for k in range(len(head.names))))
    return raw_of(head)


def near(found, place):
    return np.linalg.norm(np.subtract(found, place)) < 10


@pytest.mark.parametrize("apart", [2.6, -3.0])
@pytest.mark.parametrize("named", [True, False])
@pytest.mark.parametrize("words", [("outh", "jaw"), ("eye",)])
def test_a_card_beside_the_head_tells_nothing_of_it(apart, named, words):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        read = face_reading(rig_from_raw(with_card(EYES + np.array([apart * PUPILS, 0, 0]), words, named=named)))
    assert (read.axes.up, read.axes.facing, read.axes.sure) == ("+y", "+z", True)
    assert not read.eyes.sure or near(read.eyes.left, HEAD.eye_left)
    assert not read.mouth.sure or near(read.mouth.at, HEAD.mouth)


def test_two_alike_are_both_heads_and_what_stands_within_a_face_belongs_to_it():
    rig, apart = sample_rig(), np.array([400.0, 0, 0])
    twice = np.vstack([rig.neutral, rig.neutral + apart])
    triangles = np.vstack([rig.triangles, rig.triangles + len(rig.neutral)])
    a, rho = vertex_areas(twice, triangles), rig_channels(rig).rho
    assert not off_face(twice, triangles, np.concatenate([rig.deltas, rig.deltas], axis=1), a, rho).any()
    assert not rig_channels(rig).off_face.any()


def test_movements_that_are_one_another_s_multiples_are_one():
    d = np.random.default_rng(0).normal(size=(1, 5, 3))
    a, k = np.ones(5), 4
    same = np.arange(1.0, 1 + k)[:, None, None] * d
    assert variety(same, a, np.einsum("kvx,kvx->k", same, same)[:, None]) == pytest.approx(1)
    apart = np.eye(k)[:, :, None] * np.ones(3)
    assert variety(apart, np.ones(k), np.full((k, 1), 3.0)) == pytest.approx(k)


@pytest.mark.parametrize("below", [0.4, 0.6])
def test_of_a_head_that_was_cut_below_its_eyes_no_eyes_are_found_and_its_mouth_is(below):
    read = face_reading(rig_from_raw(raw_of(cut(HEAD, HEAD.neutral[:, 1] < EYES[1] - below * PUPILS))))
    assert (read.eyes.left, read.eyes.right, read.eyes.sure) == (None, None, False)
    assert any("beyond the edge" in sign.name for sign in read.eyes.signs)
    assert near(read.mouth.at, HEAD.mouth)


@pytest.mark.parametrize("above", [0.5, 0.7])
def test_of_a_head_that_was_cut_above_its_mouth_no_mouth_is_found_and_its_eyes_are(above):
    read = face_reading(rig_from_raw(raw_of(cut(HEAD, HEAD.neutral[:, 1] > EYES[1] - above * PUPILS))))
    assert (read.mouth.at, read.mouth.sure) == (None, False)
    assert read.eyes.sure
    assert near(read.eyes.left, HEAD.eye_left)


def test_the_edge_of_a_head_is_its_neck_and_no_opening_or_seam_of_it():
    rig = sample_rig()
    rho = rig_channels(rig).rho
    edge = outer_edge(rig.neutral, rig.triangles, rho)
    assert rig.neutral[edge, 1].max() < HEAD.mouth[1] - 0.5 * rho
    split = rig.triangles.copy()
    right = rig.neutral[split, 0].mean(axis=1) < 0
    split[right] += len(rig.neutral)
    halves = outer_edge(np.vstack([rig.neutral, rig.neutral]), split, rho)
    assert set((halves % len(rig.neutral)).tolist()) <= set(edge.tolist())
    assert not rig_channels(rig).cut.any()


def test_eyes_lend_no_trust_to_a_wide_pair_around_them_and_others_as_strong_leave_a_doubt():
    def pair(kind, trust, x, y):
        return Candidate(kind, kind, trust, np.array([[x, y, 0.0], [-x, y, 0.0]]))

    eyes = [pair("blink", 2.5, 30, 0), pair("ball", 1.5, 30, 0), pair("motion", 0.5, 47, 18)]
    found, _ = choose(eyes, [])
    assert found.sure
    assert found.places is not None
    others, mouth = pair("part", 2.0, 30, 70), Candidate("tear", "tear", 1.8, np.array([[0.0, -60, 0]]))
    assert not choose([*eyes, others], [])[0].sure
    assert choose([*eyes, pair("part", 2.0, 30, -70)], [mouth])[0].sure
    np.testing.assert_allclose(np.abs(found.places[:, 0]), 30)


# ---------------------------------------------------------------- ears and eyeballs
def head_with_cheek(out):
    """Points of a head whose ears lie at the sides, 80 mm from the middle, `out` further than the skin before them."""
    ears = [np.array([side * 80.0, 0, 0]) for side in (1, -1)]
    before = [ear * (80 - out) / 80 + [0, y, 30] for ear in ears for y in (-5, 0, 5)]
    return np.array([*ears, *before]), ears


@pytest.mark.parametrize(("out", "sure"), [(15.0, True), (3.0, False), (-10.0, False)])
def test_ears_stand_out_over_the_cheek_before_them(out, sure):
    skin, ears = head_with_cheek(out)
    assert are_ears(skin, ears, 0.0, 60.0) == sure


def test_an_ear_and_what_is_not_its_mirror_image_are_no_ears():
    skin, (left, right) = head_with_cheek(15.0)
    assert not are_ears(skin, [left, np.add(right, [0, 0, 25])], 0.0, 60.0)


@pytest.mark.parametrize(("wider", "moved"), [(1.10, True), (1.03, False)])
def test_lids_drawn_far_round_a_face_have_the_eyeballs_for_their_middles(wider, moved):
    shape = rig_shape(sample_rig())
    halves = [shape.neutral[shape.called_eyes & (side * shape.neutral[:, 0] > 0)] for side in (1, -1)]
    balls = np.array([(half.min(axis=0) + half.max(axis=0)) / 2 for half in halves])
    lids = balls * [wider, 1, 1] + [0, 0, 12]
    np.testing.assert_allclose(before_the_balls(shape, lids)[:, 0], (balls if moved else lids)[:, 0])
    np.testing.assert_allclose(before_the_balls(shape, lids)[:, 2], lids[:, 2])


@pytest.mark.parametrize(("low", "high", "lids"), [(0.2, 0.4, False), (-0.15, 0.6, True)])
def test_a_strip_above_an_eye_is_no_opening_of_its_lids_and_what_goes_around_it_is(low, high, lids):
    """A coarse brow drawn above an eye ends in a border that is nearer than the lids', which became too few."""
    rig, found = sample_rig(), rig_points(sample_rig()).eyes
    p = float(np.linalg.norm(found.places[0] - found.places[1]))
    drawn = []
    for place in found.places:
        off = (rig.neutral - place) / p
        drawn.append(
            np.flatnonzero((np.abs(off[:, 0]) < 0.3) & (off[:, 1] > low) & (off[:, 1] < high) & (off[:, 2] > -1))
        )
    eyes, border = eyes_of(rig, (drawn, []), 0.0, found)
    assert bool(len(border)) == lids
    assert lids or np.linalg.norm(eyes - found.places, axis=1).max() < 0.2 * p


@pytest.mark.parametrize(("up", "against"), [(0.0, 0), (15.0, 0), (25.0, 1)])
def test_eyes_drawn_far_from_where_the_signs_agree_leave_a_doubt(up, against):
    places = np.array([[30.0, 0, 0], [-30.0, 0, 0]])
    assert len(against_eyes(places + np.array([0, up, 0]), places)) == against
