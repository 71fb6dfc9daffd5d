"""Cameras that others calibrated, cameras that see nothing, and markers that a camera can read."""

import json

import numpy as np
import pytest
from msgspec.structs import replace
from scipy.spatial.transform import Rotation

from capture_plan.anatomy.performed_deltas import performed_deltas
from capture_plan.camera import cameras_for, look_at, otherwise, why_blind
from capture_plan.check.camera_claims import camera_claims, difference
from capture_plan.check.check import check_plan
from capture_plan.errors import InfeasibleError, RigError
from capture_plan.face.blocking import opaque_triangles
from capture_plan.layout.face import see_face
from capture_plan.layout.problem import task_of
from capture_plan.layout.settings import LayoutSettings
from capture_plan.layout.unread import pose_views
from capture_plan.plan.record import cameras_of
from capture_plan.plan.settings import Settings
from capture_plan.progress import listen
from capture_plan.visibility import Sight, camera_views
from tests.once import QUICK, plan_of


def calibration(path, cameras, unit_mm=1000.0, **more):
    """Cameras as Pose2Sim writes them, in a unit."""
    lines = []
    for camera in cameras:
        t = -camera.rotation @ camera.position / unit_mm
        entries = {
            "name": camera.name,
            "size": [float(n) for n in camera.size_px],
            "matrix": camera.intrinsics.tolist(),
            "distortions": camera.distortion[:4].tolist(),
            "rotation": Rotation.from_matrix(camera.rotation).as_rotvec().tolist(),
            "translation": t.tolist(),
            **more,
        }
        lines += [
            f"[{camera.name.replace(' ', '_')}]",
            *(f"{key} = {json.dumps(value)}" for key, value in entries.items()),
        ]
    path.write_text("\n".join([*lines, "[metadata]", "adjusted = false", "error = 0.0"]))
    return str(path)


@pytest.mark.parametrize("unit_mm", [1000.0, 1.0, 10.0])
def test_a_calibration_gives_back_its_cameras_in_millimetres(tmp_path, rig, unit_mm):
    before = cameras_for("head-mounted-pair", rig.neutral, rig.skin)
    said = []
    with listen(said.extend):
        after = cameras_for(calibration(tmp_path / "Calib.toml", before, unit_mm), rig.neutral, rig.skin)
    for one, other in zip(before, after, strict=True):
        assert one.numbers == pytest.approx(other.numbers, abs=1e-6)
        assert one.name == other.name
    assert len(said) == 1
    assert ("not metres" in said[0]) == (unit_mm != 1000)


@pytest.mark.parametrize(
    ("more", "says"),
    [
        ({"fisheye": True, "distortions": [0.1, 0, 0, 0, 0.1]}, "a fisheye lens of 5 numbers"),
        ({"distortions": [0.1, 0, 0, 0, 0, 0.2]}, "a lens of 6 numbers"),
        ({"size": [640]}, "'size' must be 2 numbers"),
        ({"distortions": [0.1, "wide", 0, 0]}, "'distortions' must be 4 numbers"),
        ({"distortions": [[0.1], [0, 0], 0, 0]}, "'distortions' must be 4 numbers"),
        ({"rotation": "none"}, "'rotation' must be 3 numbers or 3x3 numbers"),
        ({"matrix": [[1, 0], [0, 1]]}, "'matrix' must be 3x3 numbers"),
        ({"name": "same"}, "two cameras are called 'same'"),
    ],
)
def test_what_a_calibration_cannot_mean_is_refused_in_one_line(tmp_path, rig, more, says):
    pair = cameras_for("head-mounted-pair", rig.neutral, rig.skin)
    with pytest.raises(RigError, match=says) as refused:
        cameras_for(calibration(tmp_path / "Calib.toml", pair, **more), rig.neutral, rig.skin)
    assert "\n" not in str(refused.value)


def test_a_camera_that_is_switched_off_is_left_out(tmp_path, rig):
    path = tmp_path / "Calib.toml"
    calibration(path, cameras_for("head-mounted-pair", rig.neutral, rig.skin))
    path.write_text(path.read_text().replace("[metadata]", "ignore = true\n[metadata]"))
    assert [camera.name for camera in cameras_for(str(path), rig.neutral, rig.skin)] == ["boom top"]


def standing(rig, position, target=(0.0, 690.0, 140.0)):
    (camera,) = cameras_for("frontal", rig.neutral, rig.skin)
    position = np.array(position, dtype=float)
    return type(camera)(
        "a",
        position,
        look_at(position, np.array(target, dtype=float)),
        camera.intrinsics,
        camera.size_px,
        camera.distortion,
    )


