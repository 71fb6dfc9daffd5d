"""Takes of meshes: each frame is tested against the mesh; what fails is left out, counted, and changes no other."""

import numpy as np
import pytest
import trimesh

from capture_plan.curves.frames import SelectedFrames, StoredFrames
from capture_plan.errors import RigError
from capture_plan.sample import sample_rig
from capture_plan.sequence import read_sequence
from capture_plan.sequence.frame_tests import MOST_FAULTY, places, take_mesh

T, BAD = 12, 4  # frames, and the one that fails


def faces(seed=0):
    """Frames of a face that moves, the first at rest."""
    rig = sample_rig()
    w = np.random.default_rng(seed).uniform(0, 0.3, (T, len(rig.names)))
    w[0] = 0
    return np.stack([rig.pose(row) for row in w])


def turned(X):
    """A rigid motion for each frame: heads turn between frames."""
    a = np.linspace(0, 0.6, len(X))
    R = np.array([[[np.cos(b), 0, np.sin(b)], [0, 1, 0], [-np.sin(b), 0, np.cos(b)]] for b in a])
    return np.einsum("tij,tvj->tvi", R, X) + 200 * a[:, None, None]


def spoiled(X, how, t=BAD):
    Y = X.copy()
    spoil = {
        "wild": lambda x: np.where(np.arange(len(x))[:, None] == 5, 1e8, x),
        "a little wild": lambda x: x + np.where(np.arange(len(x))[:, None] == 5, 120.0, 0.0),
        "order": lambda x: x[np.random.default_rng(0).permutation(len(x))],
        "unit": lambda x: 0.1 * x,
        "mirrored": lambda x: x * [-1, 1, 1],
        "zeros": lambda x: 0 * x,
        "no number": lambda x: np.where(np.arange(len(x))[:, None] == 5, np.nan, x),
    }[how]
    for one in np.atleast_1d(t):
        Y[one] = spoil(Y[one])
    return Y


def read(tmp_path, X, rig=None, **arrays):
    np.savez(tmp_path / "take.npz", frames=X, faces=sample_rig().triangles, fps=30.0, **arrays)
    return read_sequence(tmp_path / "take.npz", rig=rig)


def frames_of(take):
    return take.frames.block(0, len(take))


HOW = ("wild", "a little wild", "order", "unit", "zeros", "no number")


@pytest.mark.parametrize("with_rig", [True, False])
@pytest.mark.parametrize("how", HOW)
def test_a_frame_that_fails_is_left_out_and_changes_no_other(tmp_path, how, with_rig):
    rig, X = sample_rig() if with_rig else None, turned(faces())
    whole, take = read(tmp_path, X, rig), read(tmp_path, spoiled(X, how), rig)
    others = np.delete(np.arange(T), BAD)
    assert len(take) == T - 1
    assert frames_of(take) == pytest.approx(frames_of(whole)[others], abs=1e-6 if with_rig else 0.5)
    words = {"wild": "torn off", "a little wild": "torn off", "order": "do", "unit": "do"}.get(how, "no face")
    assert any(words in note and "left out" in note for note in take.notes)
    assert [note for note in whole.notes if "left out" in note] == []


def test_a_mirrored_frame_does_not_lie_on_the_rig(tmp_path):
    take = read(tmp_path, spoiled(faces(), "mirrored"), sample_rig())
    assert frames_of(take) == pytest.approx(np.delete(faces(), BAD, axis=0), abs=0.5)


@pytest.mark.parametrize("with_rig", [True, False])
@pytest.mark.parametrize("how", ["wild", "order", "unit"])
def test_above_a_fifth_of_such_frames_the_take_is_refused_with_their_numbers(tmp_path, how, with_rig):
    rig, some = sample_rig() if with_rig else None, np.arange(6, 6 + int(MOST_FAULTY * T) + 1)
    with pytest.raises(RigError, match=r"take\.npz has 3 of 12 frames that do not show the mesh") as error:
        read(tmp_path, spoiled(faces(), how, some), rig)
    assert how == "wild" or "frames 6 to 8 (3 of 12)" in str(error.value)
    assert len(read(tmp_path, spoiled(faces(), how, some[:-1]), rig)) == T - 2


def test_the_vertex_that_is_torn_off_is_named(tmp_path):
    notes = read(tmp_path, spoiled(faces(), "wild"), sample_rig()).notes
    assert any(f"vertex 5 in frame {BAD}" in note for note in notes)


@pytest.mark.parametrize("how", ["order", "unit", "zeros", "no number"])
def test_a_first_frame_that_fails_spoils_no_other(tmp_path, how):
    take = read(tmp_path, spoiled(faces(), how, 0), sample_rig())
    assert len(take) == T - 1
    assert frames_of(take) == pytest.approx(faces()[1:], abs=0.5)


