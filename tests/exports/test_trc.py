"""TRC tables read back by pandas, as programs of motion capture do."""

import numpy as np
import pandas as pd

from capture_plan.exports.trc import write
from capture_plan.plan.record import words_of
from tests.exports.deliveries import badly_named, posed_dots, sample


def test_a_table_of_coordinates_one_frame_a_pose(tmp_path):
    (path,) = write(sample(), tmp_path)
    with path.open() as file:
        kind, heads, values, names, axes = (next(file).rstrip("\n").split("\t") for _ in range(5))
    facts = dict(zip(heads, values, strict=True))
    table = pd.read_csv(path, sep="\t", skiprows=5, header=None)
    e, m = posed_dots(sample()).shape[:2]
    assert (kind[0], facts["Units"]) == ("PathFileType", "mm")
    assert kind[4] == words_of(sample().plan)
    assert (int(facts["NumFrames"]), int(facts["NumMarkers"])) == (e, m) == (len(table), len(sample().names))
    assert tuple(names[2::3]) == sample().names
    assert axes[2:5] == ["X1", "Y1", "Z1"]
    assert table[0].tolist() == list(range(1, e + 1))
    assert np.abs(table.iloc[:, 2:].to_numpy().reshape(e, m, 3) - posed_dots(sample())).max() < 0.01


def test_names_hold_no_tab_and_are_all_different(tmp_path):
    (path,) = write(badly_named(30), tmp_path)
    names = path.read_text().splitlines()[3].split("\t")[2::3]
    assert len(set(names)) == 30
