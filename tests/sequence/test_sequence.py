"""Takes: recorded weights pose the rig, meshes lie on it with the head held still, whatever the file."""

import json

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from capture_plan.curves.frames import PosedFrames, StoredFrames
from capture_plan.errors import RigError
from capture_plan.sample import sample_rig
from capture_plan.sequence import read_sequence
from capture_plan.sequence.animation import Channel, sample
from capture_plan.sequence.head_stabilisation import HeldFrames, still_vertices, stillness
from tests.formats.test_gltf import Writer, primitive, write_sample_glb


def weights(seed=0, frames=6):
    rig = sample_rig()
    w = np.zeros((frames, len(rig.names)))
    some = np.random.default_rng(seed).choice(len(rig.names), 5, replace=False)
    w[1:, some] = np.random.default_rng(seed).uniform(0, 1, (frames - 1, 5))
    return w


def posed(seed=0, frames=6):
    rig = sample_rig()
    return np.stack([rig.pose(w) for w in weights(seed, frames)])


def shaken(frames, seed):
    """Every frame turned and moved rigidly, up to half a metre."""
    rng = np.random.default_rng(seed)
    turns = Rotation.random(len(frames), random_state=seed).as_matrix()
    return np.einsum("txy,tvy->tvx", turns, frames) + rng.uniform(-500, 500, (len(frames), 1, 3))


def frames_of(sequence):
    return np.concatenate([block for _, block in sequence.chunks()])


@settings(max_examples=8, deadline=None)
@given(st.integers(0, 1000))
def test_adding_any_rigid_motion_to_each_frame_changes_nothing(seed):
    rig = sample_rig()
    still = stillness(rig.displacement.max(axis=0))
    plain, moved = (
        HeldFrames(StoredFrames(x), rig.neutral, still).block(0, 4)
        for x in (posed(seed, 4), shaken(posed(seed, 4), seed))
    )
    assert np.abs(plain - moved).max() < 1e-6  # millimetres


def test_without_a_rig_rigid_motion_changes_nothing_either():
    start, frames = posed()[0], posed(3, 8)
    first = still_vertices(StoredFrames(frames), start)
    second = still_vertices(StoredFrames(shaken(frames, 4)), start)
    assert np.abs(first - second).max() < 1e-6


def test_the_head_is_held_by_what_is_still():
    rig = sample_rig()
    still = stillness(rig.displacement.max(axis=0)) * rig.skin
    held = HeldFrames(StoredFrames(shaken(posed(), 1)), rig.neutral, still).block(0, 6)
    assert np.abs(held - posed()).max() < 0.1  # millimetres: the jaw's motion is not taken for the head's


def test_driven_frames_are_the_rig_posed(tmp_path):
    rig, w = sample_rig(), weights()
    np.savez(tmp_path / "take.npz", weights=w, names=np.array(rig.names), fps=60)
    take = read_sequence(tmp_path / "take.npz", rig=rig)
    assert (len(take), take.fps, take.seconds) == (6, 60.0, 0.1)
    assert frames_of(take) == pytest.approx(posed(), abs=1e-4)
    assert take.motion() == pytest.approx(np.linalg.norm(posed() - rig.neutral, axis=2).max(axis=0), abs=1e-4)


def test_chunks_are_the_whole_take_in_order(tmp_path):
    rig = sample_rig()
    np.savez(tmp_path / "take.npz", weights=weights(1, 1200), names=np.array(rig.names), fps=30)
    take = read_sequence(tmp_path / "take.npz", rig=rig)
    sizes = [(start, len(block)) for start, block in take.chunks()]
    assert [start for start, _ in sizes] == list(np.cumsum([0] + [count for _, count in sizes])[:-1])
    assert sum(count for _, count in sizes) == 1200
    assert len(sizes) > 1
    assert take.frame(700) == pytest.approx(rig.pose(weights(1, 1200)[700]), abs=1e-4)


