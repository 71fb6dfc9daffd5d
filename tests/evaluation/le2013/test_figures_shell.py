"""Pictures of thin-shell layouts show the numbers they were given; inherited markers differ from new ones."""

import io

import matplotlib
import msgspec
import numpy as np
import pytest
from PIL import Image

from capture_plan import figures
from capture_plan.evaluation.le2013.cross_subject import CrossSubject, LeftOut, Shared
from capture_plan.evaluation.le2013.evaluation import Evaluation, Rims
from capture_plan.evaluation.le2013.methods import MIRRORED, NESTED, PAPER, Scored, vertex_errors
from capture_plan.evaluation.le2013.methods import OURS as OUR_METHOD
from capture_plan.evaluation.le2013.validation import Descents, Folds, Recovery
from capture_plan.figures.style import OTHERS, OURS
from capture_plan.sample import sample_rig
from capture_plan.sample.motion import sample_motion
from capture_plan.sheets.style import rgb
from capture_plan.shell.take import face_take


@pytest.fixture(scope="module")
def sitter():
    return figures.sit(sample_rig())


@pytest.fixture(scope="module")
def take():
    return face_take(sample_rig(), sample_motion(frames=30))


def scored(method, vertices, rmse_mm):
    return Scored(method, len(vertices), tuple(int(v) for v in vertices), rmse_mm, 1, ())


