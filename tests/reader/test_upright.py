"""A head that lies anyhow in its file is put upright; one that lies along axes is left alone."""

import dataclasses
import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from capture_plan.face.axes import Vote, axes_matrix, vector
from capture_plan.face.frame import find_frame, head_shape
from capture_plan.face.reading import face_reading
from capture_plan.face.shape import border_loops
from capture_plan.formats.raw import RawRig
from capture_plan.reader.read import read_rig, rig_from_raw
from capture_plan.reader.upright import (
    PITCH_DEGREES,
    lifted,
    neck_is_level,
    pitch_is_sure,
    rotated,
    straightened,
    upright,
)
from capture_plan.rig.read_options import ReadOptions
from capture_plan.sample import sample_rig
from tests.face.test_face_decoys import raw_of
from tests.face_heads import bend, sample_head
from tests.light import light_sample


def head() -> RawRig:
    rig = light_sample()
    return RawRig(
        rig.name, rig.neutral, rig.triangles, rig.deltas, rig.names, rig.parts, rig.part_names, rig.source_index
    )


def degrees(R):
    return np.degrees(np.arccos(np.clip((np.trace(R) - 1) / 2, -1, 1)))


@settings(max_examples=6, deadline=None)
@given(st.integers(0, 10_000))
def test_turning_a_head_turns_what_is_found_the_other_way(seed):
    Q = Rotation.random(random_state=seed).as_matrix()
    assert degrees(upright(rotated(head(), Q)).R @ Q @ upright(head()).R.T) < 0.5


def test_an_upright_head_is_told_upright_but_for_its_pitch():
    R = upright(head()).R
    assert R[0] == pytest.approx([1, 0, 0], abs=1e-3)
    assert degrees(R) < 10


@pytest.mark.parametrize(("up", "facing"), [("+y", "+z"), ("+z", "-y"), ("-x", "+y")])
def test_a_head_along_axes_is_left_alone(up, facing):
    raw = rotated(head(), axes_matrix(up, facing).T)
    assert straightened(raw, head_shape(raw)).raw is raw


@pytest.mark.parametrize("axis", ["y", "z"])
@pytest.mark.parametrize("angle", [-20, 12, 35])
def test_a_head_turned_about_one_axis_comes_back_exactly(axis, angle):
    Q = Rotation.from_euler(axis, angle, degrees=True).as_matrix()
    made = straightened(lying := rotated(head(), Q), head_shape(lying))
    found, Q_back = made.raw, made.Q
    assert np.abs(found.neutral - head().neutral).max() < 0.1  # millimetres
    assert degrees(Q_back @ Q) < 0.1
    assert f"turned by {abs(angle)} degrees" in found.note


def test_a_turned_rig_reads_as_the_straight_one(tmp_path):
    raw = rotated(head(), Rotation.from_euler("zy", [15, 20], degrees=True).as_matrix())
    np.savez(
        tmp_path / "a.npz", vertices=raw.neutral / 10, faces=raw.triangles, deltas=raw.deltas / 10, names=raw.names
    )
    rig = read_rig(tmp_path / "a.npz")
    turn = rig.neutral - rig.neutral.mean(axis=0)
    plain = head().neutral - head().neutral.mean(axis=0)
    R, _ = Rotation.align_vectors(turn, plain)
    assert degrees(R.as_matrix()) < 12
    assert abs(R.as_euler("xyz", degrees=True)[1:]).max() < 0.1  # no yaw, no roll
    assert "put upright" in rig.note
    again = read_rig(tmp_path / "a.npz", unit_mm=rig.unit_mm, up=rig.up, facing=rig.facing)
    assert again.fingerprint == rig.fingerprint


def test_a_mesh_without_symmetry_is_left_alone():
    rng = np.random.default_rng(0)
    v = rng.normal(size=(400, 3)) * [1, 2, 3] + rng.exponential(size=(400, 3))
    raw = dataclasses.replace(
        head(), neutral=v, deltas=rng.normal(size=(1, 400, 3)).astype(np.float32), names=("a",),
        triangles=np.arange(399).reshape(-1, 3), parts=np.zeros(400, dtype=np.int32), source_index=np.arange(400),
    )  # fmt: skip
    assert straightened(raw, head_shape(raw)).raw is raw


