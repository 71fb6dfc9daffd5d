"""Cameras as EasyMocap keeps them: intri.yml and extri.yml of OpenCV's FileStorage, side by side.

    intri.yml   K_01 3x3, dist_01 of 4 or 5 numbers, at times W_01 and H_01
    extri.yml   R_01 rotation vector or Rot_01 3x3, T_01:  camera = R world + T, metres
Cameras are named by what stands behind the first underscore: leading zeros stay.
"""

from pathlib import Path
from typing import Any

from capture_plan.camera.calibration import Calibration
from capture_plan.camera.fields import distinct, flat, middle_size, pinhole_lens, placed, rotation, whole_pixels
from capture_plan.camera.opencv import _array
from capture_plan.errors import RigError


def read_easymocap(intrinsic: dict[str, Any], extrinsic: dict[str, Any], path: Path) -> Calibration:
    """The cameras of a pair of documents."""
    table = {str(key): _array(value) for key, value in (intrinsic | extrinsic).items()}
    names = [key[2:] for key in table if key.startswith("K_")]
    cameras, guessed = [], False
    for name in names:
        where = f"{path}, {name}"
        K = flat(table, f"K_{name}", where, 9).reshape(3, 3)
        turn = f"Rot_{name}" if f"Rot_{name}" in table else f"R_{name}"
        if turn not in table or f"T_{name}" not in table:
            raise RigError(f"{where}: extri.yml has no {turn} or T_{name}: calibrate where the camera stands")
        t = flat(table, f"T_{name}", where, 3)
        stated = f"W_{name}" in table and f"H_{name}" in table
        size = (
            (whole_pixels(table, f"W_{name}", where), whole_pixels(table, f"H_{name}", where))
            if stated
            else middle_size(K, where)
        )
        guessed |= not stated
        dist = table.get(f"dist_{name}", [])
        cameras.append(placed(name, K, size, pinhole_lens(dist, where), rotation(table[turn], turn, where), t=t))
    note = ("image sizes are not in the files and are taken as twice the principal point",) if guessed else ()
    return Calibration("EasyMocap", distinct(tuple(cameras), str(path)), "metres", notes=note)
