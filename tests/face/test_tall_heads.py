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


def test_what_stands_as_far_off_on_a_piece_of_its_own_is_set_aside():
    head = tall(1.6)
    rows = [k for k, name in enumerate(head.names) if name.startswith("brow")]
    moved = np.linalg.norm(head.deltas[rows], axis=2).max(axis=0) > 0.1
    brow = cut(head, moved & head.of("skin"))
    still = head.deltas.copy()
    still[rows] = 0
    own = np.zeros_like(brow.deltas)
    own[rows] = brow.deltas[rows]
    apart = add(replace(head, deltas=still), (brow.neutral + np.array([0, 20.0, 5.0]), brow.triangles), "other", own)
    channels = find_channels(apart.neutral, apart.triangles, apart.deltas, apart.names)
    assert {name for name, own in zip(apart.names, channels.facial, strict=True) if not own} == {
        head.names[k] for k in rows
    }
    assert channels.elsewhere.sum() == len(rows)


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