@pytest.mark.parametrize(
    ("degrees_down", "stated"),
    [(-50, None), (-30, ("+y", "+z")), (30, None), (45, ("+y", "+z")), (60, None)],
)
def test_a_head_that_bows_or_looks_up_is_lifted_and_told(degrees_down, stated):
    up, facing = stated or (None, None)
    bowed = rotated(head(), Rotation.from_euler("x", degrees_down, degrees=True).as_matrix())
    rig, upright_rig = (rig_from_raw(dataclasses.replace(raw, up=up, facing=facing)) for raw in (bowed, head()))
    back = np.reshape(rig.turn, (3, 3)) @ Rotation.from_euler("x", degrees_down, degrees=True).as_matrix()
    assert degrees(back) < 12
    assert re.search(r"the head is tipped by about \d+ degrees from the axes of its file: it was put upright", rig.note)
    read = face_reading(rig)
    assert read.sure
    assert read.axes.turned_degrees > 20
    apart = np.subtract(read.eyes.left, face_reading(upright_rig).eyes.left @ back.T)
    assert np.linalg.norm(apart) < 5


def test_a_head_that_bows_a_little_is_left_as_its_artist_made_it():
    bowed = rotated(head(), Rotation.from_euler("x", 14, degrees=True).as_matrix())
    assert rig_from_raw(bowed).turn == tuple(np.eye(3).ravel())


@pytest.mark.parametrize("named", [True, False])
def test_a_snout_is_no_tipped_head(named):
    sample = sample_head()

    def snout(v):
        x, y, z = v.T
        forward = np.clip((z - 90) / 60, 0, 2) * np.exp(-(((y - 680) / 40) ** 2))
        return v + np.stack([-0.3 * x * np.clip(forward, 0, 1), 0 * y, 60 * forward], axis=1)

    animal = bend(sample, snout)
    names = sample.names if named else tuple(f"t{k}" for k in range(len(sample.names)))
    raw = dataclasses.replace(raw_of(sample), neutral=animal.neutral, deltas=animal.deltas, names=names)
    assert rig_from_raw(raw).turn == tuple(np.eye(3).ravel())


@pytest.mark.parametrize("given", [{"up": "+z"}, {"up": "+z", "facing": "-y"}, {}])
def test_axes_of_a_turned_head_are_the_nearest_of_its_file_and_may_be_given(given, tmp_path):
    Q = Rotation.from_euler("xzx", [75, 12, 12], degrees=True).as_matrix()
    rig = rig_from_raw(rotated(head(), Q), ReadOptions(**given))
    up, facing = ((np.reshape(rig.turn, (3, 3))[row] @ vector(axis)) for row, axis in ((1, rig.up), (2, rig.facing)))
    assert min(up, facing) > 0.7  # nearer to it than to any other axis
    assert face_reading(rig).axes.up == rig.up
    assert degrees(np.reshape(rig.turn, (3, 3)) @ Q) < PITCH_DEGREES


@pytest.mark.parametrize(("words", "sure"), [("", True), ("cheek", False), ("jaw", False), ("eye", False)])
def test_how_far_a_turned_head_bows_is_sure_only_where_enough_movements_tell_it(words, sure):
    raw = head()
    rows = [k for k, name in enumerate(raw.names) if words in name]
    some = dataclasses.replace(raw, deltas=raw.deltas[rows], names=tuple(raw.names[k] for k in rows))
    for turn in ([40, 30, 40], [0, 30, 0]):
        read = rig_from_raw(rotated(some, Rotation.from_euler("xzx", turn, degrees=True).as_matrix()))
        assert read.understood is not None
        assert read.understood.axes.sure == sure
        assert sure or "how far it bows is not sure" in read.note


def test_signs_that_scatter_or_are_too_few_tell_no_pitch():
    ways = [np.array([0, np.cos(a), np.sin(a)]) for a in np.radians([-10, -5, 0, 0, 5, 10])]
    votes = [Vote(str(i), "up", way, 6.0, 0.05) for i, way in enumerate(ways)]
    assert pitch_is_sure(votes, np.eye(3))
    assert not pitch_is_sure(votes[1:5], np.eye(3))
    assert not pitch_is_sure(
        [dataclasses.replace(one, direction=one.direction * [0, 1, 6]) for one in votes], np.eye(3)
    )
    facing = [dataclasses.replace(one, role="facing", direction=one.direction[[0, 2, 1]]) for one in votes]
    assert pitch_is_sure(facing, np.eye(3))
    assert not pitch_is_sure(facing, Rotation.from_euler("x", 30, degrees=True).as_matrix())


