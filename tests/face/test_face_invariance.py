"""What is understood of a face hangs on none of the things that don't make it a face.

The sample always; FaceCap and ICT FaceKit where the environment variable CAPTURE_PLAN_RIGS names a folder that
holds them (`npz/facecap_generic.npz`, `npz/ict_facekit_full.npz`).
"""

import os
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from capture_plan.face.axes import axes_matrix
from capture_plan.face.reading import face_reading
from capture_plan.formats.raw import RawRig
from capture_plan.mesh.decimate import decimate
from capture_plan.reader.read import read_raw, rig_from_raw
from capture_plan.rig.read_options import ReadOptions
from tests.face_family import PAIRS, UNITS, Truth, judge, raw_rig
from tests.face_heads import sample_head

RIGS = Path(os.environ.get("CAPTURE_PLAN_RIGS", "no such folder"))
FILES = {"FaceCap": RIGS / "npz" / "facecap_generic.npz", "ICT": RIGS / "npz" / "ict_facekit_full.npz"}
NOISE_MM = 0.05
SIDES = (("Left", "Right"), ("_L", "_R"))


@cache
def rig(name: str) -> tuple[RawRig, Truth]:
    """A rig as its file has it, and what is understood of it, which must be beyond doubt."""
    if name == "sample":
        head = sample_head()
        raw = raw_rig(head, Truth("+y", "+z", 1.0, head.eye_left, head.eye_right, head.mouth), (None, None, None))
    elif FILES[name].exists():
        raw = read_raw(FILES[name])
    else:
        pytest.skip(f"{name} is not at hand")
    reading = face_reading(rig_from_raw(raw))
    assert all(part.sure for part in (reading.axes, reading.unit, reading.eyes, reading.mouth))
    eyes = (np.array(reading.eyes.left), np.array(reading.eyes.right))
    return raw, Truth(reading.axes.up, reading.axes.facing, reading.unit.mm, *eyes, np.array(reading.mouth.at))


def renamed(raw: RawRig, truth: Truth) -> tuple[RawRig, Truth]:
    names = tuple(f"shape_{k:02d}" for k in range(len(raw.names)))
    return replace(raw, names=names, part_names=tuple(f"mesh_{i}" for i in range(len(raw.part_names)))), truth


def renumbered(raw: RawRig, truth: Truth) -> tuple[RawRig, Truth]:
    rng = np.random.default_rng(0)
    order = rng.permutation(len(raw.neutral))
    triangles = rng.permutation(np.argsort(order)[raw.triangles].astype(np.int32))
    arrays = {"neutral": raw.neutral[order], "deltas": raw.deltas[:, order], "parts": raw.parts[order]}
    return replace(raw, triangles=triangles, **arrays), truth


def turned(raw: RawRig, truth: Truth, up: str = "-x", facing: str = "+z") -> tuple[RawRig, Truth]:
    """The same head in a file whose `up` and `facing` are these."""
    R = axes_matrix(up, facing).T @ truth.rotation
    deltas = (raw.deltas @ R.T).astype(np.float32)
    return replace(raw, neutral=raw.neutral @ R.T, deltas=deltas), replace(truth, up=up, facing=facing)


def mirrored(raw: RawRig, truth: Truth) -> tuple[RawRig, Truth]:
    """The head in a mirror: what was left is right, in names as well."""
    flip = np.where(np.abs(truth.rotation[0]) > 0.5, -1.0, 1.0)
    places = [p * [-1.0, 1.0, 1.0] for p in (truth.eye_right, truth.eye_left, truth.mouth)]
    arrays = {"neutral": raw.neutral * flip, "deltas": (raw.deltas * flip).astype(np.float32)}
    names, parts = (tuple(map(_other_side, some)) for some in (raw.names, raw.part_names))
    image = replace(
        raw, triangles=np.ascontiguousarray(raw.triangles[:, ::-1]), names=names, part_names=parts, **arrays
    )
    return image, replace(truth, eye_left=places[0], eye_right=places[1], mouth=places[2])


def _other_side(name: str) -> str:
    for left, right in SIDES:
        if left in name:
            return name.replace(left, right)
        if right in name:
            return name.replace(right, left)
    return name


def scaled(raw: RawRig, truth: Truth, unit: str = "m") -> tuple[RawRig, Truth]:
    """The same head in a file of another unit that it does not state."""
    by = truth.unit_mm / UNITS[unit]
    deltas = (raw.deltas * by).astype(np.float32)
    return replace(raw, neutral=raw.neutral * by, deltas=deltas, unit_mm=None), replace(truth, unit_mm=UNITS[unit])


def decimated(raw: RawRig, truth: Truth) -> tuple[RawRig, Truth]:
    retained, triangles = decimate(raw.neutral, raw.triangles, len(raw.triangles) // 2)
    numbers = np.arange(len(retained), dtype=np.int32)
    arrays = {"neutral": raw.neutral[retained], "deltas": raw.deltas[:, retained], "parts": raw.parts[retained]}
    return replace(raw, triangles=triangles, source_index=numbers, **arrays), truth


def noisy(raw: RawRig, truth: Truth) -> tuple[RawRig, Truth]:
    """Every pose measured with noise of its own."""
    rng, sd = np.random.default_rng(0), NOISE_MM / truth.unit_mm
    off = rng.normal(scale=sd, size=raw.neutral.shape)
    deltas = raw.deltas + rng.normal(scale=sd, size=raw.deltas.shape) - off
    return replace(raw, neutral=raw.neutral + off, deltas=deltas.astype(np.float32)), truth


CHANGES = (renamed, renumbered, turned, mirrored, scaled, decimated, noisy)


@pytest.mark.parametrize("change", CHANGES, ids=lambda change: change.__name__)
@pytest.mark.parametrize("name", ["sample", *FILES])
def test_a_changed_file_of_a_face_is_understood_as_before(name: str, change: Callable):
    raw, truth = change(*rig(name))
    found = rig_from_raw(raw)
    assert set(judge(found, face_reading(found), truth).values()) == {"right"}


@pytest.mark.parametrize(("up", "facing"), PAIRS[::3])
def test_the_sample_is_understood_in_all_axes(up, facing):
    raw, truth = turned(*rig("sample"), up=up, facing=facing)
    found = rig_from_raw(raw)
    assert set(judge(found, face_reading(found), truth).values()) == {"right"}


@pytest.mark.parametrize("unit", UNITS)
def test_the_sample_is_understood_in_all_units(unit):
    raw, truth = scaled(*rig("sample"), unit=unit)
    found = rig_from_raw(raw)
    assert set(judge(found, face_reading(found), truth).values()) == {"right"}


@pytest.mark.parametrize("unit_mm", [0.1, 25.4])
def test_no_place_of_a_file_moves_with_the_unit_it_is_read_in(unit_mm):
    raw, _ = rig("sample")
    before, after = (rig_from_raw(raw, ReadOptions(unit)) for unit in (1.0, unit_mm))
    assert np.mean(before.skin == after.skin) > 0.999
    places = [[one.in_file(np.array(p)) for p in places_of(face_reading(one))] for one in (before, after)]
    np.testing.assert_allclose(places[1], places[0], atol=0.02)


def places_of(read):
    """Every place of a reading, millimetres."""
    return [
        read.eyes.left,
        read.eyes.right,
        read.ears.left,
        read.ears.right,
        *(p.at for p in (read.mouth, read.nose, read.chin)),
    ]
