"""Pictures of thin-shell layouts show the numbers they were given; inherited markers differ from new ones."""

import io

import matplotlib
import numpy as np
import pytest
from PIL import Image

from capture_plan import figures
from capture_plan.figures.style import OTHERS, OURS
from capture_plan.layout.shell.evaluate import NESTED, PAPER, Scored, vertex_errors
from capture_plan.layout.shell.evaluate import OURS as OUR_METHOD
from capture_plan.layout.shell.evaluation import Evaluation
from capture_plan.layout.shell.take import face_take
from capture_plan.layout.shell.validate import Folds
from capture_plan.rig import sample_rig
from capture_plan.rig.sample.motion import sample_motion
from capture_plan.sheets.style import rgb


@pytest.fixture(scope="module")
def sitter():
    return figures.sit(sample_rig())


@pytest.fixture(scope="module")
def take():
    return face_take(sample_rig(), sample_motion(frames=30))


def scored(method, vertices, rmse_mm):
    return Scored(method, len(vertices), tuple(int(v) for v in vertices), rmse_mm, 1, ())


def evaluation(*scored, folds=(), descents_mm=()):
    counts = tuple(sorted({one.markers for one in scored}))
    return Evaluation(
        "head", "take", 30, 9, 1, 2.0, 5, 5, counts, scored, (), (), tuple(folds), (), tuple(descents_mm), (), ()
    )


def text(figure):
    return [words.get_text() for words in figure.findobj(matplotlib.text.Text)]


def pixels(figure):
    return np.asarray(Image.open(io.BytesIO(figures.png(figure))).convert("RGB")).astype(int)


def near(picture, colour, within=12):
    return int((np.abs(picture - np.array(rgb(colour))).max(axis=2) <= within).sum())


def line(figure, label):
    return next(one for one in figure.axes[0].get_lines() if one.get_label() == label)


def test_a_curve_goes_through_the_errors_that_were_found():
    found = evaluation(
        *(scored(OUR_METHOD, range(m), 1 / m) for m in (4, 6)), *(scored(PAPER, range(m), 2 / m) for m in (4, 6))
    )
    figure = figures.error_against_markers(found)
    assert line(figure, OUR_METHOD).get_xydata() == pytest.approx(np.array([[4, 1 / 4], [6, 1 / 6]]))
    assert line(figure, PAPER).get_ydata() == pytest.approx([2 / 4, 2 / 6])


def test_every_start_is_drawn_from_its_first_error_on():
    found = evaluation(scored(OUR_METHOD, range(4), 0.5), descents_mm=((2.0, 1.0, 0.9), (3.0, 1.5, 1.6)))
    figure = figures.error_over_iterations(found)
    assert line(figure, "start 2").get_xydata() == pytest.approx(np.array([[0, 3.0], [1, 1.5], [2, 1.6]]))
    assert set(line(figure, OUR_METHOD).get_ydata()) == {0.5}


def test_unseen_frames_are_shown_as_mean_and_standard_deviation():
    found = evaluation(scored(OUR_METHOD, range(4), 0.5), folds=[Folds(OUR_METHOD, 4, (1.0, 3.0), (1.0, 1.0))])
    figure = figures.error_on_unseen_frames(found)
    drawn = figure.axes[0].containers[0]
    assert drawn.lines[0].get_ydata() == pytest.approx([2.0])
    low, high = drawn.lines[2][0].get_segments()[0][:, 1]
    assert (low, high) == pytest.approx((1.0, 3.0))


def test_inherited_markers_are_red_and_new_ones_blue(sitter, take):
    front = take.at[take.candidates][np.argsort(-take.shell.vertices[take.candidates, 2])]
    same = figures.nested_layouts(sitter, [scored(NESTED, front[:1], 1.0), scored(NESTED, front[:1], 1.0)])
    grown = figures.nested_layouts(sitter, [scored(NESTED, front[:1], 1.0), scored(NESTED, front[[0, 300]], 0.5)])
    picture = pixels(same)
    left, right = picture[:, : picture.shape[1] // 2], picture[:, picture.shape[1] // 2 :]
    assert near(left, OURS) > 50 > near(left, OTHERS[0])
    assert near(right, OTHERS[0]) > 50 > near(right, OURS)
    assert "0.500 mm, 1 new" in text(grown)


def test_a_map_says_the_error_of_its_layout_and_is_zero_at_its_markers(sitter, take):
    H = np.flatnonzero(take.candidates)[::200]
    one = scored(OUR_METHOD, take.at[H], 0.77)
    assert vertex_errors(take.shell, take.motion, take.places(take.at[H]))[H].max() < 1e-9
    figure = figures.error_maps(sitter, take, {"Ours": one})
    assert "Ours: 0.77 mm" in text(figure)