def lopsided() -> RawRig:
    """The sample with one half of it drawn forward and down."""
    raw = head()
    pull = 7 * np.clip(raw.neutral[:, :1] / 40, 0, 1) * [0.5, 0.5, 1]
    return dataclasses.replace(raw, neutral=raw.neutral + pull)


def test_a_head_too_lopsided_to_be_turned_leaves_a_doubt():
    assert rig_from_raw(lopsided()).understood.axes.sure
    turned = rotated(lopsided(), Rotation.from_euler("y", 25, degrees=True).as_matrix())
    assert straightened(turned, head_shape(turned)).doubted
    rig = rig_from_raw(turned)
    assert not rig.understood.axes.sure
    assert "too lopsided to tell" in rig.note


@pytest.mark.parametrize("share", [0.5, 1.0])
def test_the_mouth_of_a_neutral_that_gapes_lies_between_its_lips(share):
    raw = head()
    jaw = raw.deltas[raw.names.index("jawOpen")]
    gaping = rig_from_raw(dataclasses.replace(raw, neutral=raw.neutral + share * jaw))
    closed = face_reading(sample_rig()).mouth.at
    lip = np.abs(raw.neutral - closed).sum(axis=1).argsort()[:30]  # both lips, the lower of which moves with the jaw
    lowest = gaping.neutral[lip, 1].min()
    assert face_reading(gaping).mouth.at[1] == pytest.approx((closed[1] + lowest) / 2, abs=8)


@pytest.mark.parametrize("forward", [40.0, 75.0])
def test_a_head_is_lifted_only_where_what_goes_up_and_what_looks_forward_tell_one_pitch(forward):
    """Skin of a face that is drawn flat looks up, although nothing that moves goes back."""
    raw = raw_of(sample_head())
    frame = find_frame(raw, ReadOptions(1.0))
    votes = tuple(tilted(vote, {"up": 40.0, "facing": forward}.get(vote.role, 0.0)) for vote in frame.votes)
    eyes = dataclasses.replace(frame.points.eyes, places=frame.points.eyes.places + np.array([0, 0, 45.0]))
    tipped = dataclasses.replace(frame, votes=votes, points=dataclasses.replace(frame.points, eyes=eyes))
    assert (lifted(raw, tipped).raw is not raw) == (forward == 40.0)


def tipped_frame(raw, *, scatter=0.0):
    """A frame whose signs and eyes tell a head that looks up by 40 degrees, each sign twice: so much more and less."""
    frame = find_frame(raw, ReadOptions(1.0))
    votes = tuple(tilted(vote, 40.0 + off) for vote in frame.votes for off in (scatter, -scatter))
    eyes = dataclasses.replace(frame.points.eyes, places=frame.points.eyes.places + np.array([0, 0, 45.0]))
    return dataclasses.replace(frame, votes=votes, points=dataclasses.replace(frame.points, eyes=eyes))


def test_a_head_is_lifted_only_by_signs_that_agree_on_how_far():
    raw = raw_of(sample_head())
    assert lifted(raw, tipped_frame(raw)).raw is not raw
    left = lifted(raw, tipped_frame(raw, scatter=60.0))
    assert left.doubted
    assert np.array_equal(left.Q, np.eye(3))
    assert "left as it is" in left.raw.note


@pytest.mark.parametrize("aslant", [0.0, 20.0])
def test_a_head_whose_neck_is_cut_level_stands_as_its_file_says(aslant):
    raw = raw_of(sample_head())
    frame = tipped_frame(raw)
    mouth = frame.points.mouth.places[0]
    edge = next(loop for loop in border_loops(raw.triangles) if raw.neutral[loop, 1].max() < mouth[1])
    neutral = raw.neutral.copy()
    neutral[edge, 1] = neutral[edge, 1].min() + np.tan(np.radians(aslant)) * neutral[edge, 2]
    cut = dataclasses.replace(raw, neutral=neutral)
    assert neck_is_level(cut, np.eye(3), mouth) == (aslant == 0)
    assert lifted(cut, frame).doubted == (aslant == 0)
    assert np.array_equal(lifted(cut, frame).Q, np.eye(3)) == (aslant == 0)
    scattered = tipped_frame(raw, scatter=60.0)
    assert (lifted(cut, scattered).raw is cut) == (aslant == 0)


def tilted(vote, degrees):
    """The vote with its direction so far from the axis of its role: up tips forward, forward tips down."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    ways = {"up": [0, c, s], "facing": [0, -s, c]}
    return dataclasses.replace(vote, direction=np.array(ways.get(vote.role, vote.direction)))
