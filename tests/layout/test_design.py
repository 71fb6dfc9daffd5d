"""Layouts of the sample head, as `plan` makes them."""

from itertools import pairwise

import numpy as np
import pytest
from msgspec.structs import replace

from capture_plan.errors import InfeasibleError
from capture_plan.layout.assembly import SINGLE_COVER, decided_in, follow
from capture_plan.layout.design import design_layout
from capture_plan.layout.face import SIXTY_EIGHT
from capture_plan.layout.problem import task_of
from capture_plan.layout.settings import LayoutSettings
from capture_plan.mesh.mirror import mirror_map

SETTINGS = LayoutSettings()


def test_a_supervisor_gets_full_rank_at_the_error_of_68_points_with_fewer_markers(studio):
    assert studio.information.rank == studio.information.full_rank
    assert studio.information.error_mm <= studio.references[SIXTY_EIGHT].error_mm
    assert studio.information.landmarks < 68


def test_the_paper_s_single_cover_is_shown_beside_it_with_its_blindness(studio):
    single = studio.references[SINGLE_COVER]
    assert single.landmarks < studio.information.landmarks
    assert single.rank < single.full_rank
    assert single.error_mm > studio.information.error_mm


def test_every_blendshape_is_on_some_landmark(face, studio):
    assert {name for m in studio.landmarks for name in m.blendshapes} | set(studio.uncovered) == set(face.used)


def test_a_symmetric_layout_is_its_own_mirror_image(face, studio):
    vertices = {m.vertex for m in studio.landmarks}
    assert {int(i) for i in mirror_map(face.rig.neutral)[list(vertices)]} == vertices


def test_partners_are_numbered_side_by_side_and_sides_are_the_subject_s_own(studio):
    for right, left in pairwise(studio.landmarks):
        if right.side == "right":
            assert left.side == "left"
            assert right.position[0] < 0 < left.position[0]


def test_landmarks_are_numbered_from_the_top_down_under_names_of_their_own(studio):
    heights = [m.position[1] for m in studio.landmarks]
    assert all(a >= b - 2 for a, b in pairwise(heights))
    assert [m.name for m in studio.landmarks] == [f"M{i:02d}" for i in range(1, len(heights) + 1)]
    assert len({m.label for m in studio.landmarks}) == len(studio.landmarks)


def test_every_program_was_proved_optimal(studio):
    assert all(program.proven_optimal for program in studio.programs)


@pytest.mark.parametrize("weights", ["lexicographic", "paper", "count"])
def test_the_single_cover_is_what_the_paper_asks_for(face, weights):
    layout = design_layout(face, replace(SETTINGS, method="cover", weights=weights, symmetric=False))
    assert len(layout.programs) == 1
    if weights == "paper":
        assert len(layout.landmarks) >= layout.certificate.landmarks
    else:
        assert len(layout.landmarks) == layout.certificate.landmarks


def test_a_larger_epsilon_never_needs_fewer_landmarks(face):
    counts = [
        len(design_layout(face, replace(SETTINGS, method="cover", weights="count", epsilon=epsilon)).landmarks)
        for epsilon in (0.3, 0.5, 0.7, 0.9)
    ]
    assert counts == sorted(counts)


def test_the_same_settings_give_the_same_layout(face, studio):
    assert design_layout(face, SETTINGS) == studio


def test_skin_that_nobody_sees_is_refused(face):
    with pytest.raises(InfeasibleError, match="min_visibility"):
        design_layout(replace_visibility(face, np.zeros(len(face.rig.neutral))), SETTINGS)


def replace_visibility(face, visibility):
    return type(face)(face.rig, face.used, visibility)


def test_a_layout_follows_from_its_decisions_alone(face, studio):
    task = task_of(face, SETTINGS)
    assert follow(task, decided_in(studio, task)) == studio


@pytest.mark.parametrize(("less", "proven"), [(0.0, True), (0.5, False)])
def test_a_program_is_proven_where_its_bound_reaches_its_cost(face, studio, less, proven):
    task, (first, *others) = task_of(face, SETTINGS), studio.programs
    weaker = replace(studio, programs=(replace(first, bound=first.bound - less), *others))
    assert follow(task, decided_in(weaker, task)).programs[0].proven_optimal == proven


def test_of_as_many_landmarks_the_lexicographic_cover_has_the_best_places(face):
    fewest, best = (
        design_layout(face, replace(SETTINGS, method="cover", weights=weights))
        for weights in ("count", "lexicographic")
    )
    assert len(best.landmarks) == len(fewest.landmarks)
    assert np.mean([m.quality for m in best.landmarks]) < np.mean([m.quality for m in fewest.landmarks])
