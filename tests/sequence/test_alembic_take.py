"""Alembic: frames as they were written, with what moves them as a whole; damage ends in one line."""

import importlib.util
from contextlib import suppress

import numpy as np
import pytest

from capture_plan.errors import RigError
from capture_plan.sample import sample_rig
from capture_plan.sequence import read_sequence
from capture_plan.sequence.read import read_take
from tests.light import light_sample

needs_it = pytest.mark.skipif(importlib.util.find_spec("alembic3d") is None, reason="the extra 'alembic' is missing")
SQUARE = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [2, 0, 0]])


def ints(values):
    import imath  # pyright: ignore[reportMissingImports]

    found = imath.IntArray(len(values))
    for i, value in enumerate(values):
        found[i] = int(value)
    return found


def write(path, meshes, *, fps=25.0, place=None, below=None):
    """Meshes of (frames, polygons) below one transform; polygons are turned: the format has them run clockwise."""
    import imath  # pyright: ignore[reportMissingImports]
    from alembic3d import AbcCoreAbstract  # pyright: ignore[reportMissingImports]
    from alembic3d.Abc import OArchive  # pyright: ignore[reportMissingImports]
    from alembic3d.AbcGeom import (  # pyright: ignore[reportMissingImports]
        OPolyMesh,
        OPolyMeshSchemaSample,
        OXform,
        XformSample,
    )

    archive = OArchive(str(path))
    clock = archive.addTimeSampling(AbcCoreAbstract.TimeSampling(1 / fps, 0.0))
    node = OXform(archive.getTop(), "head", clock)
    for matrix in [np.eye(4)] if place is None else place:
        sample = XformSample()
        sample.setMatrix(imath.M44d(*np.asarray(matrix, dtype=float).T.ravel().tolist()))
        node.getSchema().set(sample)
    if below is not None:
        node, sample = OXform(node, "jaw", clock), XformSample()
        sample.setMatrix(imath.M44d(*np.asarray(below, dtype=float).T.ravel().tolist()))
        node.getSchema().set(sample)
    for number, (frames, polygons) in enumerate(meshes):
        schema = OPolyMesh(node, f"mesh{number}", clock).getSchema()
        corners, sizes = ints([i for polygon in polygons for i in polygon[::-1]]), ints([len(p) for p in polygons])
        for frame in frames:
            points = imath.V3fArray(len(frame))
            for i, point in enumerate(np.asarray(frame, dtype=float).tolist()):
                points[i] = imath.V3f(*point)
            schema.set(OPolyMeshSchemaSample(points, corners, sizes))
    return path


@needs_it
def test_meshes_come_one_after_the_other_with_their_faces_frames_and_rate(tmp_path):
    first, second = [SQUARE + 0.1 * t for t in range(6)], [SQUARE * (1 + t) for t in range(6)]
    take = read_take(write(tmp_path / "a.abc", [(first, [[0, 1, 2, 3], [1, 4, 2]]), (second, [[0, 1, 2]])], fps=50))
    assert take.fps == 50
    frames = take.frames.block(0, 6)
    np.testing.assert_allclose(frames, np.concatenate([first, second], axis=1), atol=1e-6)
    assert sorted(map(sorted, take.triangles.tolist())) == [[0, 1, 2], [0, 2, 3], [1, 2, 4], [5, 6, 7]]
    n = np.cross(*(SQUARE[take.triangles[0]][i] - SQUARE[take.triangles[0][0]] for i in (1, 2)))
    assert n[2] > 0  # as they were given: the format's own run the other way


@needs_it
def test_what_moves_a_mesh_as_a_whole_moves_its_points(tmp_path):
    places = [np.eye(4) for _ in range(4)]
    for t, place in enumerate(places):
        place[:3, 3] = [10 * t, 0, 5]
        place[:2, :2] = [[0, -1], [1, 0]]
    take = read_take(write(tmp_path / "a.abc", [([SQUARE], [[0, 1, 2, 3]])], place=places))
    expected = [SQUARE @ place[:3, :3].T + place[:3, 3] for place in places]
    np.testing.assert_allclose(take.frames.block(0, 4), expected, atol=1e-6)


@needs_it
def test_what_lies_below_moves_with_what_lies_above(tmp_path):
    above, below = np.eye(4), np.eye(4)
    above[:3, 3], below[:2, :2] = [10, 0, 5], [[0, -1], [1, 0]]
    path = write(tmp_path / "a.abc", [([SQUARE, SQUARE + 1], [[0, 1, 2, 3]])], place=[above], below=below)
    expected = SQUARE @ below[:3, :3].T + above[:3, 3]
    np.testing.assert_allclose(read_take(path).frames.block(0, 1)[0], expected, atol=1e-6)


@needs_it
def test_a_scan_in_alembic_is_that_of_the_same_frames_in_an_archive(tmp_path):
    rig = light_sample()
    jaw, smile = (rig.deltas[rig.names.index(name)] for name in ("jawOpen", "mouthSmileLeft"))
    frames = np.stack([rig.neutral + w * jaw + (1 - w) * smile for w in np.linspace(0, 1, 8)]) / 10
    write(tmp_path / "a.abc", [(frames, rig.triangles)])
    np.savez(tmp_path / "b.npz", frames=frames.astype(np.float32), faces=rig.triangles, fps=25.0)
    one, other = (read_sequence(tmp_path / name) for name in ("a.abc", "b.npz"))
    assert one.fps == other.fps == 25
    np.testing.assert_allclose(one.frames.block(0, 8), other.frames.block(0, 8), atol=0.01)


@needs_it
@pytest.mark.parametrize(
    ("meshes", "says"),
    [
        ([([SQUARE, SQUARE[:4]], [[0, 1, 2]])], "faces change from frame to frame"),
        ([], "has no mesh with faces"),
        ([([SQUARE] * 2, [])], "has no mesh with faces"),
    ],
)
def test_what_is_no_take_of_a_mesh_is_refused_in_one_line(tmp_path, meshes, says):
    with pytest.raises(RigError, match=says):
        read_sequence(write(tmp_path / "a.abc", meshes))


@needs_it
@pytest.mark.parametrize("seed", range(6))
def test_a_damaged_file_ends_in_one_line_or_in_its_frames(tmp_path, seed):
    rng = np.random.default_rng(seed)
    data = bytearray(write(tmp_path / "a.abc", [([SQUARE + t for t in range(30)], [[0, 1, 2, 3]])]).read_bytes())
    for at in rng.integers(0, len(data), 8):
        data[at] = rng.integers(256)
    (tmp_path / "a.abc").write_bytes(data[: len(data) // 2] if seed % 2 else data)
    with suppress(RigError):
        assert len(read_take(tmp_path / "a.abc").frames)


def test_without_the_extra_it_is_said_how_to_get_it(tmp_path, monkeypatch):
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    (tmp_path / "a.abc").write_bytes(b"Ogawa")
    with pytest.raises(RigError, match=r"a\.abc: it is Alembic: install .* 'capture-plan\[alembic\]'"):
        read_sequence(tmp_path / "a.abc", rig=sample_rig())
