"""Parts of a camera out of what a file holds, each checked where it enters: numbers, rotations, lenses, sizes.

`where` opens the line of every error: the file, and the camera in it.
"""

import contextlib
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from capture_plan.camera.camera import Camera, rotation_about
from capture_plan.camera.lens import FISHEYE, SAMPLES, SIZES, fitted
from capture_plan.errors import RigError

MOST = 1e9  # millimetres or pixels: larger ones are slips, whose squares cannot be reckoned with
MOST_CAMERAS = 2_000  # of one file; a scan dome has 200
LEAST_PIXELS = 32  # of an image side: less is a principal point in parts of the image, or from its middle
FULL_TURN = 2 * np.pi + 1e-6  # a rotation vector in radians is not longer
LENS_OFF_PX = 0.01  # as far as a lens in place of another program's may be off without a word
MOST_LENS_OFF_PX = 0.1  # and as far as it may be off at all: half of what a dot is measured with
OPENGL = np.diag([1.0, -1.0, -1.0])  # x right, y up, z backward, to x right, y down, z forward


def numbers(table: Mapping[str, Any], key: str, where: str, *shapes: tuple[int, ...]) -> np.ndarray:
    """table[key] as floats of one of these shapes, a single number where no shape is given."""
    shapes = shapes or ((),)
    if key not in table:
        raise RigError(f"{where}: '{key}' is missing")
    try:
        array = np.array(table[key], dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        array = None
    fits = array is not None and not isinstance(table[key], bool | str) and array.shape in shapes
    if array is None or not fits or not (np.abs(array) < MOST).all():
        wanted = " or ".join("x".join(map(str, shape)) + " numbers" if shape else "one number" for shape in shapes)
        wanted += f" below {MOST:g}" if fits else ""
        raise RigError(f"{where}: '{key}' must be {wanted}, found {str(table[key])[:60]}")
    return array


def flat(table: Mapping[str, Any], key: str, where: str, *counts: int) -> Float[np.ndarray, " n"]:
    """table[key] as numbers in one row, however it is nested; as many as one of `counts`."""
    found = {key: np.ravel(np.array(table[key], dtype=object)).tolist()} if key in table else {}
    return numbers(found, key, where, *[(n,) for n in counts])


def words(text: str | None, key: str, where: str, *counts: int) -> Float[np.ndarray, " n"]:
    """The numbers of a text, parted by spaces, commas or semicolons; as many as one of `counts`."""
    if text is None:
        raise RigError(f"{where}: '{key}' is missing")
    values: list[Any] = text.replace(",", " ").replace(";", " ").split()
    with contextlib.suppress(ValueError):
        values = [float(value) for value in values]
    if len(values) not in counts:
        wanted = " or ".join(map(str, counts))
        raise RigError(f"{where}: '{key}' must be {wanted} numbers, found {len(values)}: {text.strip()[:60]}")
    return numbers({key: values}, key, where, (len(values),))


def whole_pixels(table: Mapping[str, Any], key: str, where: str) -> int:
    """table[key] as a whole number of pixels above 0."""
    number = float(numbers(table, key, where))
    if number < 1 or number != round(number):
        raise RigError(f"{where}: '{key}' must be a whole number of pixels, found {number:g}")
    return int(number)


def matrix(fx: float, fy: float, cx: float, cy: float, skew: float = 0.0) -> Float[np.ndarray, "3 3"]:
    """[[fx, skew, cx], [0, fy, cy], [0, 0, 1]], pixels."""
    return np.array([[fx, skew, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])


def middle_size(intrinsics: Float[np.ndarray, "3 3"], where: str) -> tuple[int, int]:
    """Width and height of an image whose middle is the principal point, for files that do not say its size."""
    width, height = 2 * np.floor(intrinsics[:2, 2] + 0.75)  # images have an even number of pixels
    if min(width, height) < LEAST_PIXELS:
        raise RigError(
            f"{where}: its principal point is ({intrinsics[0, 2]:g}, {intrinsics[1, 2]:g}) and no image size is given: "
            "write the size, and the principal point in pixels from the first pixel's centre"
        )
    return int(width), int(height)


def turned(vector: Float[np.ndarray, "3"], where: str) -> Float[np.ndarray, "3 3"]:
    """The matrix of a rotation vector (Rodrigues), radians."""
    if (length := float(np.linalg.norm(vector))) > FULL_TURN:
        raise RigError(
            f"{where}: its rotation vector has the length {length:.4g}, expected at most 6.28 radians: "
            "it is in degrees, or three Euler angles: write a rotation vector in radians, or a 3x3 matrix"
        )
    return rotation_about(vector)


def rotation(value: Any, key: str, where: str) -> Float[np.ndarray, "3 3"]:
    """A 3x3 matrix, as it stands or made from a rotation vector in radians."""
    flat = np.ravel(np.array(value, dtype=object)).tolist()
    shape = (9,) if len(flat) == 9 else (3,)
    found = numbers({key: value if len(flat) not in (3, 9) else flat}, key, where, shape)
    return found.reshape(3, 3) if len(found) == 9 else turned(found, where)


def quaternion(wxyz: Float[np.ndarray, "4"], where: str) -> Float[np.ndarray, "3 3"]:
    """The rotation matrix of a quaternion, w first (Hamilton)."""
    if abs((length := float(np.linalg.norm(wxyz))) - 1) > 0.01:
        raise RigError(f"{where}: its quaternion has the length {length:.4g}, expected 1: export the camera again")
    return Rotation.from_quat(np.roll(wxyz, -1)).as_matrix()


def rigid(values: Any, key: str, where: str) -> tuple[Float[np.ndarray, "3 3"], Float[np.ndarray, "3"]]:
    """Rotation and translation of a 3x4 or 4x4 matrix, given in rows or as one list."""
    flat = np.ravel(np.array(values, dtype=object)).tolist()
    found = numbers({key: flat}, key, where, (12,), (16,)).reshape(-1, 4)
    return found[:3, :3], found[:3, 3]


def pinhole_lens(values: Sequence[Any] | np.ndarray, where: str) -> Float[np.ndarray, " n"]:
    """Numbers of a lens in OpenCV's order, 4 and more of them, as `Camera` has them."""
    flat = np.ravel(np.array(values, dtype=object)).tolist()
    lens = numbers({"distortion": flat}, "distortion", where, (len(flat),))
    if len(lens) in (0, 4):
        lens = np.concatenate([lens, np.zeros(5 - len(lens))])
    if len(lens) >= 5 and not lens[5:].any():
        return lens[:5].copy()
    if len(lens) not in SIZES:
        raise RigError(f"{where}: a lens of {len(lens)} numbers is not read: calibrate it with k1 k2 p1 p2 k3")
    return lens


def fisheye_lens(values: Sequence[Any] | np.ndarray, where: str) -> Float[np.ndarray, "4"]:
    """The four numbers of a fisheye lens; those left out are 0."""
    flat = np.ravel(np.array(values, dtype=object)).tolist()
    lens = numbers({"distortion": flat}, "distortion", where, (len(flat),))
    if lens[FISHEYE:].any():
        raise RigError(f"{where}: a fisheye lens of {len(lens)} numbers, expected k1 k2 k3 k4: calibrate it with these")
    return np.concatenate([lens[:FISHEYE], np.zeros(max(FISHEYE - len(lens), 0))])


def radial_lens(
    straight: Float[np.ndarray, " n"], bent: Float[np.ndarray, " n"], focal_px: float, where: str, called: str
) -> tuple[Float[np.ndarray, " n"], tuple[str, ...]]:
    """The lens in place of a radial model `called` so, by its radii (focal length 1), and what to say of it."""
    if not (np.isfinite(bent).all() and np.isfinite(straight).all() and (np.diff(straight) > 0).all()):
        raise RigError(f"{where}: its lens ({called}) folds inside the image: calibrate it with k1 k2 p1 p2 k3")
    lens, off = fitted(straight, bent, LENS_OFF_PX / focal_px / 2)
    if off * focal_px > MOST_LENS_OFF_PX:
        raise RigError(
            f"{where}: its lens ({called}) comes within {off * focal_px:.2g} px of OpenCV's rational model, expected "
            f"{MOST_LENS_OFF_PX:g}: calibrate it with k1 k2 p1 p2 k3"
        )
    said = f"its lens ({called}) is carried over to OpenCV's within {max(off * focal_px, 1e-4):.1g} px"
    return lens, (said,)


def placed(
    name: str,
    intrinsics: Float[np.ndarray, "3 3"],
    size_px: tuple[int, int],
    lens: Float[np.ndarray, " n"],
    world_to_camera: Float[np.ndarray, "3 3"],
    *,
    t: Float[np.ndarray, "3"] | None = None,
    centre: Float[np.ndarray, "3"] | None = None,
    fisheye: bool = False,
) -> Camera:
    """A camera by its rotation and either t of camera = R world + t, or its centre."""
    if centre is None:
        assert t is not None
        centre = -world_to_camera.T @ t  # what is no rotation has another inverse; `Camera` refuses it
    return Camera(name, centre, world_to_camera, intrinsics, size_px, lens, fisheye)


def listed(names: Sequence[str]) -> str:
    """The first few of some names, and how many more there are."""
    more = f" and {len(names) - 5} more" if len(names) > 5 else ""
    return ", ".join(name[:60] for name in names[:5]) + more


def distinct(cameras: tuple[Camera, ...], where: str) -> tuple[Camera, ...]:
    """The cameras. RigError where there is none, where they are too many, or two have one name."""
    if not cameras:
        raise RigError(f"{where} has no cameras that were calibrated: calibrate and export them again")
    if len(cameras) > MOST_CAMERAS:
        raise RigError(f"{where} has {len(cameras):,} cameras, expected at most {MOST_CAMERAS:,}: export one frame")
    names = [camera.name for camera in cameras]
    if len(set(names)) < len(names):
        twice = next(name for name in names if names.count(name) > 1)
        raise RigError(f"{where}: two cameras are called '{twice}': give each its own name")
    return cameras


def radii(intrinsics: Float[np.ndarray, "3 3"], size_px: tuple[int, int]) -> Float[np.ndarray, " n"]:
    """Radii on the image plane (focal length 1) from nearly 0 to a little beyond the farthest corner of the image."""
    corners = np.array([[x, y] for x in (0, size_px[0]) for y in (0, size_px[1])]) - intrinsics[:2, 2]
    far = np.hypot(*(corners / np.diag(intrinsics)[:2]).T).max()
    return np.linspace(far / SAMPLES, 1.02 * far, SAMPLES)


def polynomial_lens(
    k: Sequence[float],
    p: Sequence[float],
    intrinsics: Float[np.ndarray, "3 3"],
    size_px: tuple[int, int],
    where: str,
) -> tuple[Float[np.ndarray, " n"], tuple[str, ...]]:
    """Brown's lens with k1 k2 k3 k4, and OpenCV's p1 p2: k4 is the factor of r⁸, which OpenCV's polynomial lacks."""
    bent_to = radii(intrinsics, size_px)
    straight = np.linspace(0, 3 * bent_to[-1], 20 * SAMPLES)[1:]
    bent = straight * np.polyval([k[3], k[2], k[1], k[0], 1.0], straight**2)
    folds = np.flatnonzero(np.diff(bent) <= 0)
    end = folds[0] if len(folds) else len(bent) - 1
    if bent[end] < bent_to[-1]:
        straight, bent = straight[: end + 1], bent[: end + 1]  # the image's corners show nothing
    straight = np.interp(bent_to[bent_to <= bent[end]], bent, straight)
    bent = straight * np.polyval([k[3], k[2], k[1], k[0], 1.0], straight**2)
    lens, notes = radial_lens(straight, bent, intrinsics[0, 0], where, "k1 to k4")
    lens = lens.copy()
    lens[2:4] = p
    return lens, notes
