"""Laws of cameras: projection, files, presets, and what they see."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from capture_plan.anatomy.regions import face_regions
from capture_plan.camera import PRESETS, Camera, cameras_for, look_at, read_cameras
from capture_plan.errors import RigError
from capture_plan.sample import sample_rig
from capture_plan.visibility import camera_visibility
from tests.solids import patch, sphere, square, together


@pytest.fixture(autouse=True)
def own_cache(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))


def camera(
    position=(0.0, 0.0, 500.0), target=(0.0, 0.0, 0.0), distortion=(0, 0, 0, 0, 0), focal=1000.0, size=(640, 480)
):
    position = np.array(position, dtype=float)
    middle = [(size[0] - 1) / 2, (size[1] - 1) / 2]
    return Camera(
        name="test",
        position=position,
        rotation=look_at(position, np.array(target, dtype=float)),
        intrinsics=np.array([[focal, 0, middle[0]], [0, focal, middle[1]], [0, 0, 1]]),
        size_px=size,
        distortion=np.array(distortion, dtype=float),
    )


def test_the_target_is_in_the_image_centre_and_the_subjects_left_on_the_right():
    centre, left, top = camera().project(np.array([[0.0, 0, 0], [50, 0, 0], [0, 50, 0]]))
    assert centre == pytest.approx([319.5, 239.5])
    assert left == pytest.approx([419.5, 239.5])  # 1000 px * 50 mm / 500 mm; +x is the subject's left
    assert top == pytest.approx([319.5, 139.5])


def test_behind_the_camera_is_no_pixel():
    assert np.isnan(camera().project(np.array([[0.0, 0, 501]]))).all()


@pytest.mark.parametrize(
    ("which", "coefficient", "moved"),
    [
        (0, 0.2, (0.05, 0.05)),
        (1, 0.4, (0.05, 0.05)),
        (2, 0.2, (0.1, 0.2)),
        (3, 0.2, (0.2, 0.1)),
        (4, 0.8, (0.05, 0.05)),
    ],
)
def test_each_distortion_coefficient_by_hand(which, coefficient, moved):
    """Brown's model at a = b = 0.5, where s = 0.5."""
    distortion = np.zeros(5)
    distortion[which] = coefficient
    bent = camera(distortion=distortion, focal=100).project(np.array([[250.0, -250.0, 0]]))[0]  # image y points down
    assert (bent - [319.5, 239.5]) / 100 - 0.5 == pytest.approx(moved)


@pytest.mark.parametrize(
    ("which", "moved"),
    [
        (0, (0.6 * 0.4, 0.2 * 0.4)),
        (1, (0.6 * 0.4**2, 0.2 * 0.4**2)),
        (2, (2 * 0.6 * 0.2, 0.4 + 2 * 0.2**2)),
        (3, (0.4 + 2 * 0.6**2, 2 * 0.6 * 0.2)),
        (4, (0.6 * 0.4**3, 0.2 * 0.4**3)),
    ],
)
def test_no_distortion_coefficient_takes_a_for_b(which, moved):
    """Brown's model at a = 0.6 and b = 0.2, where s = 0.4."""
    distortion = 0.1 * np.eye(5)[which]
    bent = camera(distortion=distortion, focal=100).project(np.array([[300.0, -100.0, 0]]))[0]
    assert (bent - [319.5, 239.5]) / 100 - [0.6, 0.2] == pytest.approx(0.1 * np.array(moved))


def test_points_beyond_the_fold_of_the_lens_are_not_in_the_image():
    """With k1 = -0.5, r (1 - 0.5 r²) turns back at r = sqrt(2/3): farther points must not come back into the image."""
    lens = camera(distortion=(-0.5, 0, 0, 0, 0), focal=100)
    points = np.array([[0.8 * 500, 0, 0], [0.83 * 500, 0, 0], [1.4 * 500, 0, 0]])
    assert lens.in_image(points).tolist() == [True, False, False]


