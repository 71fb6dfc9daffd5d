"""What stands still says nothing of a head: floors, skies and stages change no axis, unit, eye or mouth."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from capture_plan.face.facts import reading_facts
from capture_plan.face.flying import flying
from capture_plan.face.moving import moving_pieces
from capture_plan.face.of_rig import rig_channels
from capture_plan.formats.raw import RawRig
from capture_plan.reader.read import rig_from_raw
from tests.face_heads import Head, add, ellipsoid, sample_head

ABOVE = np.array([0.0, 720.0, 40.0])  # the middle of the sample's head, mm


def plane(y: float, half: float, n: int) -> tuple[np.ndarray, np.ndarray]:
    """A level square of n x n vertices, mm."""
    x, z = (one.ravel() for one in np.meshgrid(*2 * [np.linspace(-half, half, n)], indexing="ij"))
    i = np.arange(n * n).reshape(n, n)
    a, b, c, d = (one.ravel() for one in (i[:-1, :-1], i[1:, :-1], i[:-1, 1:], i[1:, 1:]))
    return np.stack([x, np.full(n * n, y), z], 1), np.concatenate([np.stack([a, c, b], 1), np.stack([b, c, d], 1)])


STILL = {
    "floor": plane(-900, 1e4, 2),
    "fine floor": plane(-900, 1e4, 40),
    "table at the neck": plane(560, 2e3, 80),
    "sky of 50 m": ellipsoid(ABOVE, (5e4, 5e4, 5e4)),
    "sky of 50 km": ellipsoid(ABOVE, (5e7, 5e7, 5e7)),
    "room": ellipsoid(ABOVE, (1e3, 1e3, 1e3), 60),
    "tower far away": ellipsoid(np.array([3e6, 0, 2e6]), (90, 3000, 90)),
}


def read(head: Head, unit_mm: float, *, stated: bool):
    """What is understood of a head in a file of this unit."""
    index = np.arange(len(head.neutral), dtype=np.int32)
    deltas = (head.deltas / unit_mm).astype(np.float32)
    arrays = (head.neutral / unit_mm, head.triangles, deltas, head.names, head.parts, head.part_names, index)
    return rig_from_raw(RawRig("case", *arrays, unit_mm=unit_mm if stated else None))


def understood(rig):
    """Axes, unit, and the places of eyes and mouth in the rig's millimetres."""
    facts = reading_facts(rig)
    places = [facts.eyes.left, facts.eyes.right, facts.mouth]
    sure = (facts.axes.sure, facts.unit.sure, facts.eyes.sure, facts.mouth.sure)
    at = [0.0 if place is None or place.mm is None else place.mm for place in places]
    return (facts.axes.up, facts.axes.facing, facts.unit.mm, sure), np.array(at)


def few(head: Head) -> Head:
    """The head with a jaw, lids and two corners of the mouth alone: too few to crop a figure by."""
    retained = ("jawOpen", "eyeBlinkLeft", "eyeBlinkRight", "mouthSmileLeft", "mouthSmileRight", "mouthPucker")
    rows = [head.names.index(name) for name in retained]
    return replace(head, deltas=head.deltas[rows], names=retained)


@cache
def alone(blendshapes: int, unit_mm: float, *, stated: bool):
    """What is understood of the head without anything else, or of the one with few blendshapes."""
    head = next(one for one in (sample_head(), few(sample_head())) if len(one.names) == blendshapes)
    return understood(read(head, unit_mm, stated=stated))


FAR = ("floor", "sky of 50 km", "tower far away")  # where single precision is at its end in every unit


@pytest.mark.parametrize(
    ("still", "unit_mm", "stated"),
    [*((still, 1.0, False) for still in STILL), *((still, 1000.0, True) for still in FAR)],
)
def test_adding_what_stands_still_changes_nothing_that_is_understood_of_the_head(still, unit_mm, stated):
    for head in (sample_head(), few(sample_head())):
        before, places = alone(len(head.names), unit_mm, stated=stated)
        after, found = understood(read(add(head, STILL[still], "thing"), unit_mm, stated=stated))
        assert after == before
        assert found == pytest.approx(places, abs=0.5)


def test_the_size_of_what_moves_is_that_without_what_stands_still():
    head = sample_head()
    alone = rig_channels(read(head, 1.0, stated=True))
    with_sky = rig_channels(read(add(head, STILL["sky of 50 m"], "thing"), 1.0, stated=True))
    assert with_sky.rho == pytest.approx(alone.rho, rel=1e-6)
    assert with_sky.extent == pytest.approx(alone.extent, rel=1e-6)


def test_a_piece_moves_as_a_whole_or_not_at_all():
    head = add(sample_head(), STILL["floor"], "thing")
    moves = moving_pieces(head.triangles, head.deltas)
    assert not moves[-4:].any()
    assert moves[: len(sample_head().neutral)][sample_head().of("skin")].all()
    assert moving_pieces(head.triangles, 0 * head.deltas).all()


def test_a_vertex_that_flies_off_is_told_below_any_sky():
    head = sample_head()
    deltas = head.deltas.copy()
    deltas[0, 100] = [0, 0, 3000.0]
    odd = add(replace(head, deltas=deltas), ellipsoid(ABOVE, (5e4, 5e4, 5e4), 60), "sky")
    assert flying(odd.neutral, odd.triangles, odd.deltas).tolist() == [True] + [False] * (len(head.names) - 1)
