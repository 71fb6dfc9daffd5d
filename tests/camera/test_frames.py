"""Files in wrong conventions: each is read right by itself or ends with a line that names the mend."""

import json
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from capture_plan.camera import Calibration, Camera, cameras_for, find_frame, looked_at, misplaced
from capture_plan.camera.frame import WORLDS, standing, to_head
from capture_plan.errors import RigError
from capture_plan.progress import listen
from tests.camera import camera_files as write
from tests.camera.camera_files import OPENGL, stage, with_square_pixels

MIRROR, FLIP = np.diag([-1.0, 1, 1]), np.diag([1.0, -1, 1])
METRES = 1000.0


def changed(change):
    """A change of R and t of each camera, by its (R, t, centre)."""
    return lambda cameras: [
        replace(one, **dict(zip("Rt", change(one.R, one.t, one.centre), strict=True))) for one in cameras
    ]


def in_unit(mm):
    return changed(lambda R, t, C: (R, t / mm))


def in_world(world):
    """The cameras of a world with other axes."""
    W = to_head(world).T
    return changed(lambda R, t, C: (R @ W.T, t))


TO_WORLD = changed(lambda R, t, C: (R.T, C))
CENTRE = changed(lambda R, t, C: (R, C))
GL = changed(lambda R, t, C: (OPENGL @ R, OPENGL @ t))
GL_TO_WORLD = changed(lambda R, t, C: ((OPENGL @ R).T, C))
TRANSPOSED = changed(lambda R, t, C: (R.T, -R.T @ C))
T_FOR_CENTRE = changed(lambda R, t, C: (R, -R @ t))  # a writer of places that writes t
LEFT_HANDED = changed(lambda R, t, C: (FLIP @ R @ MIRROR, FLIP @ t))
REFLECTED = changed(lambda R, t, C: (R @ MIRROR, t))


def both(*changes):
    def apply(cameras):
        for change in changes:
            cameras = change(cameras)
        return cameras

    return apply


def lens(**more):
    return lambda cameras: [replace(one, **more) for one in cameras]


def shifted(cameras):
    """The principal point from the middle of the image."""
    return [replace(one, K=one.K - [[0, 0, one.size[0] / 2], [0, 0, one.size[1] / 2], [0, 0, 0]]) for one in cameras]


def in_parts(cameras):
    return [replace(one, K=one.K / [[one.size[0]], [one.size[1]], [1]]) for one in cameras]


def in_degrees(folder, cameras):
    """As Pose2Sim writes it, its rotation vectors in degrees."""
    path = write.pose2sim(folder, cameras)
    lines = []
    for line in path.read_text().splitlines():
        vector = json.loads(line.split(" = ")[1]) if line.startswith("rotation") else None
        lines.append(f"rotation = {np.degrees(vector).tolist()}" if vector else line)
    path.write_text("\n".join(lines))
    return path


def own(folder, cameras):
    text = ""
    for one in cameras:
        text += f'[[cameras]]\nname = "{one.name}"\nwidth = {one.size[0]}\nheight = {one.size[1]}\n'
        text += f"fx = {one.K[0, 0]:.17g}\nfy = {one.K[1, 1]:.17g}\ncx = {one.K[0, 2]:.17g}\ncy = {one.K[1, 2]:.17g}\n"
        text += f"dist = {list(map(float, one.lens))}\nR = {one.R.tolist()}\nt = {one.t.tolist()}\n"
    (folder / "own.toml").write_text(text)
    return folder / "own.toml"


def half_a_pixel(folder, cameras):
    return write.colmap(folder, cameras, pixel=0.5)


def chunk_metres(folder, cameras):
    return write.metashape(folder, cameras, chunk=(np.eye(3), np.zeros(3), 0.01))


def plain(cameras):
    return cameras


