"""What hides skin from a camera: laws of the triangles that block."""

from dataclasses import replace

import numpy as np
import pytest

from capture_plan.face.anchors import eyeballs
from capture_plan.face.blocking import opaque_triangles, thin
from capture_plan.layout.face import see_face
from capture_plan.mesh import boundary_vertices
from capture_plan.rig.parts import part_kind
from capture_plan.sample import sample_rig


@pytest.fixture(scope="module")
def rig():
    return sample_rig()


def of_parts(rig, *names):
    return np.isin(rig.parts, [rig.part_names.index(name) for name in names])


def nameless(rig):
    return replace(rig, parts=np.zeros(len(rig.parts), dtype=int), part_names=("mesh",))


def named(rig, **names):
    return replace(rig, part_names=tuple(names.get(name, name) for name in rig.part_names))


def without(rig, gone):
    """The rig as it is exported without these vertices."""
    stay = np.flatnonzero(~gone)
    number = np.cumsum(~gone) - 1
    return replace(
        rig,
        neutral=rig.neutral[stay],
        deltas=rig.deltas[:, stay],
        triangles=number[rig.triangles[~gone[rig.triangles].any(axis=1)]],
        skin=rig.skin[stay],
        parts=rig.parts[stay],
        source_index=rig.source_index[stay],
    )


def test_lashes_are_thin_by_name_and_without_names_by_shape(rig):
    lashes = of_parts(rig, "lashes_L", "lashes_R")
    assert np.array_equal(thin(rig), lashes)
    assert np.array_equal(thin(nameless(rig)), lashes)


def test_skin_eyeballs_teeth_and_tongue_block_with_names_and_without(rig):
    solid = rig.skin | of_parts(rig, "eye_L", "eye_R", "teeth_upper", "teeth_lower", "tongue")
    for one in (rig, nameless(rig)):
        assert not thin(one)[solid].any()
        assert not thin(one)[eyeballs(one)[0]].any()
        kept = {tuple(corners) for corners in opaque_triangles(one)}
        assert kept == {tuple(corners) for corners in rig.triangles if not thin(one)[corners].all()}


def test_a_part_that_holds_skin_blocks_whatever_it_is_called(rig):
    assert not thin(named(rig, skin="eyelash_head"))[rig.skin].any()


@pytest.mark.parametrize("name", ["tearLine", "M_EyeOcclusion", "eyebrows", "cornea_shell"])
def test_clear_shells_and_brows_are_thin_by_name(rig, name):
    assert thin(named(rig, teeth_upper=name))[of_parts(rig, "teeth_upper")].all()


@pytest.mark.parametrize("name", ["glasses", "helmet", "hair_cap"])
def test_what_is_worn_and_hair_of_one_piece_block(rig, name):
    assert not thin(named(rig, tongue=name))[of_parts(rig, "tongue")].any()


def test_hair_of_many_open_sheets_is_thin_and_of_few_is_not(rig):
    def strands(number):
        x = rig.neutral[rig.skin].max(axis=0)
        corners = np.concatenate([x + np.array([[i, 0, 0], [i, 9, 0], [i + 0.5, 9, 0]]) for i in range(number)])
        v, n = len(rig.neutral), len(corners)
        return replace(
            rig,
            neutral=np.vstack([rig.neutral, corners]),
            triangles=np.vstack([rig.triangles, v + np.arange(n).reshape(-1, 3)]),
            deltas=np.pad(rig.deltas, ((0, 0), (0, n), (0, 0))),
            skin=np.pad(rig.skin, (0, n)),
            parts=np.pad(rig.parts, (0, n), constant_values=len(rig.part_names)),
            part_names=(*rig.part_names, "fringe_hair"),
            source_index=np.arange(v + n),
        )

    assert part_kind("fringe_hair") == "hair"
    assert len(boundary_vertices(strands(8).triangles)) > 0
    assert thin(strands(8))[len(rig.neutral) :].all()
    assert not thin(strands(7))[len(rig.neutral) :].any()


def test_a_head_is_seen_as_if_it_had_no_lashes(rig):
    few = ("eyeBlinkLeft", "browDownLeft", "jawOpen")
    lashes = of_parts(rig, "lashes_L", "lashes_R")
    whole, bare = see_face(rig, few), see_face(without(rig, lashes), few)
    assert np.array_equal(whole.visibility[~lashes], bare.visibility)