def test_the_image_ends_half_a_pixel_beyond_the_centres_of_its_outermost_pixels():
    """At 1 pixel in a millimetre the image of 640 x 480 is 640 x 480 mm, its middle at the target."""
    near, far = (np.array([[side * x, 0, 0] for side in (1, -1)]) for x in (319.9, 320.1))
    low, high = (np.array([[0, side * y, 0] for side in (1, -1)]) for y in (239.9, 240.1))
    one = camera(focal=500.0)
    assert one.in_image(np.vstack([near, low])).all()
    assert not one.in_image(np.vstack([far, high])).any()
    exact = camera(position=(0.0, 0.0, 512.0), focal=512.0)  # powers of two: nothing is rounded
    ends = np.array([[-320.0, 0, 0], [0, 240, 0], [320, 0, 0], [0, -240, 0]])
    assert exact.in_image(ends).tolist() == [True, True, False, False]  # left and top belong to the image


def test_a_camera_sees_exactly_the_cap_of_a_sphere():
    """From distance d of the centre a sphere of radius r shows where cos(theta) > r / d."""
    vertices, triangles = sphere(60, 90)
    at = np.arange(len(vertices))
    for position in ([0, 0, 250], [300, 100, -200], [0, 110, 1]):
        eye = np.array(position, dtype=float)
        seen = camera_visibility(
            vertices, np.zeros((1, len(vertices), 3)), triangles, at, [camera(eye, focal=50.0, size=(4000, 4000))]
        )
        cosine = vertices @ eye / 100 / np.linalg.norm(eye)
        edge = np.abs(cosine - 100 / np.linalg.norm(eye)) < 0.005  # the polyhedron's own normals
        assert np.array_equal(seen[~edge] == 1, cosine[~edge] > 100 / np.linalg.norm(eye))
        assert 0 < seen.mean() < 0.5


def test_what_lies_behind_the_camera_hides_nothing_and_what_lies_before_it_does():
    eye = np.array([0.0, 100, 1])
    for height, share in ((50, 0), (150, 1)):
        mesh = together(patch(), square((0, height, 0), (30, 0, 0), (0, 0, -30)))
        seen = camera_visibility(mesh[0], np.zeros((1, len(mesh[0]), 3)), mesh[1], np.array([0]), [camera(eye)])
        assert seen[0] == share


def test_outside_the_image_is_not_seen():
    vertices, triangles = patch()
    still = np.zeros((1, len(vertices), 3))
    away = camera((0.0, 100, 1), target=(200.0, 0, 0))
    assert camera_visibility(vertices, still, triangles, np.array([0]), [away])[0] == 0


def test_share_of_cameras_and_least_over_shapes():
    """Three cameras, two of them in front; a blendshape that turns the patch over is seen by the third alone."""
    vertices, triangles = patch()
    cameras = [camera((x, y, 1.0)) for x, y in ((0.0, 100.0), (30.0, 100.0), (0.0, -100.0))]
    over = np.stack([np.zeros_like(vertices), vertices * [-2.0, 0, 0]])
    at = np.array([0])
    assert camera_visibility(vertices, over[:1], triangles, at, cameras)[0] == pytest.approx(2 / 3)
    assert camera_visibility(vertices, over, triangles, at, cameras)[0] == pytest.approx(1 / 3)


FILE = """
[[cameras]]
name = "top"
width = 640
height = 480
fx = 900.0
fy = 910
dist = [0.1, 0, 0, 0]
R = [[1, 0, 0], [0, -1, 0], [0, 0, -1]]
t = [0, 10, 500]

[[cameras]]
name = "turned"
width = 640
height = 480
fx = 900.0
fy = 910.0
cx = 300.0
cy = 200.0
rvec = [3.141592653589793, 0, 0]
t = [0, 10, 500]

[[cameras]]
name = "by tape"
width = 640
height = 480
fx = 900.0
fy = 910.0
position = [0, 10, 500]
look_at = [0, 10, 0]
"""