def evaluation(*scored, folds=(), descents_mm=((1.0, 0.5),), layouts=((0,), (1,)), rims=(), subjects=None):
    counts = tuple(sorted({one.markers for one in scored}))
    recovery = Recovery(1, 0, 0.0, 1, 0.0, (0,), (0,))
    return Evaluation(
        rig="head",
        take="take",
        frames=30,
        vertices=9,
        held=1,
        rest_mm=2.0,
        motion_rank=3,
        uneven=0.1,
        used=5,
        full_rank=5,
        counts=counts,
        scored=scored,
        rims=rims,
        symmetry=(),
        recoveries=tuple(Recovery(m, 0, 0.0, 1, 0.0, (0,), (0,)) for m in counts),
        published=recovery,
        folds=tuple(folds),
        skinning=(),
        descents=Descents(1, descents_mm, layouts),
        unperformed=(),
        notes=(),
        subjects=subjects,
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
    found = evaluation(scored(OUR_METHOD, range(1), 0.5), descents_mm=((2.0, 1.0, 0.9), (3.0, 1.5, 1.6)))
    figure = figures.error_over_iterations(found)
    assert line(figure, "start 2").get_xydata() == pytest.approx(np.array([[0, 3.0], [1, 1.5], [2, 1.6]]))
    assert set(line(figure, OUR_METHOD).get_ydata()) == {0.5}


def test_a_layout_in_use_is_a_letter_at_its_number_and_error():
    used = scored("seven points", range(7), 0.9)
    figure = figures.error_against_markers(evaluation(scored(OUR_METHOD, range(4), 0.5), used))
    (letter,) = [words for words in figure.axes[0].texts if words.get_text() == "A"]
    assert letter.get_position() == (7, 0.9)
    assert line(figure, "A: seven points").get_xydata() == pytest.approx(np.array([[7, 0.9]]))


def test_people_are_shown_under_the_layouts_of_others():
    rows = tuple(LeftOut(name, 4, mm, 0.4, 0.5, 1.5, 0) for name, mm in (("one", 0.6), ("two", 0.8)))
    found = evaluation(scored(OUR_METHOD, range(4), 0.4), subjects=CrossSubject(rows, ()))
    figure = figures.error_between_people(found)
    assert line(figure, "two").get_xydata() == pytest.approx(np.array([[4, 0.8]]))


def test_unseen_frames_are_shown_as_mean_and_standard_deviation():
    found = evaluation(scored(OUR_METHOD, range(4), 0.5), folds=[Folds(OUR_METHOD, 4, (1.0, 3.0), (1.0, 1.0))])
    figure = figures.error_on_unseen_frames(found)
    drawn = figure.axes[0].containers[0]
    assert drawn.lines[0].get_ydata() == pytest.approx([2.0])
    low, high = drawn.lines[2][0].get_segments()[0][:, 1]
    assert (low, high) == pytest.approx((1.0, 3.0))


def front_of(take):
    """Vertices that may carry a marker, the foremost first."""
    at = np.flatnonzero(take.candidates)
    return take.at[at[np.argsort(-take.shell.vertices[at, 2])]]


def test_inherited_markers_are_red_and_new_ones_blue(sitter, take):
    front = front_of(take)
    one, two = scored(NESTED, front[:1], 1.0), scored(NESTED, front[[0, 300]], 0.5)
    picture = pixels(figures.nested_layouts(sitter, [one, one], []))
    left, right = picture[:, : picture.shape[1] // 2], picture[:, picture.shape[1] // 2 :]
    assert near(left, OURS) > 50 > near(left, OTHERS[0])
    assert near(right, OTHERS[0]) > 50 > near(right, OURS)
    grown = figures.nested_layouts(sitter, [one, two], [one, two])
    assert {"0.500 mm, 1 new", "M = 2, free"} <= set(text(grown))


def test_markers_before_an_iteration_are_green_and_after_it_red(sitter, take):
    first, second = ((int(v),) for v in front_of(take)[[0, 300]])
    still = evaluation(scored(OUR_METHOD, range(4), 0.5), layouts=(first, first))
    moved = evaluation(scored(OUR_METHOD, range(4), 0.5), layouts=(first, second))
    assert near(pixels(figures.layouts_over_iterations(sitter, still)), OTHERS[1]) < 20
    figure = figures.layouts_over_iterations(sitter, moved)
    assert near(pixels(figure), OTHERS[1]) > 20 < near(pixels(figure), OTHERS[0])
    assert "0.500 mm, 1 moved" in text(figure)


def test_held_points_are_blue_where_the_rim_is_held(sitter, take):
    at = front_of(take)[:2]
    rims = (Rims(2, 0.5, 0.7, tuple(at.tolist())),)
    both = evaluation(scored(OUR_METHOD, at, 0.5), scored(MIRRORED, at, 0.6), rims=rims)
    figure = figures.constraints(sitter, take, both)
    picture = pixels(figure)
    third = picture.shape[1] // 3
    assert near(picture[:, :third], OURS) == 0
    assert near(picture[:, third:], OURS) > 50
    assert {"M = 2, 0.700 mm", "M = 2, 0.600 mm"} <= set(text(figure))


def test_a_found_marker_lies_on_the_simulated_one(sitter, take):
    found = evaluation(scored(OUR_METHOD, range(1), 0.5))
    at = int(np.searchsorted(take.at, front_of(take)[0]))
    one = Recovery(1, 0, 0.0, 1, 0.0, (at,), (at,))
    figure = figures.recovered_layouts(sitter, take, msgspec.structs.replace(found, recoveries=(one,), published=one))
    assert near(pixels(figure), OTHERS[0]) > 20 < near(pixels(figure), OTHERS[1])
    assert "1 of 1 found, 0.000 mm" in text(figure)


def test_layouts_from_all_people_say_their_error(sitter, take):
    shared = Shared(2, tuple(front_of(take)[:2].tolist()), 0.123)
    found = evaluation(scored(OUR_METHOD, range(4), 0.4), subjects=CrossSubject((), (shared,)))
    assert "0.123 mm over all" in text(figures.shared_layouts(sitter, found))


def test_maps_of_one_figure_share_one_scale(sitter, take):
    H = np.flatnonzero(take.candidates)
    maps = {"few": scored(OUR_METHOD, take.at[H[::400]], 2.0), "more": scored(OUR_METHOD, take.at[H[::100]], 1.0)}
    figure = figures.error_maps(sitter, take, maps)
    assert sum("error of each vertex, mm" in words for words in text(figure)) == 1


def test_a_map_says_the_error_of_its_layout_and_is_zero_at_its_markers(sitter, take):
    H = np.flatnonzero(take.candidates)[::200]
    one = scored(OUR_METHOD, take.at[H], 0.77)
    assert vertex_errors(take.shell, take.motion, take.places(take.at[H]))[H].max() < 1e-9
    figure = figures.error_maps(sitter, take, {"Ours": one})
    assert "Ours: 0.770 mm" in text(figure)
