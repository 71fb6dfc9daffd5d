"""What recorded columns drive, and how it is told: Faceware's values, columns that compete, the brief mapping."""

import re
import tomllib
from importlib.resources import files

import numpy as np
import pytest

from capture_plan.cli import open_take, unheard
from capture_plan.curves.columns import plain
from capture_plan.curves.mapping import drive
from capture_plan.curves.take_report import WIDE, mapped, of_several
from capture_plan.progress import listen
from capture_plan.sample import sample_rig
from capture_plan.sequence import map_weights, read_sequence

FACEWARE = tomllib.loads(files("capture_plan.names").joinpath("data", "faceware.toml").read_text(encoding="utf-8"))


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


def test_the_mapping_in_lines_names_every_column_and_every_idle_blendshape():
    columns = ["JawOpen", "AU12_r", "HeadYaw", "thing"]
    mapping = map_weights(columns, ["jawOpen", "mouthSmileLeft", "mouthSmileRight", "tongueOut"])
    text = "\n".join(mapped(mapping))
    assert all(name in text for name in (*columns, "tongueOut"))
    assert "AU12_r -> mouthSmileLeft, mouthSmileRight" in text
    assert "2 columns drive 3 of the rig's 4 blendshapes" in text


def test_no_line_is_too_long_and_no_name_lost():
    names = sample_rig().names
    for columns in (names, [name.replace("Left", "_L").replace("Right", "_R") for name in names], list(FACEWARE)):
        lines = mapped(map_weights(columns, names))
        assert max(map(len, lines)) <= WIDE
        words = set(re.split(r"[\s,:]+", " ".join(lines)))
        assert set(columns) <= words
        assert set(map(plain, names)) <= set(map(plain, words))


def test_reasons_of_several_columns_are_in_the_plural():
    assert of_several("it is no weight") == "they are no weights"
    assert of_several("it moves the whole head, which is held still").startswith("they move the whole head")
    assert of_several("it says how far the face is at rest").startswith("they say")


TAKE = "Timecode,JawOpen,HeadYaw,thing\n" + "".join(f"00:00:0{t // 30}:{t % 30:02d},0.5,1,2\n" for t in range(90))


def test_reading_a_take_tells_who_listens_what_was_understood(tmp_path):
    (tmp_path / "a.csv").write_text(TAKE)
    said = []
    with listen(said.extend):
        read_sequence(tmp_path / "a.csv", rig=sample_rig())
    read_sequence(tmp_path / "a.csv", rig=sample_rig())  # nobody listens
    assert said[0] == "a: 90 frames, 30 in a second, 3 s"
    assert len([line for line in said if line.startswith("a:")]) == 1


def test_the_command_line_shows_the_mapping_on_standard_error(tmp_path, capsys):
    (tmp_path / "a.csv").write_text(TAKE)
    open_take(tmp_path / "a.csv", sample_rig(), None)
    out, err = capsys.readouterr()
    assert out == ""
    assert all(word in err for word in ("JawOpen", "HeadYaw", "thing", "no column drives"))


def test_what_hardly_moves_is_no_missing_column(tmp_path):
    rows = "".join(f"00:00:0{t // 30}:{t % 30:02d},0.5,0.02\n" for t in range(90))
    (tmp_path / "a.csv").write_text("Timecode,JawOpen,MouthPucker\n" + rows)
    message = " ".join(read_sequence(tmp_path / "a.csv", rig=sample_rig()).messages())
    assert "1 of the driven blendshapes hardly moves (no weight above 0.1): mouthPucker" in " ".join(message.split())
    assert "2 columns drive 2 of the rig's 52 blendshapes" in message


def test_notes_are_said_once():
    heard = ["take: 3 frames", "  note: 6 of 70 frames have no face", "    and were left out", "  2 columns drive"]
    lines = ["Note: take: 6 of 70 frames have no face and were left out.", "Note: another thing.", "Sum."]
    assert unheard(lines, heard) == lines[1:]
    assert unheard(["note: 6 of 70 frames have no face and were left out"], heard) == []


QUARTERS = ("Lip_Funneler_LB", "Lip_Funneler_LT", "Lip_Funneler_RB", "Lip_Funneler_RT")


def test_action_units_in_words_drive_what_they_name_and_quarters_never_add_up_to_more_than_the_whole():
    columns = ["Outer_Brow_Raiser_L", "Inner_Brow_Raiser_L", "Lid_Tightener_R", "Eyes_Closed_R", *QUARTERS]
    names = sample_rig().names
    mapping = map_weights(columns, names)
    message = {drive.column: drive.blendshape for drive in mapping.drives}
    assert [message[column] for column in columns[:4]] == [
        "browOuterUpLeft", "browInnerUp", "eyeSquintRight", "eyeBlinkRight"
    ]  # fmt: skip
    w = drive(mapping, columns, names, np.ones((1, len(columns))))[0]
    assert w[names.index("mouthFunnel")] == pytest.approx(1)
    assert w.max() <= 1 + 1e-9


def test_top_and_bottom_of_an_action_unit_are_the_upper_and_the_lower_lip():
    lips = {
        "Lip_Suck_LT": "mouthRollUpper",
        "Lip_Suck_LB": "mouthRollLower",
        "Chin_Raiser_T": "mouthShrugUpper",
        "Chin_Raiser_B": "mouthShrugLower",
    }
    drives = map_weights([*lips], sample_rig().names).drives
    assert {column: {one.blendshape for one in drives if one.column == column} for column in lips} == {
        column: {blendshape} for column, blendshape in lips.items()
    }


def test_of_a_blink_and_a_wink_that_stands_still_the_blink_counts():
    names, columns = ("eyeBlinkLeft", "eyeBlinkRight"), ("まばたき", "ウィンク", "ウィンク右")
    mapping = map_weights(columns, names, still=("ウィンク", "ウィンク右"))
    assert {(one.column, one.blendshape) for one in mapping.drives} == {("まばたき", name) for name in names}
    both = map_weights(columns, names)
    assert {one.column for one in both.drives} == {"ウィンク", "ウィンク右"}


def test_a_column_of_the_same_name_counts_though_it_stands_still():
    mapping = map_weights(("eyeBlinkLeft", "blink_l"), ("eyeBlinkLeft",), still=("eyeBlinkLeft",))
    assert [one.column for one in mapping.drives] == ["eyeBlinkLeft"]
