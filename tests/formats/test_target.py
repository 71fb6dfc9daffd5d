"""MakeHuman folders: the base mesh's numbers, blendshapes from `.target` files, without shells and joints."""

import gzip
import zipfile
from pathlib import Path

import numpy as np
import pytest

from capture_plan.errors import RigError
from capture_plan.reader.read import read_raw

BASE = """v 9 9 9\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 5 5 5\nv 6 5 5\nv 6 6 5
g joint-l-eye\nf 1 2 3\ng body\nf 2 3 4 5\ng helper-tights\nf 6 7 8\ng helper-l-eye\nf 2 3 4\n"""


def write(folder: Path, **targets: str) -> Path:
    (folder / "units" / "face").mkdir(parents=True)
    (folder / "base.obj").write_text(BASE)
    for stem, text in targets.items():
        (folder / "units" / "face" / f"{stem}.target").write_text(text)
    return folder


def test_a_target_moves_the_vertices_it_numbers(tmp_path):
    rig = read_raw(write(tmp_path / "r", smile="# face unit\n3 .5 0 -.25\n7 1 1 1\n", still=""))
    assert (rig.names, rig.unit_mm, rig.up, rig.facing) == (("smile", "still"), 100.0, "+y", "+z")
    np.testing.assert_array_equal(rig.source_index, [1, 2, 3, 4])
    np.testing.assert_array_equal(rig.deltas[0], [[0, 0, 0], [0, 0, 0], [0.5, 0, -0.25], [0, 0, 0]])
    assert not rig.deltas[1].any()


def test_shells_and_joints_are_left_out_and_parts_keep_their_names(tmp_path):
    rig = read_raw(write(tmp_path / "r", smile="3 1 0 0"))
    assert rig.part_names == ("body", "helper-l-eye")
    np.testing.assert_array_equal(rig.triangles, [[0, 1, 2], [0, 2, 3], [0, 1, 2]])


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("8 1 0 0", "moves vertex 8 of 8"),
        ("-1 1 0 0", "moves vertex -1 of 8"),
        ("1.5 1 0 0", "moves vertex 1.5 of 8"),
        ("99999999999 1 0 0", "belongs to another base mesh"),
        ("1 1 0", "not a table"),
        ("nan 1 0 1", "not a table of"),
        ("1 1 0 0\n2 x 0 0", "not a table"),
        ("\0\1\2", "not a table"),
        ("", "every blendshape equals the neutral"),
    ],
)
def test_targets_that_do_not_fit_are_refused_in_one_line(tmp_path, text, says):
    with pytest.raises(RigError, match=says) as error:
        read_raw(write(tmp_path / "r", smile=text))
    assert "\n" not in str(error.value)


def test_more_than_fits_is_refused_before_it_is_made(tmp_path, monkeypatch):
    monkeypatch.setattr("capture_plan.input.bounds.MOST_DISPLACEMENTS", 20)
    with pytest.raises(RigError, match="2 blendshapes of 8 vertices are more than fit"):
        read_raw(write(tmp_path / "r", a="1 1 0 0", b="1 1 0 0"))


def packed(folder: Path) -> Path:
    """The folder with its targets compressed."""
    for path in sorted(folder.rglob("*.target")):
        path.with_name(f"{path.name}.gz").write_bytes(gzip.compress(path.read_bytes()))
        path.unlink()
    return folder


@pytest.mark.parametrize("zipped", [False, True])
def test_compressed_targets_are_read(tmp_path, zipped):
    plain = read_raw(write(tmp_path / "r", smile="3 .5 0 -.25\n", blink="2 0,5 0 1\n"))
    path = packed(write(tmp_path / "s", smile="3 .5 0 -.25\n", blink="2 0.5 0 1\n"))
    if zipped:
        with zipfile.ZipFile(tmp_path / "s.zip", "w") as archive:
            for file in (file for file in path.rglob("*") if file.is_file()):
                archive.write(file, file.relative_to(path))
        path = tmp_path / "s.zip"
    rig = read_raw(path)
    assert rig.names == plain.names == ("blink", "smile")
    np.testing.assert_array_equal(rig.deltas, plain.deltas)


def test_a_damaged_target_is_refused_in_one_line(tmp_path):
    folder = packed(write(tmp_path / "r", smile="3 .5 0 -.25\n"))
    path = next(folder.rglob("*.gz"))
    path.write_bytes(path.read_bytes()[:-9])
    with pytest.raises(RigError, match=r"smile\.target\.gz is no whole gzip file"):
        read_raw(folder)


@pytest.mark.parametrize("zipped", [False, True])
def test_targets_without_their_mesh_are_refused_by_its_name(tmp_path, zipped):
    path = write(tmp_path / "r", smile="3 1 0 0")
    (path / "base.obj").unlink()
    if zipped:
        with zipfile.ZipFile(tmp_path / "r.zip", "w") as archive:
            archive.writestr("units/smile.target", "3 1 0 0")
        path = tmp_path / "r.zip"
    with pytest.raises(RigError, match=r"MakeHuman's base\.obj"):
        read_raw(path)


def test_targets_of_one_name_in_two_folders_are_numbered(tmp_path):
    folder = write(tmp_path / "r", smile="3 1 0 0")
    (folder / "smile.target").write_text("3 2 0 0")
    rig = read_raw(folder)
    assert rig.names == ("smile", "smile 2")
    assert "smile 2" in rig.note
