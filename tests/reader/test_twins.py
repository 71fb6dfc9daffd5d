"""Levels of detail and spare heads that move are left out and named, with their own blendshapes; what is worn stays."""

from dataclasses import replace

import numpy as np
import pytest

from capture_plan.formats.raw import RawRig
from capture_plan.reader.twins import one_of_each
from tests.face_channels import seven
from tests.face_heads import Head, bearded, caged, haired, hatted, sample_head
from tests.reader.test_belongs import FACES, NUMBERS, SAMPLE, SKIN, level

ASIDE = np.array([260.0, 0, 0])
HEAD = sample_head()


def raw_of(head: Head, names: tuple[str, ...] | None = None) -> RawRig:
    """The head as a file in which every part is a mesh."""
    index = np.arange(len(head.neutral), dtype=np.int32)
    meshes = head.parts.astype(np.int32)
    arrays = (head.neutral, head.triangles, head.deltas, names or head.names, head.parts, head.part_names, index)
    return RawRig("r", *arrays, meshes=meshes)


def with_mesh(head: Head, name: str, points, triangles, deltas, names) -> Head:
    """A head with one more mesh that its own blendshapes (k) or further ones move."""
    every = tuple(dict.fromkeys((*head.names, *names)))
    whole = np.zeros((len(every), len(head.neutral) + len(points), 3), np.float32)
    whole[: len(head.names), : len(head.neutral)] = head.deltas
    for own, delta in zip(names, deltas, strict=True):
        whole[every.index(own), len(head.neutral) :] = delta
    return replace(
        head,
        neutral=np.concatenate([head.neutral, points]),
        triangles=np.concatenate([head.triangles, triangles + len(head.neutral)]).astype(np.int32),
        deltas=whole,
        names=every,
        parts=np.append(head.parts, np.full(len(points), len(head.part_names))).astype(np.int32),
        part_names=(*head.part_names, name),
    )


OF_SKIN = [k for k, delta in enumerate(SAMPLE.deltas) if np.linalg.norm(delta[NUMBERS], axis=1).max() > 1]


def coarse(share):
    """The skin in fewer triangles, and how the blendshapes OF_SKIN move it."""
    points, triangles = level(share)
    near = np.linalg.norm(SKIN[:, None] - points[None], axis=2).argmin(axis=0)
    return points, triangles, SAMPLE.deltas[OF_SKIN][:, NUMBERS[near]]


@pytest.mark.parametrize("share", [0.5, 0.1, 0.05])
@pytest.mark.parametrize("by", [0 * ASIDE, ASIDE], ids=["on it", "beside"])
@pytest.mark.parametrize("own", ["", "LOD1_"])
def test_a_level_of_detail_that_moves_is_left_out_and_named(share, by, own):
    points, triangles, deltas = coarse(share)
    names = tuple(own + SAMPLE.names[k] for k in OF_SKIN)
    rig = one_of_each(raw_of(with_mesh(HEAD, "face_LOD1", points + by, triangles, deltas, names)))
    assert rig.left_out == ("face_LOD1",)
    assert "face_LOD1" in rig.note
    assert (names[0] in rig.note) == bool(own)
    assert (rig.names, rig.part_names) == (HEAD.names, HEAD.part_names)
    np.testing.assert_array_equal(rig.neutral, HEAD.neutral)
    np.testing.assert_array_equal(rig.deltas, HEAD.deltas)


@pytest.mark.parametrize("few", [3, 20])
def test_a_spare_head_of_fewer_blendshapes_is_left_out_with_them(few):
    names = tuple(f"old_{SAMPLE.names[k]}" for k in OF_SKIN[:few])
    head = with_mesh(HEAD, "old", SKIN + ASIDE, FACES, SAMPLE.deltas[OF_SKIN[:few]][:, NUMBERS], names)
    rig = one_of_each(raw_of(head))
    assert (rig.left_out, rig.names) == (("old",), HEAD.names)


def test_of_two_heads_that_the_same_blendshapes_move_the_first_stays():
    head = with_mesh(HEAD, "twin", SKIN + ASIDE, FACES, SAMPLE.deltas[:, NUMBERS], SAMPLE.names)
    assert one_of_each(raw_of(head)).left_out == ("twin",)


@pytest.mark.parametrize("same", [True, False])
def test_of_two_heads_with_blendshapes_of_their_own_the_first_stays_where_both_move_alike_else_none_goes(same):
    names = tuple(f"B_{name}" for name in SAMPLE.names)
    deltas = SAMPLE.deltas[:, NUMBERS] * np.where(np.arange(len(names)) % 2 == 0, 1, 1 if same else 0.5)[:, None, None]
    found = one_of_each(raw_of(with_mesh(HEAD, "twin", SKIN + ASIDE, FACES, deltas, names)))
    assert found.left_out == (("twin",) if same else ())
    assert len(found.names) < 60 if same else len(found.names) == 2 * len(HEAD.names)
    assert ("twin" in found.note) == same


def test_eyes_of_the_same_level_go_with_it_and_others_stay():
    points, triangles, deltas = coarse(0.1)
    head = with_mesh(HEAD, "face_LOD1", points, triangles, deltas, [SAMPLE.names[k] for k in OF_SKIN])
    eye = HEAD.of("eye_L")
    inner = HEAD.triangles[eye[HEAD.triangles].all(axis=1)]
    used = np.unique(inner)
    for name in ("eye_LOD1", "cornea"):
        moves = HEAD.deltas[:, used]
        head = with_mesh(head, name, HEAD.neutral[used], np.searchsorted(used, inner), moves, HEAD.names)
    assert set(one_of_each(raw_of(head)).left_out) == {"face_LOD1", "eye_LOD1"}


def test_a_hand_that_moves_is_no_copy_of_the_other():
    rng = np.random.default_rng(0)
    hand = np.concatenate([SKIN[:, :1] + 200 + 0.3 * SKIN[:, 1:2], SKIN[:, 1:]], axis=1)  # of no symmetry of its own
    gestures = rng.normal(size=(60, 1, 1)) * (hand - hand.mean(axis=0)) * 0.1
    names = tuple(f"gesture_{i}" for i in range(60))
    head = with_mesh(HEAD, "hand_l", hand, FACES, gestures, names)
    head = with_mesh(head, "hand_r", hand * [-1, 1, 1], FACES[:, ::-1], gestures * [-1, 1, 1], names)
    assert one_of_each(raw_of(head)).left_out == ()


@pytest.mark.parametrize("worn", [bearded, hatted, haired, caged])
@pytest.mark.parametrize("channels", [lambda head: head, seven], ids=["full", "seven"])
def test_what_is_worn_and_moves_along_stays(worn, channels):
    head = channels(worn(HEAD))
    deltas = head.deltas.copy()
    deltas[0] += np.where(np.any(deltas, axis=(0, 2))[:, None], 0, 1).astype(np.float32)
    assert one_of_each(raw_of(replace(head, deltas=deltas))).left_out == ()


def test_of_two_heads_in_one_mesh_eyes_and_teeth_go_with_theirs():
    v, b = len(HEAD.neutral), np.array([400.0, 0, 0])
    two = replace(
        HEAD,
        neutral=np.concatenate([HEAD.neutral, HEAD.neutral + b]),
        triangles=np.concatenate([HEAD.triangles, HEAD.triangles + v]),
        deltas=np.concatenate([HEAD.deltas, HEAD.deltas], axis=1),
        parts=np.zeros(2 * v, dtype=np.int32),
        part_names=("heads",),
    )
    assert np.array_equal(one_of_each(raw_of(two)).neutral, HEAD.neutral)