def test_a_file_gives_the_same_camera_by_matrix_by_vector_and_by_tape(tmp_path):
    path = tmp_path / "rig.toml"
    path.write_text(FILE)
    top, turned, tape = read_cameras(path).cameras
    assert (top.name, top.size_px) == ("top", (640, 480))
    assert top.position == pytest.approx([0, 10, 500])
    for other in (turned, tape):
        assert np.allclose(top.rotation, other.rotation)
        assert np.allclose(top.position, other.position)
    assert top.distortion.tolist() == [0.1, 0, 0, 0, 0]
    assert top.intrinsics[:2, 2].tolist() == [319.5, 239.5]
    assert turned.intrinsics[:2, 2].tolist() == [300, 200]
    for one in (top, turned, tape):
        assert one.intrinsics[:, :2].tolist() == [[900, 0], [0, 910], [0, 0]]
        assert one.intrinsics[2, 2] == 1


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("[[cameras]]", "[[kameras]]", "has no cameras"),
        (FILE, "", "has no cameras"),
        ('"top"', "top", "is not TOML"),
        ("width = 640", "", "'width' is missing"),
        ("width = 640", "width = 640.5", "whole number of pixels, found 640.5"),
        ("fx = 900.0", "fx = -1", "above 0 pixels"),
        ("fx = 900.0", 'fx = "wide"', "'fx' must be one number, found wide"),
        ("fx = 900.0", "f = 900.0", "unknown key 'f'"),
        ("fy = 910\n", "fy = nan\n", "'fy' must be one number"),
        ("fy = 910\n", f"fy = 1{'0' * 400}\n", "'fy' must be one number"),
        ("fy = 910\n", "fy = 1e200\n", "'fy' must be one number below 1e"),
        ("R = [[1, 0, 0], [0, -1, 0], [0, 0, -1]]", "R = [[1, 0], [0, 1]]", "'R' must be 3x3 numbers"),
        ("[0, 0, -1]]", "[0, 0, 1]]", "not a rotation"),
        ("t = [0, 10, 500]", "", "its pose is given by R: give R and t or"),
        ("look_at = [0, 10, 0]", "look_at = [0, 90, 500]", "straight up or down"),
        ('"turned"', '"top"', "two cameras are called 'top'"),
        ("dist = [0.1, 0, 0, 0]", "dist = [0.1, 0]", "'dist' must be 4 numbers or 5 numbers"),
    ],
)
def test_a_bad_camera_file_is_refused_in_one_line(tmp_path, old, new, message):
    path = tmp_path / "rig.toml"
    path.write_text(FILE.replace(old, new))
    with pytest.raises(RigError, match=message.replace("[", r"\[")) as error:
        read_cameras(path)
    assert "\n" not in str(error.value)


def test_a_missing_or_binary_file_is_refused_in_one_line(tmp_path):
    (tmp_path / "noise.toml").write_bytes(bytes(range(256)))
    for path in (tmp_path / "noise.toml", tmp_path / "none.toml", tmp_path):
        with pytest.raises(RigError, match=r"is not TOML|does not exist|is a folder"):
            read_cameras(path)
    with pytest.raises(RigError, match="neither a file nor one of phone, frontal, head-mounted"):
        cameras_for("frontel", np.zeros((3, 3)), np.ones(3, dtype=bool))


AHEAD = [name for name in PRESETS if not name.endswith("-N")]


@pytest.mark.parametrize("preset", ["ring-5", "dome-24"])
def test_a_ring_or_a_dome_has_as_many_cameras_as_its_name_says_all_aimed_at_the_philtrum(preset):
    rig = sample_rig()
    cameras = cameras_for(preset, rig.neutral, rig.skin)
    assert len(cameras) == int(preset.split("-")[1])
    for one in cameras:
        middle = (np.array(one.size_px) - 1) / 2
        assert one.project(np.array([[0.0, 686.0, 143.0]]))[0] == pytest.approx(middle, abs=0.03 * one.size_px[1])


@pytest.mark.parametrize("preset", ["ring-N", "dome-N"])
def test_a_ring_without_a_number_asks_for_one(preset):
    rig = sample_rig()
    with pytest.raises(RigError, match=r"without a number: write how many, as (ring|dome)-12"):
        cameras_for(preset, rig.neutral, rig.skin)


