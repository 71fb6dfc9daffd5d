"""What looks like a face beside the face: a veil that moves with it, a second head in the same file."""

import dataclasses

import numpy as np
import pytest

from capture_plan.face.anchors import _mouth as anchors_of_mouth
from capture_plan.face.anchors import face_anchors
from capture_plan.face.facts import reading_facts
from capture_plan.face.of_rig import rig_points, rig_shape
from capture_plan.face.reading import face_reading
from capture_plan.formats.raw import RawRig
from capture_plan.mesh import vertex_normals
from capture_plan.reader.read import rig_from_raw
from capture_plan.sample import sample_rig
from tests.face_channels import seven
from tests.face_heads import cut, mask, sample_head, visible_skin

SEVEN_OF_A_MASK = seven(mask(sample_head()))


def raw_of(head):
    """The head as a file of millimetres without a statement."""
    index = np.arange(len(head.neutral), dtype=np.int32)
    return RawRig("case", head.neutral, head.triangles, head.deltas, head.names, head.parts, head.part_names, index)


def with_more(head, points, triangles, deltas):
    """A head with one more piece."""
    return dataclasses.replace(
        head,
        neutral=np.vstack([head.neutral, points]),
        triangles=np.vstack([head.triangles, triangles + len(head.neutral)]).astype(np.int32),
        deltas=np.concatenate([head.deltas, deltas.astype(np.float32)], axis=1),
        parts=np.concatenate([head.parts, np.zeros(len(points), dtype=head.parts.dtype)]),
    )


def test_a_veil_that_moves_with_the_mouth_leaves_a_doubt_or_the_mouth_behind_it():
    head = sample_head()
    veil = cut(head, visible_skin(head) & (head.neutral[:, 1] < 690) & (head.neutral[:, 2] > 80))
    hanging = veil.neutral + 12 * vertex_normals(veil.neutral, veil.triangles)
    hanging[:, 1] -= 120 * np.clip((690 - hanging[:, 1]) / 60, 0, 1)
    mouth = face_reading(rig_from_raw(raw_of(with_more(head, hanging, veil.triangles, 0.8 * veil.deltas)))).mouth
    assert not mouth.sure or np.linalg.norm(np.subtract(mouth.at, head.mouth)) < 10


@pytest.mark.parametrize("apart", [140.0, 170.0, 250.0])
def test_of_two_heads_in_one_file_no_face_is_sure_and_it_is_said(apart):
    head = sample_head()
    one, other = np.concatenate([head.deltas, 0 * head.deltas]), np.concatenate([0 * head.deltas, head.deltas])
    twice = dataclasses.replace(head, deltas=one, names=head.names + tuple(f"B_{name}" for name in head.names))
    rig = rig_from_raw(raw_of(with_more(twice, head.neutral + np.array([apart, 0, 0]), head.triangles, other)))
    read = face_reading(rig)
    assert (read.eyes.sure, read.mouth.sure) == (False, False)
    assert "two heads move in this file" in rig.note


def test_the_two_halves_of_one_head_are_no_two_heads():
    head = sample_head()
    x = head.neutral[head.triangles, 0].mean(axis=1)
    halves = [cut_by_triangles(head, side) for side in (x > 0, x <= 0)]
    split = with_more(halves[0], halves[1].neutral, halves[1].triangles, halves[1].deltas)
    assert "two heads" not in rig_from_raw(raw_of(split)).note


def cut_by_triangles(head, retained):
    used = np.unique(head.triangles[retained])
    triangles = np.searchsorted(used, head.triangles[retained]).astype(np.int32)
    pick = {"neutral": head.neutral[used], "deltas": head.deltas[:, used], "parts": head.parts[used]}
    return dataclasses.replace(head, triangles=triangles, **pick)


def test_a_jaw_and_two_blinks_are_all_of_the_face_however_far_apart():
    head = sample_head()
    rows = [head.names.index(name) for name in ("jawOpen", "eyeBlinkLeft", "eyeBlinkRight")]
    few = dataclasses.replace(head, deltas=head.deltas[rows], names=tuple(head.names[k] for k in rows))
    mask = cut(few, visible_skin(few) & (few.neutral[:, 2] > 60))
    assert rig_from_raw(raw_of(mask)).understood.set_aside == ()


