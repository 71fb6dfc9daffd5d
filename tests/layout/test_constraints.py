"""Constraints on the sample head: every method meets each, what clashes is named, head markers keep apart."""

import numpy as np
import pytest
from msgspec.structs import replace

from capture_plan.audit.audit import audit_rig
from capture_plan.camera import cameras_for
from capture_plan.check.check import check_plan
from capture_plan.errors import InfeasibleError, RigError, SettingsError
from capture_plan.evaluation.alternatives import alternatives
from capture_plan.layout.constraints import OTHER_SHARE, counted, keep_outs
from capture_plan.layout.design import design_layout
from capture_plan.layout.face import SIXTY_EIGHT, Face, see_face
from capture_plan.layout.head_sites import HEAD_LAYOUTS, head_candidates
from capture_plan.layout.problem import task_of
from capture_plan.layout.record import View
from capture_plan.layout.settings import LayoutSettings
from capture_plan.mesh import geodesic_distance
from capture_plan.plan.summary import head_words
from capture_plan.sample import sample_rig
from tests.once import QUICK, plan_of

COVER = LayoutSettings(method="cover")
METHODS = (
    COVER,
    replace(COVER, number=31),
    LayoutSettings(method="adaptive"),
    LayoutSettings(method="distance", rounds=2),
    LayoutSettings(method="budget", budget=20),
    LayoutSettings(),
)


