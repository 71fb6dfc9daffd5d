"""USD: blendshapes of every layout, places, parts, layers that may be opened; damaged files end in one line."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from pxr import Gf, Sdf, Usd, UsdGeom, UsdSkel, UsdUtils, Vt

from capture_plan.errors import RigError
from capture_plan.formats import usd, usd_scene
from capture_plan.formats.own_process import ONE_THREAD
from capture_plan.formats.raw import finite
from capture_plan.formats.usd import read_usd
from capture_plan.reader.read import read_rig
from capture_plan.sample import sample_rig

# pyright: reportAttributeAccessIssue=false
TETRAHEDRON = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
FACES = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]
LIFT = [[0, 0, 0], [0, 0, 0], [0, 0, 0], [0, 0, 2.0]]


def new_stage(path: Path, metres=0.01, up="Y"):
    stage = Usd.Stage.CreateNew(str(path))
    UsdGeom.SetStageMetersPerUnit(stage, metres)
    UsdGeom.SetStageUpAxis(stage, up)
    stage.SetDefaultPrim(UsdSkel.Root.Define(stage, "/root").GetPrim())
    return stage


def add_mesh(stage, name="head", points=TETRAHEDRON, faces=FACES):
    mesh = UsdGeom.Mesh.Define(stage, f"/root/{name}")
    mesh.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(np.asarray(points, "f4")))
    mesh.CreateFaceVertexCountsAttr([len(face) for face in faces])
    mesh.CreateFaceVertexIndicesAttr([int(corner) for face in faces for corner in face])
    return mesh


def bind(mesh, shapes):
    """Blendshapes {name: (offsets, indices or None)} of a mesh."""
    stage, binding, paths = mesh.GetPrim().GetStage(), UsdSkel.BindingAPI.Apply(mesh.GetPrim()), []
    for name, (offsets, indices) in shapes.items():
        shape = UsdSkel.BlendShape.Define(stage, mesh.GetPath().AppendChild(f"{name}_shape"))
        shape.CreateOffsetsAttr(Vt.Vec3fArray.FromNumpy(np.asarray(offsets, "f4")))
        if indices is not None:
            shape.CreatePointIndicesAttr([int(i) for i in indices])
        paths.append(shape.GetPath())
    binding.CreateBlendShapesAttr(list(shapes))
    binding.CreateBlendShapeTargetsRel().SetTargets(paths)
    return binding


def read_here(path):
    """As `read_usd`, in this process, since a process for each of these whole files takes long."""
    answer = path.with_suffix(".answer.npz")
    usd_scene.write_archive(str(path.parent.resolve() / path.name), "rig", str(answer))
    return usd.build_rig(path.stem, *usd.opened(dict(np.load(answer))))


def save(stage, path):
    stage.Save()
    return read_here(path)


def tiny(path, **stage_settings):
    """A saved tetrahedron with one blendshape."""
    stage = new_stage(path, **stage_settings)
    bind(add_mesh(stage), {"lift": (LIFT, None)})
    stage.Save()
    return path


def write_sample(path: Path, k=4):
    stage, rig = new_stage(path), sample_rig()
    for part, title in enumerate(rig.part_names):
        inside = np.flatnonzero(rig.parts == part)
        faces = np.searchsorted(inside, rig.triangles[np.isin(rig.triangles, inside).all(axis=1)])
        moved = {rig.names[i]: np.flatnonzero(rig.deltas[i, inside].any(axis=1)) for i in range(k)}
        shapes = {name: (rig.deltas[i, inside][moved[name]] / 10, moved[name]) for i, name in enumerate(moved)}
        bind(add_mesh(stage, title, rig.neutral[inside] / 10, faces), shapes)
    stage.Save()
    return path


@pytest.mark.parametrize("suffix", ["usda", "usdc", "usdz"])
def test_every_form_of_the_file_gives_the_same_head(tmp_path, suffix):
    path = write_sample(tmp_path / ("head.usdc" if suffix == "usdz" else f"head.{suffix}"))
    if suffix == "usdz":
        UsdUtils.CreateNewUsdzPackage(str(path), str(tmp_path / "head.usdz"))
        path = tmp_path / "head.usdz"
    rig, sample = read_rig(path), sample_rig()
    by_part = np.concatenate([np.flatnonzero(sample.parts == part) for part in range(len(sample.part_names))])
    same = by_part[rig.source_index]  # parts came one after another
    assert (rig.unit_mm, rig.unit_found, rig.up_found, rig.note) == (10.0, "format", "format", "")
    assert rig.names == sample.names[:4]
    np.testing.assert_allclose(rig.neutral, sample.neutral[same], atol=1e-4)
    np.testing.assert_allclose(rig.deltas, sample.deltas[:4, same], atol=1e-4)


@pytest.mark.parametrize(("up", "axes"), [("Y", ("+y", "+z")), ("Z", ("+z", "-y"))])
def test_unit_and_up_are_the_stages(tmp_path, up, axes):
    rig = read_here(tiny(tmp_path / "r.usda", metres=0.0254, up=up))
    assert (rig.up, rig.facing) == axes
    assert rig.unit_mm == pytest.approx(25.4)


def test_offsets_of_some_points_are_those_of_all_points_with_zeros(tmp_path):
    stage = new_stage(tmp_path / "r.usda")
    bind(add_mesh(stage), {"dense": (LIFT, None), "sparse": ([[0, 0, 2]], [3])})
    rig = save(stage, tmp_path / "r.usda")
    np.testing.assert_array_equal(rig.deltas[0], LIFT)
    np.testing.assert_array_equal(rig.deltas[1], LIFT)


def test_a_blendshape_is_called_as_the_mesh_binds_it_and_is_one_over_all_meshes(tmp_path):
    stage = new_stage(tmp_path / "r.usda")
    for name in ("head", "teeth"):
        bind(add_mesh(stage, name), {"jawOpen": (LIFT, None)})
    rig = save(stage, tmp_path / "r.usda")
    assert (rig.names, rig.part_names) == (("jawOpen",), ("head", "teeth"))
    np.testing.assert_array_equal(np.flatnonzero(rig.deltas[0].any(axis=1)), [3, 7])


def test_in_betweens_are_left_out_and_reported(tmp_path):
    stage = new_stage(tmp_path / "r.usda")
    bind(add_mesh(stage), {"jawOpen": (LIFT, None)})
    between = UsdSkel.BlendShape(stage.GetPrimAtPath("/root/head/jawOpen_shape")).CreateInbetween("half")
    between.SetWeight(0.5)
    between.SetOffsets(Vt.Vec3fArray.FromNumpy(np.full((4, 3), 9, "f4")))
    rig = save(stage, tmp_path / "r.usda")
    np.testing.assert_array_equal(rig.deltas[0], LIFT)
    assert "jawOpen at 50 %" in rig.note


def test_the_transform_stack_places_vertices_and_turns_deltas(tmp_path):
    stage = new_stage(tmp_path / "r.usda")
    UsdGeom.Xformable(stage.GetPrimAtPath("/root")).AddScaleOp().Set(Gf.Vec3f(100, 100, 100))
    mesh = add_mesh(stage)
    mesh.AddTranslateOp().Set(Gf.Vec3d(0, 0, 5))
    mesh.AddRotateXOp().Set(90.0)
    bind(mesh, {"lift": (LIFT, None)})
    rig = save(stage, tmp_path / "r.usda")
    R = np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]])  # a quarter turn about x takes y to z
    np.testing.assert_allclose(rig.neutral, 100 * (TETRAHEDRON @ R.T + [0, 0, 5]), atol=1e-4)
    np.testing.assert_allclose(rig.deltas[0, 3], 100 * R @ [0, 0, 2], atol=1e-4)


def test_a_mesh_with_joints_stands_where_it_was_bound(tmp_path):
    stage = new_stage(tmp_path / "r.usda")
    skeleton = UsdSkel.Skeleton.Define(stage, "/root/bones")
    UsdGeom.Xformable(skeleton).AddTranslateOp().Set(Gf.Vec3d(7, 0, 0))
    mesh = add_mesh(stage)
    mesh.AddTranslateOp().Set(Gf.Vec3d(0, 0, 99))  # which joints override
    binding = bind(mesh, {"lift": (LIFT, None)})
    binding.CreateSkeletonRel().SetTargets([skeleton.GetPath()])
    binding.CreateJointIndicesPrimvar(False, 1).Set([0] * 4)
    binding.CreateGeomBindTransformAttr(Gf.Matrix4d().SetTranslate(Gf.Vec3d(0, 3, 0)))
    rig = save(stage, tmp_path / "r.usda")
    np.testing.assert_allclose(rig.neutral, TETRAHEDRON + np.array([7, 3, 0]))


def volume(rig):
    a, b, c = rig.neutral[rig.triangles].transpose(1, 0, 2)
    return float(np.einsum("fx,fx->", a, np.cross(b, c)) / 6)


def test_left_handed_meshes_keep_their_faces_outward(tmp_path):
    assert volume(read_here(tiny(tmp_path / "right.usda"))) > 0
    stage = new_stage(tmp_path / "r.usda")
    mesh = add_mesh(stage, faces=[face[::-1] for face in FACES])
    mesh.CreateOrientationAttr("leftHanded")
    bind(mesh, {"lift": (LIFT, None)})
    assert volume(save(stage, tmp_path / "r.usda")) > 0


def test_subsets_are_parts(tmp_path):
    stage = new_stage(tmp_path / "r.usda")
    mesh = add_mesh(stage)
    bind(mesh, {"lift": (LIFT, None)})
    UsdGeom.Subset.CreateGeomSubset(mesh, "lips", "face", [3])
    assert save(stage, tmp_path / "r.usda").part_names == ("head", "head/lips")


def test_stand_in_meshes_are_left_out_and_reported(tmp_path):
    stage = new_stage(tmp_path / "r.usda")
    bind(add_mesh(stage), {"lift": (LIFT, None)})
    add_mesh(stage, "low").CreatePurposeAttr("proxy")
    rig = save(stage, tmp_path / "r.usda")
    assert (rig.part_names, len(rig.neutral)) == (("head",), 4)
    assert "low (proxy)" in rig.note


def refer(path: Path, asset: str, how="references") -> Path:
    """A stage that refers to another file; `asset` is written as it is."""
    arc = f"prepend {how} = @{asset}@" if how != "subLayers" else ""
    layers = f"(subLayers = [@{asset}@])" if how == "subLayers" else ""
    path.write_text(f'#usda 1.0\n{layers}\ndef "other" ({arc})\n{{\n}}\n')
    return path


@pytest.mark.parametrize("how", ["references", "payload", "subLayers"])
def test_layers_beside_the_file_are_read(tmp_path, how):
    tiny(tmp_path / "part.usda")
    assert read_here(refer(tmp_path / "r.usda", "./part.usda", how)).names == ("lift",)


@pytest.mark.parametrize("how", ["references", "payload", "subLayers"])
def test_layers_elsewhere_are_refused(tmp_path, how):
    secret = tiny(tmp_path / "secret.usda")
    (tmp_path / "inside").mkdir()
    (tmp_path / "inside" / "link.usda").symlink_to(secret)
    places = (
        "C:/a.usda",
        "../secret.usda",
        str(secret),
        f"file://{secret}",
        "http://example.org/a.usd",
        '`"${HOME}"`',
        "link.usda",
    )
    for asset in (*places, "./deep/../../secret.usda", '`"${HOME}"`'):
        with pytest.raises(RigError, match=r"^refers to .* which lies outside its folder"):
            read_here(refer(tmp_path / "inside" / "r.usda", asset, how))


def test_a_layer_that_is_missing_or_refers_elsewhere_itself_is_refused(tmp_path):
    with pytest.raises(RigError, match=r"needs the file './b.usda', which is not beside it"):
        read_here(refer(tmp_path / "a.usda", "./b.usda"))
    refer(tmp_path / "b.usda", "/etc/c.usda")
    with pytest.raises(RigError, match=r"refers to '/etc/c.usda', which lies outside"):
        read_here(refer(tmp_path / "a.usda", "./b.usda"))


def test_an_archive_may_refer_only_to_what_is_inside_it(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # where the library looks for what it does not find
    tiny(tmp_path / "part.usda")
    refer(tmp_path / "top.usda", "./part.usda")
    assert UsdUtils.CreateNewUsdzPackage(str(tmp_path / "top.usda"), str(tmp_path / "whole.usdz"))
    (tmp_path / "part.usda").unlink()
    assert read_here(tmp_path / "whole.usdz").names == ("lift",)
    tiny(tmp_path / "beside.usda")
    for asset in ("beside.usda", "../beside.usda", str(tmp_path / "beside.usda")):
        with Sdf.ZipFileWriter.CreateNew(str(tmp_path / "bad.usdz")) as archive:
            archive.AddFile(str(refer(tmp_path / "top.usda", asset)), "top.usda")
        with pytest.raises(RigError, match="outside its folder or archive"):
            read_here(tmp_path / "bad.usdz")


def test_value_clips_are_refused(tmp_path):
    stage = new_stage(tmp_path / "r.usda")
    Usd.ClipsAPI(stage.DefinePrim("/root/a")).SetClipAssetPaths([Sdf.AssetPath("/etc/x.usd")])
    stage.Save()
    with pytest.raises(RigError, match="takes the values of /root/a from other files"):
        read_here(tmp_path / "r.usda")


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda mesh: None, "no blendshapes found"),
        (
            lambda mesh: bind(mesh, {"a": (LIFT, None)}).GetBlendShapeTargetsRel().SetTargets(["/no"]),
            "no blendshapes found",
        ),
        (lambda mesh: mesh.GetFaceVertexIndicesAttr().Set([9] * 12), "a face that uses vertex 9 of 4"),
        (lambda mesh: mesh.GetFaceVertexCountsAttr().Set([3] * 5), "need 15 corners of 12"),
        (lambda mesh: mesh.GetFaceVertexCountsAttr().Set([-3, 15]), "need 12 corners of 12"),
        (lambda mesh: mesh.GetPrim().SetActive(False), "has no mesh with faces"),
    ],
)
def test_what_is_wrong_is_said_in_one_line(tmp_path, change, says):
    stage = new_stage(tmp_path / "r.usda")
    change(add_mesh(stage))
    with pytest.raises(RigError, match=says) as error:
        save(stage, tmp_path / "r.usda")
    assert len(str(error.value).splitlines()) == 1


def test_a_shape_of_another_mesh_is_left_out_and_named(tmp_path):
    stage = new_stage(tmp_path / "r.usda")
    bind(add_mesh(stage), {"good": (LIFT, None), "bad": ([[0, 0, 1]], [4])})
    raw = finite(save(stage, tmp_path / "r.usda"))
    assert raw.names == ("good",)
    assert raw.note.endswith("bad")


def test_without_the_library_one_line_says_how_to_install_it(tmp_path, monkeypatch):
    path = tiny(tmp_path / "r.usda")
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with pytest.raises(RigError, match=r"r.usda needs the library for USD: install .* 'capture-plan\[usd\]'"):
        read_usd(path)


def test_a_program_that_dies_or_hangs_is_one_line(tmp_path, monkeypatch):
    path = tiny(tmp_path / "r.usda")
    reports = "from pathlib import Path; import os; Path(os.environ['TMPDIR'], 'report').touch(); os.abort()"
    for code in (reports, "import time; time.sleep(60)", "print('no archive')"):
        program = tmp_path / "program.py"
        program.write_text(code)
        monkeypatch.setattr(usd, "PROGRAM", program)
        monkeypatch.setattr(usd, "SECONDS", 1.0)
        monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
        with pytest.raises(RigError, match=r"^r.usda cannot be read: it is damaged, or too large"):
            read_usd(path)
        assert sorted(p.name for p in tmp_path.iterdir()) == ["program.py", "r.usda"]  # nothing is left behind


def test_memory_is_bounded(tmp_path):
    code = "import runpy, sys; p = runpy.run_path(sys.argv[1]); p['limit_memory'](0); bytearray(p['MEMORY_BYTES'])"
    done = subprocess.run([sys.executable, "-c", code, str(usd.PROGRAM)], capture_output=True, text=True)
    assert "MemoryError" in done.stderr


DAMAGE = """
import random, runpy, sys
from pathlib import Path
program = runpy.run_path(sys.argv[4])
program["limit_memory"](len(Path(sys.argv[1]).read_bytes()))
data, path, start = Path(sys.argv[1]).read_bytes(), Path(sys.argv[2]), int(sys.argv[3])
for i in range(start, 2 * 60):
    print(i, flush=True)
    random.seed(i)
    damaged = bytearray(data[: len(data) * i // 60] if i < 60 else data)
    if i >= 60:
        for _ in range(random.randint(1, 8)):
            damaged[random.randrange(len(damaged))] = random.randrange(256)
    path.write_bytes(damaged)
    program["write_archive"](str(path), "rig", str(path.with_suffix(".answer.npz")))
"""


@pytest.mark.parametrize("suffix", ["usda", "usdc", "usdz"])
def test_damaged_files_are_one_line_even_those_that_end_the_process(tmp_path, suffix):
    """All in one process, as starting one for each takes too long; what ends it is read again as a person would."""
    whole = tiny(tmp_path / ("whole.usdc" if suffix == "usdz" else f"whole.{suffix}"))
    if suffix == "usdz":
        UsdUtils.CreateNewUsdzPackage(str(whole), str(whole := tmp_path / "whole.usdz"))
    path, start, ended = tmp_path / f"damaged.{suffix}", 0, 0
    while start < 120:
        program = [sys.executable, "-c", DAMAGE, str(whole), str(path), str(start), str(usd.PROGRAM)]
        done = subprocess.run(program, capture_output=True, env=os.environ | ONE_THREAD)
        if done.returncode == 0:
            break
        assert done.returncode < 0, done.stderr  # a signal, never an exception of ours
        start, ended = int(done.stdout.split(b"\n")[-2]) + 1, ended + 1
        if ended <= 3:
            with pytest.raises(RigError, match="cannot be read: it is damaged") as error:
                read_usd(path)
            assert len(str(error.value).splitlines()) == 1


def test_blendshapes_of_normals_alone_of_equal_names_and_those_that_are_gone(tmp_path):
    stage = new_stage(tmp_path / "r.usda")
    binding = bind(add_mesh(stage), {"a": (LIFT, None), "b": (LIFT, None), "c": ([], [1, 2]), "d": (LIFT, None)})
    binding.CreateBlendShapesAttr(["a", "a", "c", "d"])
    targets = binding.GetBlendShapeTargetsRel().GetTargets()
    binding.GetBlendShapeTargetsRel().SetTargets([*targets[:3], "/no"])
    rig = save(stage, tmp_path / "r.usda")
    assert rig.names == ("a", "a 2", "c")
    assert not rig.deltas[2].any()
    assert "a 2" in rig.note
    assert "1 of 4 blendshapes that head is bound to" in rig.note


def test_names_that_do_not_fit_give_way_to_the_blendshapes_own(tmp_path):
    stage = new_stage(tmp_path / "r.usda")
    bind(add_mesh(stage), {"a": (LIFT, None), "b": (LIFT, None)}).CreateBlendShapesAttr(["x", "a", "b"])
    rig = save(stage, tmp_path / "r.usda")
    assert rig.names == ("a_shape", "b_shape")
    assert "3 names for 2 blendshapes" in rig.note


@pytest.mark.parametrize("above", [False, True])
def test_an_invisible_mesh_is_left_out_and_named(tmp_path, above):
    stage = new_stage(tmp_path / "r.usda")
    bind(add_mesh(stage), {"lift": (LIFT, None)})
    UsdGeom.Xform.Define(stage, "/root/group")
    mesh = add_mesh(stage, "group/old")
    UsdGeom.Imageable(stage.GetPrimAtPath("/root/group") if above else mesh.GetPrim()).MakeInvisible()
    rig = save(stage, tmp_path / "r.usda")
    assert (rig.part_names, rig.left_out) == (("head",), ("old",))
    assert "old (invisible)" in rig.note


def test_a_rig_whose_only_blendshapes_are_invisible_is_still_read(tmp_path):
    stage = new_stage(tmp_path / "r.usda")
    mesh = add_mesh(stage)
    bind(mesh, {"lift": (LIFT, None)})
    UsdGeom.Imageable(mesh.GetPrim()).MakeInvisible()
    add_mesh(stage, "hat")
    rig = save(stage, tmp_path / "r.usda")
    assert (rig.part_names, rig.left_out) == (("head", "hat"), ())
    assert "head (invisible)" in rig.note


def test_weights_that_an_animation_holds_are_told(tmp_path):
    stage = new_stage(tmp_path / "r.usda")
    bind(add_mesh(stage), {"lift": (LIFT, None), "b": (LIFT, None)})
    animation = UsdSkel.Animation.Define(stage, "/root/animation")
    animation.CreateBlendShapesAttr(["lift", "b"])
    animation.CreateBlendShapeWeightsAttr([0.4, 0.0])
    rig = save(stage, tmp_path / "r.usda")
    assert "lift at 40 %" in rig.note
    assert "b at" not in rig.note
    np.testing.assert_array_equal(rig.neutral, TETRAHEDRON)


BROKEN_HATS = {
    "corner": (TETRAHEDRON, [[0, 1, 9]], "hat has a face that uses vertex 9 of 4"),
    "NaN": (TETRAHEDRON * [1, np.nan, 1], FACES, "hat holds NaN or infinite coordinates"),
}


@pytest.mark.parametrize("kind", BROKEN_HATS)
def test_a_broken_mesh_that_nothing_moves_is_left_out_and_named(tmp_path, kind):
    points, faces, says = BROKEN_HATS[kind]
    stage = new_stage(tmp_path / "r.usda")
    add_mesh(stage, "hat", points, faces)
    bind(add_mesh(stage), {"lift": (LIFT, None)})
    rig = save(stage, tmp_path / "r.usda")
    assert says in rig.note
    assert rig.left_out == ("hat",)
    np.testing.assert_allclose(rig.neutral, TETRAHEDRON)
    np.testing.assert_array_equal(rig.source_index, [4, 5, 6, 7])
    bind(UsdGeom.Mesh(stage.GetPrimAtPath("/root/hat")), {"tip": (LIFT, None)})
    if kind == "corner":
        with pytest.raises(RigError, match="vertex 9 of 4"):
            save(stage, tmp_path / "r.usda")
