"""Dots keep their distance through the air, keep off with their edges, and those that meet in a pose are named."""

import numpy as np
import pytest
from msgspec.structs import replace

from capture_plan.check.check import check_plan
from capture_plan.check.landmark_claims import mirrored_claim
from capture_plan.layout.design import design_layout
from capture_plan.layout.dot_contact import GAP_MM, NEUTRAL, meeting_words, meetings
from capture_plan.layout.naming import name_landmarks
from capture_plan.layout.problem import task_of
from capture_plan.layout.settings import LayoutSettings
from capture_plan.layout.spacing import nearest_straight
from capture_plan.mesh import geodesic_distance, straight_table
from capture_plan.plan.make import make_plan
from capture_plan.plan.record import sealed
from capture_plan.plan.settings import Settings
from tests.once import QUICK, plan_of

COVER = LayoutSettings(method="cover")


@pytest.fixture(scope="module")
def plan():
    return plan_of(QUICK)


def test_the_straight_table_holds_every_distance_below_its_radius_and_no_other():
    points = np.random.default_rng(0).normal(size=(60, 3))
    points[7] = points[3]  # two vertices on one place
    at = np.arange(0, 60, 1)[5:]
    table = straight_table(points, np.union1d(at, [3]), 0.9)
    apart = np.linalg.norm(points[:, None] - points[None], axis=2)
    stored = np.zeros((60, 60), dtype=bool)
    stored[table.nonzero()] = True
    expected = apart < 0.9
    expected[np.setdiff1d(np.arange(5), [3])] = expected[:, np.setdiff1d(np.arange(5), [3])] = False
    assert (stored | np.eye(60, dtype=bool))[np.ix_(at, at)].tolist() == expected[np.ix_(at, at)].tolist()
    assert (table != table.T).nnz == 0
    assert table[3, 7] > 0


def test_lips_of_a_closed_mouth_are_neighbours_though_far_apart_along_the_skin(face):
    near = face.near(8.0, face.sites(LayoutSettings())).tocoo()
    skin = np.flatnonzero(face.rig.skin & (face.regions.of_vertex == face.regions.names.index("upper lip")))
    along = geodesic_distance(face.graph, skin[:40])
    rows = np.searchsorted(skin[:40], near.row)
    held = (rows < 40) & (skin[:40][np.minimum(rows, 39)] == near.row)
    assert along[rows[held], near.col[held]].max() > 8.0


@pytest.mark.parametrize(
    "settings", [COVER, replace(COVER, method="distance"), replace(COVER, method="budget", budget=20)]
)
def test_dots_of_the_neutral_stand_apart_straight_by_the_spacing(face, settings):
    layout = design_layout(face, settings)
    vertices = np.array([m.vertex for m in layout.markers])
    assert nearest_straight(face.rig.neutral, vertices) >= settings.spacing_mm


def test_a_dot_keeps_off_a_zone_with_its_edge(face):
    for dot_mm in (2.0, 6.0):
        task = task_of(face, replace(COVER, dot_mm=dot_mm))
        vertices = task.sites.vertices[task.open_]
        assert not face.zone("wet lip", 2.5 + dot_mm / 2)[vertices].any()
    wide, small = (len(task_of(face, replace(COVER, dot_mm=dot_mm)).open_) for dot_mm in (6.0, 2.0))
    assert wide < small


def test_dots_that_meet_in_a_pose_are_those_that_come_within_a_diameter_and_the_gap(rig, plan):
    marks = plan.layout.markers
    poses = {"shut": {"mouthShrugLower": 1.0, "mouthClose": 1.0}, "still": {}}
    for dot_mm in (3.0, 25.0):
        found = meetings(rig, marks, poses, dot_mm)
        for name, weights in {NEUTRAL: {}, **poses}.items():
            posed = rig.pose(np.array([weights.get(each, 0.0) for each in rig.names]))[[m.vertex for m in marks]]
            expected = {
                (marks[a].name, marks[b].name)
                for a in range(len(marks))
                for b in range(a + 1, len(marks))
                if np.linalg.norm(posed[a] - posed[b]) < dot_mm + GAP_MM - 0.005
            }
            messages = [one for one in found if one.pose == name]
            assert {one.dots for one in messages} == expected
            assert [one.apart_mm for one in messages] == sorted(one.apart_mm for one in messages)
    assert "E" not in meeting_words((), 3.0, {})
    words = meeting_words(found, 25.0, {found[0].pose: "shot 5 (E01)"})
    assert f"shot 5 (E01) {' and '.join(found[0].dots)}" in words
    assert all(f"{one.dots[0]} and {one.dots[1]} {one.apart_mm:.1f} mm" in words for one in found)
    assert words.count("(they overlap)") == sum(one.apart_mm < 25.0 for one in found)


def test_a_plan_names_the_dots_that_meet_and_its_check_finds_them_missing(rig):
    wide = make_plan(rig, Settings(landmarks=replace(COVER, dot_mm=9.0, keep_out={}), expressions=QUICK.expressions))
    assert wide.meetings
    assert all(one.holds for one in check_plan(wide, rig))
    broken = [one.what for one in check_plan(sealed(replace(wide, meetings=wide.meetings[1:])), rig) if not one.holds]
    assert broken == ["dots that come near each other when the face moves are those of the rig"]


def test_mirrored_landmarks_have_mirrored_names(plan, face):
    task = task_of(face, COVER)
    assert mirrored_claim(plan, task).holds
    at = {m.vertex: i for i, m in enumerate(plan.layout.landmarks)}
    pair = next(m for m in plan.layout.landmarks if m.side == "left" and int(face.mirror[m.vertex]) in at)
    for change in ({"region": "ear"}, {"side": "right"}, {"label": f"{pair.label} 9"}):
        marks = list(plan.layout.landmarks)
        marks[at[pair.vertex]] = replace(pair, **change)
        forged = replace(plan, layout=replace(plan.layout, landmarks=tuple(marks)))
        assert not mirrored_claim(forged, task).holds


def test_a_mirrored_pair_that_lies_in_the_middle_is_counted_one_after_the_other(plan, face):
    task, regions, of = task_of(face, COVER), face.regions, face.mirror
    v = np.arange(len(of))
    inner = (regions.side == 0) & (of != v) & (of[of] == v) & (regions.of_vertex == regions.of_vertex[of])
    first = int(np.flatnonzero(inner & face.markable)[0])
    landmarks = name_landmarks(face, COVER, np.array([first, of[first]]), [0, 0])
    assert landmarks[0].label != landmarks[1].label
    assert mirrored_claim(replace(plan, layout=replace(plan.layout, landmarks=landmarks)), task).holds
