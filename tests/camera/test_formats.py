"""Every format gives the pixels that OpenCV gives, to a hundredth of one; its traps; what is refused."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from capture_plan.camera import Camera, read_cameras
from capture_plan.errors import RigError
from tests.camera import camera_files as write
from tests.camera.camera_files import stage, with_square_pixels

OFF_PX = 0.01
RATIONAL = (0.3, -0.1, 0.001, -0.002, 0.05, 0.28, -0.08, 0.02)
PRISM = (*RATIONAL, 0.002, -0.001, 0.0015, 0.0007)
TILT = (*PRISM, 0.02, -0.03)
FISHEYE = (0.02, -0.01, 0.003, -0.0006)
LENSES = {"brown": stage()[0].lens, "rational": RATIONAL, "prism": PRISM, "tilt": TILT, "fisheye": FISHEYE}


@pytest.fixture(scope="module")
def points():
    """Places round the head, millimetres, all of them in front of every camera."""
    return np.random.default_rng(0).uniform([-90, 570, 20], [90, 800, 160], (200, 3))


def off(read, cameras, points, mm=1.0):
    """The most that pixels of cameras differ from OpenCV's; points in the file's world and unit."""
    assert len(read.cameras) == len(cameras)
    found = [one.project(points * mm) - known.pixels(points) for one, known in zip(read.cameras, cameras, strict=True)]
    return np.abs(found).max()


@pytest.mark.parametrize("kind", LENSES)
def test_a_lens_bends_as_opencv_says_and_back(kind, points):
    known = stage(lens=LENSES[kind], fisheye=kind == "fisheye")[1]
    camera = Camera("a", known.centre, known.R, known.K, known.size, np.array(known.lens), known.fisheye)
    pixels = camera.project(points)
    assert np.abs(pixels - known.pixels(points)).max() < 1e-6
    way = points - camera.position
    assert camera.rays(pixels) == pytest.approx(way / np.linalg.norm(way, axis=1, keepdims=True), abs=1e-9)


def test_a_fisheye_sees_beyond_a_right_angle_and_no_further_than_its_fold():
    camera = Camera("a", np.zeros(3), np.eye(3), np.diag([300.0, 300, 1]), (99, 99), np.array([0, 0, 0, 0.0]), True)
    beside, behind = np.array([[1.0, 0, -0.1]]), np.array([[0.0, 0, -1]])
    assert camera.project(beside)[0, 0] == pytest.approx(300 * (np.pi / 2 + np.arctan(0.1)))
    assert np.isnan(camera.project(behind)).all()
    folding = replace(
        camera, distortion=np.array([-0.2, 0, 0, 0])
    )  # theta (1 - 0.2 theta²) turns at sqrt(1/0.6) = 74 degrees
    assert np.isfinite(folding.project(np.array([[3.0, 0, 1]]))).all()
    assert np.isnan(folding.project(np.array([[4.0, 0, 1]]))).all()


def test_pixels_that_no_direction_reaches_have_no_ray():
    camera = Camera("a", np.zeros(3), np.eye(3), np.diag([100.0, 100, 1]), (99, 99), np.array([-0.5, 0, 0, 0, 0]))
    assert np.isfinite(camera.rays(np.array([[50.0, 0]]))).all()
    assert np.isnan(camera.rays(np.array([[60.0, 0]]))).all()  # r (1 - 0.5 r²) is at most 0.544


@pytest.mark.parametrize(
    ("kind", "size", "fisheye"), [("brown", 5, False), ("rational", 8, False), ("fisheye", 4, True)]
)
def test_pose2sim(tmp_path, points, kind, size, fisheye):
    cameras = stage(1000.0, lens=LENSES[kind], fisheye=fisheye)
    read = read_cameras(write.pose2sim(tmp_path, cameras))
    assert (read.unit, len(read.cameras[0].distortion)) == ("metres", size)
    assert off(read, cameras, points / 1000, 1000) < OFF_PX
    assert [camera.name for camera in read.cameras] == ["c1", "c2", "c3"]


@pytest.mark.parametrize("kind", ["yml", "xml", "json"])
@pytest.mark.parametrize("lens", LENSES)
def test_opencv_storage(tmp_path, points, kind, lens):
    cameras = stage(lens=LENSES[lens], fisheye=lens == "fisheye")
    read = read_cameras(write.opencv(tmp_path, cameras, kind))
    assert off(read, cameras, points) < OFF_PX
    assert read.cameras[0].size_px == (1920, 1080)
    assert (read.format, read.unit) == ("OpenCV", None)


def test_four_numbers_of_a_lens_have_no_k3(tmp_path):
    read = read_cameras(write.opencv(tmp_path, stage(lens=(0.1, 0.2, 0.3, 0.4))))
    assert read.cameras[0].distortion.tolist() == [0.1, 0.2, 0.3, 0.4, 0]


@pytest.mark.parametrize("kind", ["yml", "xml", "json"])
def test_a_stereo_pair_stands_in_the_axes_of_its_first_camera(tmp_path, points, kind):
    cameras = stage()
    read = read_cameras(write.stereo(tmp_path, cameras, kind))
    one = cameras[0]
    for camera, known in zip(read.cameras, cameras, strict=False):
        assert np.abs(camera.project(points @ one.R.T + one.t) - known.pixels(points)).max() < OFF_PX
    assert read.cameras[0].position.tolist() == [0, 0, 0]


def test_a_script_in_json_may_give_plain_lists(tmp_path, points):
    import json

    (known,) = stage()[:1]
    entry = {"K": known.K.tolist(), "dist": list(known.lens), "R": known.R.tolist(), "t": known.t.tolist()}
    (tmp_path / "a.json").write_text(json.dumps({"left eye": entry | {"image_size": [1920, 1080]}}))
    read = read_cameras(tmp_path / "a.json")
    assert off(read, [known], points) < OFF_PX
    assert read.cameras[0].name == "left eye"


@pytest.mark.parametrize("matrix", [False, True])
def test_easymocap_from_either_file_or_the_folder(tmp_path, points, matrix):
    cameras = stage(1000.0)
    write.easymocap(tmp_path, cameras, matrix)
    for path in (tmp_path, tmp_path / "intri.yml", tmp_path / "extri.yml"):
        read = read_cameras(path)
        assert off(read, cameras, points / 1000, 1000) < OFF_PX
        assert [camera.name for camera in read.cameras] == ["01", "02", "03"]  # leading zeros stay


@pytest.mark.parametrize("lens", ["brown", "fisheye"])
def test_kalibr_multiplies_its_chain(tmp_path, points, lens):
    cameras = stage(1000.0, lens=LENSES[lens][:4], fisheye=lens == "fisheye")
    read = read_cameras(write.kalibr(tmp_path, cameras))
    one = cameras[0]
    for camera, known in zip(read.cameras, cameras, strict=True):
        in_first = (points / 1000) @ one.R.T + one.t
        assert np.abs(camera.project(1000 * in_first) - known.pixels(points / 1000)).max() < OFF_PX


def test_kalibrs_omni_is_refused_by_name(tmp_path):
    path = write.kalibr(tmp_path, stage())
    path.write_text(path.read_text().replace("pinhole", "omni"))
    with pytest.raises(RigError, match=r"omni-radtan is not read.*pinhole-equi"):
        read_cameras(path)


@pytest.mark.parametrize("binary", [False, True])
@pytest.mark.parametrize("model", write.COLMAP)
def test_colmap(tmp_path, points, model, binary):
    lens = {"PINHOLE": (0.0,) * 5, "SIMPLE_RADIAL": (0.05, 0, 0, 0, 0), "RADIAL": (0.05, -0.02, 0, 0, 0)}
    lens |= {"OPENCV": (0.05, -0.02, 0.001, 0.002), "FULL_OPENCV": RATIONAL, "OPENCV_FISHEYE": FISHEYE}
    cameras = stage(lens=lens[model], fisheye=model == "OPENCV_FISHEYE")
    cameras = with_square_pixels(cameras) if "RADIAL" in model else cameras
    folder = write.colmap(tmp_path, cameras, model, binary)
    read = read_cameras(folder)
    assert off(read, cameras, points) < OFF_PX
    assert read.unit is None  # its scale is arbitrary
    assert [camera.name for camera in read.cameras] == ["c1", "c2", "c3"]
    assert off(read_cameras(folder / f"images.{'bin' if binary else 'txt'}"), cameras, points) < OFF_PX


def test_colmaps_first_pixel_has_its_centre_at_a_half(tmp_path, points):
    cameras = stage(lens=(0.0,) * 5)
    read = read_cameras(write.colmap(tmp_path, cameras, pixel=0.0))
    shift = read.cameras[0].project(points) - cameras[0].pixels(points)
    assert shift == pytest.approx(np.full((200, 2), -0.5), abs=1e-6)


@pytest.mark.parametrize(
    ("lens", "k4"), [("brown", 0.0), ("brown", 0.03), ("fisheye", 0.0)], ids=["k3", "k4", "fisheye"]
)
def test_nerfstudio(tmp_path, points, lens, k4):
    cameras = stage(lens=LENSES[lens], fisheye=lens == "fisheye")
    read = read_cameras(write.nerfstudio(tmp_path, cameras, k4))
    if not k4:
        assert off(read, cameras, points) < OFF_PX
    for camera, known in zip(read.cameras, cameras, strict=True):
        assert np.abs(camera.project(points) - with_k4(known, k4, points)).max() < OFF_PX
    assert any("documents disagree" in note for note in read.notes)


def with_k4(known, k4, points):
    """OpenCV's pixels, and what a factor k4 of r⁸ adds to them."""
    x, y, z = (points @ known.R.T + known.t).T
    r8 = ((x / z) ** 2 + (y / z) ** 2) ** 4
    return known.pixels(points) + np.stack([x / z * k4 * r8, y / z * k4 * r8], axis=1) @ known.K[:2, :2].T


