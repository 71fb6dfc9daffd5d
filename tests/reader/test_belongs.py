"""What repeats the face without moving is left out; what is worn, looks out of it or lies under it stays."""

from functools import cache

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from capture_plan.formats.raw import RawRig
from capture_plan.mesh import vertex_normals
from capture_plan.mesh.decimate import decimate
from capture_plan.reader.belongs import what_belongs
from capture_plan.sample import sample_rig

SAMPLE = sample_rig()
ASIDE = np.array([260.0, 0, 0])


def part(name):
    """Vertices and triangles of a part of the sample, and its vertices' numbers."""
    inside = np.flatnonzero(SAMPLE.parts == SAMPLE.part_names.index(name))
    triangles = SAMPLE.triangles[np.isin(SAMPLE.triangles, inside).all(axis=1)]
    return SAMPLE.neutral[inside], np.searchsorted(inside, triangles), inside


def rig_with(*others, several=True):
    """The sample, every part a mesh, and further still meshes (name, vertices, triangles); or all in one mesh."""
    meshes = [(name, *part(name)[:2]) for name in SAMPLE.part_names] + list(others)
    starts = np.cumsum([0] + [len(x) for _, x, _ in meshes])
    order = np.concatenate([part(name)[2] for name in SAMPLE.part_names])
    deltas = np.zeros((len(SAMPLE.names), starts[-1], 3), np.float32)
    deltas[:, : len(order)] = SAMPLE.deltas[:, order]
    number = np.repeat(np.arange(len(meshes), dtype=np.int32), np.diff(starts))
    return RawRig(
        name="r",
        neutral=np.concatenate([x for _, x, _ in meshes]),
        triangles=np.concatenate([t + s for (_, _, t), s in zip(meshes, starts, strict=False)]).astype(np.int32),
        deltas=deltas,
        names=SAMPLE.names,
        parts=number if several else np.zeros_like(number),
        part_names=tuple(name for name, _, _ in meshes) if several else ("mesh",),
        source_index=np.arange(starts[-1], dtype=np.int32),
        meshes=number if several else None,
    )


SKIN, FACES, NUMBERS = part("skin")
WIDEST = SAMPLE.names[int(np.linalg.norm(SAMPLE.deltas, axis=2).max(axis=1).argmax())]


def posed(name):
    """The skin in a blendshape."""
    return SKIN + SAMPLE.deltas[SAMPLE.names.index(name), NUMBERS]


@cache
def level(share):
    """The skin in fewer triangles."""
    retained, triangles = decimate(SKIN, FACES, int(share * len(FACES)))
    return SKIN[retained], triangles


def shuffled(x, triangles):
    """Another order of the vertices."""
    order = np.random.default_rng(0).permutation(len(x))
    return x[order], np.argsort(order)[triangles]


COPIES = {
    "beside": lambda: (posed(WIDEST) + ASIDE, FACES),
    "on it": lambda: (SKIN, FACES),
    "turned": lambda: (posed(WIDEST) @ Rotation.from_euler("y", 40, degrees=True).as_matrix().T - 2 * ASIDE, FACES),
    "in another order": lambda: shuffled(posed(WIDEST) + ASIDE, FACES),
    "half": lambda: level(0.5),
    "a tenth, beside": lambda: (level(0.1)[0] + ASIDE, level(0.1)[1]),
    "a twentieth": lambda: level(0.05),
}


@pytest.mark.parametrize("how", COPIES)
def test_a_still_copy_of_the_face_is_left_out_and_named(how):
    rig = what_belongs(rig_with(("spare", *COPIES[how]())))
    assert rig.left_out == ("spare",)
    assert "spare" in rig.note
    assert rig.part_names == SAMPLE.part_names
    np.testing.assert_array_equal(rig.neutral, what_belongs(rig_with()).neutral)


