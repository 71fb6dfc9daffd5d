"""Unit and axes: turning or scaling a head turns or scales what is found; what is given or promised is heeded."""

import dataclasses
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from capture_plan.errors import RigError
from capture_plan.face.axes import axes_matrix
from capture_plan.face.frame import find_frame
from capture_plan.formats.raw import RawRig
from capture_plan.rig.read_options import AXES, ReadOptions
from capture_plan.sample import sample_rig

PAIRS = [(up, facing) for up in AXES for facing in AXES if up[1] != facing[1]]
pair = st.sampled_from(PAIRS)


@cache
def head(named: bool = True) -> RawRig:
    """The sample in its own axes and millimetres, as a reader would give it."""
    rig = sample_rig()
    part_names = rig.part_names if named else tuple(f"part{i}" for i in range(len(rig.part_names)))
    names = rig.names if named else tuple(f"morph_{i}" for i in range(len(rig.names)))
    return RawRig(rig.name, rig.neutral, rig.triangles, rig.deltas, names, rig.parts, part_names, rig.source_index)


def turned(raw: RawRig, up: str, facing: str, scale: float = 1.0) -> RawRig:
    """The rig as a program with these axes and this unit writes it."""
    R = scale * axes_matrix(up, facing)  # ours = R file, R^-1 = R^T / scale^2
    return dataclasses.replace(raw, neutral=raw.neutral @ R, deltas=(raw.deltas @ R).astype(np.float32))


@pytest.mark.parametrize(("up", "facing"), PAIRS)
def test_axes_are_right_handed_and_left_is_x(up, facing):
    R = axes_matrix(up, facing)
    np.testing.assert_array_equal(R @ R.T, np.eye(3))
    assert np.linalg.det(R) == 1
    np.testing.assert_array_equal(axes_matrix("+y", "+z"), np.eye(3))


@settings(max_examples=24, deadline=None)
@given(pair=pair, named=st.booleans())
def test_turning_a_head_turns_its_axes(pair, named):
    frame = find_frame(turned(head(named), *pair))
    assert (frame.up, frame.facing, frame.up_found, frame.facing_found) == (*pair, "detected", "detected")


@pytest.mark.parametrize("unit_mm", [1.0, 10.0, 100.0, 1000.0, 25.4])
@pytest.mark.parametrize("named", [True, False])
def test_scaling_a_head_scales_its_unit(unit_mm, named):
    frame = find_frame(turned(head(named), "+y", "+z", 1 / unit_mm))
    assert (frame.unit_mm, frame.unit_found) == (unit_mm, "detected")
    assert (frame.note == "") == frame.unit.sure == (unit_mm != 100.0)


@pytest.mark.parametrize("k", range(0, 52, 7))
def test_one_blendshape_is_enough_or_leaves_a_doubt(k):
    raw = turned(head(), "+z", "-y", 0.1)
    one = dataclasses.replace(raw, deltas=raw.deltas[k : k + 1], names=raw.names[k : k + 1])
    frame = find_frame(one)
    assert frame.unit_mm == 10.0
    assert (frame.up, frame.facing) == ("+z", "-y") or "not sure how the head lies" in frame.note


@pytest.mark.parametrize("name", ["browInnerUp", "eyeBlinkLeft", "jawOpen", "mouthSmileRight"])
def test_one_telling_blendshape_is_enough(name):
    raw = turned(head(), "+z", "-y", 0.1)
    k = raw.names.index(name)
    one = dataclasses.replace(raw, deltas=raw.deltas[k : k + 1], names=(name,))
    frame = find_frame(one)
    assert (frame.unit_mm, frame.up, frame.facing) == (10.0, "+z", "-y")


def test_triangles_wound_the_other_way_change_nothing():
    raw = dataclasses.replace(head(), triangles=head().triangles[:, ::-1].copy())
    frame = find_frame(raw)
    assert (frame.up, frame.facing) == ("+y", "+z")


