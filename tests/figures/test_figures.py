"""Figures: the right size, colours where values are, dots where landmarks are, the same bytes every time."""

import io
import threading
import xml.etree.ElementTree as ElementTree

import matplotlib
import numpy as np
import pytest
from PIL import Image

from capture_plan import figures
from capture_plan.evaluation.baseline_cache import blendshape_errors, peers, predicted_by_seed, seeded, upper_estimates
from capture_plan.evaluation.zell2022.epsilon_sweep import EpsilonRow
from capture_plan.evaluation.zell2022.variants import single_cover
from capture_plan.figures.style import OURS, house
from capture_plan.layout.face import see_face
from capture_plan.layout.settings import LayoutSettings
from capture_plan.sample import sample_rig
from capture_plan.sheets.style import rgb
from capture_plan.sheets.view import FRONT

FREE = LayoutSettings(method="cover", symmetric=False)


@pytest.fixture(scope="module")
def face():
    rig = sample_rig()
    return see_face(rig, rig.names[:12])


@pytest.fixture(scope="module")
def sitter(face):
    return figures.sit(face.rig)


def pixels(figure):
    return np.asarray(Image.open(io.BytesIO(figures.png(figure))).convert("RGB")).astype(int)


def near(picture, colour, within=12):
    return np.abs(picture - np.array(rgb(colour))).max(axis=2) <= within


def text(figure):
    return [words.get_text() for words in figure.findobj(matplotlib.text.Text)]


def test_a_landmark_that_is_seen_has_a_dot_at_its_place_and_a_hidden_one_has_none(face, sitter):
    normals = sitter.posed.normals
    front = int(np.argmax(np.where(face.rig.skin, face.rig.neutral[:, 2] * (normals[:, 2] > 0.5), -1e9)))
    back = int(np.argmin(np.where(face.rig.skin, face.rig.neutral[:, 2], 1e9)))
    places, there = sitter.places(FRONT, sitter.front, np.array([front, back]))
    assert there.tolist() == [True, False]
    figure = figures.layouts_figure([figures.Captioned(sitter, "one", "", np.array([front, back]))], columns=1)
    picture = pixels(figure)
    row, column = np.argwhere(near(picture, OURS)).mean(axis=0)
    scale = picture.shape[1] / sitter.front.z.shape[1]
    assert np.hypot(column - places[0, 0] * scale, row - places[0, 1] * scale) < 3


def test_every_layout_says_its_number(face, sitter):
    vertices = np.flatnonzero(face.markable)[:7]
    shown = text(figures.named_layouts(sitter, {"first": vertices, "second": vertices[:4]}, {"first": "0.2 mm"}))
    assert {"first", "M = 7, 0.2 mm", "second", "M = 4"} <= set(shown)


def test_a_map_colours_the_skin_that_has_values_and_leaves_the_rest_in_clay(face, sitter):
    values = np.where(face.markable & (face.rig.neutral[:, 0] > 5), 1.0, np.nan)
    grey = sitter.front.rgb.astype(int)
    shown = figures.maps_figure([figures.HeadMap(sitter, "left", values, "share")], columns=1)
    assert "share" in text(shown)
    painted = sitter.posed, sitter.painted(values, lambda v: np.tile([1.0, 0.0, 0.0], (len(v), 1)))
    left, right = sitter.close_up(FRONT, painted[1]).rgb.astype(int), sitter.close_up(FRONT, painted[0]).rgb.astype(int)
    red = left[..., 0] - left[..., 1] > 100
    middle = left.shape[1] // 2
    assert red[:, middle + 20 :].sum() > 20 * max(1, red[:, : middle - 20].sum())
    assert np.abs(grey[..., 0] - grey[..., 2]).max() < 120
    assert not ((right[..., 0] - right[..., 1]) > 100).any()


def test_the_curve_over_epsilon_names_what_is_uncovered_and_what_is_not_proven():
    rows = (
        EpsilonRow(0.3, 4, 4, True, (1, 2, 3, 4), (1, 2, 3, 4, 5), ()),
        EpsilonRow(0.9, 6, 5, False, (1, 2, 3, 4, 5, 6), (1, 2, 3, 4, 5, 6, 7), ("jawOpen",)),
    )
    said = text(figures.number_against_epsilon(rows))
    assert {"1 uncovered", "fewest found", "no cover has fewer", "landmarks M"} <= set(said)
    assert "fewest, proven" in text(figures.number_against_epsilon(rows[:1]))


