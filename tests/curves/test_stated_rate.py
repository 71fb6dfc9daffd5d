"""Frame rates as people write them."""

import json

import numpy as np
import pytest

from capture_plan.curves.stated_rate import rate_in_value, rate_in_words, rates_in_line
from capture_plan.sample import sample_rig
from capture_plan.sequence import read_sequence


@pytest.mark.parametrize(
    ("text", "fps"),
    [
        ("30", 30), ("29,97", 29.97), ("60 fps", 60), ("60Hz", 60), ("30000/1001", 29.97003), ("1/60", 60),
        ("1/25 s", 25), ("2.4e1", 24), ("48000", None), ("0", None), ("1/0", None), ("jaw", None), ("", None),
    ],
)  # fmt: skip
def test_a_cell_is_read_as_it_is_meant(text, fps):
    assert rate_in_words(text) == (None if fps is None else pytest.approx(fps, abs=1e-4))


@pytest.mark.parametrize(
    ("line", "rates"),
    [
        ("# recorded at 60fps", {60}), ("# 24000/1001 fps", {23.976024}), ("frame rate;60", {60}),
        ("# fps: 30.0 fps", {30}), ("# frame rate: 1/60", {60}), ("# take 12 of 30", set()),
        ("# fps: 60, was 30 fps", {60, 30}),
    ],
)  # fmt: skip
def test_a_line_tells_its_rates(line, rates):
    assert rates_in_line(line) == rates


@pytest.mark.parametrize(
    "value", [24, "24 fps", "24/1", [24, 1], {"num": 24, "den": 1}, {"numerator": 24, "denominator": 1}]
)
def test_a_value_of_a_document_is_a_number_words_or_a_fraction(value):
    assert rate_in_value(value) == 24
    assert rate_in_value([24, 1, 1]) is None
    assert rate_in_value(True) is None


@pytest.mark.parametrize("told", [{"fps": "30000/1001"}, {"frameRate": [30000, 1001]}, {"dt": 1001 / 30000}])
def test_a_take_has_the_rate_that_its_document_tells(tmp_path, told):
    rig = sample_rig()
    weights = np.linspace(0, 1, 12)[:, None] * np.ones(len(rig.names))
    path = tmp_path / "take.json"
    path.write_text(json.dumps({**told, "names": list(rig.names), "weights": weights.tolist()}))
    assert read_sequence(path, rig=rig).fps == pytest.approx(29.97, abs=1e-3)