@pytest.mark.parametrize("unit_mm", [1.0, 10.0, 1000.0])
def test_stored_frames_come_back_in_millimetres_on_the_rig(tmp_path, unit_mm):
    np.savez(tmp_path / "take.npz", frames=shaken(posed(), 2) / unit_mm, fps=24)
    take = read_sequence(tmp_path / "take.npz", rig=sample_rig())
    assert frames_of(take) == pytest.approx(posed(), abs=0.1)
    assert (take.neutral == sample_rig().neutral).all()


def write_frames(folder, frames, suffix):
    folder.mkdir()
    for t, x in enumerate(frames, start=1):
        mesh = trimesh.Trimesh(x, sample_rig().triangles, process=False)
        mesh.export(folder / f"head.{t:04d}{suffix}")
    return folder


@pytest.mark.parametrize("suffix", [".obj", ".ply"])
def test_numbered_files_are_frames_in_the_order_of_their_numbers(tmp_path, suffix):
    folder = write_frames(tmp_path / "take", posed(frames=11), suffix)
    take = read_sequence(folder, rig=sample_rig(), fps=25.0)
    assert (len(take), take.fps) == (11, 25.0)
    assert frames_of(take) == pytest.approx(posed(frames=11), abs=0.1)


def test_missing_numbers_and_assumed_rates_are_told(tmp_path):
    folder = write_frames(tmp_path / "take", posed(), ".ply")
    (folder / "head.0003.ply").unlink()
    notes = read_sequence(folder, rig=sample_rig()).notes
    assert "1 of the numbers 1 to 6 are missing" in notes
    assert any("frame rate" in note for note in notes)


def test_a_take_without_a_rig_finds_its_unit_and_axes(tmp_path):
    rig = sample_rig()
    turn = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])  # +z up, facing -y
    frames = posed(5, 12) @ turn.T / 10
    np.savez(tmp_path / "take.npz", frames=frames, faces=rig.triangles, fps=30)
    take = read_sequence(tmp_path / "take.npz")
    assert frames_of(take) == pytest.approx(posed(5, 12), abs=0.1)


def test_a_cut_of_the_artists_mesh_takes_its_own_vertices(tmp_path):
    rig = sample_rig()
    whole = np.full((6, rig.source_index.max() + 5, 3), 7.0)
    whole[:, rig.source_index] = posed()
    np.savez(tmp_path / "take.npz", frames=whole, fps=24)
    assert frames_of(read_sequence(tmp_path / "take.npz", rig=rig)) == pytest.approx(posed(), abs=0.1)


def animated(tmp_path, times, values, **sampler):
    """The sample with one blendshape, jawOpen, and keys for its weight."""
    rig, writer = sample_rig(), Writer()
    k = rig.names.index("jawOpen")
    vertices, delta = (rig.neutral / 1000).astype(np.float32), (rig.deltas[k] / 1000).astype(np.float32)
    writer.mesh([primitive(writer, vertices, rig.triangles.astype(np.uint16).ravel(), [delta])], ["jawOpen"])
    accessors = {
        "input": writer.add(np.array(times, dtype=np.float32)),
        "output": writer.add(np.array(values, dtype=np.float32)),
    }
    channel = {"sampler": 0, "target": {"node": 0, "path": "weights"}}
    writer.document["animations"] = [{"samplers": [accessors | sampler], "channels": [channel]}]
    return writer.glb(tmp_path / "take.glb")


