"""A mouth is sure only where lips are: not behind a beak or a muzzle, nor inside a mouth that stands wide open."""

import dataclasses

import numpy as np
import pytest

from capture_plan.face.lips import against_mouth
from capture_plan.face.reading import face_reading
from capture_plan.reader.read import rig_from_raw
from tests.face.test_face_decoys import raw_of
from tests.face_channels import full, seven
from tests.face_heads import bend, sample_head

PUPILS = 60.0


def beaked(length):
    """The sample with lips drawn forward into a beak."""

    def f(v):
        q = np.exp(-((v[:, 0] / 28) ** 2 + ((v[:, 1] - 672) / 26) ** 2)) * np.clip((v[:, 2] - 80) / 60, 0, 1.3)
        narrow, flat = 1 - 0.6 * np.clip(q, 0, 1), 1 - 0.3 * np.clip(q, 0, 1)
        return np.stack([v[:, 0] * narrow, 672 + (v[:, 1] - 672) * flat, v[:, 2] + length * q], axis=1)

    return bend(sample_head(), f)


def muzzled(length):
    """The sample with nose and mouth drawn forward and down into a long muzzle."""

    def f(v):
        w = np.clip((v[:, 2] - 110) / 40, 0, 1.5) * np.exp(-(((v[:, 1] - 682) / 34) ** 4) - (v[:, 0] / 45) ** 4)
        return v + length * w[:, None] * [0, -0.25, 1]

    return bend(sample_head(), f)


@pytest.mark.parametrize("shape", [beaked, muzzled])
@pytest.mark.parametrize("length", [50, 80, 120])
@pytest.mark.parametrize("channels", [full, seven])
def test_the_mouth_of_a_beak_or_a_muzzle_is_right_or_doubted_and_it_is_said_why(shape, length, channels):
    head = channels(shape(length))
    mouth = face_reading(rig_from_raw(raw_of(head))).mouth
    assert not mouth.sure or np.linalg.norm(np.subtract(mouth.at, head.mouth)) < 10
    assert mouth.sure or any(sign.weight < 0 for sign in mouth.signs)


@pytest.mark.parametrize("share", [0.25, 0.5, 1.0])
def test_a_mouth_that_stands_open_in_the_neutral_stays_sure_between_its_lips(share):
    head = sample_head()
    jaw = head.names.index("jawOpen")
    deltas = head.deltas.copy()
    deltas[jaw] *= -share
    names = tuple("mouthClosed" if name == "jawOpen" else name for name in head.names)
    opened = dataclasses.replace(head, neutral=head.neutral + share * head.deltas[jaw], deltas=deltas, names=names)
    mouth = face_reading(rig_from_raw(raw_of(opened))).mouth
    assert mouth.sure
    assert np.linalg.norm(np.subtract(mouth.at, head.mouth + share * np.array([0, -16.4, -9]))) < 10


def disc(z):
    """Skin of a flat face at a depth."""
    x, y = np.meshgrid(np.arange(-40.0, 41, 4), np.arange(-40.0, 41, 4))
    return np.stack([x.ravel(), y.ravel(), np.full(x.size, float(z))], axis=1)


@pytest.mark.parametrize(("before", "doubted"), [(0, False), (15, False), (25, True), (60, True)])
def test_skin_far_before_a_mouth_speaks_against_it(before, doubted):
    mouth = np.zeros(3)
    assert bool(against_mouth(disc(before), mouth, np.zeros((0, 3)), mouth, PUPILS)) == doubted


@pytest.mark.parametrize(("gape", "apart", "doubted"), [(0, 5, False), (0, 10, True), (20, 15, False), (20, 20, True)])
def test_movements_may_place_a_mouth_at_either_of_its_open_lips_and_no_further(gape, apart, doubted):
    lips = np.array([[0, gape / 2, 0], [0, -gape / 2, 0]])
    mouth, sign = np.zeros(3), np.array([0.0, -apart, 0])
    assert bool(against_mouth(disc(0), mouth, lips, sign, PUPILS)) == doubted