def test_every_axis_of_an_error_has_its_unit():
    curves = {"a": ([4, 8], [2.0, 1.0]), "ours": ([4, 8], [1.0, 0.5])}
    budget = figures.draw_error_against_budget(curves, ours="ours", meaning="error, mm", levels={"68": 0.6}, budget=8)
    noise = figures.error_against_noise(curves, ours="ours", meaning="error, mm")
    bars = figures.blendshape_bars(("x", "y"), {"ours": np.array([0.1, 0.3])}, meaning="error, mm")
    for figure in (budget, noise, bars):
        assert any("mm" in words for words in text(figure))
    assert "y" in text(bars)


def test_the_matrix_has_a_dot_where_a_landmark_stands_for_a_blendshape():
    extent = np.array([[0.9, 0.1], [0.4, 0.5]])
    figure = figures.incidence(("jaw$Open$", "smile"), ("M01", "M02"), extent, epsilon=0.5)
    (dots,) = [c for c in figure.axes[0].collections if len(c.get_offsets()) == 2]
    assert dots.get_offsets().tolist() == [[0, 0], [1, 1]]
    assert "jaw$Open$" in text(figure)
    assert figures.png(figure).startswith(b"\x89PNG")


def test_files_are_the_same_every_time_and_twice_as_fine_as_the_page(tmp_path):
    def drawn():
        return figures.error_against_noise({"ours": ([0.1, 0.2], [1.0, 2.0])}, ours="ours", meaning="error, mm")

    assert figures.png(drawn()) == figures.png(drawn())
    assert figures.svg(drawn()) == figures.svg(drawn())
    figure = drawn()
    picture = Image.open(figures.write_figure(figure, tmp_path / "a.png"))
    assert picture.size == tuple(int(2 * 100 * inches) for inches in figure.get_size_inches())
    ElementTree.parse(figures.write_figure(figure, tmp_path / "a.svg"))


def test_the_style_of_the_house_is_not_left_behind_by_any_thread():
    before = dict(matplotlib.rcParams)

    def draw():
        for _ in range(3):
            figures.png(figures.error_against_noise({"ours": ([0.1], [1.0])}, ours="ours", meaning="error, mm"))

    threads = [threading.Thread(target=draw) for _ in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert dict(matplotlib.rcParams) == before
    with house():
        assert matplotlib.rcParams["font.family"][0] == "Roboto"


def test_every_figure_of_the_paper_can_be_drawn(face, sitter):
    vertices = single_cover(face, FREE)
    row = EpsilonRow(0.5, 3, 3, True, tuple(vertices.tolist()), tuple(vertices.tolist()), ())
    by_seed = {"random": [vertices, vertices]}
    drawn = [
        figures.teaser(sitter, face, [row]),
        figures.models([(sitter, face, vertices)]),
        figures.occlusion(sitter, face),
        figures.replacements(sitter, face, FREE, vertices),
        figures.suited(sitter, face, FREE, face.used[:1]),
        figures.seeds(sitter, by_seed, {"random": [0.1, 0.2]}),
    ]
    assert all((pixels(figure) < 250).any() for figure in drawn)


def test_peers_are_the_same_from_the_disk_and_only_random_ones_hang_on_the_seed(face):
    first, again = peers(face, FREE, 6), peers(face, FREE, 6)
    assert all(np.array_equal(first[name], again[name]) for name in first)
    hanging = seeded(face, FREE, 6, seeds=(0, 1))
    assert "random" in hanging
    assert not {"QR pivot", "SCO04 (surface error)"} & set(hanging)
    errors = predicted_by_seed(face.observation(0.2), hanging)
    assert [len(some) for some in errors.values()] == [2] * len(hanging)


def test_the_error_of_a_blendshape_alone_falls_with_more_landmarks_and_less_noise(face):
    vertices = np.flatnonzero(face.markable)[::200]
    few = blendshape_errors(face.observation(0.2), vertices[:3])
    assert (blendshape_errors(face.observation(0.2), vertices) <= few + 1e-12).all()
    assert (blendshape_errors(face.observation(0.1), vertices[:3]) <= few + 1e-12).all()
    (total,) = upper_estimates(face.observation(0.2), {"few": vertices[:3]}).values()
    assert total > 0
