"""NPZ rigs: what is written is read, units and parts included; other archives get one clear line."""

import dataclasses
import tracemalloc
import zipfile

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from capture_plan.errors import RigError
from capture_plan.formats.npz import read_npz

GOOD = {
    "vertices": np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], dtype=float),
    "faces": np.array([[0, 1, 2], [1, 3, 2]]),
    "deltas": np.ones((2, 4, 3), dtype=np.float32),
    "names": np.array(["smile", "frown"]),
}


def save(path, **changes):
    np.savez(path, **{key: array for key, array in (GOOD | changes).items() if array is not None})
    return path


@settings(max_examples=25, deadline=None)
@given(v=st.integers(3, 30), k=st.integers(1, 5), seed=st.integers(0, 2**32 - 1))
def test_what_is_saved_is_read(tmp_path_factory, v, k, seed):
    rng = np.random.default_rng(seed)
    arrays = {
        "vertices": rng.normal(size=(v, 3)),
        "faces": rng.integers(0, v, (7, 3)),
        "deltas": rng.normal(size=(k, v, 3)).astype(np.float32),
        "names": np.array([f"shape {i}" for i in range(k)]),
        "source_index": rng.permutation(v),
    }
    rig = read_npz(save(tmp_path_factory.mktemp("npz") / "rig.npz", **arrays))
    np.testing.assert_array_equal(rig.neutral, arrays["vertices"])
    np.testing.assert_array_equal(rig.triangles, arrays["faces"])
    np.testing.assert_array_equal(rig.deltas, arrays["deltas"])
    np.testing.assert_array_equal(rig.source_index, arrays["source_index"])
    assert rig.names == tuple(arrays["names"])


@pytest.mark.parametrize(
    ("units", "unit_mm"),
    [
        ("mm", 1.0),
        ("cm", 10.0),
        ("m", 1000.0),
        ("dm (MakeHuman decimetres)", 100.0),
        ("in", 25.4),
        ("cm?", None),
        ("?", None),
    ],
)
def test_units_are_lengths_in_millimetres_and_doubtful_ones_are_unknown(tmp_path, units, unit_mm):
    assert read_npz(save(tmp_path / "r.npz", units=np.array(units))).unit_mm == unit_mm


def test_parts_of_triangles_and_of_vertices_are_both_understood(tmp_path):
    by_face = read_npz(save(tmp_path / "f.npz", part=np.array(["skin", "eye"])))
    assert [by_face.part_names[part] for part in by_face.parts] == ["skin", "skin", "skin", "eye"]
    by_vertex = read_npz(save(tmp_path / "v.npz", part=np.array(["skin", "eye", "skin", "eye"])))
    assert [by_vertex.part_names[part] for part in by_vertex.parts] == ["skin", "eye", "skin", "eye"]


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"names": None}, "no array 'names'"),
        ({"vertices": np.zeros((4, 2))}, r"'vertices' has the shape \(4, 2\), expected \(n, 3\)"),
        ({"faces": np.zeros((2, 4), int)}, "split polygons into triangles"),
        ({"faces": GOOD["faces"].astype(float)}, "'faces' holds float64, expected integers"),
        ({"faces": GOOD["faces"] + 1}, "uses vertex 4 of 4: count vertices from 0"),
        ({"faces": GOOD["faces"] - 1}, "uses vertex -1 of 4"),
        ({"faces": np.zeros((0, 3), int)}, "no triangles found"),
        ({"names": np.array([1, 2])}, "'names' holds int64, expected text"),
        ({"names": np.array(["a", None], dtype=object)}, "'names.npy' is not a readable array"),
        ({"deltas": GOOD["deltas"][:1]}, "1 blendshapes of 4 vertices but 2 names"),
        ({"deltas": GOOD["deltas"][:, :3]}, "'deltas' has 3 vertices, 'vertices' has 4"),
        ({"vertices": GOOD["vertices"] + np.inf}, "the neutral holds NaN or infinite"),
        ({"deltas": GOOD["deltas"] * 0}, "every blendshape equals the neutral"),
        ({"deltas": GOOD["deltas"][:0], "names": GOOD["names"][:0]}, "no blendshapes found, only a neutral"),
        ({"part": np.array(["a", "b", "c"])}, "'part' has 3 entries"),
        ({"source_index": np.arange(3)}, "'source_index' is not one integer"),
    ],
)
@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_archives_that_are_no_rig_are_refused(tmp_path, changes, says):
    with pytest.raises(RigError, match=says):
        read_npz(save(tmp_path / "r.npz", **changes))


def test_foreign_and_cut_off_files_are_refused(tmp_path):
    whole = save(tmp_path / "whole.npz").read_bytes()
    for name, data in (("foreign", b"hello" * 99), ("cut", whole[: len(whole) // 2])):
        path = tmp_path / f"{name}.npz"
        path.write_bytes(data)
        with pytest.raises(RigError, match=f"{name}.npz is not an NPZ archive"):
            read_npz(path)
    np.save(tmp_path / "one.npy", GOOD["vertices"])
    with pytest.raises(RigError, match="not an NPZ archive"):
        read_npz((tmp_path / "one.npy").rename(tmp_path / "one.npz"))


def test_a_raw_rig_is_checked_whenever_one_is_made(tmp_path):
    rig = read_npz(save(tmp_path / "r.npz"))
    with pytest.raises(RigError, match="uses vertex 4 of 4, counted from 0"):
        dataclasses.replace(rig, triangles=rig.triangles + 1)


def test_arrays_that_declare_more_than_they_hold_are_refused_before_they_are_made(tmp_path):
    path = save(tmp_path / "rig.npz")
    with zipfile.ZipFile(path) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    for lie in (b"(2, 4000000000, 3), }", b"(-2, 4, 3), }", b"(2, 4, 3"):
        header = members["deltas.npy"][:10] + b"{'descr': '<f4', 'fortran_order': False, 'shape': " + lie
        members["deltas.npy"] = header.ljust(127) + b"\n" + bytes(96)
        with zipfile.ZipFile(path, "w") as archive:
            for name, data in members.items():
                archive.writestr(name, data)
        tracemalloc.start()
        with pytest.raises(RigError, match=r"'deltas\.npy' is not a readable array|'deltas' has the shape"):
            read_npz(path)
        assert tracemalloc.get_traced_memory()[1] < 1_000_000
        tracemalloc.stop()