@pytest.mark.parametrize(
    ("how", "values", "middle"),
    [
        ("LINEAR", [0, 1, 0], 0.5),
        ("STEP", [0, 1, 0], 0.0),
        ("CUBICSPLINE", [0, 0, 9, -4, 1, 0, 0, 0, 0], 0.5 + (9 + 4) * 2 / 30 / 8),
    ],
)
def test_an_animated_gltf_drives_itself_between_its_keys_too(tmp_path, how, values, middle):
    """Keys at 0, 2/30 and 3/30 s; Hermite: half the end value and d/8 of the tangents, 9 out and -4 in, d = 2/30 s."""
    take = read_sequence(animated(tmp_path, [0, 2 / 30, 3 / 30], values, interpolation=how), fps=30.0)
    assert take.rig is not None
    times = np.array([0, 2 / 30, 3 / 30])
    keys = np.array(values, dtype=float).reshape(3, -1)
    cubic = (keys[:, :1], keys[:, 2:]) if how == "CUBICSPLINE" else None
    channel = Channel(("jawOpen",), times, keys[:, keys.shape[1] // 2, None], how == "STEP", cubic)
    assert sample(channel, np.array([0, 1 / 30, 2 / 30, 1.0]))[:, 0] == pytest.approx([0, middle, 1, 0])


def test_an_animated_gltf_has_its_own_rate_and_mapping(tmp_path):
    take = read_sequence(animated(tmp_path, np.arange(7) / 24, np.linspace(0, 1, 7)))
    assert (take.fps, len(take), take.notes) == (24.0, 7, ())
    assert take.mapping is not None
    assert [(one.column, one.blendshape, one.share) for one in take.mapping.drives] == [("jawOpen", "jawOpen", 1.0)]
    want = sample_rig().displacement[sample_rig().names.index("jawOpen")].max()
    assert take.motion().max() == pytest.approx(want, rel=1e-4)


def test_an_animation_whose_keys_go_back_in_time_is_refused(tmp_path):
    with pytest.raises(RigError, match=r"take\.glb.* keys that do not follow each other"):
        read_sequence(animated(tmp_path, [0, 0.2, 0.1], [0, 1, 0]))
    with pytest.raises(RigError, match="no animation of blendshape weights"):
        read_sequence(write_sample_glb(tmp_path / "still.glb", k=2))


def test_live_link_face_is_read_by_name_and_rate(tmp_path):
    rows = [f"10:00:00:{t:02d}.000,3,{t / 60},0.5,0.1" for t in range(60)]
    (tmp_path / "t.csv").write_text("Timecode,BlendshapeCount,JawOpen,CheekPuff,HeadYaw\n" + "\n".join(rows) + "\n")
    take = read_sequence(tmp_path / "t.csv", rig=sample_rig())
    rig = sample_rig()
    assert (take.fps, len(take)) == (60.0, 60)
    want = rig.pose(np.array([{"jawOpen": 0.5, "cheekPuff": 0.5}.get(name, 0) for name in rig.names]))
    assert take.frame(30) == pytest.approx(want, abs=1e-4)
    assert ("HeadYaw", "it moves the whole head, which is held still") in take.mapping.left_out


@pytest.mark.parametrize(
    "document",
    [
        [{"timestamp": t / 60, "blendShapes": {"jawOpen": 0.1 * t, "cheekPuff": 0.2}} for t in range(5)],
        {"fps": 60, "frames": [{"blendshapes": {"jawOpen": 0.1 * t, "cheekPuff": 0.2}} for t in range(5)]},
        {"exportFps": 60, "facsNames": ["jawOpen", "cheekPuff"], "weightMat": [[0.1 * t, 0.2] for t in range(5)]},
        {"fps": 60, "jawOpen": [0.1 * t for t in range(5)], "cheekPuff": [0.2] * 5},
    ],
)
def test_every_kind_of_json_holds_the_same_take(tmp_path, document):
    (tmp_path / "t.json").write_text(json.dumps(document))
    take = read_sequence(tmp_path / "t.json", rig=sample_rig())
    rig = sample_rig()
    want = rig.pose(np.array([{"jawOpen": 0.3, "cheekPuff": 0.2}.get(name, 0) for name in rig.names]))
    assert (take.fps, len(take)) == (60.0, 5)
    assert take.frame(3) == pytest.approx(want, abs=1e-4)


def test_openface_leaves_out_what_it_did_not_track(tmp_path):
    rows = [f"{t}, 0, {t / 25}, 0.9, {int(t != 2)}, 0.1, 2.5, 1" for t in range(5)]
    (tmp_path / "o.csv").write_text(
        "frame, face_id, timestamp, confidence, success, pose_Tx, AU26_r, AU26_c\n" + "\n".join(rows) + "\n"
    )
    take = read_sequence(tmp_path / "o.csv", rig=sample_rig())
    rig = sample_rig()
    assert (take.fps, len(take)) == (25.0, 4)
    assert take.frame(0) == pytest.approx(rig.pose(0.5 * np.array([name == "jawOpen" for name in rig.names])), abs=1e-4)
    assert "1 of 5 frames has no face and was left out" in take.notes


def test_weights_in_per_cent_are_told_and_taken_as_shares(tmp_path):
    np.savez(tmp_path / "t.npz", weights=np.array([[0.0], [80.0]]), names=np.array(["jawOpen"]), fps=30)
    take = read_sequence(tmp_path / "t.npz", rig=sample_rig())
    rig = sample_rig()
    assert take.frame(1) == pytest.approx(rig.pose(0.8 * np.array([name == "jawOpen" for name in rig.names])), abs=1e-3)
    assert "per cent" in take.notes[0]


def write(path, text):
    path.write_text(text)
    return path


@pytest.mark.parametrize(
    ("name", "text", "says"),
    [
        ("a.csv", "jawOpen\n", "no frames"),
        ("a.csv", "jawOpen,cheekPuff\n1\n", "line 2 has 1 values, expected 2"),
        ("a.csv", "jawOpen,jawOpen\n1,2\n", "two columns 'jawOpen'"),
        ("a.csv", "jawOpen\nnan\n", "no frame in which the face was tracked"),
        ("a.csv", "hips\n1\n", "none of the 1 weights"),
        ("a.json", "[" * 100_000, "no JSON"),
        ("a.json", '{"a": 1}', "holds no weights"),
        ("a.json", '{"names": ["jawOpen"], "weights": [[1, 2]]}', "frame 0 has 2 numbers, expected 1"),
        ("a.npz", "x", "not an NPZ archive"),
        ("a.obj", "v 0 0 0", "single frame"),
        ("a.xyz", "", "not a format"),
    ],
)
def test_what_is_no_take_is_refused_in_one_line(tmp_path, name, text, says):
    with pytest.raises(RigError, match=says) as refused:
        read_sequence(write(tmp_path / name, text), rig=sample_rig())
    assert "\n" not in str(refused.value)
    assert name in str(refused.value) or "none of" in str(refused.value)


def test_weights_need_a_rig(tmp_path):
    with pytest.raises(RigError, match="give the rig that they drive"):
        read_sequence(write(tmp_path / "a.csv", "jawOpen\n1\n"))


def test_another_mesh_is_refused(tmp_path):
    rng = np.random.default_rng(0)
    np.savez(tmp_path / "few.npz", frames=posed()[:, :100], fps=24)
    with pytest.raises(RigError, match="has 100 vertices"):
        read_sequence(tmp_path / "few.npz", rig=sample_rig())
    np.savez(tmp_path / "mixed.npz", frames=posed()[:, rng.permutation(posed().shape[1])], fps=24)
    with pytest.raises(RigError, match="vertex order was lost"):
        read_sequence(tmp_path / "mixed.npz", rig=sample_rig())


def test_pickles_and_giants_are_refused_before_they_are_read(tmp_path):
    np.savez(tmp_path / "a.npz", frames=np.array([{}], dtype=object))
    with pytest.raises(RigError, match="never loaded"):
        read_sequence(tmp_path / "a.npz", rig=sample_rig())


def test_a_file_of_another_mesh_among_the_frames_is_named(tmp_path):
    folder = write_frames(tmp_path / "take", posed(frames=3), ".ply")
    trimesh.creation.box().export(folder / "head.0002.ply")
    with pytest.raises(RigError, match=r"head\.0002\.ply has 8 vertices"):
        frames_of(read_sequence(folder, rig=sample_rig()))


def test_frames_in_which_nothing_moves_are_the_neutral():
    rig = sample_rig()
    still = PosedFrames(rig, np.zeros((3, len(rig.names))))
    assert np.array_equal(still.block(0, 3), np.broadcast_to(rig.neutral, (3, *rig.neutral.shape)))
