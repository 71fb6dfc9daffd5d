"""The shot list as a take of Live Link Face, read back by pandas and by the package's reader of takes."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from capture_plan.errors import PlanError
from capture_plan.exports.livelink import HOLD_S, RAMP_S, RATE, REST_S, column_of, write
from capture_plan.names.name_map import NameMap
from capture_plan.names.recognise import recognise
from capture_plan.plan.inputs import PlanInputs
from capture_plan.sequence import read_sequence
from tests.exports.deliveries import sample

ONE = round((REST_S + 2 * RAMP_S + HOLD_S) * RATE)  # frames of an expression


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    (path,) = write(sample(), tmp_path_factory.mktemp("livelink"))
    return path


def test_a_table_as_the_app_writes_it(path):
    table = pd.read_csv(path)
    assert table.shape[1] == 2 + 61
    assert (table["BlendshapeCount"] == 61).all()
    names = [recognise(name) for name in table.columns[2:54]]
    assert len({found.name for found in names}) == 52
    assert table.iloc[0, 0] == "00:00:00:00.000"
    assert table.iloc[RATE + 30, 0] == "00:00:01:30.000"
    assert len(table) == ONE * len(sample().plan.packing.expressions) + round(REST_S * RATE)


def test_each_expression_is_held_at_its_weights_and_at_rest_between(path):
    table = pd.read_csv(path)
    columns = [column[:1].lower() + column[1:] for column in table.columns[2:54]]
    weights = table.iloc[:, 2:54].to_numpy()
    for number, expression in enumerate(sample().plan.in_session):
        start = number * ONE
        held = weights[start + round((REST_S + RAMP_S + HOLD_S / 2) * RATE)]
        assert {name: w for name, w in zip(columns, held, strict=True) if w} == expression.pose
        assert not weights[start].any()
        assert not weights[start + ONE - 1].any()
    assert np.abs(np.diff(weights, axis=0)).max() <= 1 / (RAMP_S * RATE) + 1e-6


def test_the_packages_own_reader_sees_the_same_take(path):
    rig = sample().inputs.rig
    take = read_sequence(path, rig=rig)
    assert take.fps == pytest.approx(RATE)
    middle = round((REST_S + RAMP_S + HOLD_S / 2) * RATE)
    pose = sample().plan.in_session[0].pose
    expected = rig.pose(np.array([pose.get(name, 0.0) for name in rig.names]))
    assert np.abs(take.frames.block(middle, middle + 1)[0] - expected)[rig.skin].max() < 0.01


def test_halves_of_what_arkit_does_not_split_share_its_column():
    rig = sample().inputs.rig
    assert column_of(rig, "browInnerUp_L") == column_of(rig, "browInnerUp_R") == column_of(rig, "browInnerUp")
    assert column_of(rig, "jawLeft") != column_of(rig, "jawRight")
    assert column_of(rig, "shape_12") is None
    assert column_of(replace(rig, meanings=(("jawOpen", "mouthClose"),)), "jawOpen") == column_of(rig, "mouthClose")


def test_without_a_blendshape_of_arkit_it_says_why(tmp_path):
    of = sample()
    unnamed = {name: f"shape_{i}" for i, name in enumerate(of.inputs.rig.names)}
    rig = replace(of.inputs.rig, meanings=tuple(unnamed.items()))
    assert NameMap(unnamed).meaning("jawOpen") == unnamed["jawOpen"]
    with pytest.raises(PlanError, match=r"no preview for Live Link: none of the \d+ .* --names"):
        write(replace(of, inputs=PlanInputs(rig)), tmp_path)
    assert not list(tmp_path.iterdir())
