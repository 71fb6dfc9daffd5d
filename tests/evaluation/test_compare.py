"""Layouts side by side on the sample head: fair, repeatable, and read as a table that tells the truth."""

import json

import numpy as np
import pytest

from capture_plan.curves.frames import PosedFrames
from capture_plan.errors import InfeasibleError, PlanError
from capture_plan.evaluation.baselines import BASELINES
from capture_plan.evaluation.compare import (
    FOR_TAKE,
    FREE,
    MIXES,
    PLACED,
    STUDIO,
    TAKE,
    WORN,
    Comparison,
    Row,
    compare_layouts,
    least_upper,
)
from capture_plan.evaluation.compare_report import comparison_text, verdicts
from capture_plan.evaluation.user_layouts import read_layouts, take_weights
from capture_plan.layout.settings import LayoutSettings
from capture_plan.layout.weight_recovery import Errors, Score
from capture_plan.sample import sample_rig
from capture_plan.sequence import Sequence, read_sequence
from capture_plan.shell.takes import takes_of

SETTINGS = LayoutSettings()


def played():
    """Weights of a few blendshapes at a time."""
    rng = np.random.default_rng(3)
    w = np.zeros((20, 52))
    for row in w:
        row[rng.choice(52, 4, replace=False)] = rng.uniform(0, 1, 4)
    return w


@pytest.fixture(scope="module")
def found(face):
    take = np.full((5, len(face.used)), 0.1)
    sequence = Sequence("played", face.rig.neutral, face.rig.triangles, PosedFrames(face.rig, played()), 30.0, face.rig)
    given = {"mine": np.flatnonzero(face.allowed(SETTINGS))[:20]}
    return compare_layouts(
        face, SETTINGS, budgets=(10,), noises_mm=(0.2,), given=given, take=take, takes=takes_of(face.rig, [sequence])
    )


def test_more_landmarks_than_candidates_are_refused_before_anything_is_designed(face):
    with pytest.raises(InfeasibleError, match="99,999 landmarks asked for"):
        compare_layouts(face, SETTINGS, budgets=(10, 99_999))


def test_every_method_stands_in_the_table_once_a_budget(found):
    at_budget = [row.method for row in found.rows if row.landmarks == 10]
    assert all(at_budget.count(name) == 1 for name in (FREE, *BASELINES))
    methods = [row.method for row in found.rows]
    assert {STUDIO, "mine", "68 points (iBUG), placed", "51 points (iBUG), placed"} <= set(methods)


def test_all_but_empirical_layouts_stand_on_the_same_candidates(found, face):
    moving, seen = np.flatnonzero(face.moving_skin), np.flatnonzero(face.allowed(SETTINGS))
    for row in found.rows:
        if row.method.endswith(PLACED):
            continue  # ears and hairlines may stand still
        assert np.isin(row.vertices, seen if row.method in (WORN, STUDIO, FOR_TAKE) else moving).all()
    assert found.candidates == len(moving)


def test_no_layout_predicts_less_than_the_bound_of_its_budget(found):
    assert len(found.least_mm) == len(found.budgets)
    for row in found.rows:
        if row.landmarks <= found.budgets[0]:
            assert row.upper_mm >= found.least_mm[0]


def test_the_table_names_every_layout_and_marks_the_best(found):
    text = comparison_text(found)
    assert all(row.method in text for row in found.rows)
    best = min((row for row in found.rows if row.landmarks == 10), key=lambda row: row.scores[MIXES][0].rmse_mm)
    line = next(line for line in text.splitlines() if best.method in line and line.strip().startswith("10"))
    assert f"{best.scores[MIXES][0].rmse_mm:.3f}*" in line
    assert TAKE in found.frames


def row(method, rmse_mm):
    errors = {"weight_mae": 0.01, "rmse_mm": rmse_mm, "max_mm": 1.0, "worst": "a"}
    scores = {
        name: (Score(noise_mm=0.2, unbounded=Errors(**errors), **errors),) for name in (MIXES, "single blendshapes")
    }
    return Row(method, (1, 2), 2, 1.0, 0.2, (), scores)


@pytest.mark.parametrize(
    ("ours", "says"), [(0.1, f"{FREE} is lowest"), (0.9, f"random is lower, 0.500 mm; {FREE} 0.900 mm")]
)
def test_it_is_said_plainly_who_wins(ours, says):
    made = Comparison(
        "rig", 3, 0.2, 0.5, (2,), (0.15,), 3, 9, (0.2,), {MIXES: 1}, (row(FREE, ours), row("random", 0.5)), ()
    )
    assert says in verdicts(made)[0]


def test_it_is_said_how_far_from_the_best_ours_can_be():
    mine = row(least_upper(0.2), 0.1)
    made = Comparison("rig", 3, 0.2, 0.5, (2,), (0.16,), 3, 9, (0.2,), {MIXES: 1}, (mine, row("random", 0.5)), ())
    assert any("below 0.160 mm" in line and "at most 25.0%" in line for line in verdicts(made))


def test_layouts_are_given_by_the_artists_vertex_numbers(tmp_path):
    rig = sample_rig()
    file = tmp_path / "mine.json"
    file.write_text(json.dumps({"mine": rig.source_index[[5, 9]].tolist()}))
    assert rig.source_index[read_layouts(file, rig)["mine"]].tolist() == rig.source_index[[5, 9]].tolist()


@pytest.mark.parametrize(
    ("content", "says"),
    [
        ("{", "not a JSON file"),
        ('{"mine": "nose"}', "not a JSON file"),
        ('{"mine": []}', "no vertices"),
        ('{"mine": [1, 1]}', "twice"),
        ('{"mine": [99999999]}', "99999999"),
    ],
)
def test_layouts_that_are_none_are_refused(tmp_path, content, says):
    (tmp_path / "mine.json").write_text(content)
    with pytest.raises(PlanError, match=says):
        read_layouts(tmp_path / "mine.json", sample_rig())


def test_a_take_gives_the_weights_of_the_used_blendshapes(tmp_path):
    rig = sample_rig()
    (tmp_path / "take.csv").write_text("jawOpen,eyeBlinkLeft\n0.5,0\n1.5,1\n")
    w = take_weights(read_sequence(tmp_path / "take.csv", rig=rig), rig, ("jawOpen",))
    assert w.tolist() == [[0.5], [1.0]]


def test_a_take_of_meshes_has_no_weights_to_compare(tmp_path):
    rig = sample_rig()
    np.savez(tmp_path / "take.npz", frames=np.stack([rig.neutral] * 2), fps=30.0)
    assert take_weights(read_sequence(tmp_path / "take.npz", rig=rig), rig, ("jawOpen",)) is None


def test_every_layout_is_held_against_the_take_and_ours_for_it_loses_least(found):
    peers = [row for row in found.rows if row.landmarks == 10]
    assert all(row.lost_mm > 0 for row in found.rows)
    assert min(peers, key=lambda row: row.lost_mm).method == FOR_TAKE
    assert next(row for row in peers if row.method == FOR_TAKE).rank > 1
    text = comparison_text(found)
    assert f"M = 10: {FOR_TAKE} loses least of the take" in text
    assert "20 frames" in text
