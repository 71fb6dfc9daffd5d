"""What lists of expressions are worth beside each other: which lists, their curves, and the figures of both."""

import io

import matplotlib
import numpy as np
import pytest
from PIL import Image

from capture_plan import figures
from capture_plan.audit.audit import audit_rig
from capture_plan.evaluation.carrigan2020.mu_sweep import AblationRow, MuRow
from capture_plan.evaluation.carrigan2020.packing_error import (
    ALONE,
    RANDOM,
    error_after,
    error_curves,
    mean_curve,
    rival_lists,
)
from capture_plan.expressions import Expression, PackingSettings
from capture_plan.expressions.active_sets import vertex_kinds
from capture_plan.notebooks_support.packing import value_sentences
from capture_plan.transfer.score import RebuildScore

SETTINGS = PackingSettings()
MU = {"Rules": (MuRow(0.2, 5, 5, "clique", 6, 7),), "None": (MuRow(0.2, 4, 3, "solver", 4, 4),)}


@pytest.fixture(scope="module")
def lists(rig):
    return rival_lists(rig, audit_rig(rig).used, SETTINGS)


@pytest.fixture(scope="module")
def sitter(rig):
    return figures.sit(rig)


def score(order, count, rms_mm, target="wide"):
    return RebuildScore(
        target=target, order=order, count=count, mean_mm=0.0, max_mm=0.0, worst="a", rms_mm=rms_mm, mixes_mm=0.0
    )


def curves(minimum, alone, chance):
    """One face: the same scans 0, 5, 10 of the packed lists, and twice as many one at a time."""
    return {
        "early": ((0, 5, 10), minimum),
        "greedy": ((0, 5, 10), minimum),
        RANDOM: ((0, 5, 10), chance),
        ALONE: ((0, 5, 10, 20), alone),
    }


def text(figure):
    return [words.get_text() for words in figure.findobj(matplotlib.text.Text)]


def pixels(figure):
    return np.asarray(Image.open(io.BytesIO(figures.png(figure))).convert("RGB")).astype(int)


def test_every_list_shows_every_blendshape_and_none_is_shorter_than_the_minimum(rig, lists):
    for name, poses in lists.items():
        assert {blendshape for pose in poses for blendshape in pose} == set(audit_rig(rig).used)
        assert len(poses) >= len(lists["minimum"]), name
    assert len(lists[ALONE]) == len(audit_rig(rig).used)


def test_random_lists_differ_by_seed_and_are_the_same_every_time(rig, lists):
    by_chance = [poses for name, poses in lists.items() if name.startswith(RANDOM)]
    assert all(a != b for n, a in enumerate(by_chance) for b in by_chance[:n])
    assert rival_lists(rig, audit_rig(rig).used, SETTINGS) == lists


def test_the_mean_of_random_lists_holds_an_ended_list_at_its_end():
    found = error_curves(
        [
            *(score(f"{RANDOM} 1", count, error) for count, error in ((0, 4.0), (2, 2.0))),
            *(score(f"{RANDOM} 2", count, error) for count, error in ((0, 4.0), (2, 1.0), (3, 0.0))),
            score("minimum", 0, 4.0),
        ]
    )
    assert found["wide"][RANDOM] == ((0, 2, 3), (4.0, 1.5, 1.0))
    assert found["wide"]["minimum"] == ((0,), (4.0,))
    assert mean_curve([((0, 1), (3.0, 1.0))] * 2) == ((0, 1), (3.0, 1.0))


def test_there_is_no_error_after_more_scans_than_a_list_has():
    curve = ((0, 5, 7), (3.0, 2.0, 1.0))
    assert error_after(curve, 5) == 2.0
    assert error_after(curve, 10) is None


def test_sentences_name_the_winner_of_every_face_and_say_when_another_is_better():
    good = curves((4.0, 1.0, 0.5), (4.0, 2.0, 1.5, 0.1), (4.0, 3.0, 2.0))
    bad = curves((4.0, 2.0, 1.0), (4.0, 1.0, 0.9, 0.1), (4.0, 3.0, 0.5))
    said = value_sentences({"wide": good, "narrow": bad})
    assert "After 5 scans the best list is early or greedy, alike (wide); one at a time (narrow)." in said
    assert "Of whole packed lists the best is early or greedy, alike (wide); random (narrow)." in said
    assert any("between 100 % more and 50 % less after 5 scans" in sentence for sentence in said)
    assert value_sentences({"wide": good})[0].endswith("(every face).")


def test_lists_over_mu_say_what_is_proven_and_reach_no_lower_than_the_bound():
    figure = figures.number_against_mu(MU, mu=0.3)
    assert {"minimum, proven", "minimum found", "no list is shorter", "expressions J", "Rules", "None"} <= set(
        text(figure)
    )
    lines = {line.get_label(): line.get_ydata() for line in figure.axes[1].lines}
    assert list(lines["no list is shorter"]) == [3]
    assert list(lines["minimum found"]) == [4]


def test_terms_start_at_nothing_and_end_at_everything():
    figure = figures.shown_by_terms([AblationRow("all", (3, 4), (0.5, 1.0))], blendshapes=4)
    strength, shown = (list(axes.lines[0].get_ydata()) for axes in figure.axes)
    assert (strength, shown) == ([0, 50, 100], [0, 75, 100])
    assert {"displacement strength shown, %", "blendshapes shown, %", "all"} <= set(text(figure))


def test_an_error_has_its_unit_a_panel_for_each_face_and_says_where_one_at_a_time_ends():
    one = curves((4.0, 1.0, 0.5), (4.0, 2.0, 1.5, 0.1), (4.0, 3.0, 2.0))
    figure = figures.error_by_scans({"wide": one, "narrow": one, "elf": one}, ours="early", cut=ALONE)
    assert {"Wide", "Narrow", "Elf", "error of the rig, mm (rms)", "one at a time ends at 20 scans: 0.100 mm"} <= set(
        text(figure)
    )
    assert [axes.axison for axes in figure.axes] == [True, True, True, False]
    assert figure.axes[0].get_xlim()[1] < 11


def test_active_skin_is_red_smoothing_amber_and_static_grey(rig, sitter):
    kinds = vertex_kinds(rig, ("jawOpen",), 0.3)[0]
    whole = {number: pixels(figures.roles_figure(sitter, np.full_like(kinds, number), "x")) for number in range(3)}
    middle = {number: picture[picture.shape[0] // 2, picture.shape[1] // 4] for number, picture in whole.items()}
    assert np.ptp(middle[0]) < 30
    assert middle[1][0] > middle[1][1] + 30 > middle[1][2] + 60
    assert middle[2][0] > middle[2][1] + 80
    said = text(figures.roles_figure(sitter, kinds, "jawOpen"))
    assert f"active, {int((kinds == 2).sum()):,} vertices" in said
    assert "jawOpen" in said


def test_a_picture_of_an_expression_is_of_the_right_size_and_of_the_pose(sitter):
    def drawn(names):
        return figures.expressions_figure(sitter, [Expression("E01", names, (1.0,) * len(names), 0.1, 0.1, "")])

    resting, opened = drawn(()), drawn(("jawOpen",))
    wide, high = opened.get_size_inches()
    assert pixels(opened).shape == (int(200 * high), int(200 * wide), 3)
    assert (np.abs(pixels(opened) - pixels(resting)).max(axis=2) > 20).mean() > 0.005
    assert {"E01", "1 blendshape, 10 % shown so far"} <= set(text(opened))
