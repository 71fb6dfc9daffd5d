"""Cameras of a Qualisys calibration (.qca.txt of QTM, which is XML).

transform   x y z, the centre in millimetres; r11 to r33, whose rows are the camera's axes: x right, y up, z backward
intrinsic   focalLengthU, V and centerPointU, V in 64ths of a pixel; radialDistortion1 to 3, tangentalDistortion1, 2
(sic) without a unit, OpenCV's k1 k2 k3 and p1 p2
fov_video   left, top, right and bottom pixel of the image: the principal point counts from left and top
"""

from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np

from capture_plan.camera.calibration import Calibration
from capture_plan.camera.camera import Camera
from capture_plan.camera.fields import OPENGL, distinct, listed, matrix, pinhole_lens, placed, words
from capture_plan.errors import RigError

PARTS = 64.0  # of a pixel
LEAST_FOCAL = 100.0  # pixels: a shorter one was given in pixels, not in 64ths


def read_qualisys(root: Element, path: Path) -> Calibration:
    """The active cameras of a calibration."""
    cameras, left = [], []
    for element in root.iter("camera"):
        name = element.get("serial") or str(len(cameras) + 1)
        if element.get("active") == "0" or element.get("calibrated") == "false" or element.find("intrinsic") is None:
            left.append(name)
            continue
        cameras.append(_camera(element, name, f"{path}, camera {name[:60]}"))
    notes = (f"left out, as not calibrated: {listed(left)}",) if left else ()
    return Calibration("Qualisys", distinct(tuple(cameras), str(path)), "millimetres", notes=notes)


def _camera(element: Element, name: str, where: str) -> Camera:
    lens, place = element.find("intrinsic"), element.find("transform")
    view = element.find("fov_video")
    view = view if view is not None else element.find("fov_marker")
    if lens is None or place is None or view is None:
        raise RigError(f"{where}: 'transform', 'intrinsic' or 'fov_video' is missing: export the calibration from QTM")

    def of(part: Element, *keys: str) -> list[float]:
        return [float(words(part.get(key), key, where, 1)[0]) for key in keys]

    left, top, right, bottom = of(view, "left", "top", "right", "bottom")
    fx, fy, cx, cy = (n / PARTS for n in of(lens, "focalLengthU", "focalLengthV", "centerPointU", "centerPointV"))
    if fx < LEAST_FOCAL:
        raise RigError(
            f"{where}: its focal length is {fx:.4g} px, as values in pixels would give, expected 64ths of a pixel: "
            "export the calibration from QTM itself"
        )
    k1, k2, k3 = of(lens, *(f"radialDistortion{n}" for n in (1, 2, 3)))
    p1, p2 = of(lens, "tangentalDistortion1", "tangentalDistortion2")
    rows = np.array(of(place, *(f"r{i}{j}" for i in (1, 2, 3) for j in (1, 2, 3)))).reshape(3, 3)
    return placed(
        name,
        matrix(fx, fy, cx - left, cy - top),
        (round(right - left) + 1, round(bottom - top) + 1),
        pinhole_lens([k1, k2, p1, p2, k3], where),
        OPENGL @ rows,
        centre=np.array(of(place, "x", "y", "z")),
    )
