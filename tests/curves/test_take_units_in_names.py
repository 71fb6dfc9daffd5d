"""Takes: a unit in a column's name tells the scale, and the name is read without it."""

import numpy as np
import pytest

from capture_plan.curves.units_in_names import full_in, without_unit
from capture_plan.names.name_map import read_name_map
from capture_plan.sample import sample_rig
from tests.curves.test_take_dialects import driven, read, table

RIG = sample_rig().names
UNITS = [
    "_pct",
    "_percent",
    " pct",
    " [%]",
    "_%",
    "Percent",
    ".Pct",
    " (percentage)",
    "_PCT",
    " in %",
    "_perc",
    "Prozent",
    "_porcentaje",
]


def lively(frames=60):
    """Weights of every blendshape of the rig, in thousandths."""
    t, k = np.arange(frames)[:, None] / 60, np.arange(len(RIG))
    return np.round(0.45 + 0.45 * np.sin((5 + k % 7) * t + k), 3)


@pytest.mark.parametrize("unit", UNITS)
def test_no_column_is_lost_to_the_unit_in_its_name(tmp_path, unit):
    take = read(tmp_path / "a.csv", table(100 * lively(), names=[name + unit for name in RIG]))
    assert driven(take, RIG) == pytest.approx(lively(), abs=1e-6)


@pytest.mark.parametrize("name", ["jawOpen", "mouthUpperUpLeft", "pctrl_jawOpen", "cheekPuff"])
def test_a_name_without_a_unit_stays(name):
    assert (full_in(name), without_unit(name)) == (None, name)
    assert {without_unit(name + unit) for unit in UNITS} == {name}


def test_a_column_that_alone_states_a_unit_is_divided_by_it_and_said(tmp_path):
    w, names = lively(), [*RIG]
    w[:, 3], names[3] = 100 * w[:, 3], names[3] + "_pct"
    take = read(tmp_path / "a.csv", table(w, names=names))
    assert driven(take, RIG) == pytest.approx(lively(), abs=1e-6)
    assert any(f"only {names[3]} of its" in note for note in take.notes)


def test_what_a_name_map_names_with_its_unit_is_found(tmp_path):
    (tmp_path / "map.toml").write_text('[weights]\n"jawOpen_pct" = "jawForward"\n')
    text = table(100 * lively(), names=[name + "_pct" for name in RIG])
    take = read(tmp_path / "a.csv", text, name_map=read_name_map(tmp_path / "map.toml"))
    assert driven(take, ["jawForward"])[:, 0] == pytest.approx(lively()[:, RIG.index("jawOpen")], abs=1e-6)