READ = None  # right by itself
FILES = {
    "Pose2Sim in millimetres": (write.pose2sim, plain, READ),
    "Pose2Sim in centimetres": (write.pose2sim, in_unit(10), READ),
    "Pose2Sim in inches": (write.pose2sim, in_unit(25.4), READ),
    "Pose2Sim camera to world": (write.pose2sim, both(in_unit(METRES), TO_WORLD), READ),
    "Pose2Sim with the place for t": (write.pose2sim, both(in_unit(METRES), CENTRE), READ),
    "Pose2Sim with OpenGL's axes": (write.pose2sim, both(in_unit(METRES), GL), READ),
    "Pose2Sim with OpenGL's camera to world": (write.pose2sim, both(in_unit(METRES), GL_TO_WORLD), READ),
    "Pose2Sim in millimetres with OpenGL's camera to world": (write.pose2sim, GL_TO_WORLD, READ),
    "Pose2Sim with R transposed": (write.pose2sim, both(in_unit(METRES), TRANSPOSED), 'pose = "rotation inverted"'),
    "Pose2Sim left-handed": (write.pose2sim, both(in_unit(METRES), LEFT_HANDED), READ),
    "Pose2Sim z up": (write.pose2sim, both(in_unit(METRES), in_world("+z up, facing -y")), READ),
    "Pose2Sim z up, facing +x": (write.pose2sim, both(in_unit(METRES), in_world("+z up, facing +x")), READ),
    "Pose2Sim facing -z": (
        write.pose2sim,
        both(in_unit(METRES), in_world("+y up, facing -z")),
        r"several readings .*world = .*facing -z",
    ),
    "Pose2Sim y down": (write.pose2sim, both(in_unit(METRES), in_world("-y up, facing -z")), READ),
    "Pose2Sim in degrees": (in_degrees, in_unit(METRES), "is in degrees"),
    "OpenCV in metres": (write.opencv, in_unit(METRES), READ),
    "OpenCV in millimetres": (write.opencv, plain, READ),
    "OpenCV camera to world": (write.opencv, TO_WORLD, READ),
    "OpenCV with OpenGL's axes": (write.opencv, GL, READ),
    "OpenCV reflected": (write.opencv, REFLECTED, "left-handed: export it right-handed"),
    "OpenCV, principal point from the middle": (write.opencv, shifted, "count it from the first pixel"),
    "OpenCV, K in parts of the image": (write.opencv, in_parts, "write it in pixels"),
    "OpenCV, focal length in millimetres": (
        write.opencv,
        lens(K=np.array([[35.0, 0, 960], [0, 35, 540], [0, 0, 1]])),
        "px",
    ),
    "OpenCV, height before width": (write.opencv, lens(size=(1080, 1920)), "width before height"),
    "stereo pair in its own axes": (write.stereo, plain, "write the calibration in the head's frame"),
    "EasyMocap in millimetres": (write.easymocap, plain, READ),
    "EasyMocap camera to world": (write.easymocap, both(in_unit(METRES), TO_WORLD), READ),
    "Kalibr in its own axes": (write.kalibr, both(in_unit(METRES), lens(lens=(0.0,) * 4)), "in the head's frame"),
    "COLMAP in metres": (write.colmap, both(in_unit(METRES), lens(lens=(0.01, 0, 0, 0))), READ),
    "COLMAP, pixels from a half": (half_a_pixel, lens(lens=(0.01, 0, 0, 0)), READ),
    "COLMAP camera to world": (write.colmap, both(TO_WORLD, lens(lens=(0.01, 0, 0, 0))), READ),
    "nerfstudio in metres": (write.nerfstudio, in_unit(METRES), READ),
    "nerfstudio world to camera": (write.nerfstudio, changed(lambda R, t, C: (OPENGL @ R.T, -OPENGL @ R.T @ t)), READ),
    "nerfstudio with OpenCV's axes": (lambda f, c: write.nerfstudio(f, c, opengl=False), plain, READ),
    "Metashape, p1 and p2 its own way": (write.metashape, plain, READ),
    "Metashape, chunk in another scale": (chunk_metres, plain, READ),
    "Metashape with OpenGL's axes": (write.metashape, GL, READ),
    "RealityCapture z up in metres": (
        write.reality_xmp,
        both(in_unit(METRES), in_world("+z up, facing -y"), with_square_pixels),
        READ,
    ),
    "RealityCapture table z up": (write.reality_csv, both(in_world("+z up, facing -y"), with_square_pixels), READ),
    "Vicon in metres": (write.vicon, both(in_unit(METRES), lens(lens=(0.0,) * 5)), READ),
    "Vicon with t for the place": (write.vicon, both(T_FOR_CENTRE, lens(lens=(0.0,) * 5)), READ),
    "Vicon z up": (write.vicon, both(in_world("+z up, facing -y"), lens(lens=(0.0,) * 5)), READ),
    "Qualisys z up": (write.qualisys, in_world("+z up, facing -y"), READ),
    "Qualisys in metres": (write.qualisys, in_unit(METRES), READ),
    "KRT in metres": (write.multiface, in_unit(METRES), READ),
    "our own in metres": (own, in_unit(METRES), "fit in metres"),
    "our own camera to world": (own, TO_WORLD, "camera to world: write the inverse"),
    "our own with OpenGL's axes": (own, GL, "OpenGL's axes: negate the second and third row"),
    "our own with the place for t": (own, CENTRE, "t is the place of the camera"),
}


def test_there_are_forty_of_them():
    assert len(FILES) >= 40


@pytest.mark.parametrize("name", FILES)
def test_a_file_in_another_convention_is_read_right_or_names_its_mend(tmp_path, rig, name):
    writer, change, says = FILES[name]
    truth = stage()
    path, said = str(writer(tmp_path, change(truth))), []
    if says is not READ:
        with pytest.raises(RigError, match=says) as refused:
            cameras_for(path, rig.neutral, rig.skin)
        assert "\n" not in str(refused.value)
        return
    with listen(said.extend):
        cameras = cameras_for(path, rig.neutral, rig.skin)
    for camera, known in zip(cameras, truth, strict=True):
        assert camera.position == pytest.approx(known.centre, abs=0.01)
        assert camera.rotation == pytest.approx(known.R, abs=1e-5)
    assert "upright in their pictures" in said[0]