def test_what_nerfstudio_did_to_the_world_is_undone(tmp_path, points):
    cameras = stage()
    applied = write.four(Rotation.from_rotvec([1.2, 0.3, -0.4]).as_matrix(), [3.0, 4, 5])
    assert off(read_cameras(write.nerfstudio(tmp_path, cameras, applied=applied)), cameras, points) < OFF_PX


@pytest.mark.parametrize(("lens", "k4"), [("brown", 0.0), ("brown", 0.03), ("fisheye", 0.0)])
def test_metashape_with_its_offsets_scale_and_swapped_tangentials(tmp_path, points, lens, k4):
    cameras = stage(lens=LENSES[lens], fisheye=lens == "fisheye")
    read = read_cameras(write.metashape(tmp_path, cameras, k4))
    for camera, known in zip(read.cameras, cameras, strict=True):
        assert np.abs(camera.project(points) - with_k4(known, k4, points)).max() < OFF_PX
    assert any("lost" in note for note in read.notes)  # a camera that was not aligned
    assert any("k1 to k4" in note for note in read.notes) == bool(k4)


def test_metashapes_p1_is_opencvs_p2(tmp_path):
    cameras = stage(lens=(0, 0, 0.001, 0.007, 0))
    path = write.metashape(tmp_path, cameras, swapped=True)
    assert "<p1>0.0070000" in path.read_text()
    assert read_cameras(path).cameras[0].distortion.tolist() == [0, 0, 0.001, 0.007, 0]


