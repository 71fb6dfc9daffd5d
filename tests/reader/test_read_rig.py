"""`read_rig`: the same head through every format, in one unit and one pose of the axes; constraints; one clear line."""

import os
import re
from pathlib import Path

import numpy as np
import pytest

from capture_plan.errors import RigError
from capture_plan.face.axes import axes_matrix
from capture_plan.reader.read import read_rig
from capture_plan.rig import Rig
from capture_plan.sample import sample_rig
from tests.formats.test_gltf import write_sample_glb

K = 4


def write_obj_folder(folder: Path, up: str = "+y", facing: str = "+z", unit_mm: float = 1.0) -> Path:
    """The sample with its first four blendshapes, as a program with these axes and this unit writes it."""
    rig, R = sample_rig(), axes_matrix(up, facing) / unit_mm
    folder.mkdir()
    order = np.argsort(rig.parts[rig.triangles[:, 0]], kind="stable")
    lines = []
    for part, triangles in ((p, rig.triangles[order[rig.parts[rig.triangles[order, 0]] == p]]) for p in range(8)):
        lines.append(f"g {rig.part_names[part]}")
        lines += [f"f {a} {b} {c}" for a, b, c in triangles + 1]
    faces = "\n".join(lines)
    for k in range(-1, K):
        shape = rig.neutral + (rig.deltas[k] if k >= 0 else 0)
        vertices = "\n".join(f"v {x:.7f} {y:.7f} {z:.7f}" for x, y, z in shape @ R)
        (folder / f"{rig.names[k] if k >= 0 else 'neutral'}.obj").write_text(vertices + "\n" + faces + "\n")
    return folder


def write_npz(path: Path, **changes) -> Path:
    rig = sample_rig()
    labels = np.array(rig.part_names)[rig.parts[rig.triangles[:, 0]]]
    arrays = {
        "vertices": rig.neutral, "faces": rig.triangles, "deltas": rig.deltas[:K], "names": np.array(rig.names[:K]),
        "part": labels, "source_index": rig.source_index, "units": np.array("mm"),
    }  # fmt: skip
    np.savez(path, **(arrays | changes))
    return path


def assert_is_the_sample(rig: Rig) -> None:
    sample = sample_rig()
    np.testing.assert_allclose(rig.neutral, sample.neutral, atol=1e-3)
    np.testing.assert_allclose(rig.deltas, sample.deltas[:K], atol=1e-3)
    np.testing.assert_array_equal(np.sort(rig.triangles, axis=0), np.sort(sample.triangles, axis=0))
    assert rig.names == sample.names[:K]
    assert [rig.part_names[part] for part in rig.parts[::97]] == [
        sample.part_names[part] for part in sample.parts[::97]
    ]
    assert (rig.skin != sample.skin).mean() < 0.01  # fewer blendshapes, a slightly smaller moving face


@pytest.mark.parametrize(("up", "facing", "unit_mm"), [("+y", "+z", 1.0), ("+z", "-y", 10.0), ("-y", "-z", 1000.0)])
def test_an_obj_folder_comes_back_whatever_its_axes_and_unit(tmp_path, up, facing, unit_mm):
    rig = read_rig(write_obj_folder(tmp_path / "head", up, facing, unit_mm), up=up)
    assert (rig.up, rig.facing, rig.unit_mm, rig.name) == (up, facing, unit_mm, "head")
    assert (rig.unit_found, rig.up_found, rig.facing_found) == ("detected", "given", "detected")
    assert_is_the_sample(rig)


def test_an_archive_comes_back(tmp_path):
    rig = read_rig(write_npz(tmp_path / "head.npz"))
    assert_is_the_sample(rig)
    np.testing.assert_array_equal(rig.source_index, sample_rig().source_index)


def test_blendshapes_that_hold_nan_are_left_out_and_named_and_the_rig_is_read(tmp_path):
    deltas = sample_rig().deltas[:K].copy()
    deltas[0, 7, 1], deltas[3, 9, 0] = np.nan, np.inf
    rig, names = read_rig(write_npz(tmp_path / "head.npz", deltas=deltas)), sample_rig().names[:K]
    assert rig.names == tuple(name for k, name in enumerate(names) if k not in (0, 3))
    assert f"left out, clean them and export again: {names[0]}, {names[3]}" in rig.note
    with pytest.raises(RigError, match="all blendshapes hold NaN"):
        read_rig(write_npz(tmp_path / "none.npz", deltas=deltas * np.nan))


@pytest.mark.parametrize("number", ["nan", "inf"])
def test_a_broken_file_of_a_folder_is_left_out_and_named(tmp_path, number):
    folder = write_obj_folder(tmp_path / "head")
    path = sorted(path for path in folder.iterdir() if path.stem != "neutral")[0]
    path.write_text(re.sub(r"\Av \S+", f"v {number}", path.read_text()))
    rig = read_rig(folder)
    assert path.stem not in rig.names
    assert path.stem in rig.note


def test_a_glb_comes_back(tmp_path):
    rig, sample = read_rig(write_sample_glb(tmp_path / "head.glb", k=K)), sample_rig()
    assert (rig.unit_mm, rig.unit_found, rig.note) == (1000.0, "format", "")
    by_part = np.concatenate([np.flatnonzero(sample.parts == part) for part in range(len(sample.part_names))])
    same = by_part[rig.source_index]  # parts came one after another
    np.testing.assert_allclose(rig.neutral, sample.neutral[same], atol=1e-4)
    np.testing.assert_allclose(rig.deltas, sample.deltas[:K, same], atol=1e-4)
    assert rig.names == sample.names[:K]


