"""Cameras of a Vicon XCP calibration (Nexus, Shogun, Cara).

    Camera     SENSOR_SIZE in pixels, PIXEL_ASPECT_RATIO, DEVICEID or NAME
    KeyFrame   FOCAL_LENGTH and PRINCIPAL_POINT in pixels; ORIENTATION, a quaternion x y z w of world to camera;
               POSITION, the centre, millimetres;  x right, y down, z forward
    VICON_RADIAL    k1 k2
    VICON_RADIAL2   Vicon3Parameter cx cy k1 k2 k3
Its lens runs the other way round than OpenCV's, in pixels: straight = centre + d (1 + k1 |d|² + k2 |d|⁴ + k3 |d|⁶),
d = bent - centre. It is carried over to OpenCV's radial model about the principal point; a centre of the lens that lies
elsewhere, skew, and cameras that move (key frames after the first) are not.
"""

from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np
from jaxtyping import Float

from capture_plan.camera.calibration import Calibration
from capture_plan.camera.camera import Camera
from capture_plan.camera.fields import (
    distinct,
    listed,
    matrix,
    pinhole_lens,
    placed,
    quaternion,
    radial_lens,
    radii,
    words,
)
from capture_plan.errors import RigError

OFF_CENTRE_PX = 1e-3  # between the centre of the lens and the principal point


def read_vicon(root: Element, path: Path) -> Calibration:
    """The cameras of an XCP file that were calibrated."""
    cameras, notes, left = [], [], []
    for element in root.iter("Camera"):
        name = element.get("NAME") or element.get("DEVICEID") or ""
        frames = element.findall("KeyFrames/KeyFrame")
        if not frames or not float(words(frames[0].get("FOCAL_LENGTH", "0"), "FOCAL_LENGTH", f"{path}, {name}", 1)[0]):
            left.append(name)
            continue
        camera, more = _camera(element, frames[0], name, f"{path}, {name[:60]}")
        cameras.append(camera)
        notes += more
        if len(frames) > 1:
            notes.append(f"camera {name} moves: the first of its {len(frames)} key frames is read")
    if left:
        notes.append(f"left out, as not calibrated: {listed(left)}")
    if len({camera.name for camera in cameras}) < len(cameras):
        raise RigError(f"{path}: two cameras have one NAME: give each its own in the Vicon system, or take NAME out")
    notes.append("image sizes are the sensors': a video that shows a part of it has other principal points")
    return Calibration("Vicon XCP", distinct(tuple(cameras), str(path)), "millimetres", notes=tuple(notes))


def _camera(element: Element, frame: Element, name: str, where: str) -> tuple[Camera, tuple[str, ...]]:
    width, height = words(element.get("SENSOR_SIZE"), "SENSOR_SIZE", where, 2).round().astype(int).tolist()
    focal = float(words(frame.get("FOCAL_LENGTH"), "FOCAL_LENGTH", where, 1)[0])
    aspect = float(words(element.get("PIXEL_ASPECT_RATIO", "1"), "PIXEL_ASPECT_RATIO", where, 1)[0]) or 1.0
    cx, cy = words(frame.get("PRINCIPAL_POINT"), "PRINCIPAL_POINT", where, 2)
    xyzw = words(frame.get("ORIENTATION"), "ORIENTATION", where, 4)
    K = matrix(focal, focal / aspect, cx, cy)
    lens, notes = _lens(frame, K, (width, height), where)
    turn = quaternion(np.roll(xyzw, 1), where)
    centre = words(frame.get("POSITION"), "POSITION", where, 3)
    return placed(name, K, (width, height), lens, turn, centre=centre), notes


def _lens(
    frame: Element, K: Float[np.ndarray, "3 3"], size: tuple[int, int], where: str
) -> tuple[Float[np.ndarray, " n"], tuple[str, ...]]:
    token, *rest = (frame.get("VICON_RADIAL2") or "").split() or [""]
    if token and token not in ("Vicon3Parameter", "ViconRadial2"):
        raise RigError(f"{where}: its lens model {token[:30]} is not read: expected Vicon3Parameter or VICON_RADIAL")
    if token:
        values = words(" ".join(rest), "VICON_RADIAL2", where, 4, 5)
        middle, k = values[:2], values[2:]
    else:
        middle, k = K[:2, 2], words(frame.get("VICON_RADIAL") or "0 0", "VICON_RADIAL", where, 2)
    if not k.any():
        return pinhole_lens([], where), ()
    k = np.concatenate([k, np.zeros(3 - len(k))])
    bent = radii(K, size)
    d = (bent * K[0, 0]) ** 2
    lens, notes = radial_lens(bent * (1 + k[0] * d + k[1] * d**2 + k[2] * d**3), bent, K[0, 0], where, "Vicon's radial")
    if (off := float(np.linalg.norm(middle - K[:2, 2]))) > OFF_CENTRE_PX:
        notes += (f"the centre of its lens lies {off:.1f} px from the principal point, which is not carried over",)
    return lens, notes
