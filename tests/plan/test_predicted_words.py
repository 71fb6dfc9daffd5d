"""What a plan says of its errors: which solve each is of, at which noise, and what the rig cannot show."""

import pytest
from msgspec.structs import replace

from capture_plan.layout.record import Information, Prediction, Reference
from capture_plan.plan.predicted import beyond_words, error_words, headline_words, known_to, prediction_words
from capture_plan.plan.summary import information_words
from capture_plan.report.contents import compare_row, error_tile, headline, predicted_row

WORTH = Information(landmarks=20, rank=5, full_rank=6, condition=9.0, noise_mm=0.5, error_mm=0.41)
MIXES = Prediction("3 to 8 blendshapes at once", 0.5, 0.3123, 0.2, 0.45, 0.0011)
USUAL = Prediction("3 to 8 blendshapes at once", 0.2, 0.1423, 0.1, 0.19, 0.0001)
TAKE = Prediction("anna", 0.5, 0.9, 0.7, 1.2, 0.002, beyond_mm=0.8)


def test_every_error_is_said_with_the_solve_that_it_is_of():
    usual, noisy, upper, _ = prediction_words(WORTH, (USUAL, MIXES, TAKE))
    for sentence, noise in ((usual, "0.2 mm of noise"), (noisy, "0.5 mm of noise")):
        assert noise in sentence
        assert "weights solved between 0 and 1" in sentence
    assert "anna 0.900 ± 0.002 mm, 9 of 10 frames 0.70 to 1.20 mm" in noisy
    assert "upper estimate is of the mean error" in upper
    assert "weights of any size" in upper
    assert "single frames can lie above it" in upper
    assert "is larger" not in upper


def test_an_upper_estimate_that_lies_below_a_predicted_error_says_why():
    few = replace(WORTH, error_mm=0.3)
    assert "Here the predicted error is larger" in prediction_words(few, (MIXES,))[-1]
    assert "Here" not in prediction_words(few, (USUAL, TAKE))[-2]


def test_what_the_rig_cannot_show_of_a_take_is_said_once_and_only_where_there_is_any():
    shown = Prediction("bert", 0.5, 0.3, 0.2, 0.4, 0.001, beyond_mm=0.0)
    other = Prediction("anna", 0.2, 0.85, 0.7, 1.1, 0.002, beyond_mm=0.8)
    (line,) = beyond_words((other, TAKE, shown, MIXES))
    assert "cannot show of anna: 0.80 mm" in line


def test_a_standard_error_is_never_printed_smaller_than_it_is():
    for prediction in (MIXES, USUAL, TAKE):
        assert known_to(prediction) >= prediction.standard_error_mm
        assert known_to(prediction) - prediction.standard_error_mm <= 0.001


def test_the_headline_is_predicted_at_the_noise_of_the_settings():
    assert headline(WORTH, (USUAL, MIXES, TAKE)) == MIXES.error_mm
    assert (
        error_words(WORTH, (USUAL, MIXES)) == "predicted error 0.312 mm, upper estimate 0.410 mm under 0.5 mm of noise"
    )
    assert information_words(WORTH, (USUAL, MIXES)).startswith("20 landmarks, rank 5 of 6, predicted error 0.312 mm")
    tile = error_tile(WORTH, (USUAL, MIXES))
    assert (tile.name, tile.figure, tile.unit) == ("Predicted error", "0.31", "mm")
    assert "weights solved between 0 and 1, 3 to 8 blendshapes at once" in tile.note


@pytest.mark.parametrize("predictions", [(), (USUAL,)], ids=["none", "of another noise"])
def test_where_nothing_was_predicted_the_upper_estimate_has_its_own_name(predictions):
    tile = error_tile(WORTH, predictions)
    assert (tile.name, tile.figure) == ("Upper estimate", "0.41")
    assert "weights of any size" in tile.note
    assert error_words(WORTH, predictions) == "upper estimate 0.410 mm under 0.5 mm of noise"


def test_rows_of_tables_keep_both_errors_apart():
    row = compare_row("mine", WORTH, own=True, error_mm=MIXES.error_mm, share=1.0)
    assert (row["error"], row["upper"]) == ("0.312 mm", "0.410 mm")
    assert predicted_row(TAKE)["beyond"] == "0.800 mm"
    assert predicted_row(MIXES)["beyond"] == ""


def test_another_layout_brings_its_own_predictions():
    other = Reference(68, 4, 4, 3.0, 0.5, 0.62, vertices=(), predictions=(MIXES,))
    assert "predicted error 0.312 mm, upper estimate 0.620 mm" in information_words(other, other.predictions)


def test_where_there_is_room_for_one_figure_it_is_what_the_solve_is_expected_to_give():
    assert headline_words(WORTH, (USUAL, MIXES)) == "predicted error 0.31 mm under 0.5 mm of noise"
    assert headline_words(WORTH, ()) == "upper estimate 0.41 mm under 0.5 mm of noise"