@pytest.mark.parametrize("preset", AHEAD)
def test_presets_show_the_upper_philtrum_in_the_middle_and_the_whole_face(preset):
    rig = sample_rig()
    face = rig.neutral[rig.skin & (rig.neutral[:, 2] > 80) & (rig.neutral[:, 1] > 640)]
    for one in cameras_for(preset, rig.neutral, rig.skin):
        assert one.in_image(face).mean() > 0.98
        middle = (np.array(one.size_px) - 1) / 2
        philtrum = np.array([[0.0, 686.0, 143.0]])  # between the base of the nose and the upper lip of the sample
        assert np.linalg.norm(one.project(philtrum)[0] - middle) < 0.03 * one.size_px[1]
        assert one.position[2] > face[:, 2].max()


def test_a_camera_file_is_read_by_name(tmp_path):
    (tmp_path / "own.toml").write_text(FILE)
    assert len(cameras_for(str(tmp_path / "own.toml"), np.zeros((3, 3)), np.ones(3, dtype=bool))) == 3


def test_a_rotation_that_mirrors_is_refused():
    with pytest.raises(RigError, match="not a rotation"):
        Camera("m", np.zeros(3), np.diag([1.0, 1, -1]), np.eye(3), (10, 10), np.zeros(5))
    turned = Rotation.from_rotvec([0.1, 0.2, 0.3]).as_matrix()
    assert Camera("r", np.zeros(3), turned, np.eye(3), (10, 10), np.zeros(5)).name == "r"


def head_mounted(tmp_path, lines, rig):
    path = tmp_path / "boom.toml"
    path.write_text("[head_mounted]\n" + lines)
    return cameras_for(str(path), rig.neutral, rig.skin)


def test_an_empty_head_mounted_table_is_the_preset(tmp_path):
    rig = sample_rig()
    preset = cameras_for("head-mounted-pair", rig.neutral, rig.skin)
    for one, other in zip(head_mounted(tmp_path, "", rig), preset, strict=True):
        assert one.name == other.name
        assert np.array_equal(one.numbers, other.numbers)


def test_a_head_mounted_pair_is_built_as_measured(tmp_path):
    rig = sample_rig()
    lines = "boom_mm = 210\nrise_mm = 15\nbaseline_mm = 80\nfield_degrees = 90\nwidth = 1000\nheight = 600\n"
    top, bottom = head_mounted(tmp_path, lines, rig)
    assert (top.position - bottom.position).tolist() == pytest.approx([0, 80, 0])
    assert top.intrinsics[1, 1] == pytest.approx(300)  # half the height over tan 45 degrees
    assert top.size_px == (1000, 600)
    philtrum = top.position - [0, 15, 210]
    for one in (top, bottom):
        assert one.project(philtrum[None])[0] == pytest.approx([499.5, 299.5])
    left, right = head_mounted(tmp_path, lines + "side_by_side = true", rig)
    assert (left.position - right.position).tolist() == pytest.approx([80, 0, 0])
    (single,) = head_mounted(tmp_path, "baseline_mm = 0", rig)
    assert single.name == "boom"


@pytest.mark.parametrize("preset", AHEAD)
def test_presets_see_brows_and_mouth_corners_at_rest(preset):
    rig = sample_rig()
    regions = face_regions(rig)
    for one in cameras_for(preset, rig.neutral, rig.skin):
        corners = np.stack([regions.anchors.corner_left, regions.anchors.corner_right])
        brows = rig.neutral[regions.of_vertex == regions.names.index("brow")]
        assert one.in_image(corners).all()
        assert one.in_image(brows).all()


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        ("boom = 210", "write a table with some of boom_mm"),
        ("boom_mm = -1", "boom_mm must be above 0"),
        ("boom_mm = 'near'", "'boom_mm' must be one number"),
        ("field_degrees = 180", "between 0 and 180"),
        ("side_by_side = 1", "true or false"),
        ("width = 0", "whole number of pixels"),
        ("[[cameras]]\nname = 'top'", "keep the one that you measured"),
    ],
)
def test_a_bad_head_mounted_table_is_refused_in_one_line(tmp_path, lines, message):
    with pytest.raises(RigError, match=message) as error:
        head_mounted(tmp_path, lines, sample_rig())
    assert "\n" not in str(error.value)
