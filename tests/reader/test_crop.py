"""Whole figures: the head is kept as it is, the body left out and told; heads and busts are not touched."""

import dataclasses

import numpy as np

from capture_plan.formats.raw import RawRig
from capture_plan.reader.crop import WHOLE_RIG, crop_to_head
from capture_plan.sample import sample_rig


def cropped(raw: RawRig) -> RawRig:
    """Cropped to the head; all of its blendshapes are the face's."""
    return crop_to_head(raw, np.ones(len(raw.names), dtype=bool))


def head_on_a_body(height_mm: float) -> RawRig:
    """The sample's head with a slab of triangles below it, down to `height_mm`."""
    rig = sample_rig()
    v = len(rig.neutral)
    y = rig.neutral[:, 1].min() - np.linspace(0, height_mm, 60)
    slab = np.stack([np.tile([-100.0, 100.0], 30), y, np.zeros(60)], axis=1)
    triangles = np.arange(58)[:, None] + np.arange(3) + v
    return RawRig(
        name="figure",
        neutral=np.concatenate([rig.neutral, slab]),
        triangles=np.concatenate([rig.triangles, triangles]),
        deltas=np.concatenate([rig.deltas, np.zeros((len(rig.names), 60, 3), np.float32)], axis=1),
        names=rig.names,
        parts=np.concatenate([rig.parts, np.zeros(60, np.int32)]),
        part_names=rig.part_names,
        source_index=np.arange(v + 60, dtype=np.int32),
    )


def test_a_bust_is_kept_whole():
    raw = head_on_a_body(300)
    assert cropped(raw) is raw


def test_of_a_figure_the_head_stays_with_all_its_numbers_and_motion():
    raw, sample = head_on_a_body(1500), sample_rig()
    head = cropped(raw)
    np.testing.assert_array_equal(head.source_index[: len(sample.neutral)], np.arange(len(sample.neutral)))
    np.testing.assert_array_equal(head.neutral, raw.neutral[head.source_index])
    np.testing.assert_array_equal(head.deltas, raw.deltas[:, head.source_index])
    np.testing.assert_array_equal(head.triangles[: len(sample.triangles)], sample.triangles)
    assert len(sample.neutral) < len(head.neutral) < len(raw.neutral) - 30
    assert f"{len(raw.neutral) - len(head.neutral)} vertices far from all that moves were left out" in head.note


def test_a_crop_does_not_depend_on_unit_or_axes():
    raw = head_on_a_body(1500)
    turned = dataclasses.replace(
        raw, neutral=raw.neutral[:, [2, 0, 1]] / 1000, deltas=raw.deltas[..., [2, 0, 1]] / 1000
    )
    np.testing.assert_array_equal(cropped(turned).source_index, cropped(raw).source_index)


def test_a_few_blendshapes_do_not_say_where_the_face_is():
    raw = head_on_a_body(1500)
    few = dataclasses.replace(raw, deltas=raw.deltas[: WHOLE_RIG - 1], names=raw.names[: WHOLE_RIG - 1])
    assert cropped(few) is few
