"""The number of landmarks over epsilon, and where else each of them could stand."""

import numpy as np
import pytest
from msgspec.structs import replace

from capture_plan.errors import InfeasibleError
from capture_plan.evaluation.zell2022.epsilon_sweep import epsilon_sweep
from capture_plan.evaluation.zell2022.replacement_map import (
    blendshape_map,
    importance,
    neutral_visibility,
    replacement_map,
)
from capture_plan.evaluation.zell2022.variants import by_metric, multicovers, single_cover, terms
from capture_plan.layout.settings import LayoutSettings

FREE = LayoutSettings(method="cover", symmetric=False)


@pytest.fixture(scope="module", params=[True, False], ids=["symmetric", "free"])
def rows(face, request):
    return epsilon_sweep(face, replace(FREE, symmetric=request.param), (0.9, 0.3, 0.5, 0.7))


def covered(face, vertices, epsilon):
    return (face.relative_displacement(FREE)[:, vertices] >= epsilon).any(axis=1)


def test_a_higher_epsilon_never_needs_fewer_landmarks(rows):
    assert [row.epsilon for row in rows] == [0.3, 0.5, 0.7, 0.9]
    fewest = [row.fewest for row in rows]
    assert fewest == sorted(fewest)


def test_no_cover_beats_the_proven_bound(rows):
    for row in rows:
        assert row.bound <= row.fewest == len(row.vertices) <= len(row.paper_vertices)
        assert row.proven_optimal == (row.bound == row.fewest)


def test_covers_of_the_sweep_cover_all_but_what_is_said(face, rows):
    for row in rows:
        for vertices in (row.vertices, row.paper_vertices):
            missed = {face.used[k] for k in np.flatnonzero(~covered(face, list(vertices), row.epsilon))}
            assert missed <= set(row.uncovered)


def test_a_landmark_is_among_its_own_replacements_and_each_keeps_the_cover(face):
    vertices = single_cover(face, FREE)
    before = covered(face, vertices, FREE.epsilon)
    for which, vertex in enumerate(vertices):
        q = replacement_map(face, FREE, vertices, which)
        places = np.flatnonzero(np.isfinite(q))
        assert vertex in places
        assert not set(places.tolist()) & set(np.delete(vertices, which).tolist())
        for place in places[:: max(1, len(places) // 12)]:
            replaced = vertices.copy()
            replaced[which] = place
            assert not (before & ~covered(face, replaced, FREE.epsilon)).any()


def test_no_vertex_without_a_value_could_replace_the_landmark(face):
    vertices = single_cover(face, FREE)
    q, before = replacement_map(face, FREE, vertices, 0), covered(face, vertices, FREE.epsilon)
    others = np.flatnonzero(~np.isfinite(q) & face.allowed(FREE))
    for place in others[:: len(others) // 40]:
        if place not in vertices:
            assert (before & ~covered(face, np.r_[place, vertices[1:]], FREE.epsilon)).any()


def test_the_best_place_has_the_value_one_and_values_keep_the_order_of_importance(face):
    name = face.used[3]
    q, raw = blendshape_map(face, FREE, name), importance(face, FREE)[3]
    on = np.isfinite(q)
    assert np.nanmax(q) == 1
    assert np.array_equal(np.argsort(q[on], kind="stable"), np.argsort(raw[on], kind="stable"))
    assert (face.relative_displacement(FREE)[3, on] >= FREE.epsilon).all()


def test_a_landmark_that_stands_for_nothing_has_no_replacements(face):
    still = int(np.flatnonzero(~(face.relative_displacement(FREE) >= FREE.epsilon).any(axis=0))[0])
    with pytest.raises(InfeasibleError, match="lower epsilon"):
        replacement_map(face, FREE, np.array([still]), 0)


def test_expressions_only_ever_hide_what_the_neutral_shows(face):
    assert (neutral_visibility(face) >= face.visibility - 1e-9).all()


def test_every_form_of_the_program_covers_every_blendshape(face):
    forms = terms(face, FREE) | multicovers(face, FREE) | by_metric(face, FREE, {"flat": face.markable.astype(float)})
    assert set(forms) > {"Displacement only", "Distance Off", "Swarm", "Distance On", "Adaptive", "Flat"}
    for vertices in forms.values():
        assert covered(face, vertices, FREE.epsilon).all()
