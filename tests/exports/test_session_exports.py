"""What the session writes for other programs, read back by other code."""

import csv

import pytest

from capture_plan.exports.rows import write_rows
from capture_plan.exports.slate import write_slate
from capture_plan.expressions.pack import pack
from capture_plan.expressions.session import session, shot_title
from capture_plan.expressions.session_settings import SessionSettings
from capture_plan.expressions.settings import PackingSettings
from capture_plan.sample import sample_rig

RIG = sample_rig()
PACKING = pack(RIG, RIG.names, PackingSettings(method="minimum"))


def test_the_slate_has_every_item_once_and_room_for_ticks(tmp_path):
    of = session(RIG, RIG.names, PACKING, SessionSettings(minutes=15))
    rows = list(csv.DictReader(write_slate(of, tmp_path / "slate.csv").open(newline="", encoding="utf-8")))
    assert [row["shot"] for row in rows] == [
        shot_title(item).removeprefix("Shot ") * (item.kind != "pause") for item in of.items
    ]
    assert [row["name"] for row in rows] == [item.name for item in of.items]
    assert [row["sentence"] for row in rows] == [item.sentence for item in of.items]
    assert float(rows[-1]["covered_percent"]) == pytest.approx(100, abs=0.1)
    assert all(row["take_1"] == row["pass"] == row["retake"] == "" for row in rows)
    assert sum(row["fits_the_time"] != "yes" and row["kind"] == "expression" for row in rows) == 18 - of.fitting


def test_no_cell_of_a_table_is_a_formula_and_numbers_stay_numbers(tmp_path):
    names = ["=cmd()", "+1", "@x", "-a", "\tx", "\rx", "\nx", " =1", "\uff1d1"]
    write_rows(tmp_path / "t.csv", [["frame", *names, "a-b"], [-1, *[0.5] * len(names), "c=d"]])
    with (tmp_path / "t.csv").open(newline="", encoding="utf-8") as file:
        heads, row = csv.reader(file)
    assert heads == ["frame", *(f"'{name}" for name in names), "a-b"]
    assert row == ["-1", *["0.5"] * len(names), "c=d"]
