"""Meshes finer than dots can be placed: some vertices stand for all, evenly, in mirrored pairs, and a plan says so."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import KDTree

from capture_plan.audit.audit import audit_rig
from capture_plan.audit.mesh import fine
from capture_plan.check.check import check_plan
from capture_plan.errors import InfeasibleError
from capture_plan.layout.design import design_layout
from capture_plan.layout.face import Face, see_face
from capture_plan.layout.settings import LayoutSettings
from capture_plan.layout.site_sampling import places_on, spread_sites
from capture_plan.plan.make import make_plan
from capture_plan.plan.settings import Settings
from capture_plan.report.proofs import landmark_proofs

GRAIN = 7.0


@pytest.fixture
def finely(rig, monkeypatch):
    """The sample, which counts as a fine mesh whose places stand far apart, by a name of its own: audits are kept."""
    monkeypatch.setattr("capture_plan.audit.mesh.FINE", 2000)
    monkeypatch.setattr("capture_plan.layout.site_sampling.GRAIN_MM", GRAIN)
    return replace(rig, name="fine head")


def test_places_stand_apart_in_mirrored_pairs_and_near_everything():
    half = np.random.default_rng(3).uniform(0.6, 20, (400, 3))
    points = np.concatenate([half, half * [-1, 1, 1]])
    mirror = np.roll(np.arange(800), 400)
    order = np.random.default_rng(4).permutation(800)
    chosen = spread_sites(points, order, mirror, 1.0)
    assert chosen[order[0]]
    assert (chosen == chosen[mirror]).all()
    apart, _ = KDTree(points[chosen]).query(points[chosen], k=2)
    assert apart[:, 1].min() > 1.0
    assert KDTree(points[chosen]).query(points)[0].max() <= 1.0
    assert chosen.sum() < 800


def test_on_an_ordinary_mesh_all_skin_is_asked(face):
    assert (face.places == face.rig.skin).all()
    assert not fine(face.rig)


def test_what_a_blendshape_moves_most_is_a_place_or_beside_one(finely, used):
    face = Face(finely, used, np.ones(len(finely.neutral)))
    peaks = face.displacement.argmax(axis=1)
    apart, _ = KDTree(finely.neutral[face.places]).query(finely.neutral[peaks])
    assert apart.max() <= GRAIN
    assert face.places[peaks.min()]  # the first of them all is asked first
    assert face.places.sum() < finely.skin.sum() / 2


def test_what_moves_nothing_changes_no_place(finely, face):
    moved = face.displacement[::9]
    with_still = np.vstack([0 * moved[:1], moved, 0 * moved[:1]])
    np.testing.assert_array_equal(places_on(finely, with_still, face.mirror), places_on(finely, moved, face.mirror))


def test_landmarks_stand_on_places_pins_anywhere_and_all_at_the_spacing(finely, used):
    face = see_face(finely, used)
    assert (face.visibility > 0).sum() > face.places.sum()  # what is no place is as well seen as the nearest one
    off = np.flatnonzero(face.markable & ~face.places & (face.mirror != np.arange(len(face.mirror))))
    wide = off[np.abs(finely.neutral[off, 0] - finely.neutral[face.mirror[off], 0]) > 40]
    pinned_at = int(wide[finely.neutral[wide, 1].argmin()])  # far from the eyes, where there is little room
    pin = int(finely.source_index[pinned_at])
    settings = LayoutSettings(method="cover", rounds=1, pins=(pin,), keep_out={})
    beside = face.near(8.0, face.sites(settings))[[pinned_at]].indices
    assert {pinned_at, int(face.mirror[pinned_at])} <= set(face.dotted(settings).tolist())  # they may meet others
    places = face.around(np.array([pinned_at]), 8.0) & face.places
    assert len(np.flatnonzero(places)) > 0
    assert set(np.flatnonzero(places)) <= set(beside.tolist())  # no place within the spacing of a pin is taken
    layout = design_layout(face, settings)
    vertices = np.array([m.vertex for m in layout.landmarks])
    pinned = {pinned_at, int(face.mirror[pinned_at])}
    assert pinned <= set(vertices.tolist())
    assert all(face.places[v] for v in vertices.tolist() if v not in pinned)
    apart, _ = KDTree(finely.neutral[vertices]).query(finely.neutral[vertices], k=2)
    assert apart[:, 1].min() >= 8.0 - 1e-9


def test_a_plan_of_a_fine_mesh_holds_and_says_what_its_proofs_speak_of(finely):
    settings = Settings(landmarks=LayoutSettings(method="cover", rounds=1))
    plan = make_plan(finely, settings)
    claims = check_plan(plan, finely)
    assert [claim.what for claim in claims if not claim.holds] == []
    said = next(line for line in landmark_proofs(plan) if "finer than dots can be placed" in line)
    assert "3,207 vertices" in said
    assert "speaks of layouts of these" in said
    assert "fine" in {finding.kind for finding in audit_rig(finely).findings}


def test_too_many_places_for_their_pairs_are_refused_in_one_line(face, monkeypatch):
    monkeypatch.setattr("capture_plan.layout.spacing.MOST_PAIRS", 10_000)
    unasked, sites = Face(face.rig, face.used, face.visibility), face.sites(LayoutSettings())
    with pytest.raises(InfeasibleError, match=r"3,207 places for landmarks.*give a smaller spacing") as refused:
        unasked.spacing(sites, 8.0)
    assert len(str(refused.value).splitlines()) == 1