@pytest.mark.parametrize("how", ["beside", "in another order"])
def test_a_copy_in_the_same_mesh_is_a_piece_of_it(how):
    rig = what_belongs(rig_with(("spare", *COPIES[how]()), several=False))
    assert len(rig.neutral) == len(SAMPLE.neutral)
    assert "a piece of mesh" in rig.left_out[0]


def test_eyes_and_teeth_beside_go_with_their_head():
    others = [(f"{name} spare", part(name)[0] + ASIDE, part(name)[1]) for name in ("eye_L", "eye_R", "teeth_lower")]
    rig = what_belongs(rig_with(("spare", posed(WIDEST) + ASIDE, FACES), *others))
    assert rig.part_names == SAMPLE.part_names
    assert len(rig.left_out) == 4


def test_teeth_that_swung_open_go_with_their_head():
    jaw = SAMPLE.names.index("jawOpen")
    teeth, triangles, numbers = part("teeth_lower")
    others = [("teeth spare", teeth + SAMPLE.deltas[jaw, numbers] + ASIDE, triangles)]
    rig = what_belongs(rig_with(("spare", posed("jawOpen") + ASIDE, FACES), *others))
    assert rig.left_out == ("spare", "teeth spare")


def ball(middle, radius):
    """A round mesh of 24 by 12 fields."""
    a, b = np.meshgrid(np.linspace(0, 2 * np.pi, 24, endpoint=False), np.linspace(0.1, np.pi - 0.1, 12))
    x = np.stack([np.sin(b) * np.cos(a), np.cos(b), np.sin(b) * np.sin(a)], axis=2).reshape(-1, 3)
    i = np.arange(11 * 24).reshape(11, 24)
    j = np.roll(i, -1, axis=1)
    return middle + radius * x, np.concatenate(
        [np.stack(t, axis=2).reshape(-1, 3) for t in ((i, j, i + 24), (j, j + 24, i + 24))]
    )


def raised(keep, distance):
    """Cloth over the skin where `keep(centre)` of a triangle is true."""
    return SKIN + distance * vertex_normals(SKIN, FACES), FACES[keep(SKIN[FACES].mean(axis=1))]


MIDDLE, HEIGHT = SKIN.mean(axis=0), float(np.ptp(SKIN[:, 1]))
OTHERS = {
    "a hat": raised(lambda c: c[:, 1] > MIDDLE[1] + 0.2 * HEIGHT, 8),
    "a hood": raised(lambda c: c[:, 2] < SKIN[:, 2].min() + 0.75 * np.ptp(SKIN[:, 2]), 6),
    "a tight hood": raised(lambda c: c[:, 2] < SKIN[:, 2].min() + 0.75 * np.ptp(SKIN[:, 2]), 0),
    "a mask": raised(lambda c: c[:, 2] > MIDDLE[2] + 30, 3),
    "half the head": raised(lambda c: c[:, 0] > 0, 0),
    "a cage": ball(MIDDLE, 220),
    "a third eye": (part("eye_L")[0] + [0, 60, 0], part("eye_L")[1]),
    "a body": (ball(MIDDLE - [0, 600, 0], 400)[0] * [0.5, 1, 0.4], ball(MIDDLE, 1)[1]),
}


@pytest.mark.parametrize("what", OTHERS)
def test_what_is_no_copy_stays(what):
    x, triangles = OTHERS[what]
    used, inner = np.unique(triangles, return_inverse=True)
    rig = what_belongs(rig_with((what, x[used], inner.reshape(-1, 3))))
    assert rig.left_out == ()
    assert rig.part_names[-1] == what


def test_a_copy_that_moves_stays():
    rig = rig_with(("twin", SKIN + ASIDE, FACES))
    rig.deltas[0, -len(SKIN) :] = 5
    assert what_belongs(rig).left_out == ()


def test_nothing_of_the_sample_is_left_out():
    rig = what_belongs(rig_with())
    assert (rig.left_out, rig.note, len(rig.neutral)) == ((), "", len(SAMPLE.neutral))
