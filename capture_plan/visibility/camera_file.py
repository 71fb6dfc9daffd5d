"""Cameras from a TOML file: one [[cameras]] table each, in OpenCV's convention, in the rig's millimetres.

    [[cameras]]
    name = "boom top"
    width = 1536                        # pixels
    height = 2048
    fx = 2100.0                         # focal lengths, pixels
    fy = 2100.0
    cx = 767.5                          # image centre, pixels; left out: the middle of the image
    cy = 1023.5
    dist = [0.0, 0.0, 0.0, 0.0, 0.0]    # k1 k2 p1 p2 k3; left out: no distortion
    R = [[1, 0, 0], [0, -1, 0], [0, 0, -1]]   # world to camera, or rvec = [rx, ry, rz] in radians (Rodrigues)
    t = [0.0, 760.0, 400.0]             # millimetres: camera = R world + t

Who has measured with a tape only writes, instead of R and t, where the camera stands and what its image centre shows:

    position = [0.0, 740.0, 400.0]      # millimetres, in the rig's frame: +y up, the face looks along +z
    look_at = [0.0, 690.0, 140.0]
"""

from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from capture_plan.errors import RigError
from capture_plan.input.documents import read_toml
from capture_plan.visibility.camera import Camera, look_at

MOST = 1e9  # millimetres or pixels: larger ones are slips, whose squares cannot be reckoned with
POSES = ("R and t", "rvec and t", "position and look_at")
KEYS = {
    "name",
    "width",
    "height",
    "fx",
    "fy",
    "cx",
    "cy",
    "dist",
    "R",
    "rvec",
    "t",
    "position",
    "look_at",
    "convention",
}


def read_cameras(path: str | Path) -> tuple[Camera, ...]:
    """The cameras of a TOML file; RigError says what to change in it."""
    return cameras_of(read_toml(Path(path), RigError, "give a camera file"), Path(path))


def cameras_of(content: dict[str, Any], path: Path) -> tuple[Camera, ...]:
    """The cameras of its [[cameras]] tables."""
    tables = content.get("cameras")
    if not isinstance(tables, list) or not tables or not all(isinstance(table, dict) for table in tables):
        raise RigError(f"{path}: has no cameras: write one [[cameras]] table for each, or one [head_mounted] table")
    cameras = tuple(camera_from(table, f"{path}, camera {number}") for number, table in enumerate(tables, start=1))
    return distinct(cameras, path)


def distinct(cameras: tuple[Camera, ...], path: Path) -> tuple[Camera, ...]:
    """The cameras. RigError where two have one name."""
    names = [camera.name for camera in cameras]
    if len(set(names)) < len(names):
        twice = next(name for name in names if names.count(name) > 1)
        raise RigError(f"{path}: two cameras are called '{twice}': give each its own name")
    return cameras


def camera_from(table: dict[str, Any], where: str) -> Camera:
    """The camera that one [[cameras]] table describes; `where` opens the lines of its errors."""
    if unknown := sorted(set(table) - KEYS):
        raise RigError(f"{where}: unknown key '{unknown[0]}': known are {', '.join(sorted(KEYS))}")
    if table.get("convention", "opencv") != "opencv":
        raise RigError(
            f"{where}: convention is '{table['convention']}', only 'opencv' is read: convert the camera first"
        )
    width, height = (whole_pixels(table, key, where) for key in ("width", "height"))
    fx, fy = (float(numbers(table, key, where)) for key in ("fx", "fy"))
    cx = float(numbers(table, "cx", where)) if "cx" in table else (width - 1) / 2
    cy = float(numbers(table, "cy", where)) if "cy" in table else (height - 1) / 2
    lens = numbers(table, "dist", where, (4,), (5,)) if "dist" in table else np.zeros(5)
    position, rotation = _pose(table, where)
    return Camera(
        name=str(table.get("name", where.rpartition(", ")[2])),
        position=position,
        rotation=rotation,
        intrinsics=np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]]),
        size_px=(width, height),
        distortion=np.resize(np.append(lens, 0.0), 5) if len(lens) == 4 else lens,
    )


def _pose(table: dict[str, Any], where: str) -> tuple[np.ndarray, np.ndarray]:
    """Position in millimetres and world-to-camera rotation."""
    given = {key for key in ("R", "rvec", "t", "position", "look_at") if key in table}
    if given == {"position", "look_at"}:
        position = numbers(table, "position", where, (3,))
        try:
            return position, look_at(position, numbers(table, "look_at", where, (3,)))
        except RigError as error:
            raise RigError(f"{where}: {error}") from error
    if given == {"R", "t"}:
        rotation = numbers(table, "R", where, (3, 3))
    elif given == {"rvec", "t"}:
        rotation = Rotation.from_rotvec(numbers(table, "rvec", where, (3,))).as_matrix()
    else:
        found = ", ".join(sorted(given)) or "nothing"
        raise RigError(f"{where}: its pose is given by {found}: give {' or '.join(POSES)}")
    return -rotation.T @ numbers(table, "t", where, (3,)), rotation


def numbers(table: dict[str, Any], key: str, where: str, *shapes: tuple[int, ...]) -> np.ndarray:
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


def whole_pixels(table: dict[str, Any], key: str, where: str) -> int:
    """table[key] as a whole number of pixels above 0."""
    number = float(numbers(table, key, where))
    if number < 1 or number != round(number):
        raise RigError(f"{where}: '{key}' must be a whole number of pixels, found {number:g}")
    return int(number)