def test_the_same_file_read_twice_has_the_same_fingerprint(tmp_path):
    path = write_npz(tmp_path / "head.npz")
    assert read_rig(path).fingerprint == read_rig(path).fingerprint


def test_the_subject_s_left_is_positive_x_however_the_file_lay(tmp_path):
    rig = read_rig(write_obj_folder(tmp_path / "head", "+z", "-y"))
    left = rig.displacement[rig.names.index("browDownLeft")]
    assert left @ rig.neutral[:, 0] / left.sum() > 10


def test_skin_may_be_given_as_parts_or_as_numbers_of_the_artists_file(tmp_path):
    path = write_npz(tmp_path / "head.npz")
    by_part = read_rig(path, skin="skin, eye_L")
    assert {by_part.part_names[part] for part in np.unique(by_part.parts[by_part.skin])} == {"skin", "eye_L"}
    numbers = tmp_path / "skin.txt"
    first, second, *_, last = sample_rig().source_index
    numbers.write_text(f"{first}-{second}  # two of the forehead\n{last},\n")
    rig = read_rig(path, skin=str(numbers))
    np.testing.assert_array_equal(rig.source_index[rig.skin], [first, second, last])


@pytest.mark.parametrize(
    ("text", "says"), [("1-x", "'1-x' is no vertex number"), ("", "names no vertex"), ("9999999", "names no")]
)
def test_useless_skin_files_are_refused(tmp_path, text, says):
    (tmp_path / "skin.txt").write_text(text)
    with pytest.raises(RigError, match=says):
        read_rig(write_npz(tmp_path / "head.npz"), skin=str(tmp_path / "skin.txt"))


def test_an_unknown_part_is_answered_with_the_parts_there_are(tmp_path):
    with pytest.raises(RigError, match="'face' is neither a file nor a part of head: its parts are skin, eye_L"):
        read_rig(write_npz(tmp_path / "head.npz"), skin="face")


def test_paths_that_hold_no_rig_are_refused_with_what_to_give(tmp_path):
    (tmp_path / "empty").mkdir()
    (tmp_path / "mixed").mkdir()
    (tmp_path / "mixed" / "notes.txt").write_text("hello")
    (tmp_path / "above" / "inner").mkdir(parents=True)
    (tmp_path / "above" / "inner" / "neutral.obj").write_text("v 0 0 0")
    (tmp_path / "one.obj").write_text("v 0 0 0")
    (tmp_path / "nothing.npz").write_bytes(b"")
    (tmp_path / "film.mov").write_bytes(b"x")
    for name, says in {
        "gone": "does not exist",
        "empty": "the folder empty is empty",
        "mixed": "holds no OBJ files: give a folder",
        "above": "holds no OBJ files: give inner inside it",
        "one.obj": "is a single mesh: give the folder",
        "nothing.npz": "is empty: export it again",
        "film.mov": "is not a format that is read here: give a folder",
    }.items():
        with pytest.raises(RigError, match=says) as error:
            read_rig(tmp_path / name)
        assert "\n" not in str(error.value)


@pytest.mark.skipif(os.name == "nt" or os.geteuid() == 0, reason="this user may read every file")
def test_a_file_that_may_not_be_read_is_refused(tmp_path):
    path = write_npz(tmp_path / "head.npz")
    path.chmod(0)
    with pytest.raises(RigError, match="cannot be read"):
        read_rig(path)


def archive_of(path, **changes):
    rig = sample_rig()
    retained = rig.rows(("jawOpen", "browInnerUp", "mouthSmileLeft", "mouthSmileRight"))
    arrays = {"vertices": rig.neutral, "faces": rig.triangles, "deltas": rig.deltas[retained]}
    np.savez(path, **arrays | {"names": [rig.names[i] for i in retained]} | changes)
    return arrays["deltas"]


def test_names_hold_nothing_that_a_screen_would_obey(tmp_path):
    archive_of(tmp_path / "r.npz", names=["\x1b[31mjawOpen", "brow\u202eInnerUp", "smile\nLeft", "smile\u2028Left"])
    rig = read_rig(tmp_path / "r.npz")
    assert all(name.isprintable() for name in rig.names)
    assert len(set(rig.names)) == 4
    assert "cannot be shown" in rig.note


@pytest.mark.parametrize("far", [1e7, 1e19, 1e38])
def test_a_blendshape_that_moves_beyond_all_measure_is_left_out_and_named(tmp_path, far):
    deltas = archive_of(tmp_path / "r.npz")
    deltas[1, 0, 2] = far
    archive_of(tmp_path / "r.npz", deltas=deltas)
    rig = read_rig(tmp_path / "r.npz")
    assert "browInnerUp" not in rig.names
    assert "browInnerUp" in rig.note


def test_a_neutral_beyond_all_measure_is_refused(tmp_path):
    archive_of(tmp_path / "r.npz", vertices=np.full_like(sample_rig().neutral, 1e19))
    with pytest.raises(RigError, match="lies 1e\\+19 units out"):
        read_rig(tmp_path / "r.npz")