def test_metashapes_skew_is_kept(tmp_path, points):
    K = np.array([[1400.0, 2.5, 955], [0, 1390, 537], [0, 0, 1]])
    (known,) = stage(K=K, lens=(0.0,) * 5)[:1]
    (camera,) = read_cameras(write.metashape(tmp_path, [known])).cameras
    seen = (points @ known.R.T + known.t) @ K.T
    assert camera.project(points) == pytest.approx(seen[:, :2] / seen[:, 2:], abs=OFF_PX)


@pytest.mark.parametrize("k4", [0.0, 0.03])
def test_reality_capture_table(tmp_path, points, k4):
    cameras = with_square_pixels(stage())
    read = read_cameras(write.reality_csv(tmp_path, cameras, k4))
    for camera, known in zip(read.cameras, cameras, strict=True):
        assert np.abs(camera.project(points) - with_k4(known, k4, points)).max() < OFF_PX
    assert read.cameras[0].size_px == (1920, 1080)


def test_a_size_that_no_image_tells_is_asked_for(tmp_path, points):
    cameras = with_square_pixels(stage())
    path = write.reality_csv(tmp_path, cameras, images=False)
    with pytest.raises(RigError, match=r"does not hold the size.*\[calibration\]"):
        read_cameras(path)
    assert off(read_cameras(path, size_px=(1920, 1080)), cameras, points) < OFF_PX


@pytest.mark.parametrize("attributes", [False, True])
def test_reality_capture_sidecars(tmp_path, points, attributes):
    cameras = with_square_pixels(stage())
    read = read_cameras(write.reality_xmp(tmp_path, cameras, attributes))
    assert off(read, cameras, points) < OFF_PX
    assert off(read_cameras(tmp_path / "c2.xmp"), cameras[1:2], points) < OFF_PX