def test_neither_a_turn_of_the_head_nor_another_person_nor_a_wide_mouth_fails(tmp_path):
    rig = sample_rig()
    other = faces() * np.array([1.08, 0.95, 1.0])
    wide = np.stack([rig.pose(1.6 * (np.arange(len(rig.names)) == k)) for k in range(min(20, len(rig.names)))])
    for X in (turned(faces()), turned(other), np.concatenate([rig.neutral[None], wide])):
        assert len(read(tmp_path, X, rig)) == len(X)


def folder_of(folder, X):
    folder.mkdir()
    for t, x in enumerate(X):
        trimesh.Trimesh(x, sample_rig().triangles, process=False).export(folder / f"head.{t:04d}.obj")
    return folder


@pytest.mark.parametrize(
    ("damage", "at"),
    [("short", 0), ("short", BAD), ("short", T - 1), ("letters", BAD), ("empty", 0), ("zeros", T - 1)],
)
def test_a_file_that_cannot_be_read_is_a_frame_left_out(tmp_path, damage, at):
    folder = folder_of(tmp_path / "take", faces())
    file = folder / f"head.{at:04d}.obj"
    lines = file.read_text().splitlines()
    text = {"short": lines[: len(lines) // 5], "letters": ["v a b c", *lines], "empty": []}
    file.write_text("\n".join(text.get(damage, ["v 0 0 0" if line[:2] == "v " else line for line in lines])))
    take = read_sequence(folder, rig=sample_rig(), fps=30.0)
    assert frames_of(take) == pytest.approx(np.delete(faces(), at, axis=0), abs=0.5)
    named = "no face" if damage == "zeros" else file.name
    assert any(named in note and "left out" in note for note in take.notes)


def test_many_files_of_another_mesh_are_refused(tmp_path):
    folder = folder_of(tmp_path / "take", faces())
    for t in (2, 5, 9):
        trimesh.creation.box().export(folder / f"head.{t:04d}.obj")
    with pytest.raises(RigError, match=r"3 of 12 frames cannot be read \(the first: head\.0002\.obj has 8 vertices"):
        read_sequence(folder, rig=sample_rig())


@pytest.mark.parametrize("kind", ["i2", "i4", "f2", "f4", "f8"])
@pytest.mark.filterwarnings("error")
def test_positions_may_have_any_type_of_number(tmp_path, kind):
    X = np.round(faces()).astype(kind)
    assert frames_of(read(tmp_path, X, sample_rig())) == pytest.approx(X.astype(float), abs=2)
    np.save(tmp_path / "take.npy", X)
    assert len(read_sequence(tmp_path / "take.npy", rig=sample_rig())) == T


def test_weights_without_names_are_called_so(tmp_path):
    for shape in ((600, 52), (52, 600), (600, 300), (599, 52)):
        np.save(tmp_path / "w.npy", np.random.default_rng(0).random(shape))
        with pytest.raises(RigError, match="weights without names"):
            read_sequence(tmp_path / "w.npy", rig=sample_rig())


def test_frames_that_are_kept_come_in_their_order():
    X = np.arange(30.0).reshape(10, 1, 3)
    retained = np.array([0, 1, 2, 5, 7, 8])
    frames = SelectedFrames(StoredFrames(X), retained)
    assert np.array_equal(frames.block(0, 6), X[retained])
    assert np.array_equal(frames.block(2, 5), X[retained[2:5]])


def test_places_are_said_in_ranges():
    some = np.zeros(40, dtype=bool)
    some[[3, 7, 8, 9, 12]] = True
    assert places(some) == "frames 3, 7 to 9 and 12"
    some[[20, 30]] = True
    assert places(some) == "frames 3, 7 to 9, 12 and 2 more places"


@pytest.mark.parametrize("unit_mm", [10.0, 1000.0])
def test_frames_are_tested_in_millimetres_whatever_their_unit(tmp_path, unit_mm):
    take = read(tmp_path, spoiled(turned(faces()), "a little wild") / unit_mm, sample_rig())
    assert len(take) == T - 1


def test_what_a_blendshape_stretches_may_be_stretched_as_far_and_further():
    neutral, triangles = np.eye(3), np.array([[0, 1, 2]])
    pulled = np.zeros((1, 3, 3))
    pulled[0, 0, 0] = 70.0
    plain, open_mouth = (take_mesh(neutral, triangles, d).most for d in (0 * pulled, pulled))
    assert (open_mouth[[0, 2]] > plain[[0, 2]] + 70).all()
    assert open_mouth[1] == plain[1]
