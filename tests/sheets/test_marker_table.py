"""The marker table: what a ring is in words, and which dots callipers are too coarse for."""

from dataclasses import replace

import pytest

from capture_plan.sample import sample_rig
from capture_plan.sheets.head import make_head
from capture_plan.sheets.marker_pages import marked_face
from capture_plan.sheets.marker_table import FINER, ring_column, ring_words, too_fine
from tests.once import plan_of


@pytest.fixture(scope="module")
def face():
    rig, layout = sample_rig(), plan_of().layout
    return marked_face(rig, make_head(rig), layout, {m.name: 0.2 + 0.1 * i for i, m in enumerate(layout.markers)})


def test_a_dot_whose_ring_asks_for_more_than_callipers_give_is_told_to_be_placed_by_other_means(face):
    fine = [too_fine(m, face) for m in face.landmarks]
    assert fine == sorted(fine, reverse=True)  # the rings grow from dot to dot
    assert {True, False} == set(fine)
    for m, one in zip(face.landmarks, fine, strict=True):
        assert (FINER in ring_column(face).cell(m)) == one
        assert ring_column(face).cell(m).startswith(f"{face.rings[m.name]:.1f}")
    wide = replace(face, rings={m.name: 5.0 for m in face.landmarks})
    assert not any(too_fine(m, wide) for m in wide.landmarks)
    assert "mask" in ring_words(face)
    assert "mask" not in ring_words(wide)


def test_the_share_of_crews_is_what_was_found_and_nothing_is_said_without_rings(face):
    assert "95% of crews" in ring_words(face)
    assert "48% of crews" in ring_words(replace(face, kept=0.48))
    assert ring_words(replace(face, rings={})) == ""
