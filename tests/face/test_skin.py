"""Which vertices are skin: laws on a head of balls, and the sample with and without its part names."""

import numpy as np
import pytest

from capture_plan.face.skin import find_skin, is_ball
from capture_plan.sample import sample_rig
from tests.solids import sphere


def scene(*solids):
    """(vertices, triangles, parts) of several (vertices, triangles)."""
    vertices, triangles, parts = [], [], []
    for part, (v, f) in enumerate(solids):
        triangles.append(f + sum(map(len, vertices)))
        vertices.append(v)
        parts.append(np.full(len(v), part))
    return np.concatenate(vertices), np.concatenate(triangles), np.concatenate(parts)


def bumpy_head(radius=100.0):
    vertices, triangles = sphere(radius=radius)
    return vertices * [0.8, 1.2, 1.0], triangles


def eyeball(x):
    vertices, triangles = sphere(8, 12, 14.0)
    return vertices + np.array([x, 20.0, 92.0]), triangles


def nod(vertices):
    delta = np.zeros((1, len(vertices), 3), dtype=np.float32)
    delta[0, :, 1] = np.where(vertices[:, 2] > 30, -5, 0)
    return delta


def test_eyeballs_are_no_skin_although_they_move_and_are_seen():
    vertices, triangles, parts = scene(bumpy_head(), eyeball(30.0), eyeball(-30.0))
    skin = find_skin(vertices, triangles, nod(vertices), np.zeros_like(parts), ("mesh",))
    assert not skin[parts > 0].any()
    assert skin[parts == 0].mean() > 0.98  # what an eyeball covers is hidden


@pytest.mark.parametrize(
    "name",
    ["teeth_upper", "M_EyeOcclusion", "Hair_Cards", "lashes", "helper-tongue", "T-shirt", "Headwear", "Headphones"],
)
def test_a_part_named_for_something_else_is_no_skin(name):
    patch, triangles = bumpy_head(40.0)
    vertices, triangles, parts = scene(bumpy_head(), (patch + np.array([0, 0, 150]), triangles))
    skin = find_skin(vertices, triangles, nod(vertices), parts, ("face", name))
    assert not skin[parts == 1].any()
    assert skin[parts == 0].all()


def test_the_main_part_is_skin_whatever_its_name():
    vertices, triangles, parts = scene(bumpy_head(), eyeball(30.0), eyeball(-30.0))
    assert find_skin(vertices, triangles, nod(vertices), parts, ("eyebrows", "a", "b"))[parts == 0].mean() > 0.98


def test_what_lies_inside_is_no_skin():
    vertices, triangles, parts = scene(bumpy_head(), bumpy_head(60.0))
    skin = find_skin(vertices, triangles, nod(vertices), np.zeros_like(parts), ("mesh",))
    assert np.array_equal(skin, parts == 0)


def test_unused_vertices_are_no_skin():
    vertices, triangles = bumpy_head()
    vertices = np.vstack([vertices, [[0, 0, 300]]])
    skin = find_skin(vertices, triangles, nod(vertices), np.zeros(len(vertices), dtype=int), ("mesh",))
    assert not skin[-1]
    assert skin[:-1].all()


def test_a_seam_does_not_cut_the_skin():
    """The lower half, cut loose along the equator with its border vertices doubled, stays skin."""
    vertices, triangles = bumpy_head()
    below = vertices[triangles].mean(axis=1)[:, 1] < 0
    doubled = triangles.copy()
    doubled[below] += len(vertices)
    vertices = np.vstack([vertices, vertices])
    skin = find_skin(vertices, doubled, nod(vertices), np.zeros(len(vertices), dtype=int), ("mesh",))
    assert skin[np.unique(doubled)].all()


def test_a_ball_is_told_from_a_head():
    assert is_ball(sphere()[0])
    assert not is_ball(bumpy_head()[0])


def test_the_sample_has_no_eyes_teeth_tongue_or_lashes_and_no_mouth_bag():
    rig = sample_rig()
    skin = find_skin(rig.neutral, rig.triangles, rig.deltas, rig.parts, rig.part_names)
    assert set(rig.parts[skin]) == {rig.part_names.index("skin")}
    mouth = rig.neutral[np.isin(rig.parts, [rig.part_names.index("teeth_upper"), rig.part_names.index("teeth_lower")])]
    low, high = mouth.min(axis=0), mouth.max(axis=0) - [0, 0, 10]  # behind the front teeth
    inside = ((rig.neutral > low) & (rig.neutral < high)).all(axis=1) & (rig.parts == 0)
    assert inside.sum() > 30  # the bag is there
    assert not skin[inside].any()


def test_the_sample_needs_no_names():
    rig = sample_rig()
    named = find_skin(rig.neutral, rig.triangles, rig.deltas, rig.parts, rig.part_names)
    bare = find_skin(rig.neutral, rig.triangles, rig.deltas, np.zeros_like(rig.parts), ("mesh",))
    assert (named != bare).mean() < 0.01
