"""What recorded columns drive, and how it is told: Faceware's values, columns that compete, the brief mapping."""

import tomllib
from importlib.resources import files

import pytest

from capture_plan.cli import open_take
from capture_plan.progress import listen
from capture_plan.rig import sample_rig
from capture_plan.rig.sequence import map_weights, read_sequence

FACEWARE = tomllib.loads(files("capture_plan.rig").joinpath("data", "faceware.toml").read_text(encoding="utf-8"))


@pytest.mark.parametrize("spell", [str, str.lower, lambda name: f"13.{name}"])
def test_faceware_drives_the_nearest_blendshapes_of_the_same_side(spell):
    columns = [spell(name) for name in FACEWARE]
    mapping = map_weights(columns, sample_rig().names)
    assert len(mapping.columns) >= 33
    for one in mapping.drives:
        for side, other in (("left", "Right"), ("right", "Left")):
            if side in one.column.lower() and not one.column.lower().endswith(("lookleft", "lookright")):
                assert not one.blendshape.endswith(other) or "jaw" in one.column


def test_of_two_columns_the_one_that_drives_less_wins():
    """brows_midBrows_down moves both brows, brows_rightBrow_down its own."""
    mapping = map_weights(["brows_midBrows_down", "brows_leftBrow_down", "brows_rightBrow_down"], sample_rig().names)
    assert {one.column for one in mapping.drives} == {"brows_leftBrow_down", "brows_rightBrow_down"}
    assert "driven by another column" in dict(mapping.left_out)["brows_midBrows_down"]


def test_the_brief_mapping_names_every_column_and_every_idle_blendshape():
    columns = ["JawOpen", "AU12_r", "HeadYaw", "thing"]
    mapping = map_weights(columns, ["jawOpen", "mouthSmileLeft", "mouthSmileRight", "tongueOut"])
    text = "\n".join(mapping.brief())
    assert all(name in text for name in (*columns, "tongueOut"))
    assert "AU12_r drives mouthSmileLeft" in text


TAKE = "Timecode,JawOpen,HeadYaw,thing\n" + "".join(f"00:00:0{t // 30}:{t % 30:02d},0.5,1,2\n" for t in range(90))


def test_reading_a_take_tells_who_listens_what_was_understood(tmp_path):
    (tmp_path / "a.csv").write_text(TAKE)
    said = []
    with listen(said.extend):
        read_sequence(tmp_path / "a.csv", rig=sample_rig())
    read_sequence(tmp_path / "a.csv", rig=sample_rig())  # nobody listens
    assert said[0] == "a: 90 frames, 30 in a second"
    assert len([line for line in said if line.startswith("a:")]) == 1


def test_the_command_line_shows_the_mapping_on_standard_error(tmp_path, capsys):
    (tmp_path / "a.csv").write_text(TAKE)
    open_take(tmp_path / "a.csv", sample_rig(), None)
    out, err = capsys.readouterr()
    assert out == ""
    assert all(word in err for word in ("JawOpen", "HeadYaw", "thing", "driven by nothing"))