def calibration(known, unit=None):
    cameras = [Camera(k.name, k.centre, k.R, k.K, k.size, np.zeros(5), k.fisheye) for k in known]
    return Calibration("test", tuple(cameras), unit)


@pytest.mark.parametrize("world", WORLDS)
def test_every_world_turns_up_to_y_and_the_face_to_z(world):
    W = to_head(world)
    assert pytest.approx(np.eye(3)) == W @ W.T
    assert np.linalg.det(W) == pytest.approx(1)


def test_where_cameras_look_is_where_their_axes_meet():
    known = [replace(one, R=one.R) for one in stage()]
    meeting = looked_at(calibration(known).cameras)
    assert np.linalg.norm(meeting - [5, 690, 100]) < 10  # they look at x = 0, 5 and 10
    assert looked_at(calibration(known[:1] * 2).cameras) is None


def test_a_rolled_camera_has_the_face_rolled_by_as_much(rig):
    (one,) = calibration(stage()[:1]).cameras
    head = rig.neutral[rig.skin]
    for degrees in (30.0, 90.0, 170.0):
        turned = replace(one, rotation=Rotation.from_euler("z", degrees, degrees=True).as_matrix() @ one.rotation)
        rolled = standing(turned, head).roll - standing(one, head).roll
        assert abs(rolled) == pytest.approx(degrees)


@pytest.mark.parametrize("share", [1, 2, 3])
def test_a_camera_that_looks_elsewhere_does_not_turn_the_others(rig, share):
    """One of four may look at something else; of two or more, nobody knows which are right."""
    known = [*stage(), replace(stage()[0], name="c4")]
    away = calibration(known, "millimetres")
    spun = [
        replace(one, rotation=one.rotation @ Rotation.from_euler("y", 150, degrees=True).as_matrix())
        for one in away.cameras
    ]
    mixed = replace(away, cameras=(*spun[:share], *away.cameras[share:]))
    if share > 1:
        with pytest.raises(RigError):
            find_frame(mixed, rig.neutral[rig.skin], "a")
        return
    found = find_frame(mixed, rig.neutral[rig.skin], "a")
    assert found.convention.words("millimetres") == "nothing"
    assert f"{4 - share} of 4 cameras" in found.said


def test_what_a_person_states_of_a_calibration_is_taken(tmp_path, rig):
    write.pose2sim(tmp_path, both(in_unit(METRES), TRANSPOSED)(stage()))
    own = tmp_path / "own.toml"
    own.write_text('[calibration]\nfile = "Calib.toml"\npose = "rotation inverted"\n')
    cameras = cameras_for(str(own), rig.neutral, rig.skin)
    assert cameras[1].rotation == pytest.approx(stage()[1].R, abs=1e-5)
    (folder := tmp_path / "xmp").mkdir()
    write.reality_xmp(folder, with_square_pixels(stage()), images=False)
    own.write_text('[calibration]\nfile = "xmp"\nsize = [1920, 1080]\nunit = "millimetres"\n')
    assert cameras_for(str(own), rig.neutral, rig.skin)[1].size_px == (1920, 1080)


@pytest.mark.parametrize(
    ("lines", "says"),
    [
        ("unit = 'metres'", "write file = the camera file"),
        ("file = 'none.xcp'", "does not exist"),
        ("file = 'a'\nunit = 'yards'", "unit is 'yards', expected one of millimetres, centimetres, metres, inches"),
        ("file = 'a'\nmirrored = 3", "expected one of true, false"),
        ("file = 'a'\nscale = 3", "unknown key 'scale': known are file, size, unit"),
    ],
)
def test_a_wrong_calibration_table_is_refused_in_one_line(tmp_path, rig, lines, says):
    (tmp_path / "own.toml").write_text("[calibration]\n" + lines)
    with pytest.raises(RigError, match=says):
        cameras_for(str(tmp_path / "own.toml"), rig.neutral, rig.skin)


def test_one_misplaced_camera_is_named_with_its_mend(rig):
    head, (one, *_) = rig.neutral[rig.skin], calibration(stage()).cameras
    assert misplaced(one, head) is None
    aside = Rotation.from_euler("y", 100, degrees=True).as_matrix()
    for wrong, says in (
        (replace(one, position=one.position / 1000), "would fit in metres"),
        (replace(one, position=one.position * [1, 1, -1]), "behind the head"),
        (replace(one, rotation=OPENGL @ one.rotation), "OpenGL's axes"),
        (replace(one, rotation=one.rotation @ aside), "looks past it"),
    ):
        assert says in (misplaced(wrong, head) or "")
