"""Cameras of a transforms.json, as nerfstudio and instant-ngp write it: each frame is a camera here.

    w, h, fl_x, fl_y, cx, cy        pixels, for all frames or in each; camera_angle_x in place of fl_x
    k1, k2, p1, p2, k3, k4          OpenCV's, but k4 is the factor of r⁸; of the fisheye lens k1 to k4
    frames[].transform_matrix       camera to world, x right, y up, z backward
    applied_transform, _scale       what was done to the world of the photogrammetry before it was written: undone here
The program's code counts pixels from the first one's corner (`pixel_offset` 0.5), its page of data conventions from its
centre: the code is followed, and 0.5 taken from the principal point.
"""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from capture_plan.camera.calibration import Calibration
from capture_plan.camera.camera import Camera
from capture_plan.camera.fields import (
    OPENGL,
    distinct,
    fisheye_lens,
    matrix,
    numbers,
    pinhole_lens,
    placed,
    polynomial_lens,
    rigid,
)
from capture_plan.errors import RigError

PIXEL = 0.5  # nerfstudio's centre of the first pixel
HALF = "0.5 px are taken off the principal point, as the program's code counts pixels; its documents disagree"
PINHOLES = ("OPENCV", "PINHOLE", "SIMPLE_PINHOLE", "PERSPECTIVE")
FISHEYES = ("OPENCV_FISHEYE", "FISHEYE", "EQUIDISTANT")


def read_nerfstudio(document: dict[str, Any], path: Path) -> Calibration:
    """The cameras of a transforms.json."""
    frames = document.get("frames")
    if not isinstance(frames, list) or not all(isinstance(frame, dict) for frame in frames):
        raise RigError(f"{path}: 'frames' must be a list of frames with transform_matrix: export the file again")
    shared = {key: value for key, value in document.items() if key != "frames"}
    R, t = np.eye(3), np.zeros(3)
    if "applied_transform" in shared:
        R, t = rigid(shared["applied_transform"], "applied_transform", str(path))
    scale = float(numbers({"applied_scale": 1.0} | shared, "applied_scale", str(path)))
    if abs(abs(np.linalg.det(R)) - 1) > 1e-3 or scale <= 0:
        raise RigError(f"{path}: 'applied_transform' must be a rotation and 'applied_scale' above 0: export it again")
    cameras, notes = [], [HALF]
    for number, frame in enumerate(frames[:3000]):
        camera, more = _camera(shared | frame, number, path)
        turn = camera.rotation @ R  # of world = R original + t
        centre = R.T @ (camera.position / scale - t)
        cameras.append(replace(camera, position=centre, rotation=turn))
        notes += more
    return Calibration("nerfstudio", distinct(tuple(cameras), str(path)), None, notes=tuple(notes))


def _camera(table: dict[str, Any], number: int, path: Path) -> tuple[Camera, tuple[str, ...]]:
    name = str(table.get("file_path", f"frame {number}")).replace("\\", "/").removeprefix("./")
    where = f"{path}, {name[:60]}"
    w, h = float(numbers(table, "w", where)), float(numbers(table, "h", where))
    if "fl_x" in table:
        fx = float(numbers(table, "fl_x", where))
    else:
        fx = w / 2 / np.tan(float(numbers(table, "camera_angle_x", where)) / 2)
    fy = float(numbers(table, "fl_y", where)) if "fl_y" in table else fx
    cx = float(numbers(table, "cx", where)) if "cx" in table else w / 2
    cy = float(numbers(table, "cy", where)) if "cy" in table else h / 2
    k = {key: float(numbers(table, key, where)) for key in ("k1", "k2", "k3", "k4", "p1", "p2") if key in table}
    k1, k2, k3, k4, p1, p2 = (k.get(key, 0.0) for key in ("k1", "k2", "k3", "k4", "p1", "p2"))
    model = str(table.get("camera_model", "OPENCV_FISHEYE" if table.get("is_fisheye") else "OPENCV")).upper()
    if model not in PINHOLES + FISHEYES:
        raise RigError(f"{where}: camera_model {model[:30]} is not read: expected OPENCV or OPENCV_FISHEYE")
    K, fisheye, notes = matrix(fx, fy, cx - PIXEL, cy - PIXEL), model in FISHEYES, ()
    if fisheye:
        lens = fisheye_lens([k1, k2, k3, k4], where)
    elif k4:
        lens, notes = polynomial_lens([k1, k2, k3, k4], [p1, p2], K, (round(w), round(h)), where)
    else:
        lens = pinhole_lens([k1, k2, p1, p2, k3], where)
    turn, centre = rigid(table.get("transform_matrix"), "transform_matrix", where)
    size = (round(w), round(h))
    return placed(
        name.rpartition(".")[0] or name, K, size, lens, OPENGL @ turn.T, centre=centre, fisheye=fisheye
    ), notes
