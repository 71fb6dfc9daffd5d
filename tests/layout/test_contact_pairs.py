"""No two dots meet when the face moves: in a blendshape alone, in a pose, but for what a person pins twice."""

from dataclasses import replace as dataclass_replace

import numpy as np
import pytest
from msgspec.structs import replace

from capture_plan.anatomy.performed_deltas import performed_deltas
from capture_plan.layout.contact_pairs import met_in, pose_movements, without_pairs_of
from capture_plan.layout.design import chosen_apart, design_layout
from capture_plan.layout.dot_contact import GAP_MM, meetings
from capture_plan.layout.face import Face
from capture_plan.layout.problem import task_of
from capture_plan.layout.settings import LayoutSettings

POSES = {
    "shut": {"jawOpen": 0.4, "mouthClose": 0.4, "mouthPucker": 1.0},
    "sour": {"mouthRollLower": 1.0, "mouthShrugLower": 1.0},
}
WIDE = LayoutSettings(method="budget", budget=24, dot_mm=7.0, spacing_mm=9.0)


@pytest.fixture(scope="module")
def near(face):
    at, wide = np.flatnonzero(face.markable), {"dot_mm": WIDE.dot_mm, "spacing_mm": WIDE.spacing_mm}
    planned = met_in(face.rig.neutral, at, pose_movements(face.rig, POSES, at), **wide)
    assert planned.nnz
    return (planned + face.met(WIDE)).astype(bool).astype(np.float32)


@pytest.fixture(scope="module")
def apart(face):
    return design_layout(face, WIDE, poses=POSES)


def message(face, layout, dot_mm=WIDE.dot_mm):
    alone = {name: {name: 1.0} for name in face.used}
    return meetings(face.rig, layout.markers, alone | POSES, dot_mm)


def test_pairs_that_meet_are_those_that_every_pose_shows_one_by_one(face, near):
    some = np.random.default_rng(0).permutation(np.flatnonzero(face.markable))[:250]
    x = face.rig.neutral[some]
    expected = np.zeros((len(some), len(some)), dtype=bool)
    for moved in (*performed_deltas(face.rig, face.used)[:, some], *pose_movements(face.rig, POSES, some)):
        expected |= np.linalg.norm((x + moved)[:, None] - (x + moved)[None], axis=2) < WIDE.dot_mm + GAP_MM
    expected &= np.linalg.norm(x[:, None] - x[None], axis=2) >= WIDE.spacing_mm
    assert expected.any()
    assert (near[some][:, some].toarray() > 0).tolist() == expected.tolist()


def test_a_pose_is_the_rig_posed(face):
    at = np.arange(0, len(face.rig.neutral), 97)
    *_, last = pose_movements(face.rig, POSES, at)
    weights = np.array([POSES["sour"].get(name, 0.0) for name in face.rig.names])
    assert np.allclose(face.rig.neutral[at] + last, face.rig.pose(weights)[at], atol=1e-4)


def test_no_dots_of_a_layout_meet_where_some_would_have(face, apart):
    task = task_of(face, WIDE)
    neutral_only = replace(WIDE, dot_mm=0.0)
    assert [one for one in message(face, design_layout(face, neutral_only)) if one.pose != "neutral"]
    assert not [one for one in message(face, apart) if one.pose != "neutral"]
    assert len(task.apart_in(POSES).open_) < len(task.open_)


@pytest.mark.parametrize("symmetric", [False, True])
def test_two_pins_that_meet_stay_and_are_told_and_no_others_meet(face, near, symmetric):
    settings = replace(WIDE, symmetric=symmetric, budget=12)
    task = task_of(face, settings)
    vertices = task.sites.vertices[task.open_]
    pairs = zip(*near[vertices[:, 0]][:, vertices[:, 0]].nonzero(), strict=True)
    u, v = next((int(vertices[i, 0]), int(vertices[j, 0])) for i, j in pairs)
    assert without_pairs_of(near, np.array([u, v]))[u, v] == 0 < near[u, v]
    assert (near - without_pairs_of(near, np.array([u, v]))).nnz == 2
    layout = design_layout(face, replace(settings, pins=tuple(face.rig.source_index[[u, v]].tolist())), poses=POSES)
    pinned = {u, v, *(face.mirror[[u, v]].tolist() if symmetric else ())}
    assert pinned <= {m.vertex for m in layout.landmarks}
    names = {m.name for m in layout.landmarks if m.vertex in pinned}
    met = [set(one.dots) for one in message(face, layout) if one.pose != "neutral"]
    assert met
    assert all(dots <= names for dots in met)


def test_partners_that_alone_stand_for_a_blendshape_may_meet(face):
    plain = task_of(face, WIDE)
    site = next(s for s in plain.open_ if plain.sites.size[s] == 2)
    deltas, pair = face.rig.deltas.copy(), plain.sites.vertices[site]
    jaw, x = face.rig.names.index("jawOpen"), face.rig.neutral[pair, 0]
    deltas[jaw] = 0
    deltas[jaw, pair, 0] = x.mean() - x  # the two vertices alone, onto each other
    task = task_of(Face(dataclass_replace(face.rig, deltas=deltas), face.used, face.visibility), WIDE)
    apart = task.apart_in({})
    assert apart.met is not None
    assert apart.met[pair[0], pair[1]]
    assert apart.reachable.tolist() == task.reachable.tolist()
    assert len(apart.open_) < len(task.open_)


def test_where_all_partners_would_meet_as_many_are_placed_all_the_same(face):
    deltas = face.rig.deltas.copy()
    deltas[face.rig.names.index("jawOpen")] = face.rig.neutral * [-1, 0, 0]
    crushed = Face(dataclass_replace(face.rig, deltas=deltas), face.used, face.visibility)
    task = task_of(crushed, replace(WIDE, budget=6))
    _, _, sites = chosen_apart(task, task.apart_in({}), 0.1, None, None)
    assert task.sites.size[sites].sum() == 6


@pytest.mark.parametrize("settings", [LayoutSettings(method="cover"), replace(WIDE, spacing_mm=0.0)])
def test_the_papers_methods_and_dots_without_a_spacing_know_the_neutral_alone(face, settings):
    task = task_of(face, settings)
    assert task.apart_in(POSES) is task
