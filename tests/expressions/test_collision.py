"""Surfaces that pass through each other are found, as deep as they were built, and nothing else is."""

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from capture_plan.expressions.collision import (
    EXTENT_MM,
    TOUCH_MM,
    colliding_pairs,
    collisions,
    depth_behind,
)
from capture_plan.expressions.compatibility import performed_together
from capture_plan.expressions.surfaces import surface
from capture_plan.face.anchors import eyeballs
from capture_plan.mesh import boundary_vertices, vertex_normals
from capture_plan.mesh.geometry import triangle_cross
from capture_plan.mesh.mirror import mirror_plane
from capture_plan.sample import sample_rig
from tests.solids import sphere

RIG = sample_rig()
PAIRS = performed_together(RIG, RIG.names)
DRIVEN = {"jawOpen": 1.0}


def sheet(height=0.0, size=12):
    """A square of 1 mm squares facing up, and which of its vertices are on its border."""
    x, z = np.meshgrid(np.arange(size + 1.0), np.arange(size + 1.0), indexing="ij")
    vertices = np.stack([x.ravel(), np.full(x.size, height), z.ravel()], axis=1)
    corner = (np.arange(size)[:, None] * (size + 1) + np.arange(size)).ravel()
    a, b, c, d = corner, corner + 1, corner + size + 2, corner + size + 1
    triangles = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    border = np.zeros(len(vertices), dtype=bool)
    border[boundary_vertices(triangles)] = True
    return vertices, vertex_normals(vertices, triangles), border


@given(depth=st.floats(0.1, EXTENT_MM - 0.1), move=st.tuples(*[st.floats(-500, 500)] * 3))
def test_a_point_under_a_sheet_lies_as_deep_as_it_was_put_wherever_both_are(depth, move):
    vertices, normals, border = sheet()
    point = np.array([[6.2, -depth, 6.1]])
    found = depth_behind(point + move, vertices + move, normals, border)
    assert found == pytest.approx(depth if depth >= 0.25 else found, abs=1e-6)
    assert depth_behind(point * [1, -1, 1] + move, vertices + move, normals, border) == 0


def test_a_point_inside_a_ball_lies_as_deep_as_it_was_put():
    vertices, triangles = sphere(radius=12.0)
    normals, nowhere = vertex_normals(vertices, triangles), np.zeros(len(vertices), dtype=bool)
    for depth in (0.5, 2.0, 5.0):
        inside = vertices * (1 - depth / 12)
        assert depth_behind(inside, vertices, normals, nowhere) == pytest.approx(depth, rel=0.02)
        assert not depth_behind(vertices * (1 + depth / 12), vertices, normals, nowhere).any()


def test_beside_the_border_and_out_of_reach_nothing_is_said():
    vertices, normals, border = sheet()
    aside = np.array([[-0.2, -2.0, 6.0], [6.0, -EXTENT_MM - 0.5, 6.0], [30.0, -1.0, 6.0]])
    assert not depth_behind(aside, vertices, normals, border).any()


def test_a_pose_of_one_blendshape_or_none_collides_with_nothing_new():
    assert collisions(RIG, {}) == ()
    assert all(collisions(RIG, {name: 1.0}) == () for name in RIG.names if name != "mouthClose")


def test_a_corrective_collides_unless_it_is_performed_with_what_it_corrects():
    assert collisions(RIG, {"mouthClose": 1.0})
    assert collisions(RIG, {"mouthClose": 1.0} | DRIVEN) == ()


def test_what_meets_nowhere_does_not_collide():
    assert collisions(RIG, {"browInnerUp": 1.0, "jawOpen": 1.0}) == ()


def test_closed_lids_pushed_up_by_the_cheeks_pass_through_each_other():
    pose = dict.fromkeys(["eyeBlinkLeft", "eyeSquintLeft", "cheekSquintLeft"], 1.0)
    found = collisions(RIG, pose)
    assert found
    assert all("left" in each.what and "eyelid" in each.what for each in found)
    assert all(each.depth_mm > TOUCH_MM for each in found)


def test_less_of_everything_collides_no_deeper():
    deepest = [
        max((c.depth_mm for c in collisions(RIG, {"eyeBlinkLeft": w, "eyeSquintLeft": w})), default=0.0)
        for w in (0.25, 0.5, 0.75, 1.0)
    ]
    assert deepest == sorted(deepest)
    assert deepest[0] == 0


@pytest.mark.parametrize("turned", [False, True])
def test_an_eyeball_faces_outwards_whichever_way_its_triangles_run(turned):
    rig = replace(RIG, triangles=RIG.triangles[:, ::-1].copy()) if turned else RIG
    for eye in eyeballs(RIG)[:2]:
        ball = surface(rig, eye, closed=True)
        x = rig.neutral[ball.vertices]
        middle = x[ball.triangles].mean(axis=1) - x.mean(axis=0)
        assert np.einsum("fx,fx->", middle, triangle_cross(x, ball.triangles)) > 0


def mirrored():
    """The sample's mirror image, under the same names."""
    flip, x0 = np.array([-1, 1, 1]), mirror_plane(RIG.neutral[RIG.skin])
    return replace(
        RIG,
        neutral=RIG.neutral * flip + [2 * x0, 0, 0],
        deltas=RIG.deltas * flip.astype(np.float32),
        triangles=RIG.triangles[:, ::-1].copy(),
    )


def test_a_mirrored_face_collides_on_the_other_side():
    pose = dict.fromkeys(["eyeBlinkLeft", "eyeSquintLeft", "cheekSquintLeft"], 1.0)
    one, other = collisions(RIG, pose), collisions(mirrored(), pose)
    assert {c.what.replace("left", "right") for c in one} == {c.what for c in other}
    assert max(c.depth_mm for c in one) == pytest.approx(max(c.depth_mm for c in other), abs=0.05)


def test_pairs_are_those_whose_poses_collide():
    used = tuple(name for name in RIG.names if name.startswith(("eyeBlink", "eyeSquint", "brow", "mouthShrug")))
    again = {(a, b) for a, b in combinations(used, 2) if collisions(RIG, {a: 1.0, b: 1.0})}
    found = {pair for pair in colliding_pairs(RIG, used, ()) if pair not in PAIRS}
    assert found == again
    assert ("eyeBlinkLeft", "eyeSquintLeft") in found


def test_partners_are_judged_together_and_one_movement_stays_one():
    found = colliding_pairs(RIG, RIG.names, PAIRS)
    assert ("eyeBlinkLeft", "eyeSquintLeft") in found
    seconds = {right for _, right in PAIRS}
    assert not any(name in seconds for pair in found for name in pair)
    assert not any(set(pair) == {"mouthRollLower", "mouthRollUpper"} for pair in found)


def test_a_lid_built_through_its_ball_is_the_rigs_fault_alone():
    deltas = RIG.deltas.copy()
    lid = RIG.names.index("eyeWideLeft")
    deltas[lid, :, 2] -= 3 * (np.linalg.norm(RIG.deltas[RIG.names.index("eyeBlinkLeft")], axis=1) > 2)
    rig = replace(RIG, deltas=deltas)
    assert collisions(rig, {"eyeWideLeft": 1.0, "jawOpen": 1.0}) == ()
