"""What is kept on disk: equal to what is computed, known by content, never trusted when broken."""

import os
from pathlib import Path

import numpy as np
import pytest

from capture_plan.cache import cache_dir, cached, digest
from capture_plan.errors import RigError
from capture_plan.reader.read import read_rig


@pytest.fixture(autouse=True)
def own_cache(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))


@pytest.fixture
def rig_file(tmp_path):
    x, y = np.meshgrid(np.arange(12.0), np.arange(12.0))
    vertices = 12 * np.stack([x.ravel(), y.ravel(), -0.1 * (x.ravel() - 5.5) ** 2], axis=1)
    corner = (np.arange(11)[:, None] * 12 + np.arange(11)).ravel()
    faces = np.concatenate(
        [np.stack([corner, corner + 1, corner + 13], 1), np.stack([corner, corner + 13, corner + 12], 1)]
    )
    deltas = np.zeros((2, 144, 3))
    deltas[0, 30, 2], deltas[1, 100, 1] = 5, 4
    path = tmp_path / "face.npz"
    np.savez(path, vertices=vertices, faces=faces, deltas=deltas, names=np.array(["a", "b"]))
    return path


def entries():
    return sorted((cache_dir() / "rigs").glob("*.npz"))


def test_a_rig_from_the_cache_is_the_rig_that_was_read(rig_file):
    first, second = read_rig(rig_file, unit_mm=1.0), read_rig(rig_file, unit_mm=1.0)
    assert len(entries()) == 1
    assert first.fingerprint == second.fingerprint
    assert (first.names, first.part_names, first.note, first.unit_mm) == (
        second.names,
        second.part_names,
        second.note,
        second.unit_mm,
    )
    for name in ("neutral", "triangles", "deltas", "skin", "parts", "source_index"):
        np.testing.assert_array_equal(getattr(first, name), getattr(second, name))
        assert getattr(first, name).dtype == getattr(second, name).dtype


def test_another_unit_and_another_content_are_other_rigs(rig_file):
    read_rig(rig_file, unit_mm=1.0)
    read_rig(rig_file, unit_mm=2.0)
    arrays = dict(np.load(rig_file))
    arrays["deltas"][0, 30, 2] = 6
    np.savez(rig_file, **arrays)
    changed = read_rig(rig_file, unit_mm=1.0)
    assert changed.displacement.max() == pytest.approx(6)
    assert len(entries()) == 3


def test_a_broken_entry_is_read_again(rig_file):
    whole = read_rig(rig_file, unit_mm=1.0)
    (entry,) = entries()
    entry.write_bytes(entry.read_bytes()[:100])
    assert read_rig(rig_file, unit_mm=1.0).fingerprint == whole.fingerprint


def test_an_entry_is_believed_only_under_its_own_name_and_whole(rig_file):
    """A poisoned shelf: another rig's entry, links, pipes, changed numbers and damage at any byte."""
    whole = read_rig(rig_file, unit_mm=1.0)
    (entry,) = entries()
    other = read_rig(rig_file, unit_mm=2.0)
    (theirs,) = set(entries()) - {entry}
    assert other.fingerprint != whole.fingerprint
    data, rng = entry.read_bytes(), np.random.default_rng(0)
    arrays = dict(np.load(entry))
    arrays["deltas"] = arrays["deltas"] * 2
    np.savez(entry.with_suffix(".changed"), **arrays)
    poison = [theirs.read_bytes(), entry.with_suffix(".changed.npz").read_bytes(), b"", data[:-30], b"PK" + data]
    poison += [data[:at] + bytes([data[at] ^ 0xFF]) + data[at + 1 :] for at in rng.integers(0, len(data), 40)]
    for content in poison:
        entry.write_bytes(content)
        assert read_rig(rig_file, unit_mm=1.0).fingerprint == whole.fingerprint
    entry.unlink()
    entry.symlink_to(theirs)
    assert read_rig(rig_file, unit_mm=1.0).fingerprint == whole.fingerprint
    assert not entry.is_symlink()
    entry.unlink()
    if hasattr(os, "mkfifo"):
        os.mkfifo(entry)
        assert read_rig(rig_file, unit_mm=1.0).fingerprint == whole.fingerprint


def test_what_cannot_be_read_is_not_kept(tmp_path):
    (tmp_path / "no.glb").write_bytes(b"nothing")
    with pytest.raises(RigError):
        read_rig(tmp_path / "no.glb")
    assert entries() == []


def test_names_tell_apart_what_is_cut_elsewhere():
    assert digest(["ab", "c"]) != digest(["a", "bc"])
    assert digest([np.zeros(2)]) != digest([np.zeros((2, 1))])


def test_a_shelf_keeps_its_newest_entries():
    (cache_dir() / "shelf").mkdir(parents=True)
    (cache_dir() / "shelf" / "hero.npz").write_bytes(b"a person's rig")
    for number in range(4):
        cached(lambda number=number: {"x": np.array([number])}, "shelf", digest([f"{number}"]), entries=2)
    assert len(list((cache_dir() / "shelf").glob("*.npz"))) == 2 + 1
    assert (cache_dir() / "shelf" / "hero.npz").exists()


def test_a_user_without_a_home_goes_without_a_cache(monkeypatch):
    def homeless():
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.delenv("XDG_CACHE_HOME")
    monkeypatch.setattr(Path, "home", homeless)
    assert cached(answer, "shelf", digest(["name"]), entries=2)["x"].tolist() == [0, 1, 2]


def answer():
    return {"x": np.arange(3)}


@pytest.mark.skipif(os.name != "posix", reason="owners and permissions of POSIX")
def test_a_folder_that_is_a_link_or_of_somebody_else_is_not_used(tmp_path, monkeypatch):
    (tmp_path / "theirs").mkdir()
    cache_dir().parent.mkdir()
    cache_dir().symlink_to(tmp_path / "theirs")
    cached(answer, "shelf", "name", entries=3)
    assert not list((tmp_path / "theirs").iterdir())
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "other"))
    monkeypatch.setattr(os, "getuid", lambda: os.stat(tmp_path).st_uid + 1)
    cached(answer, "shelf", "name", entries=3)
    assert not list(cache_dir().iterdir())


@pytest.mark.skipif(os.name != "posix", reason="owners and permissions of POSIX")
def test_a_folder_of_ours_that_others_could_write_is_made_private(tmp_path):
    cache_dir().mkdir(parents=True)
    cache_dir().chmod(0o777)
    cached(answer, "shelf", "name", entries=3)
    assert cache_dir().stat().st_mode & 0o077 == 0
    assert len(list((cache_dir() / "shelf").iterdir())) == 1
