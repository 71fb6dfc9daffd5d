"""Folders of CSV tables: places, faces, titles and separators; tables that do not fit are refused."""

from pathlib import Path

import numpy as np
import pytest

from capture_plan.errors import RigError
from capture_plan.reader.read import read_raw

NEUTRAL, MOVED = "x,y,z\n0,0,0\n1,0,0\n1,1,0\n0,1,0\n", "x,y,z\n0,0,0\n1,0,0\n1,1,2e0\n0,1,0\n"


def write(folder: Path, **files: str) -> Path:
    folder.mkdir()
    for stem, text in ({"neutral": NEUTRAL, "faces": "0,1,2,3\n", "smile": MOVED} | files).items():
        (folder / f"{stem}.csv").write_text(text)
    return folder


@pytest.mark.parametrize("separator", [",", ";", "\t", ", "])
@pytest.mark.parametrize("titles", ["x,y,z\n", "vertex x,vertex y,vertex z\n", "", "\ufeffx,y,z\n"])
def test_tables_read_the_same_with_any_separator_and_title(tmp_path, separator, titles):
    files = {stem: (titles + text[6:]).replace(",", separator) for stem, text in (("neutral", NEUTRAL), ("a", MOVED))}
    rig = read_raw(write(tmp_path / "r", **files))
    np.testing.assert_array_equal(rig.neutral, [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    np.testing.assert_array_equal(rig.triangles, [[0, 1, 2], [0, 2, 3]])
    assert rig.names == ("a", "smile")
    np.testing.assert_array_equal(rig.deltas[0], rig.deltas[1])


@pytest.mark.parametrize(
    ("files", "says"),
    [
        ({"faces": "0,1,9\n"}, "vertices beyond its 4"),
        ({"faces": "0,1.5,2\n"}, "whole vertex numbers"),
        ({"faces": "0,1,1e300\n"}, "whole vertex numbers"),
        ({"faces": "0,1\n"}, "three or four"),
        ({"smile": "0,0,0\n"}, "smile.csv has 1 vertices"),
        ({"smile": "0,0\n1,1\n"}, "has 2 columns"),
        ({"smile": "0,0,0\n1,1\n"}, "not a table of numbers"),
        ({"smile": "x,y,z\n"}, "has no rows"),
        ({"smile": "\0\1"}, "smile.csv"),
        ({"smile": NEUTRAL}, "every blendshape equals the neutral"),
    ],
)
def test_tables_that_do_not_make_one_rig_are_refused_in_one_line(tmp_path, files, says):
    with pytest.raises(RigError, match=says) as error:
        read_raw(write(tmp_path / "r", **files))
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("odd", ["", "x,y,z\n", "0,0,0\n", "0,0\n1,1\n", "0,0,0\n1,1\n", "a table of weights"])
def test_one_table_that_is_no_whole_blendshape_is_left_out_and_named(tmp_path, odd):
    rig = read_raw(write(tmp_path / "r", odd=odd))
    assert rig.names == ("smile",)
    assert "odd.csv" in rig.note


def test_a_folder_without_faces_or_neutral_says_so(tmp_path):
    for gone, says in (("faces", "no table faces"), ("neutral", "called neutral")):
        folder = write(tmp_path / gone)
        (folder / f"{gone}.csv").unlink()
        with pytest.raises(RigError, match=says):
            read_raw(folder)
