"""A calibration is laid on the head by places of it, or by what its cameras look at; and a head that may slip."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from capture_plan.camera import UNITS, Camera, Slip, camera_of, cameras_for, own_text, read_cameras, recorded
from capture_plan.errors import RigError
from capture_plan.progress import listen
from capture_plan.registration.picked_points import named_vertices
from capture_plan.visibility import SEEN, Sight
from capture_plan.visibility.occluder import Occluder
from capture_plan.visibility.seen import seen_by, sights
from tests.camera import camera_files as write
from tests.camera.camera_files import stage
from tests.camera.test_frames import GL, LEFT_HANDED, MIRROR, TRANSPOSED, both, changed, in_unit

NAMES = ("nose_tip", "eye_outer_left", "eye_outer_right", "mouth_left", "chin")
ALIGN = "[calibration]\nfile = 'Calib.toml'\n{more}\n[align]\n"


@pytest.fixture(scope="module")
def places(rig):
    found = named_vertices(rig)
    return {name: rig.neutral[found[name]] for name in NAMES}


def somewhere(seed):
    """A rotation Q and a shift c (mm) of the world: x becomes Q x + c."""
    rng = np.random.default_rng(seed)
    return Rotation.from_quat(rng.normal(size=4)).as_matrix(), rng.uniform(-3000, 3000, 3)


def moved(Q, c):
    """The cameras in the moved world."""
    return changed(lambda R, t, C: (R @ Q.T, -R @ Q.T @ (Q @ C + c)))


def table(places, Q, c, mm=1.0, more=""):
    return ALIGN.format(more=more) + "\n".join(f"{name} = {((Q @ p + c) / mm).tolist()}" for name, p in places.items())


def aligned(folder, rig, places, text):
    (folder / "own.toml").write_text(text)
    return cameras_for(str(folder / "own.toml"), rig.neutral, rig.skin, lambda: places)


def same_places(cameras, within=0.01, turned=1e-4):
    for one, truth in zip(cameras, stage(), strict=True):
        assert np.linalg.norm(one.position - truth.centre) < within
        assert np.abs(one.rotation - truth.R).max() < turned


@pytest.mark.parametrize("seed", range(4))
def test_places_of_the_head_undo_any_motion_of_the_world(tmp_path, rig, places, seed):
    Q, c = somewhere(seed)
    write.pose2sim(tmp_path, both(moved(Q, c), in_unit(1000))(stage()))
    same_places(aligned(tmp_path, rig, places, table(places, Q, c, 1000)))


@pytest.mark.parametrize("unit", ["millimetres", "centimetres", "inches"])
def test_a_wrong_unit_of_the_file_is_found_by_the_places(tmp_path, rig, places, unit):
    """The format says metres."""
    Q, c = somewhere(5)
    write.pose2sim(tmp_path, both(moved(Q, c), in_unit(UNITS[unit]))(stage()))
    said = []
    with listen(said.extend):
        same_places(aligned(tmp_path, rig, places, table(places, Q, c, UNITS[unit])))
    assert f"its lengths are {unit}, as the places of the head tell, not metres" in " ".join(said)


@pytest.mark.parametrize("axes", [GL, TRANSPOSED])
def test_axes_and_poses_that_are_meant_otherwise_are_found_beside_the_places(tmp_path, rig, places, axes):
    Q, c = somewhere(6)
    write.pose2sim(tmp_path, both(moved(Q, c), in_unit(1000), axes)(stage()))
    same_places(aligned(tmp_path, rig, places, table(places, Q, c, 1000)))


def test_a_file_without_a_unit_is_scaled_until_the_places_are_as_far_apart_as_on_the_rig(tmp_path, rig, places):
    Q, c = somewhere(7)
    (tmp_path / "model").mkdir()
    write.colmap(tmp_path / "model", both(moved(Q, c), in_unit(217.0))(stage()))
    text = table(places, Q, c, 217.0).replace("Calib.toml", "model")
    same_places(aligned(tmp_path, rig, places, text))


def test_a_left_handed_world_is_named_and_read_where_it_is_stated(tmp_path, rig, places):
    Q, c = np.eye(3), np.zeros(3)
    write.pose2sim(tmp_path, both(LEFT_HANDED, in_unit(1000))(stage()))
    flat = {name: MIRROR @ p for name, p in places.items()}
    same_places(aligned(tmp_path, rig, places, table(flat, Q, c, 1000, "mirrored = true")))
    with pytest.raises(RigError, match="left and right of the places are exchanged, or the file is left-handed"):
        aligned(tmp_path, rig, places, table(flat, Q, c, 1000, "mirrored = false"))


def test_places_that_are_a_little_off_say_by_how_much(tmp_path, rig, places):
    Q, c = somewhere(8)
    write.pose2sim(tmp_path, both(moved(Q, c), in_unit(1000))(stage()))
    off = dict(places) | {"chin": places["chin"] + [0, -6.0, 0]}
    said = []
    with listen(said.extend):
        cameras = aligned(tmp_path, rig, places, table(off, Q, c, 1000))
    assert "'chin'" in " ".join(said)
    same_places(cameras, within=80, turned=0.1)  # 6 mm at the chin turns cameras that stand 800 mm away
    with pytest.raises(RigError, match="'chin' lies 60 mm from where the others put it"):
        aligned(tmp_path, rig, places, table(dict(places) | {"chin": places["chin"] + [0, 0, 60.0]}, Q, c, 1000))


def test_places_in_a_file_and_beside_it_are_one_set(tmp_path, rig, places):
    Q, c = somewhere(9)
    write.pose2sim(tmp_path, both(moved(Q, c), in_unit(1000))(stage()))
    rows = [f"{name},{','.join(map(str, (Q @ p + c) / 1000))}" for name, p in places.items() if name != "chin"]
    (tmp_path / "placed.csv").write_text("\n".join(["name,x,y,z", *rows]))
    text = table({"chin": places["chin"]}, Q, c, 1000) + '\npoints = "placed.csv"'
    same_places(aligned(tmp_path, rig, places, text))


def test_cameras_that_look_at_the_philtrum_tell_where_the_head_is(tmp_path, rig):
    """A pair that is calibrated in the frame of its first camera."""
    truth = cameras_for("head-mounted-pair", rig.neutral, rig.skin)
    R0, C0 = truth[0].rotation, truth[0].position
    own = [one for one in write.stage()[:2]]
    cameras = [
        type(own[0])(
            **{
                **vars(own[0]),
                "name": one.name.replace(" ", "_"),
                "R": one.rotation @ R0.T,
                "t": -one.rotation @ (one.position - C0) / 1000,
            }
        )
        for one in truth
    ]
    write.pose2sim(tmp_path, cameras)
    found = aligned(tmp_path, rig, {}, ALIGN.format(more="") + "philtrum = true")
    apart = [np.linalg.norm(a[0].position - a[1].position) for a in (found, truth)]
    assert apart[0] == pytest.approx(apart[1], abs=0.01)
    middle = np.mean([one.rotation[2] for one in found], axis=0)
    assert middle / np.linalg.norm(middle) == pytest.approx([0, 0, -1], abs=1e-6)  # straight at the face
    assert {round(float(np.linalg.norm(one.position - found[0].position)), 2) for one in found} == {
        0.0,
        round(apart[1], 2),
    }


@pytest.mark.parametrize(
    ("lines", "says"),
    [
        ("", "write places of the head"),
        ("nose = [0, 0, 0]", "no place of the head is known as 'nose': known are nose_tip, "),
        ("nose_tip = [0, 0, 0]\nchin = [0, -0.1, 0]", "2 places of the head, expected 3 or more"),
        ("nose_tip = [0, 0]", "'nose_tip' must be 3 numbers"),
        ("philtrum = true\nnose_tip = [0, 0, 0]", "philtrum = true stands alone"),
        ("philtrum = false", "philtrum = true stands alone"),
        ("points = 'none.csv'", "none.csv does not exist"),
    ],
)
def test_a_wrong_align_table_is_refused_in_one_line(tmp_path, rig, places, lines, says):
    write.pose2sim(tmp_path, in_unit(1000)(stage()))
    with pytest.raises(RigError, match=says) as error:
        aligned(tmp_path, rig, places, ALIGN.format(more="") + lines)
    assert "\n" not in str(error.value)


def test_align_needs_a_calibration(tmp_path, rig, places):
    with pytest.raises(RigError, match=r"\[align\] stands without \[calibration\]"):
        aligned(tmp_path, rig, places, "[align]\nphiltrum = true")


def slipping(camera, mm, degrees, about=(0.0, 690.0, 60.0)):
    return Camera(**{**{f: getattr(camera, f) for f in camera.__dataclass_fields__}, "slip": Slip(mm, degrees, about)})


def test_a_slip_moves_the_head_in_the_picture_as_far_as_it_says(rig):
    """What a stance shows of a point is what the camera would show of the head there."""
    (one,) = cameras_for("head-mounted", rig.neutral, rig.skin)
    c = np.array([0.0, 690.0, 60.0])
    stances = slipping(one, 3.0, 2.0).stances
    assert len(stances) == 13
    assert np.array_equal(stances[0].position, one.position)
    x = rig.neutral[rig.skin][::40]
    far = []
    for stance in stances[1:]:
        Q = one.rotation.T @ stance.rotation
        s = one.position - c - Q @ (stance.position - c)
        assert stance.project(x) == pytest.approx(one.project((x - c) @ Q.T + c + s), abs=1e-6, nan_ok=True)
        assert np.linalg.norm(s) == pytest.approx(3.0)
        assert np.degrees(np.linalg.norm(Rotation.from_matrix(Q).as_rotvec())) == pytest.approx(2.0)
        far.append(s)
    assert np.abs(np.sum(far, axis=0)).max() < 1e-9  # as far one way as the other


def test_a_dot_is_read_only_where_it_is_read_wherever_the_head_slips(rig):
    one = cameras_for("head-mounted-pair", rig.neutral, rig.skin)[0]
    at = np.flatnonzero(rig.skin)[::7]
    occluder = Occluder(rig.neutral, rig.triangles)
    wide = slipping(one, 4.0, 3.0)
    how, pixels = sights(wide, occluder, rig.neutral, at, dot_mm=3.0)
    each = [sights(stance, occluder, rig.neutral, at, dot_mm=3.0) for stance in wide.stances]
    assert np.array_equal(how == Sight.READ, np.all([found == Sight.READ for found, _ in each], axis=0))
    read = how == Sight.READ
    assert np.array_equal(pixels[read], np.min([px for _, px in each], axis=0)[read])
    assert read.sum() < (each[0][0] == Sight.READ).sum()
    seen = seen_by(wide, occluder, rig.neutral, at)
    assert np.array_equal(seen, np.all([np.isin(found, SEEN) for found, _ in each], axis=0))


def test_a_slip_is_written_read_and_carried(tmp_path, rig):
    (tmp_path / "boom.toml").write_text("[head_mounted]\nslip_mm = 2\nslip_degrees = 1.5\n")
    cameras = cameras_for(str(tmp_path / "boom.toml"), rig.neutral, rig.skin)
    middle = rig.neutral[rig.skin].mean(axis=0)
    assert cameras[0].slip == Slip(2.0, 1.5, tuple(middle.tolist()))
    (tmp_path / "own.toml").write_text(own_text(cameras))
    assert [one.slip.mm for one in read_cameras(tmp_path / "own.toml").cameras if one.slip] == [2.0, 2.0]
    again = [camera_of(recorded(one)) for one in cameras]
    assert [one.slip for one in again] == [one.slip for one in cameras]
    still = cameras_for("head-mounted-pair", rig.neutral, rig.skin)
    assert not np.array_equal(cameras[0].numbers, still[0].numbers)


@pytest.mark.parametrize("line", ["slip_mm = -1", "slip_degrees = 120", "slip_mm = 600"])
def test_an_impossible_slip_is_refused(tmp_path, rig, line):
    (tmp_path / "boom.toml").write_text(f"[head_mounted]\n{line}\n")
    with pytest.raises(RigError, match="correct slip_mm and slip_degrees"):
        cameras_for(str(tmp_path / "boom.toml"), rig.neutral, rig.skin)
