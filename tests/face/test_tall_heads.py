"""Connected skin is one head, however long: no brow is set aside as another head's."""

from dataclasses import replace

import numpy as np
import pytest

from capture_plan.face.channels import find_channels
from capture_plan.formats.raw import RawRig
from capture_plan.reader.read import rig_from_raw
from tests.face_heads import Head, add, bend, cut, sample_head


def tall(by: float) -> Head:
    """The sample, `by` times as high."""
    return bend(sample_head(), lambda v: v * [1, by, 1])


def raw_of(head: Head) -> RawRig:
    """The head as a file that states millimetres."""
    index = np.arange(len(head.neutral), dtype=np.int32)
    arrays = (head.neutral, head.triangles, head.deltas, head.names, head.parts, head.part_names, index)
    return RawRig("case", *arrays, unit_mm=1.0)


@pytest.mark.parametrize("by", [1.0, 1.15, 1.3, 1.45, 1.6])
def test_of_a_head_of_any_height_nothing_is_set_aside(by):
    rig = rig_from_raw(raw_of(tall(by)))
    assert rig.understood.set_aside == ()
    assert "another head" not in rig.note


@pytest.mark.parametrize("by", [1.0, 1.3, 1.6])
def test_names_do_not_decide_how_long_a_head_may_be(by):
    head = replace(tall(by), names=tuple(f"shape_{k}" for k in range(len(sample_head().names))))
    assert rig_from_raw(raw_of(head)).understood.set_aside == ()


def with_brows_apart(head: Head, away: np.ndarray) -> tuple[Head, list[int]]:
    """The head whose brow movements move pieces of their own that lie so far away from its skin, mm."""
    rows = [k for k, name in enumerate(head.names) if name.startswith("brow")]
    moved = np.linalg.norm(head.deltas[rows], axis=2).max(axis=0) > 0.1
    brow = cut(head, moved & head.of("skin"))
    still, own = head.deltas.copy(), np.zeros_like(brow.deltas)
    still[rows], own[rows] = 0, brow.deltas[rows]
    return add(replace(head, deltas=still), (brow.neutral + away, brow.triangles), "other", own), rows


def test_what_stands_as_far_off_on_a_piece_of_its_own_is_set_aside():
    apart, rows = with_brows_apart(tall(1.6), np.array([0, 20.0, 40.0]))
    channels = find_channels(apart.neutral, apart.triangles, apart.deltas, apart.names)
    assert np.flatnonzero(~channels.facial).tolist() == rows
    assert np.flatnonzero(channels.elsewhere).tolist() == rows


def test_brows_that_float_on_the_skin_are_of_the_face():
    floating, _ = with_brows_apart(tall(1.6), np.array([0, 0, 3.0]))
    channels = find_channels(floating.neutral, floating.triangles, floating.deltas, floating.names)
    assert channels.facial.all()


@pytest.mark.parametrize("width_mm", [15.0, 18.0, 24.0])
def test_what_moves_the_whole_of_a_face_with_a_small_mouth_is_of_the_face(width_mm):
    """Drawn faces move little around the mouth, and all of themselves when they are glad."""
    head = sample_head()
    glad = ("browInnerUp", "browOuterUpLeft", "browOuterUpRight", "mouthSmileLeft", "mouthSmileRight")
    joy = head.deltas[[head.names.index(name) for name in glad]].sum(axis=0)
    mouths = [k for k, name in enumerate(head.names) if name.startswith("mouth")]
    near = np.exp(-((np.linalg.norm(head.neutral - head.mouth, axis=1) / width_mm) ** 2)).astype(np.float32)
    deltas = np.concatenate([head.deltas[mouths] * near[:, None], joy[None]])
    names = (*(head.names[k] for k in mouths), "Fcl_ALL_Joy")
    channels = find_channels(head.neutral, head.triangles, deltas, names)
    assert channels.radius[-1] > 2 * np.median(channels.radius)
    assert channels.facial.all()


def test_connected_skin_far_down_a_body_is_no_face():
    """One surface goes on 1.2 m below the face; what moves down there is none of it."""
    head = tall(1.0)
    x, y, _ = head.neutral.T
    low = head.of("skin") & (y < y[head.of("skin")].min() + 25) & ~head.deltas.any(axis=(0, 2))
    stretched = head.neutral - np.where(low[:, None], [0, 1200.0, 0], 0)
    deltas = head.deltas.copy()
    deltas[0] = 0
    deltas[0, low, 2] = 1 + 0.02 * x[low]
    channels = find_channels(stretched, head.triangles, deltas, head.names)
    assert not channels.facial[0]
    assert channels.facial[1:].all()
