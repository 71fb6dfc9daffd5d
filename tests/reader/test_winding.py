"""Faces of a mirrored export are turned over, and everything is as on the head itself; no other head is touched."""

import dataclasses

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from capture_plan.audit.audit import audit_rig
from capture_plan.audit.report import verdict
from capture_plan.reader.read import rig_from_raw
from capture_plan.reader.winding import looks, outwards
from tests.face.test_face_decoys import raw_of
from tests.face_heads import KINDS, sample_head


def turned_over(raw):
    return dataclasses.replace(raw, triangles=raw.triangles[:, ::-1].copy())


@pytest.mark.parametrize("degrees", [0, 90])
def test_a_head_wound_inwards_is_read_as_the_head_itself(degrees):
    raw = raw_of(sample_head())
    R = Rotation.from_euler("x", degrees, degrees=True).as_matrix()
    raw = dataclasses.replace(raw, neutral=raw.neutral @ R.T, deltas=(raw.deltas @ R.T).astype(np.float32))
    straight, inward = rig_from_raw(raw), rig_from_raw(turned_over(raw))
    assert (inward.skin == straight.skin).all()
    assert "wound inwards" in inward.note
    assert "wound inwards" not in straight.note
    assert audit_rig(inward).used == audit_rig(straight).used
    assert verdict(audit_rig(inward)) == verdict(audit_rig(straight))


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_of_head_keeps_its_faces_and_gets_them_back(kind):
    head = KINDS[kind](sample_head())
    assert outwards(head.neutral, head.triangles, head.deltas) == (head.triangles, "")
    back, message = outwards(head.neutral, head.triangles[:, ::-1].copy(), head.deltas)
    assert (back == head.triangles).all()
    assert message


def test_a_hollow_face_that_looks_forward_is_left_as_it_is():
    """A drawn face on a dish: it looks to its own middle, and forward."""
    x, y = (axis.ravel() for axis in np.meshgrid(np.linspace(-1, 1, 9), np.linspace(-1, 1, 9)))
    dish = np.column_stack([x, y, x**2 + y**2])
    corner = np.arange(81).reshape(9, 9)[:-1, :-1].ravel()
    triangles = np.concatenate([corner[:, None] + [0, 1, 10], corner[:, None] + [0, 10, 9]])
    away, forward = looks(dish, triangles, np.ones((1, 81, 3)))
    assert away < -0.2
    assert forward > 0.3
    assert outwards(dish, triangles, np.ones((1, 81, 3)))[0] is triangles


def test_what_moves_nowhere_looks_nowhere():
    head = sample_head()
    assert looks(head.neutral, head.triangles, np.zeros_like(head.deltas)) == (0.0, 0.0)
