"""How a head is shown: no teeth before the lips, no teeth of shadow between them."""

from dataclasses import replace

import numpy as np
import pytest

from capture_plan.mesh import edges
from capture_plan.rig import Rig
from capture_plan.sheets.head import BEHIND_MM, TEETH, behind_lips, make_head, pose, softened
from tests.light import light_sample


@pytest.fixture(scope="module")
def toothed():
    """The light sample with three small teeth: 4 mm before its forehead, 4 mm behind it, and far before it."""
    rig = light_sample()
    brow = np.flatnonzero(rig.skin)[rig.neutral[rig.skin][:, 2].argsort()[-400:]]
    at = rig.neutral[brow[rig.neutral[brow][:, 1].argmax()]]
    shape = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], dtype=float)
    teeth = np.concatenate([at + shape + [0, 0, away] for away in (4.0, -4.0, 40.0)])
    v = len(rig.neutral)
    return Rig(
        name="toothed",
        neutral=np.concatenate([rig.neutral, teeth]),
        triangles=np.concatenate([rig.triangles, v + np.arange(9).reshape(3, 3)]),
        names=rig.names,
        deltas=np.concatenate([rig.deltas, np.zeros((len(rig.deltas), 9, 3), rig.deltas.dtype)], axis=1),
        skin=np.r_[rig.skin, np.zeros(9, dtype=bool)],
        parts=np.r_[rig.parts, np.full(9, len(rig.part_names))],
        part_names=(*rig.part_names, "upper teeth"),
        source_index=np.r_[rig.source_index, rig.source_index.max() + 1 + np.arange(9)],
    )


def test_teeth_before_the_skin_are_put_behind_it_and_others_stay(toothed):
    head, v = make_head(toothed), len(toothed.neutral) - 9
    x = behind_lips(head, toothed.neutral)
    moved = x - toothed.neutral
    assert (moved[v : v + 3, 2] <= -4 - BEHIND_MM + 2).all()  # the skin beside the place is bent
    assert (moved[v : v + 3, 2] > -12).all()
    assert not moved[:v].any()
    assert not moved[v + 3 :].any()
    number = next(i for i, piece in enumerate(head.pieces) if piece.material is TEETH)
    drawn = pose(head, toothed.neutral).pieces[number].vertices[: len(head.pieces[number].vertices)]
    assert drawn == pytest.approx(x[head.pieces[number].vertices], abs=1e-6)


def test_a_head_without_teeth_stays_as_it_is():
    rig = light_sample()
    assert behind_lips(replace(make_head(rig), pieces=()), rig.neutral) is rig.neutral


def test_shadow_that_changes_from_vertex_to_vertex_is_softened_and_even_shade_stays():
    rig = light_sample()
    even = np.full(len(rig.neutral), 0.6)
    assert softened(even, rig.triangles) == pytest.approx(even)
    uneven = even.copy()
    uneven[::7] = 0.0
    soft = softened(uneven, rig.triangles)
    a, b = edges(rig.triangles).T
    assert np.abs(soft[a] - soft[b]).max() < 0.5 * np.abs(uneven[a] - uneven[b]).max()
    assert soft.max() <= 0.6 + 1e-12