@pytest.mark.parametrize(
    ("position", "target", "says"),
    [
        ((0, 0.69, 0.9), (0, 0.69, 0.14), r"would fit in metres: write \(0, 690, 900\)"),
        ((0, 69, 90), (0, 69, 14), "would fit in centimetres"),
        ((0, 690, -400), (0, 690, 140), "behind the head"),
        ((0, 700, 90), (0, 690, 140), "inside the head"),
        ((0, 690, 800), (900, 690, 800.1), "looks past it"),
    ],
)
def test_a_camera_that_sees_nothing_is_told_what_to_change(rig, used, position, target, says):
    camera = standing(rig, position, target)
    with pytest.raises(InfeasibleError, match=f"camera 'a' sees no skin that moves.*{says}"):
        see_face(rig, used, (camera,)).allowed(LayoutSettings())


def test_other_blind_cameras_are_counted(rig):
    camera = standing(rig, (0, 690, -400))
    assert "the other 1 see none either" in why_blind((camera, camera), rig.neutral[rig.skin])


@pytest.fixture(scope="module")
def planned():
    return plan_of(Settings(cameras="head-mounted-pair", expressions=QUICK.expressions))


def test_every_landmark_is_read_by_some_camera_with_every_blendshape_and_in_every_expression(rig, used, planned):
    cameras, marks, dot_mm = cameras_of(planned), planned.layout.landmarks, planned.settings.landmarks.dot_mm
    at = np.array([mark.vertex for mark in marks])
    alone = camera_views(rig.neutral, performed_deltas(rig, used), opaque_triangles(rig), at, cameras, dot_mm=dot_mm)
    packed = pose_views(rig, marks, planned.packing.poses, cameras, dot_mm=dot_mm)
    assert (alone.views >= 1).all()
    assert (packed.views >= 1).all()
    left = {(one.pose, one.camera, one.dot) for one in planned.unread if one.dot in {mark.name for mark in marks}}
    assert len(left) == (packed.how != Sight.READ).sum()


def test_a_mailed_plan_is_checked_without_its_camera_file(rig, planned):
    """The plan carries its cameras: a file that is not there is not asked for."""
    mailed = replace(planned, settings=replace(planned.settings, cameras="gone.toml"))
    wrong = [claim.what for claim in check_plan(mailed, rig) if not claim.holds]
    assert wrong == ["the plan is as it was written"]


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"intrinsics": ((450.0, 0.0, 767.5), (0.0, 450.0, 1023.5), (0.0, 0.0, 1.0))}, "has a focal length of 450 px"),
        ({"position": (0.0, 700.0, 450.0)}, "mm from where it stood"),
        ({"noise_px": 0.1}, "finds a dot to 0.1 px, not 0.5"),
        ({"size_px": (768, 1024)}, "has pictures of 768 x 1024 px, not 1536 x 2048"),
        ({"distortion": (0.1, 0.0, 0.0, 0.0, 0.0)}, "has another lens or principal point"),
        ({"name": "chin"}, "chin, boom bottom instead of boom top, boom bottom"),
    ],
)
def test_a_camera_that_a_plan_carries_otherwise_is_told(rig, used, planned, change, says):
    lied = replace(planned, cameras=(replace(planned.cameras[0], **change), *planned.cameras[1:]))
    assert says in otherwise(planned.cameras, lied.cameras)
    same = camera_claims(lied, see_face(rig, used, cameras_for("head-mounted-pair", rig.neutral, rig.skin)))[0]
    assert not same.holds


def test_dots_too_small_for_any_camera_are_told_with_the_size_that_would_do(rig, used):
    face = see_face(rig, used, cameras_for("head-mounted-pair", rig.neutral, rig.skin))
    with pytest.raises(InfeasibleError, match=r"a dot of 0\.2 mm is at most .* px wide .* use dots of 0?\.?\d"):
        task_of(face, LayoutSettings(dot_mm=0.2))
    task_of(face, LayoutSettings(dot_mm=0.2, min_views=0))


def test_check_sees_another_lens_another_place_and_a_missing_camera(rig, used, planned):
    cameras = cameras_for("head-mounted-pair", rig.neutral, rig.skin)
    assert all(claim.holds for claim in camera_claims(planned, see_face(rig, used, cameras)))
    first = cameras[0]
    wide = type(first)(
        first.name,
        first.position,
        first.rotation,
        first.intrinsics * [[0.5], [0.5], [1]],
        first.size_px,
        first.distortion,
    )
    same, claim = camera_claims(planned, see_face(rig, used, (wide, cameras[1])))
    assert "camera 'boom top' has a focal length of" in same.found
    assert not claim.holds
    assert "px wide in camera 'boom top', the plan says" in claim.found
    assert claim.mend == "the cameras (head-mounted-pair) have changed since the plan was made: plan again"
    for fewer in (cameras[:1], ()):
        assert not any(claim.holds for claim in camera_claims(planned, see_face(rig, used, fewer)))


def test_a_view_that_is_said_otherwise_is_found(planned):
    mark = planned.layout.landmarks[0]
    assert difference(mark, mark.views) == ""
    lied = replace(mark.views[0], always=not mark.views[0].always)
    assert "in every expression" in difference(mark, (lied, *mark.views[1:]))


def test_the_plan_of_a_preset_holds(rig, planned):
    assert all(claim.holds for claim in check_plan(planned, rig))
