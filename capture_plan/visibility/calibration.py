"""Cameras as Pose2Sim, Anipose and Caliscope write their calibrations: one TOML table for each camera.

    [cam_01]
    name = "cam_01"
    size = [1088.0, 1920.0]                     # width and height, pixels
    matrix = [[fx, 0, cx], [0, fy, cy], [0, 0, 1]]
    distortions = [k1, k2, p1, p2]              # or with k3; further ones must be 0
    rotation = [rx, ry, rz]                     # world to camera, radians (Rodrigues), or a 3x3 matrix
    translation = [tx, ty, tz]                  # camera = R world + t, in metres, or in the unit of the board
    fisheye = false

Other tables, such as [metadata], are no cameras. The unit is the one in which most cameras have the head in their
image, from outside it; metres where several do.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from capture_plan.errors import RigError
from capture_plan.progress import tell
from capture_plan.visibility.camera import Camera
from capture_plan.visibility.camera_file import distinct, numbers

UNITS = {"metres": 1000.0, "millimetres": 1.0, "centimetres": 10.0}  # the formats' own first
SHOWN = 0.05  # share of the skin that the image of a camera that looks at the head holds


def is_calibration(content: Mapping[str, Any]) -> bool:
    """Whether a TOML document holds tables of this kind."""
    return bool(camera_tables(content))


def camera_tables(content: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """The tables that describe a camera, without those that are switched off."""
    tables = {name: table for name, table in content.items() if isinstance(table, dict) and "matrix" in table}
    return {name: table for name, table in tables.items() if table.get("ignore") is not True}


def read_calibration(content: Mapping[str, Any], path: Path, skin: Float[np.ndarray, "v 3"]) -> tuple[Camera, ...]:
    """The cameras of a calibration in millimetres; `skin` of the head that they look at tells their unit."""
    tables = camera_tables(content)
    cameras = {
        unit: tuple(camera_in(table, name, f"{path}, {name}", mm) for name, table in tables.items())
        for unit, mm in UNITS.items()
    }
    showing = {unit: sum(shows(camera, skin) for camera in some) for unit, some in cameras.items()}
    best = max(UNITS, key=lambda unit: showing[unit])
    if best != "metres":
        shown = f"{showing[best]} of {len(tables)} cameras show the head"
        tell([f"{path.name}: {shown} where its unit is {best}, not metres"])
    return distinct(cameras[best], path)


def camera_in(table: dict[str, Any], name: str, where: str, unit_mm: float) -> Camera:
    """One camera whose translation is in units of `unit_mm`."""
    if missing := [key for key in ("size", "rotation", "translation") if key not in table]:
        raise RigError(f"{where}: '{missing[0]}' is missing: calibrate where the camera stands, or take it out")
    given = np.array(table.get("distortions", [0.0] * 5), dtype=object).ravel().tolist()
    lens = numbers({"distortions": given}, "distortions", where, (len(given),))
    if len(lens) < 4 or lens[5:].any():
        raise RigError(f"{where}: a lens of {len(lens)} numbers is not read: calibrate it with k1 k2 p1 p2 k3")
    if table.get("fisheye") is True and lens.any():
        raise RigError(f"{where}: a fisheye lens is not read: undistort its images, and calibrate them without fisheye")
    turn = numbers(table, "rotation", where, (3,), (3, 3))
    rotation = Rotation.from_rotvec(turn).as_matrix() if turn.shape == (3,) else turn
    width, height = numbers(table, "size", where, (2,)).round().astype(int).tolist()
    return Camera(
        name=str(table.get("name", name)),
        position=-rotation.T @ (unit_mm * numbers(table, "translation", where, (3,))),
        rotation=rotation,
        intrinsics=numbers(table, "matrix", where, (3, 3)),
        size_px=(width, height),
        distortion=np.resize(np.append(lens[:5], 0.0), 5) if len(lens) == 4 else lens[:5].copy(),
    )


def shows(camera: Camera, skin: Float[np.ndarray, "v 3"]) -> bool:
    """Whether a camera stands outside the head and has some of it in its image."""
    middle = skin.mean(axis=0)
    radius = np.linalg.norm(skin - middle, axis=1).mean()
    outside = np.linalg.norm(camera.position - middle) > radius
    return bool(outside and camera.in_image(skin).mean() > SHOWN)
