"""Zip archives: what a folder gives, its archive gives, in memory; dishonest archives are refused in one line."""

import io
import stat
import struct
import zipfile
from pathlib import Path

import numpy as np
import pytest

from capture_plan.errors import RigError
from capture_plan.input import zipped
from capture_plan.input.zipped import open_zip
from capture_plan.reader.read import read_raw
from tests.formats.test_gltf import write_sample_glb
from tests.reader.test_read_rig import write_obj_folder

NEUTRAL = "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\n"
SMILE = "v 0 0 0\nv 1 0 0\nv 1 1 2\nf 1 2 3\n"


def archive(path: Path, files: dict[str, str | bytes], method: int = zipfile.ZIP_DEFLATED) -> Path:
    with zipfile.ZipFile(path, "w", method) as zipped:
        for name, text in files.items():
            zipped.writestr(name, text)
    return path


def pack(path: Path, folder: Path) -> Path:
    return archive(path, {f"{folder.name}/{p.name}": p.read_bytes() for p in sorted(folder.iterdir())})


def test_an_archive_of_a_folder_is_the_folder(tmp_path):
    folder = write_obj_folder(tmp_path / "head")
    straight, zipped = read_raw(folder), read_raw(pack(tmp_path / "any.zip", folder))
    assert (zipped.name, zipped.names, zipped.part_names) == (straight.name, straight.names, straight.part_names)
    np.testing.assert_array_equal(zipped.deltas, straight.deltas)
    np.testing.assert_array_equal(zipped.triangles, straight.triangles)


@pytest.mark.parametrize("place", ["", "a/", "a/b/c/"])
def test_a_rig_is_found_however_deep_it_lies_beside_what_the_system_adds(tmp_path, place):
    files = {f"{place}neutral.obj": NEUTRAL, f"{place}smile.obj": SMILE, "readme.txt": "hello"}
    files |= {"__MACOSX/._neutral.obj": b"\0", f"{place}.DS_Store": b"\0", "__MACOSX/a.glb": b"\0"}
    rig = read_raw(archive(tmp_path / "head.zip", files))
    assert rig.names == ("smile",)
    assert rig.name == ("head" if not place else place.split("/")[-2])


def test_a_single_file_and_its_buffer_are_read_from_the_archive(tmp_path):
    glb = write_sample_glb(tmp_path / "head.glb", k=2)
    rig = read_raw(archive(tmp_path / "r.zip", {"export/head.glb": glb.read_bytes()}))
    np.testing.assert_array_equal(rig.deltas, read_raw(glb).deltas)
    buffer = io.BytesIO()
    np.savez(buffer, vertices=np.eye(3), faces=[[0, 1, 2]], deltas=np.ones((1, 3, 3)), names=["a"])
    assert read_raw(archive(tmp_path / "n.zip", {"x/rig.npz": buffer.getvalue()})).names == ("a",)


def test_nothing_is_written(tmp_path, monkeypatch):
    path = pack(tmp_path / "any.zip", write_obj_folder(tmp_path / "head"))
    before = sorted(tmp_path.rglob("*"))
    monkeypatch.setattr(zipfile.ZipFile, "extract", None)
    monkeypatch.setattr(zipfile.ZipFile, "extractall", None)
    read_raw(path)
    assert sorted(tmp_path.rglob("*")) == before


@pytest.mark.parametrize(
    "name", ["../neutral.obj", "a/../../neutral.obj", "/neutral.obj", "C:/neutral.obj", "a\\neutral.obj", "a//n.obj",
             "./n.obj", "a/" * 12 + "n.obj"],
)  # fmt: skip
def test_paths_that_lead_out_are_refused(tmp_path, name):
    with pytest.raises(RigError, match="no path inside it"):
        read_raw(archive(tmp_path / "r.zip", {name: NEUTRAL, "smile.obj": SMILE}))


def test_links_and_names_given_twice_are_refused(tmp_path):
    link = zipfile.ZipInfo("neutral.obj")
    link.external_attr = (stat.S_IFLNK | 0o777) << 16
    with zipfile.ZipFile(tmp_path / "link.zip", "w") as zipped:
        zipped.writestr(link, "/etc/passwd")
    with pytest.raises(RigError, match="holds the link"):
        read_raw(tmp_path / "link.zip")
    data = archive(tmp_path / "twice.zip", {"neutral.obj": NEUTRAL, "neutra2.obj": SMILE}).read_bytes()
    (tmp_path / "twice.zip").write_bytes(data.replace(b"neutra2", b"neutral"))
    with pytest.raises(RigError, match="two files of one name"):
        read_raw(tmp_path / "twice.zip")


def test_bombs_are_refused_before_anything_is_unpacked(tmp_path, monkeypatch):
    monkeypatch.setattr(zipped, "LARGE_BYTES", 1 << 16)
    bomb = archive(tmp_path / "bomb.zip", {"neutral.obj": b"0" * (1 << 20)})
    many = archive(tmp_path / "many.zip", {f"{i}.obj": "" for i in range(20)}, zipfile.ZIP_STORED)
    monkeypatch.setattr(zipfile.ZipFile, "open", None)
    with pytest.raises(RigError, match=r"would unpack from 0\.0 to 1\.0 MB"):
        read_raw(bomb)
    monkeypatch.setattr(zipped, "MOST_FILES", 10)
    with pytest.raises(RigError, match="holds 20 files"):
        read_raw(many)


def test_a_declared_size_that_lies_is_an_error_and_no_flood(tmp_path):
    """The directory says 40 bytes, the member unpacks to a million."""
    path = archive(tmp_path / "lie.zip", {"neutral.obj": b"v 0 0 0\n" * 125_000, "smile.obj": SMILE})
    data = bytearray(path.read_bytes())
    at = data.index(b"PK\1\2")
    data[at + 24 : at + 28] = struct.pack("<I", 40)
    path.write_bytes(data)
    with pytest.raises(RigError, match=r"lie\.zip"):
        read_raw(path)


def test_archives_without_one_rig_say_what_to_zip(tmp_path):
    rigs = {f"{name}/{stem}.obj": NEUTRAL for name in "ab" for stem in ("neutral", "smile")}
    with pytest.raises(RigError, match="holds 2 rigs, a/ and b/: zip one of them alone"):
        read_raw(archive(tmp_path / "two.zip", rigs))
    with pytest.raises(RigError, match="holds no rig"):
        read_raw(archive(tmp_path / "none.zip", {"a/readme.txt": ""}))


def test_an_archive_cut_or_changed_anywhere_is_refused_in_one_line(tmp_path):
    whole = archive(tmp_path / "r.zip", {"neutral.obj": NEUTRAL, "smile.obj": SMILE}).read_bytes()
    path = tmp_path / "cut.zip"
    for end in range(1, len(whole)):
        path.write_bytes(whole[:end])
        with pytest.raises(RigError, match=r"cut\.zip") as error:
            read_raw(path)
        assert "\n" not in str(error.value)
    for place in range(len(whole)):
        path.write_bytes(whole[:place] + bytes([whole[place] ^ 0xFF]) + whole[place + 1 :])
        try:
            read_raw(path)
        except RigError as error:
            assert len(str(error).splitlines()) == 1  # noqa: PT017 - some bytes, such as dates, mean nothing


def test_a_password_is_asked_away(tmp_path):
    path = archive(tmp_path / "r.zip", {"neutral.obj": NEUTRAL})
    data = bytearray(path.read_bytes())
    data[data.index(b"PK\1\2") + 8] |= 1
    path.write_bytes(data)
    with pytest.raises(RigError, match="locked with a password"), open_zip(path):
        pass