def test_reality_captures_division_model_straightens(tmp_path, points):
    """straight = bent / (1 + k1 bent²): brought back from OpenCV's pixels of the straight camera."""
    (known,) = with_square_pixels(stage(lens=(0.0,) * 5))[:1]
    write.reality_xmp(tmp_path, [known], model="division", coefficients=(-0.15, 0, 0, 0, 0, 0))
    (camera,) = read_cameras(tmp_path / "c1.xmp").cameras
    bent = (camera.project(points) - known.K[:2, 2]) / known.K[0, 0]
    straight = bent / (1 - 0.15 * (bent**2).sum(axis=1, keepdims=True))
    assert straight * known.K[0, 0] + known.K[:2, 2] == pytest.approx(known.pixels(points), abs=OFF_PX)


RADIAL = {
    "two": ('VICON_RADIAL="2e-8 3e-15"', (2e-8, 3e-15, 0)),
    "three": ('VICON_RADIAL2="Vicon3Parameter {cx} {cy} -3e-8 4e-15 1e-21"', (-3e-8, 4e-15, 1e-21)),
}


def test_vicon_without_a_lens_model(tmp_path, points):
    cameras = stage(lens=(0.0,) * 5)
    read = read_cameras(write.vicon(tmp_path, cameras))
    assert off(read, cameras, points) < OFF_PX
    assert read.unit == "millimetres"
    assert any("not calibrated" in note for note in read.notes)


@pytest.mark.parametrize("kind", RADIAL)
def test_vicons_lens_straightens_where_opencvs_bends(tmp_path, points, kind):
    """What it corrects the pixels to are OpenCV's pixels of the straight camera."""
    cameras = with_square_pixels(stage(lens=(0.0,) * 5))
    text, (k1, k2, k3) = RADIAL[kind]
    read = read_cameras(write.vicon(tmp_path, cameras, text))
    for camera, known in zip(read.cameras, cameras, strict=True):
        d = camera.project(points) - known.K[:2, 2]
        r = (d**2).sum(axis=1, keepdims=True)
        corrected = known.K[:2, 2] + d * (1 + k1 * r + k2 * r**2 + k3 * r**3)
        assert np.abs(corrected - known.pixels(points)).max() < OFF_PX
        assert np.abs(d + known.K[:2, 2] - known.pixels(points)).max() > 0.5
    assert any("Vicon's radial" in note for note in read.notes)


def test_a_vicon_lens_that_is_not_about_the_principal_point_is_told(tmp_path):
    radial = 'VICON_RADIAL2="Vicon3Parameter 900 500 -3e-8 0 0"'
    read = read_cameras(write.vicon(tmp_path, stage(lens=(0.0,) * 5), radial))
    assert any("not carried over" in note for note in read.notes)


def test_vicons_quaternion_has_w_last(tmp_path, points):
    cameras = stage(lens=(0.0,) * 5)
    with_w_first = read_cameras(write.vicon(tmp_path, cameras, w_last=False))
    assert off(with_w_first, cameras, points[:1]) > 100 or np.isnan(off(with_w_first, cameras, points[:1]))


def test_qualisys_with_its_64ths_offsets_and_rows(tmp_path, points):
    cameras = stage()
    read = read_cameras(write.qualisys(tmp_path, cameras))
    assert off(read, cameras, points) < OFF_PX
    assert read.cameras[0].size_px == (1920, 1080)


def test_a_qualisys_file_in_whole_pixels_is_refused(tmp_path):
    with pytest.raises(RigError, match="expected 64ths of a pixel"):
        read_cameras(write.qualisys(tmp_path, stage(), parts=1))


def test_multiface(tmp_path, points):
    cameras = stage()
    read = read_cameras(write.multiface(tmp_path, cameras))
    assert off(read, cameras, points) < OFF_PX
    assert any("image sizes" in note for note in read.notes)


def test_a_format_is_told_by_what_a_file_holds(tmp_path):
    for number, (writer, called) in enumerate(
        [
            (write.vicon, "Vicon"),
            (write.metashape, "Agisoft"),
            (write.qualisys, "Qualisys"),
            (write.nerfstudio, "nerfstudio"),
            (write.opencv, "OpenCV"),
            (write.kalibr, "Kalibr"),
            (write.multiface, "Multiface"),
        ]
    ):
        (folder := tmp_path / str(number)).mkdir()
        path = writer(folder, stage())
        renamed = path.rename(folder / ("file.yaml" if path.suffix in (".yml", ".yaml") else "file.dat"))
        assert read_cameras(renamed).format.startswith(called)


