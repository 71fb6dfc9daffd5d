"""Cameras as Kalibr writes a camchain: each camera relative to the one before.

cam1:
camera_model: pinhole
intrinsics: [fx, fy, cx, cy]
distortion_model: radtan              # OpenCV's k1 k2 p1 p2; equidistant: k1 k2 k3 k4 of the fisheye lens
distortion_coeffs: [k1, k2, p1, p2]
resolution: [width, height]
T_cn_cnm1: 4x4                        # camera n = T camera n-1, metres; the world is cam0
"""

from pathlib import Path
from typing import Any

import numpy as np

from capture_plan.camera.calibration import Calibration
from capture_plan.camera.fields import distinct, fisheye_lens, matrix, numbers, pinhole_lens, placed, rigid
from capture_plan.errors import RigError

LENSES = {"radtan": pinhole_lens, "plumb_bob": pinhole_lens, "equidistant": fisheye_lens, "none": pinhole_lens}


def read_kalibr(document: dict[str, Any], path: Path) -> Calibration:
    """The cameras of a camchain, in the axes of its first."""
    tables = {name: table for name, table in document.items() if isinstance(table, dict) and "intrinsics" in table}
    R, t, cameras = np.eye(3), np.zeros(3), []
    for n, (name, table) in enumerate(tables.items()):
        where = f"{path}, {name}"
        if n:
            if "T_cn_cnm1" not in table:
                raise RigError(f"{where}: 'T_cn_cnm1' is missing: calibrate it in one chain with the camera before")
            step, move = rigid(table["T_cn_cnm1"], "T_cn_cnm1", where)
            R, t = step @ R, step @ t + move
        model, lens = str(table.get("camera_model", "pinhole")), str(table.get("distortion_model", "none")).lower()
        if model != "pinhole" or lens not in LENSES:
            raise RigError(
                f"{where}: the model {model[:30]}-{lens[:30]} is not read, expected pinhole with radtan or "
                "equidistant: calibrate it with --models pinhole-radtan or pinhole-equi"
            )
        width, height = numbers(table, "resolution", where, (2,)).round().astype(int).tolist()
        K = matrix(*numbers(table, "intrinsics", where, (4,)))
        coefficients = LENSES[lens](table.get("distortion_coeffs", []), where)
        fisheye = lens == "equidistant"
        cameras.append(placed(str(name), K, (width, height), coefficients, R, t=t, fisheye=fisheye))
    return Calibration("Kalibr camchain", distinct(tuple(cameras), str(path)), "metres")
