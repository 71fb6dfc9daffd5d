"""USD takes: meshes and weights over time come back as they were written; what is no take is one line."""

import numpy as np
import pytest
from pxr import Gf, Usd, UsdGeom, UsdSkel, Vt

from capture_plan.curves.weights import WeightTable
from capture_plan.errors import RigError
from capture_plan.formats import usd, usd_scene
from capture_plan.sample import sample_rig
from capture_plan.sequence import read_sequence
from capture_plan.sequence.meshes import MeshTake
from capture_plan.sequence.usd_take import build_take
from tests.formats.test_usd import LIFT, TETRAHEDRON, add_mesh, new_stage, write_sample

# pyright: reportAttributeAccessIssue=false


def weights(frames=6, k=5):
    rig, rng = sample_rig(), np.random.default_rng(0)
    w = np.zeros((frames, len(rig.names)))
    w[1:, rng.choice(len(rig.names), k, replace=False)] = rng.uniform(0, 1, (frames - 1, k))
    return w


def posed(frames=6):
    return np.stack([sample_rig().pose(w) for w in weights(frames)])


def rate(stage, fps):
    stage.SetTimeCodesPerSecond(fps)
    return stage


def sample_points(mesh, frames, times=None):
    """Points of a mesh over time, at time codes 1, 2, ... unless others are given."""
    for time, x in zip(range(1, 1 + len(frames)) if times is None else times, frames, strict=True):
        mesh.GetPointsAttr().Set(Vt.Vec3fArray.FromNumpy(np.asarray(x, "f4")), time)


def write_frames(path, frames, *, metres=0.01, up="Y", fps=60, faces=None):
    """A take of the sample's mesh, in frames of millimetres."""
    stage = rate(new_stage(path, metres, up), fps)
    turn = np.eye(3) if up == "Y" else np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
    x = frames @ turn.T / (1000 * metres)
    mesh = add_mesh(stage, points=x[0], faces=sample_rig().triangles if faces is None else faces)
    mesh.GetPointsAttr().Clear()
    sample_points(mesh, x)
    stage.Save()
    return path


def add_animation(stage, names, w, times=None, name="take", bound=True):
    animation = UsdSkel.Animation.Define(stage, f"/root/{name}")
    animation.CreateBlendShapesAttr(list(names))
    attribute = animation.CreateBlendShapeWeightsAttr()
    for time, row in zip(range(len(w)) if times is None else times, w, strict=True):
        attribute.Set([float(x) for x in row], time)
    if bound:
        UsdSkel.BindingAPI.Apply(stage.GetPrimAtPath("/root")).CreateAnimationSourceRel().AddTarget(animation.GetPath())
    return animation


def read_here(path):
    """The take as its file has it, read in this process, since starting one for each takes long."""
    with np.errstate(all="ignore"):
        answer = path.with_suffix(".answer.npz")
        usd_scene.write_archive(str(path.parent.resolve() / path.name), "take", str(answer))
        return build_take(*usd.opened(dict(np.load(answer))))


def frames_of(take):
    return take.frames.block(0, len(take.frames))


def tetrahedra(path, count=3):
    """An unsaved stage with a mesh that lifts its tip by one more in every frame."""
    stage = rate(new_stage(path), 24)
    mesh = add_mesh(stage)
    sample_points(mesh, [TETRAHEDRON + t * np.array(LIFT) for t in range(count)])
    return stage, mesh


@pytest.mark.parametrize("suffix", ["usda", "usdc"])
@pytest.mark.parametrize(("metres", "fps"), [(0.001, 24.0), (0.01, 60.0), (1.0, 29.97)])
def test_frames_and_rate_come_back_as_they_were_written(tmp_path, suffix, metres, fps):
    take = read_here(write_frames(tmp_path / f"take.{suffix}", posed(), metres=metres, fps=fps))
    assert isinstance(take, MeshTake)
    assert (take.fps, take.up, take.facing) == (pytest.approx(fps), "+y", "+z")
    assert take.unit_mm == pytest.approx(1000 * metres)
    assert take.triangles is not None
    np.testing.assert_array_equal(take.triangles, sample_rig().triangles)
    np.testing.assert_allclose(frames_of(take) * take.unit_mm, posed(), atol=1e-3)  # millimetres


@pytest.mark.parametrize("up", ["Y", "Z"])
def test_with_and_without_a_rig_a_take_is_that_of_the_same_frames_in_an_archive(tmp_path, up):
    """Frames in millimetres, +y up; the head is held still in both."""
    path = write_frames(tmp_path / "take.usdc", posed(12), up=up)
    np.savez(tmp_path / "take.npz", frames=posed(12), faces=sample_rig().triangles, fps=60, units="mm")
    for rig in (sample_rig(), None):
        take, same = read_sequence(path, rig=rig), read_sequence(tmp_path / "take.npz", rig=rig)
        assert (take.fps, len(take)) == (60.0, 12)
        np.testing.assert_allclose(frames_of(take), frames_of(same), atol=1e-3)
        np.testing.assert_allclose(take.neutral, same.neutral, atol=1e-3)


