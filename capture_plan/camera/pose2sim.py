"""Cameras as Pose2Sim, Anipose and Caliscope write their calibrations: one TOML table for each camera.

    [cam_01]
    name = "cam_01"
    size = [1088.0, 1920.0]                     # width and height, pixels
    matrix = [[fx, 0, cx], [0, fy, cy], [0, 0, 1]]
    distortions = [k1, k2, p1, p2]              # or more, as OpenCV has them
    rotation = [rx, ry, rz]                     # world to camera, radians (Rodrigues), or a 3x3 matrix
    translation = [tx, ty, tz]                  # camera = R world + t, in metres, or in the unit of the board
    fisheye = false                             # true: distortions are those of OpenCV's fisheye lens

Other tables, such as [metadata], are no cameras.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from capture_plan.camera.calibration import Calibration
from capture_plan.camera.camera import Camera
from capture_plan.camera.fields import distinct, fisheye_lens, numbers, pinhole_lens, placed, turned
from capture_plan.errors import RigError


def camera_tables(content: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """The tables that describe a camera, without those that are switched off."""
    tables = {name: table for name, table in content.items() if isinstance(table, dict) and "matrix" in table}
    return {name: table for name, table in tables.items() if table.get("ignore") is not True}


def read_pose2sim(content: Mapping[str, Any], path: Path) -> Calibration:
    """The cameras of a calibration in Pose2Sim's TOML."""
    cameras = tuple(camera_in(table, name, f"{path}, {name}") for name, table in camera_tables(content).items())
    return Calibration("Pose2Sim, Anipose or Caliscope TOML", distinct(cameras, str(path)), "metres")


def camera_in(table: dict[str, Any], name: str, where: str) -> Camera:
    """One camera in the file's unit."""
    if missing := [key for key in ("size", "rotation", "translation") if key not in table]:
        raise RigError(f"{where}: '{missing[0]}' is missing: calibrate where the camera stands, or take it out")
    given = np.array(table.get("distortions", []), dtype=object).ravel().tolist()
    lens = numbers({"distortions": given}, "distortions", where, (len(given),))
    fisheye = table.get("fisheye") is True
    turn = numbers(table, "rotation", where, (3,), (3, 3))
    width, height = numbers(table, "size", where, (2,)).round().astype(int).tolist()
    return placed(
        str(table.get("name", name)),
        numbers(table, "matrix", where, (3, 3)),
        (width, height),
        fisheye_lens(lens, where) if fisheye else pinhole_lens(lens, where),
        turned(turn, where) if turn.shape == (3,) else turn,
        t=numbers(table, "translation", where, (3,)),
        fisheye=fisheye,
    )