def test_the_tear_of_neighbours_is_the_largest_over_every_movement_of_the_face():
    shape = rig_shape(sample_rig())
    tear, pair = shape.tears
    some = np.linspace(0, len(pair) - 1, 500).astype(int)
    (i, j), rho = pair[some].T, shape.channels.rho
    d = shape.deltas[shape.channels.facial].astype(float)
    parted = np.linalg.norm(d[:, i] - d[:, j], axis=2).max(axis=0)
    assert tear[some] == pytest.approx(
        parted / (np.linalg.norm(shape.neutral[i] - shape.neutral[j], axis=1) + 0.04 * rho)
    )


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("skin", [True, False], ids=["skin", "whole"])
def test_of_half_a_head_neither_eyes_nor_mouth_are_sure(side, skin):
    head = sample_head()
    half = cut(head, (side * head.neutral[:, 0] >= -0.5) & (visible_skin(head) | np.array(not skin)))
    read = face_reading(rig_from_raw(raw_of(half)))
    assert (read.eyes.sure, read.mouth.sure) == (False, False)


def test_of_two_unlike_heads_with_names_of_their_own_the_other_is_told():
    head = sample_head()
    one, other = np.concatenate([head.deltas, 0 * head.deltas]), np.concatenate([0 * head.deltas, head.deltas])
    twice = dataclasses.replace(head, deltas=one, names=head.names + tuple(f"B_{name}" for name in head.names))
    unlike = [0.6, 0.45, 0.7]
    twice = with_more(twice, head.neutral * unlike + np.array([600.0, 0, 0]), head.triangles, other * unlike)
    note = rig_from_raw(raw_of(twice)).note
    assert "another head" in note or "two heads" in note
    assert "another head" not in rig_from_raw(raw_of(head)).note


def test_an_empty_shell_whose_blendshapes_are_rounding_has_no_face_and_one_that_moves_has():
    head = sample_head()
    rounding = np.float32(2e-7) * np.abs(head.neutral).max() * np.sign(head.deltas)
    read = reading_facts(rig_from_raw(raw_of(dataclasses.replace(head, deltas=rounding.astype(np.float32)))))
    assert read.no_face
    assert (read.eyes.left, read.mouth.mm) == (None, None)
    one = np.where(np.arange(len(head.names))[:, None, None] % 2 == 0, head.deltas, rounding)
    assert face_reading(rig_from_raw(raw_of(dataclasses.replace(head, deltas=one.astype(np.float32))))).eyes.sure


def test_a_border_that_passes_far_from_the_mouth_is_no_lips():
    """A hairline may go around a face with its middle where the mouth is."""
    rig = sample_rig()
    points, anchors = rig_points(rig), face_anchors(rig)
    off = np.abs(rig.neutral - points.mouth.places[0]) / anchors.pupils
    around = np.flatnonzero(rig.skin & (off[:, 1] > 0.35) & (off[:, 1] < 0.45) & (off[:, 0] < 0.5) & (off[:, 2] < 0.5))
    mouths = [
        anchors_of_mouth(
            rig, ([loop], []), anchors.eye_left / 2 + anchors.eye_right / 2, anchors.pupils, 0.0, points.mouth
        )
        for loop in (around, anchors.lips)
    ]
    assert [len(lips) for _, _, lips in mouths] == [0, len(anchors.lips)]
    assert np.linalg.norm(mouths[0][0] - mouths[1][0]) < 10


@pytest.mark.parametrize("named", [True, False])
def test_a_blendshape_whose_vertices_were_exchanged_is_set_aside_and_tells_nothing(named):
    head = SEVEN_OF_A_MASK
    order = np.random.default_rng(0).permutation(len(head.neutral))
    for k in (head.names.index("jawOpen"), head.names.index("mouthPucker")):
        deltas = head.deltas.copy()
        deltas[k] = deltas[k, order]
        names = head.names if named else tuple(f"shape_{i}" for i in range(len(head.names)))
        rig = rig_from_raw(raw_of(dataclasses.replace(head, deltas=deltas, names=names)))
        mouth = face_reading(rig).mouth
        assert rig.understood.set_aside == (names[k],)
        assert not mouth.sure or np.linalg.norm(np.subtract(mouth.at, head.mouth)) < 10