def test_weights_drive_the_sample_rig_by_name(tmp_path):
    rig, w = sample_rig(), weights()
    stage = rate(new_stage(tmp_path / "take.usda"), 60)
    order = np.random.default_rng(1).permutation(len(rig.names))
    add_animation(stage, [rig.names[k] for k in order], w[:, order])
    stage.Save()
    take = read_sequence(tmp_path / "take.usda", rig=rig)
    assert (take.fps, len(take), take.notes) == (60.0, 6, ())
    assert take.mapping is not None
    assert {(one.column == one.blendshape, one.share) for one in take.mapping.drives} == {(True, 1.0)}
    np.testing.assert_allclose(frames_of(take), posed(), atol=1e-3)


def test_a_file_with_blendshapes_and_weights_drives_itself(tmp_path):
    path = write_sample(tmp_path / "take.usda", k=2)
    stage, names = Usd.Stage.Open(str(path)), sample_rig().names[:2]
    add_animation(stage, names, [[0, 0], [0.25, 1]])
    stage.Save()
    take = read_sequence(path)
    assert take.rig is not None
    assert take.rig.names == names
    want = take.rig.pose(np.array([0.25, 1]))
    np.testing.assert_allclose(take.frame(1), want, atol=1e-3)


@pytest.mark.parametrize(
    ("times", "per_second", "fps", "count"),
    [
        ([1, 2, 3], 24, 24, 3),
        ([1, 1.5, 2], 30, 60, 3),  # samples between time codes
        ([0, 20, 40], 1000, 50, 3),  # time codes are milliseconds
        ([1, 2, 5], 25, 25, 5),  # samples that repeat were left out
    ],
)
def test_frames_are_as_close_as_samples_or_time_codes(tmp_path, times, per_second, fps, count):
    stage = rate(new_stage(tmp_path / "take.usda"), per_second)
    add_animation(stage, ["a"], [[0], [0.5], [1]], times)
    stage.Save()
    take = read_here(tmp_path / "take.usda")
    assert isinstance(take, WeightTable)
    assert take.fps == pytest.approx(fps)
    at = times[0] + np.arange(count) * (times[-1] - times[0]) / (count - 1)
    np.testing.assert_allclose(take.weights[:, 0], np.interp(at, times, [0, 0.5, 1]), atol=1e-6)


def test_meshes_follow_each_other_each_in_its_place_of_every_frame(tmp_path):
    stage, mesh = tetrahedra(tmp_path / "take.usda")
    mesh.AddTranslateOp().Set(Gf.Vec3d(0, 0, 5))
    teeth = add_mesh(stage, "teeth")
    drop = teeth.AddTranslateOp()
    for time in (1, 2, 3):
        drop.Set(Gf.Vec3d(0, -time, 0), time)
    add_mesh(stage, "low").CreatePurposeAttr("proxy")
    stage.Save()
    take = read_here(tmp_path / "take.usda")
    x = frames_of(take)
    assert x.shape == (3, 8, 3)
    for t in range(3):
        np.testing.assert_allclose(x[t, :4], TETRAHEDRON + t * np.array(LIFT) + [0, 0, 5], atol=1e-6)
        np.testing.assert_allclose(x[t, 4:], TETRAHEDRON - [0, t + 1, 0], atol=1e-6)
    np.testing.assert_array_equal(take.frames.block(1, 2)[0], x[1])
    assert take.triangles is not None
    np.testing.assert_array_equal(take.triangles[4:], take.triangles[:4] + 4)
    assert "low (proxy)" in take.notes[0]


def test_what_a_skeleton_plays_comes_before_other_animations_and_points(tmp_path):
    stage, _ = tetrahedra(tmp_path / "take.usda")
    add_animation(stage, ["other"], [[0], [1]], name="a", bound=False)
    add_animation(stage, ["played"], [[0], [1]], name="b")
    stage.Save()
    take = read_here(tmp_path / "take.usda")
    assert take.columns == ("played",)
    assert take.notes == (
        "of 2 animations b is read",
        "the motion of its points is left out, since it has blendshape weights",
    )


def test_animations_of_two_skeletons_stand_side_by_side_and_the_first_of_a_name_counts(tmp_path):
    stage = new_stage(tmp_path / "take.usda")
    add_animation(stage, ["a", "b"], [[0, 0.5], [1, 0.5]], name="face")
    teeth = UsdSkel.BindingAPI.Apply(UsdSkel.Skeleton.Define(stage, "/root/teeth").GetPrim())
    animation = add_animation(stage, ["b", "c"], [[0, 0.25], [0, 0.75]], name="jaw", bound=False)
    teeth.CreateAnimationSourceRel().SetTargets([animation.GetPath()])
    stage.Save()
    take = read_here(tmp_path / "take.usda")
    assert (take.columns, take.notes) == (("a", "b", "c"), ())
    np.testing.assert_allclose(take.weights, [[0, 0.5, 0.25], [1, 0.5, 0.75]])