@pytest.mark.parametrize("how", ["names", "balls", "blinks"])
def test_eyes_are_found_from_names_from_balls_and_from_blinks(how):
    """About 60 mm apart, the subject's left first, at one height."""
    raw = head(named=how == "names")
    if how == "blinks":
        skin = raw.triangles[(raw.parts[raw.triangles] == 0).all(axis=1)]
        raw = dataclasses.replace(raw, names=head().names, triangles=skin)
    eyes = find_frame(raw).points.eyes
    assert eyes.sure
    left, right = eyes.places
    assert left[0] > 0 > right[0]
    assert 50 < left[0] - right[0] < 74
    assert abs(left[1] - right[1]) < 2


def test_a_head_that_fits_no_usual_unit_gets_the_size_of_a_human_and_says_so():
    frame = find_frame(turned(head(), "+y", "+z", 3.1))
    left, right = frame.points.eyes.places
    assert frame.unit_mm * (left[0] - right[0]) == pytest.approx(63)
    assert not frame.unit.sure
    assert "scaled to the size of a human face" in frame.note


def test_a_toon_keeps_a_usual_unit_that_gives_it_a_human_face_and_says_so():
    raw = turned(head(), "+y", "+z", 0.1)
    aside = np.tanh(raw.neutral[:, 0] / 2) * 2.5  # eyes 110 mm apart in a head that is not much wider
    toon = dataclasses.replace(raw, neutral=raw.neutral + np.c_[aside, np.zeros((len(aside), 2))])
    frame = find_frame(toon)
    assert frame.unit_mm == 10.0
    assert not frame.unit.sure
    assert "one unit was taken as 10 mm; give --unit-mm" in frame.note


def test_what_is_given_wins():
    frame = find_frame(head(), ReadOptions(25.4, "-y", "-z"))
    assert (frame.unit_mm, frame.up, frame.facing) == (25.4, "-y", "-z")
    assert (frame.unit_found, frame.up_found, frame.facing_found) == ("given", "given", "given")


def test_one_axis_given_leaves_the_other_to_be_found():
    frame = find_frame(turned(head(), "+z", "-y"), ReadOptions(up="+z"))
    assert (frame.facing, frame.up_found, frame.facing_found) == ("-y", "given", "detected")


def promised(raw: RawRig) -> RawRig:
    return dataclasses.replace(raw, unit_mm=1000.0, up="+y", facing="+z")


def test_a_promise_of_the_format_is_kept_when_it_can_be():
    frame = find_frame(promised(turned(head(), "+y", "+z", 1e-3)))
    assert (frame.unit_mm, frame.up, frame.facing, frame.note) == (1000.0, "+y", "+z", "")
    assert (frame.unit_found, frame.up_found, frame.facing_found) == ("format", "format", "format")


def test_a_promise_that_cannot_be_is_broken_aloud():
    frame = find_frame(promised(turned(head(), "+y", "-z", 0.1)))
    assert (frame.unit_mm, frame.facing) == (10.0, "-z")
    assert "the format says +y up and facing +z" in frame.note
    assert "1000 mm by the file" in frame.note
    assert "pupils" not in frame.note  # how far apart they are, only the reading of the finished rig says


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ((None, "y", None), "up is 'y', expected one of"),
        ((None, None, "z+"), r"facing is 'z\+', expected one of"),
        ((None, "+y", "-y"), "choose two different axes"),
        ((0.0, None, None), "expected a length above 0"),
        ((1e-300, None, None), "expected a length above 0"),
        ((float("nan"), None, None), "expected a length above 0"),
    ],
)
def test_impossible_wishes_are_refused(given, says):
    with pytest.raises(RigError, match=says):
        ReadOptions(*given)


def test_blendshapes_that_move_no_surface_are_refused():
    raw = head()
    deltas = np.zeros((1, len(raw.neutral), 3), dtype=np.float32)
    deltas[0, 0] = 1
    lonely = dataclasses.replace(
        raw, deltas=deltas, names=("a",), triangles=raw.triangles[(raw.triangles != 0).all(axis=1)]
    )
    with pytest.raises(RigError, match="no blendshape moves a triangle"):
        find_frame(lonely)