BOMB = '<?xml version="1.0"?><!DOCTYPE a [<!ENTITY b "ha"><!ENTITY c "&b;&b;">]><Cameras>&c;</Cameras>'


@pytest.mark.parametrize(
    ("name", "text", "says"),
    [
        ("a.xml", BOMB, "document type or entities"),
        ("a.xml", "<Cameras><Camera></Cameras>", "is not XML"),
        ("a.xml", "<html><p>hello</p></html>", "root is <html>"),
        ("a.yml", "a: &x [1]\nb: *x\n", "holds an alias"),
        ("a.yml", "a: !!python/object/apply:os.system ['true']\n", "not plain YAML"),
        ("a.yml", "[" * 5000, "not plain YAML"),
        ("a.yml", "a: 1\n" * 300_000, "expected at most 1,000,000"),
        ("a.yml", "- 1\n- 2\n", "expected camera_matrix"),
        ("a.yml", "x: 1\n", "has no cameras: found x"),
        ("a.json", "{" * 5000, "is not JSON"),
        ("a.json", '{"frames": 3}', "'frames' must be a list"),
        ("a.json", '{"frames": [{"file_path": "a"}]}', "'w' is missing"),
        ("a.txt", "hello\n", "no format that is known here"),
        ("cameras.txt", "1 PINHOLE wide 3\n", "expected CAMERA_ID MODEL WIDTH HEIGHT"),
        ("a.json", '{"K": [[900, 0, 320], [0, 900, 240], [0, 0, 1]]}', "not where the camera stands"),
        ("a.json", '{"K": [[900, 0, 0.5], [0, 900, 0.5], [0, 0, 1]], "R": [0, 0, 0], "t": [0, 0, 1]}', "in pixels"),
        (
            "a.json",
            '{"K": [[900, 0, 320], [0, 900, 240], [0, 0, 1]], "R": [0, 180, 0], "t": [0, 0, 1]}',
            "is in degrees",
        ),
        (
            "a.json",
            '{"K": [[900, 0, 320], [0, 900, 240], [0, 0, 1]], "R": [-1, 0, 0, 0, 1, 0, 0, 0, 1], "t": [0, 0, 1]}',
            "mirrors",
        ),
    ],
)
def test_what_no_camera_file_is_is_refused_in_one_line(tmp_path, name, text, says):
    (tmp_path / name).write_text(text)
    (tmp_path / "images.txt").write_text("")
    with pytest.raises(RigError, match=says.replace("(", r"\(")) as refused:
        read_cameras(tmp_path / name)
    assert "\n" not in str(refused.value)
    assert name in str(refused.value)


@pytest.mark.parametrize("keep", [3, 20, 100, 300])
def test_a_binary_model_that_was_cut_off_is_refused(tmp_path, keep):
    write.colmap(tmp_path, stage(), binary=True)
    (tmp_path / "images.bin").write_bytes((tmp_path / "images.bin").read_bytes()[:keep])
    with pytest.raises(RigError, match="ends too early"):
        read_cameras(tmp_path)


def test_a_lens_that_colmap_alone_knows_is_refused_by_name(tmp_path):
    write.colmap(tmp_path, stage())
    path = tmp_path / "cameras.txt"
    path.write_text(path.read_text().replace("OPENCV", "FOV"))
    with pytest.raises(RigError, match="FOV is not read: expected one of SIMPLE_PINHOLE"):
        read_cameras(tmp_path)


def test_a_folder_without_cameras_says_what_is_expected(tmp_path):
    with pytest.raises(RigError, match=r"expected intri\.yml and extri\.yml"):
        read_cameras(tmp_path)


def test_undistorting_agrees_with_opencv(points):
    for kind in ("brown", "rational"):
        known = stage(lens=LENSES[kind])[0]
        camera = Camera("a", known.centre, known.R, known.K, known.size, np.array(known.lens))
        pixels = camera.project(points)
        criteria = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 100, 1e-12)
        bent = pixels.reshape(-1, 1, 2), known.K, np.array(known.lens)
        plain = cv2.undistortPoints(*bent, R=np.eye(3), P=np.eye(3), criteria=criteria).reshape(-1, 2)
        rays = camera.rays(pixels) @ camera.rotation.T
        assert rays[:, :2] / rays[:, 2:] == pytest.approx(plain, abs=OFF_PX / 1400)