@pytest.fixture(scope="module")
def pin(face):
    """The allowed vertex furthest to the right that nobody chose: its mirror image is far."""
    chosen = {m.vertex for m in design_layout(face, COVER).landmarks}
    allowed = face.sites(COVER).vertices[:, 0]
    free = allowed[~np.isin(allowed, list(chosen)) & (face.mirror[allowed] != allowed)]
    return int(face.rig.source_index[free[len(free) // 2]])


def vertices_of(layout):
    return np.array([m.vertex for m in layout.landmarks])


@pytest.mark.parametrize("settings", METHODS, ids=lambda one: f"{one.method}-{one.number or one.budget}")
def test_every_method_keeps_pins_caps_keep_outs_and_forbidden_vertices(face, pin, settings):
    lips = int(face.rig.source_index[vertices_of(design_layout(face, settings))[-1]])
    asked = replace(settings, pins=(pin,), caps={"nose": 2, "brow": 8}, forbidden=(lips,))
    layout = design_layout(face, asked)
    vertices = vertices_of(layout)
    assert face.rig.vertex_of[pin] in vertices
    assert sum(m.region == "nose" for m in layout.landmarks) <= 2
    assert sum(m.region == "brow" for m in layout.landmarks) <= 8
    for name, margin in asked.keep_out.items():
        assert not face.zone(name, margin)[vertices].any()
    away = geodesic_distance(face.graph, np.array([face.rig.vertex_of[lips]]))[0, vertices]
    assert away.min() >= asked.dot_mm
    if asked.number:
        assert len(vertices) == asked.number
    if asked.budget:
        assert len(vertices) <= asked.budget


def test_more_wishes_never_make_the_program_cheaper(face, pin):
    free = design_layout(face, replace(COVER, number=31)).programs[0]
    bound = design_layout(face, replace(COVER, number=31, pins=(pin,), caps={"nose": 2})).programs[0]
    assert free.proven_optimal
    assert bound.proven_optimal
    assert bound.objective >= free.objective - 1e-6


def test_wishes_that_clash_are_named(face):
    wet = int(np.flatnonzero(face.zone("wet lip", 2.5) & (face.mirror != np.arange(len(face.mirror))))[0])
    pinned = replace(COVER, pins=(int(face.rig.source_index[wet]),))
    with pytest.raises(InfeasibleError, match=r"the pin at vertex .*; nothing on the wet lip"):
        design_layout(face, pinned)
    with pytest.raises(InfeasibleError, match=r"a landmark on every blendshape; exactly 3 landmarks"):
        design_layout(face, replace(COVER, number=3))
    with pytest.raises(InfeasibleError, match="at most 2 landmarks"):
        design_layout(face, replace(COVER, budget=2))


def test_a_wish_about_what_is_not_there_says_so(face):
    with pytest.raises(InfeasibleError, match="there is no region 'noze': name one of"):
        design_layout(face, replace(COVER, caps={"noze": 1}))
    with pytest.raises(InfeasibleError, match=r"vertex 999,999 .* is not in the rig"):
        design_layout(face, replace(COVER, pins=(999_999,)))
    inside = int(face.rig.source_index[~face.rig.skin][0])
    with pytest.raises(InfeasibleError, match=rf"pin: vertex {inside:,} .* is not on the face skin"):
        face.pinned(replace(COVER, pins=(inside,)))
    with pytest.raises(RigError, match="no keep-out zone is called 'wet lips'"):
        design_layout(face, replace(COVER, keep_out={"wet lips": 1.0}))


def test_one_or_two_head_markers_are_refused_because_they_fix_no_pose():
    for count in (0, 3, 4, 5):
        assert replace(COVER, head_markers=count).head_markers == count
    for count in (1, 2):
        with pytest.raises(SettingsError, match=f"{count} head markers do not fix"):
            replace(COVER, head_markers=count).__post_init__()


def test_a_pair_counts_twice_and_a_single_once():
    sites = task_of(see_nothing(), replace(COVER, keep_out={})).sites
    everywhere = np.ones(len(sample_rig().neutral), dtype=bool)
    np.testing.assert_array_equal(counted(sites, everywhere), sites.size)


def see_nothing():
    rig = sample_rig()
    return Face(rig, audit_rig(rig).used, rig.skin.astype(float))


def test_with_cameras_enough_of_them_see_every_landmark_at_once():
    rig = sample_rig()
    cameras = cameras_for("head-mounted-pair", rig.neutral, rig.skin)
    face = see_face(rig, audit_rig(rig).used, cameras)
    layout = design_layout(face, replace(COVER, min_views=2, dot_mm=2.0))
    views = face.views(2.0)
    at = np.flatnonzero(rig.skin)
    assert (views.views[np.isin(at, vertices_of(layout))] >= 2).all()
    assert all(len(m.views) == 2 and all(view.always and view.pixels > 0 for view in m.views) for m in layout.landmarks)
    with pytest.raises(InfeasibleError, match="min_views is 3 and there are 2 cameras"):
        design_layout(face, replace(COVER, min_views=3))


@pytest.mark.parametrize("count", [3, 4, 5])
def test_head_markers_stand_in_their_sectors_at_the_spacing_and_cost_no_landmark(face, count):
    plain, layout = (design_layout(face, replace(COVER, head_markers=n)) for n in (0, count))
    assert len(layout.head) == count
    assert len(layout.landmarks) == len(plain.landmarks)
    found = head_candidates(face)
    sector_of = {sector: set(found.vertices[found.sector == sector].tolist()) for sector in HEAD_LAYOUTS[count]}
    head = {m.vertex for m in layout.head}
    assert all(head & vertices for vertices in sector_of.values())
    dots = np.array([m.vertex for m in layout.markers])
    apart = geodesic_distance(face.graph, dots)[:, dots] + np.diag(np.full(len(dots), np.inf))
    assert apart.min() >= COVER.spacing_mm
    assert layout.head_pose.surface_mm > 0
    seen = dict(zip(found.vertices.tolist(), found.visibility.tolist(), strict=True))
    for sector in HEAD_LAYOUTS[count]:
        best = found.visibility[found.sector == sector].max()
        chosen = max(seen[m.vertex] for m in layout.head if m.vertex in sector_of[sector])
        assert chosen >= min(best, COVER.min_visibility)
    assert all(m.visibility == pytest.approx(seen[m.vertex], abs=1e-4) and m.visibility > 0 for m in layout.head)
    assert all("head" in m.stands_for for m in layout.head if not m.blendshapes)


def test_head_markers_that_no_camera_reads_promise_no_pose():
    plan = plan_of(replace(QUICK, landmarks=replace(COVER, head_markers=3)))
    (promised,) = head_words(plan)
    assert "give the head's pose to" in promised
    assert "measured" not in promised
    read, grazed = View("boom", True, 9.0), View("boom", False, 0.2, 0.0, "edge-on", "neutral")
    two = [replace(m, views=(grazed if i else read,)) for i, m in enumerate(plan.layout.head)]
    (doubted,) = head_words(replace(plan, layout=replace(plan.layout, head=tuple(two))))
    assert "do not read H02, H03, and fewer than three of the others fix no pose" in doubted


def test_two_head_markers_are_refused():
    with pytest.raises(ValueError, match="2 head markers do not fix a head's pose"):
        replace(COVER, head_markers=2)


def test_alternatives_leave_places_and_are_never_better_where_the_first_is_proved_best(face):
    layout = design_layout(face, COVER)
    others = alternatives(face, COVER, layout, count=2)
    assert others
    for other in others:
        assert other.worse >= -1e-6
        assert len(other.takes) >= max(1, round(OTHER_SHARE * len(layout.landmarks)))
        assert other.leaves
    assert all(other.as_good for other in others[:-1])


def test_a_budget_planned_again_after_a_pin_moves_few_landmarks_and_stays_near_the_best(face, pin):
    settings = LayoutSettings(method="budget", budget=24)
    former = design_layout(face, settings)
    pinned = replace(settings, pins=(pin,))
    again, afresh = design_layout(face, pinned, former=former), design_layout(face, pinned)
    assert face.rig.vertex_of[pin] in vertices_of(again)
    assert len(set(vertices_of(again)) & set(vertices_of(former))) >= 12
    assert again.information.error_mm <= 1.03 * afresh.information.error_mm
    assert again.error_bound.error_mm <= again.information.error_mm


def test_a_plan_that_breaks_a_wish_is_caught(pin):
    plan = plan_of(replace(QUICK, landmarks=replace(COVER, pins=(pin,), head_markers=3)))
    assert [claim.what for claim in check_plan(plan, sample_rig()) if not claim.holds] == []
    other = next(m for m in plan.layout.landmarks if m.source_vertex != pin)
    lies = (
        replace(plan.settings.landmarks, caps={other.region: 0}),
        replace(plan.settings.landmarks, forbidden=(other.source_vertex,)),
        replace(plan.settings.landmarks, head_markers=4),
        replace(plan.settings.landmarks, keep_out={"wet lip": 60.0}),
    )
    for settings, what in zip(lies, ("at most 0", "no landmark at", "4 head markers", "wet lip"), strict=True):
        lie = replace(plan, settings=replace(plan.settings, landmarks=settings))
        assert any(what in claim.what for claim in check_plan(lie, sample_rig()) if not claim.holds)


def shut_by_zones(face, settings):
    """Vertices of sites, and those of them that keep-outs shut."""
    sites = face.sites(settings)
    may, shut = np.zeros((2, len(face.rig.neutral)), dtype=bool)
    may[sites.vertices] = True
    for limit in keep_outs(face, settings, sites):
        shut[sites.vertices[limit.amount > 0]] = True
    return may, shut


def test_zones_relaxed_for_a_known_layout_are_open_at_its_points_and_shut_elsewhere(face):
    plain, relaxed = LayoutSettings(), LayoutSettings(relaxed_for="ibug68")
    _, before = shut_by_zones(face, plain)
    may, shut = shut_by_zones(face, relaxed)
    points = np.union1d(face.points68, face.mirror[face.points68])
    paired = points[face.markable[points] & (face.mirror[face.mirror[points]] == points)]
    far = np.linalg.norm(face.rig.neutral[paired] - face.rig.neutral[face.mirror[paired]], axis=1)
    assert (may & ~shut)[paired[(far == 0) | (far >= plain.spacing_mm)]].all()
    opened = np.flatnonzero(before & ~shut)
    away = np.linalg.norm(face.rig.neutral[opened][:, None] - face.rig.neutral[points], axis=2).min(axis=1)
    assert len(opened)
    assert away.max() < relaxed.dot_mm
    assert shut.any()


def test_half_of_68_landmarks_allowed_where_these_stand_have_less_error_than_they(face):
    layout = design_layout(face, LayoutSettings(method="budget", budget=34, relaxed_for="ibug68"))
    other = layout.references[SIXTY_EIGHT]
    assert layout.information.error_mm < other.error_mm
    assert layout.predictions[0].error_mm < other.predictions[0].error_mm
    assert layout.target_landmarks <= 34