def other_count(stage, mesh):
    mesh.GetPointsAttr().Set(Vt.Vec3fArray.FromNumpy(np.zeros((5, 3), "f4")), 3)


def no_number(stage, mesh):
    mesh.GetPointsAttr().Set(Vt.Vec3fArray.FromNumpy(np.full((4, 3), np.nan, "f4")), 3)


def other_faces(stage, mesh):
    mesh.GetFaceVertexIndicesAttr().Set([0, 1, 2] * 4, 1)
    mesh.GetFaceVertexIndicesAttr().Set([0, 2, 1] * 4, 2)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (other_count, "mesh head of 4 points, in frame 2 of 5: every frame must be of the same mesh"),
        (no_number, "mesh head with points that are no numbers in frame 2"),
        (other_faces, "mesh head whose faces change"),
        (lambda stage, mesh: mesh.GetPointsAttr().Clear(), "has no motion"),
        (lambda stage, mesh: mesh.GetFaceVertexCountsAttr().Set([]), "need 0 corners of 12"),
        (lambda stage, mesh: mesh.AddTranslateOp().Set(Gf.Vec3d(np.nan, 0, 0)), "where no number is"),
        (lambda stage, mesh: rate(stage, -1), "-1 time codes in a second"),
        (lambda stage, mesh: sample_points(mesh, [TETRAHEDRON], [1e12]), "lasts 999,999,999,999 frames, more than"),
        (lambda stage, mesh: add_animation(stage, ["a", "b"], [[0], [1]]), "1 weights for the 2 blendshapes of take"),
        (lambda stage, mesh: add_animation(stage, ["a", "a"], [[0, 0], [1, 1]]), "names a blendshape twice"),
    ],
)
def test_what_is_no_take_is_said_in_one_line(tmp_path, change, says):
    stage, mesh = tetrahedra(tmp_path / "take.usda")
    change(stage, mesh)
    stage.Save()
    with pytest.raises(RigError, match=says) as refused:
        read_here(tmp_path / "take.usda")
    assert "\n" not in str(refused.value)


def test_a_mesh_whose_points_change_in_number_is_refused_by_the_file_s_name(tmp_path):
    stage, mesh = tetrahedra(tmp_path / "take.usdc")
    other_count(stage, mesh)
    stage.Save()
    with pytest.raises(RigError, match=r"^take\.usdc: it has a mesh head of 4 points, in frame 2 of 5"):
        read_sequence(tmp_path / "take.usdc")


@pytest.mark.parametrize("suffix", ["usda", "usdc"])
def test_a_truncated_file_is_one_line(tmp_path, suffix):
    path = write_frames(tmp_path / f"take.{suffix}", posed(3))
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    with pytest.raises(RigError, match=rf"^take\.{suffix}: it ") as refused:
        read_sequence(path, rig=sample_rig())
    assert "\n" not in str(refused.value)


def test_more_motion_than_fits_is_refused_before_memory_is_asked_for(tmp_path, monkeypatch):
    """Two samples of a tetrahedron, a million frames apart: a few hundred bytes that declare 0.2 GB."""
    stage = rate(new_stage(tmp_path / "take.usda"), 24)
    sample_points(add_mesh(stage), [TETRAHEDRON, TETRAHEDRON + LIFT], [0, 999_998])
    stage.Save()
    monkeypatch.setattr(usd_scene, "MOST_BYTES", 10**6)
    monkeypatch.setattr(usd_scene, "sampled_points", None)
    with pytest.raises(RigError, match=r"holds 0\.2 GB of motion, more than 0\.0 GB: cut the take"):
        read_here(tmp_path / "take.usda")


def test_without_the_library_one_line_says_how_to_install_it(tmp_path, monkeypatch):
    path = write_frames(tmp_path / "take.usda", posed(2))
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with pytest.raises(RigError, match=r"take\.usda: it needs the library for USD: .* 'capture-plan\[usd\]'"):
        read_sequence(path)


def test_a_stage_places_points_as_the_library_does(tmp_path):
    """An independent second way: the library's own transform of each point."""
    stage, mesh = tetrahedra(tmp_path / "take.usda")
    mesh.AddRotateXYZOp().Set(Gf.Vec3f(20, 30, 40))
    mesh.AddScaleOp().Set(Gf.Vec3f(1, 2, 3))
    stage.Save()
    world = UsdGeom.XformCache(2).GetLocalToWorldTransform(mesh.GetPrim())
    want = [world.Transform(Gf.Vec3d(*p)) for p in (TETRAHEDRON + np.array(LIFT)).tolist()]
    np.testing.assert_allclose(frames_of(read_here(tmp_path / "take.usda"))[1], want, atol=1e-6)
