"""What a file may ask: plain files alone, lines, values, names and polygons of a size that somebody could mean."""

import os
import time
from dataclasses import replace

import numpy as np
import pytest

from capture_plan.errors import CapturePlanError, RigError
from capture_plan.formats.naming import numbered
from capture_plan.formats.raw import legible
from capture_plan.input import bounds
from capture_plan.reader.read import in_ranges, read_raw
from capture_plan.sequence.read import read_take
from tests.fuzz_seeds import obj_folder

RIGS = ("obj", "ply", "csv", "npz", "glb", "gltf", "vrm", "fbx", "usda", "usdz", "zip")
TAKES = ("csv", "txt", "json", "jsonl", "npz", "npy", "zip", "glb", "usda")


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="pipes of POSIX")
@pytest.mark.parametrize(("read", "suffix"), [(read_raw, s) for s in RIGS] + [(read_take, s) for s in TAKES])
def test_what_is_no_plain_file_is_refused_and_not_waited_for(tmp_path, read, suffix):
    os.mkfifo(tmp_path / "pipe")
    for name, target in (("fifo", tmp_path / "pipe"), ("zero", "/dev/zero")):
        (path := tmp_path / f"{name}.{suffix}").symlink_to(target)
        with pytest.raises(RigError, match=r"a device or a pipe, expected a file: copy what it holds into a file$"):
            read(path)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="pipes of POSIX")
def test_a_pipe_among_the_meshes_of_a_folder_is_left_out_and_named(tmp_path):
    obj_folder(tmp_path / "rig")
    os.mkfifo(tmp_path / "rig" / "smile.obj")
    assert "smile.obj is a device or a pipe" in read_raw(tmp_path / "rig").note


def test_lines_and_values_without_end_are_refused_at_once():
    start = time.process_time()
    for text in (b"1 " * 20_000_000, b"\n" * 20_000_000, "1 " * 20_000_000):
        with pytest.raises(RigError, match=r"^a\.obj has "):
            bounds.check_line_sizes(text, "a.obj")
    with pytest.raises(RigError, match="20,000,000 values"):
        bounds.check_values(b"," * 20_000_000)
    with pytest.raises(RigError, match="4,001 columns"):
        bounds.check_cells(1, 4_001)
    assert time.process_time() - start < 2
    bounds.check_line_sizes((b"1 " * (bounds.LONGEST_LINE // 2 - 1) + b"\n") * 3, "a.obj")


def test_a_polygon_of_more_corners_than_anybody_makes_is_refused(tmp_path):
    obj_folder(tmp_path / "rig")
    with (tmp_path / "rig" / "neutral.obj").open("a") as file:
        file.write("f" + " 1 2 3" * 4_000 + "\n")
    with pytest.raises(RigError, match="a face of 12,000 corners"):
        read_raw(tmp_path / "rig")


def test_names_are_no_longer_than_names_and_said_to_be_cut(tmp_path):
    obj_folder(tmp_path / "rig")
    raw = read_raw(tmp_path / "rig")
    long = replace(raw, names=("a" * 100_000, *raw.names[1:]))
    assert max(map(len, legible(long).names)) <= bounds.LONGEST_NAME
    assert "too long" in legible(long).note
    assert len(str(CapturePlanError("b" * 10**6))) < 2_000


def test_equal_names_are_told_apart_in_time_that_grows_as_they_do():
    start = time.process_time()
    names, _ = numbered(["a"] * 20_000 + ["a 7"])
    assert len(set(names)) == 20_001
    assert names[-1] == "a 7"
    assert time.process_time() - start < 2


def test_ranges_hold_what_lies_between_their_ends():
    rng = np.random.default_rng(0)
    for count in (0, 1, 5, 30):
        low = rng.integers(0, 100, count)
        ranges = list(zip(low.tolist(), (low + rng.integers(-2, 12, count)).tolist(), strict=True))
        numbers = rng.permutation(120)
        expected = [any(a <= number <= b for a, b in ranges) for number in numbers.tolist()]
        np.testing.assert_array_equal(in_ranges(numbers, ranges), expected)
