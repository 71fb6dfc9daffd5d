"""Cameras of an Agisoft Metashape XML (File > Export > Export Cameras).

    sensor/resolution              width and height
    sensor/calibration             f, cx, cy, b1, b2, k1 to k4, p1, p2; cx, cy from the middle of the image
    camera/transform               4x4, camera to chunk, x right, y down, z forward; none where it was not aligned
    chunk/transform                rotation, translation and scale, chunk to world; or of a component
Its centre of the first pixel is (0.5, 0.5); its p1 is OpenCV's p2 and its p2 OpenCV's p1:
    u = w/2 + cx + x' (f + b1) + y' b2,  v = h/2 + cy + y' f
    x' = x radial + p1 (r² + 2 x²) + 2 p2 x y,  y' = y radial + p2 (r² + 2 y²) + 2 p1 x y
The world is metric where the project has a scale bar, markers or coordinates.
"""

from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np
from jaxtyping import Float

from capture_plan.camera.calibration import Calibration
from capture_plan.camera.fields import (
    distinct,
    fisheye_lens,
    listed,
    matrix,
    pinhole_lens,
    placed,
    polynomial_lens,
    words,
)
from capture_plan.errors import RigError

PIXEL = 0.5  # Metashape's centre of the first pixel
Lens = tuple[Float[np.ndarray, "3 3"], tuple[int, int], Float[np.ndarray, " n"], bool]


def read_metashape(root: Element, path: Path) -> Calibration:
    """The aligned cameras of the first chunk that has any."""
    chunks = [chunk for chunk in root.iter("chunk") if chunk.find("cameras") is not None]
    if not chunks:
        raise RigError(f"{path}: has no chunk with cameras: export it from Metashape with Export Cameras")
    chunk, notes, lenses, cameras, left = chunks[0], [], {}, [], []
    if len(chunks) > 1:
        notes.append(f"the first of {len(chunks)} chunks is read")
    sensors = {sensor.get("id"): sensor for sensor in chunk.iterfind("sensors/sensor")}
    for camera in chunk.iter("camera"):
        name = camera.get("label", camera.get("id", ""))
        where = f"{path}, {name[:60]}"
        if camera.find("transform") is None or camera.get("enabled") in ("0", "false"):
            left.append(name)
            continue
        number = camera.get("sensor_id")
        if number not in sensors:
            raise RigError(f"{where}: its sensor {number} is not in the file: export the cameras again")
        if number not in lenses:
            lenses[number], more = _lens(sensors[number], where)
            notes += more
        local = words(camera.findtext("transform"), "transform", where, 16).reshape(4, 4)
        R, t, scale = _to_world(chunk, camera, where)
        K, size, lens, fisheye = lenses[number]
        turn, centre = R @ local[:3, :3], scale * R @ local[:3, 3] + t
        cameras.append(placed(name, K, size, lens, turn.T, centre=centre, fisheye=fisheye))
    if left:
        notes.append(f"left out, as not aligned or switched off: {listed(left)}")
    return Calibration("Agisoft Metashape", distinct(tuple(cameras), str(path)), None, notes=tuple(notes))


def _to_world(
    chunk: Element, camera: Element, where: str
) -> tuple[Float[np.ndarray, "3 3"], Float[np.ndarray, "3"], float]:
    """Rotation, translation and scale from the chunk, or from the component of the camera, to the world."""
    number, found = camera.get("component_id"), chunk.find("transform")
    for component in chunk.iterfind("components/component"):
        own = component.find("transform")
        if component.get("id") == number and own is not None:
            found = own
    if found is None:
        return np.eye(3), np.zeros(3), 1.0
    turn, move, scale = (found.findtext(tag) for tag in ("rotation", "translation", "scale"))
    R = words(turn, "rotation", where, 9).reshape(3, 3) if turn else np.eye(3)
    t = words(move, "translation", where, 3) if move else np.zeros(3)
    s = float(words(scale, "scale", where, 1)[0]) if scale else 1.0
    if s <= 0:
        raise RigError(f"{where}: the scale of its chunk is {s:g}, expected above 0: export the cameras again")
    return R, t, s


def _lens(sensor: Element, where: str) -> tuple[Lens, tuple[str, ...]]:
    """The lens of a sensor: the adjusted calibration where there is one."""
    found = sorted(sensor.iterfind("calibration"), key=lambda one: one.get("class") != "adjusted")
    size = sensor.find("resolution")
    if not found or size is None:
        raise RigError(
            f"{where}: its sensor has no calibration or resolution: align the cameras, and export them again"
        )
    width, height = (round(float(words(size.get(key), key, where, 1)[0])) for key in ("width", "height"))
    kind = found[0].get("type", sensor.get("type", "frame"))
    if kind not in ("frame", "fisheye", "equidistant_fisheye"):
        raise RigError(f"{where}: a lens of type '{kind[:30]}' is not read: expected frame or fisheye")
    v = {part.tag: float(words(part.text, part.tag, where, 1)[0]) for part in found[0] if part.tag in _NUMBERS}
    if not (focal := v.get("f", v.get("fx"))):
        raise RigError(f"{where}: its sensor has no focal length f: align the cameras, and export them again")
    old = "fx" in v  # before version 1.3: fx, fy, skew, and cx, cy in pixels from the corner
    fx, fy = (v["fx"], v.get("fy", v["fx"])) if old else (focal + v.get("b1", 0.0), focal)
    cx, cy = (v.get(key, 0.0) - PIXEL + (0 if old else side / 2) for key, side in (("cx", width), ("cy", height)))
    K = matrix(fx, fy, cx, cy, v.get("skew", v.get("b2", 0.0)))
    k, p = [v.get(f"k{n}", 0.0) for n in (1, 2, 3, 4)], [v.get("p2", 0.0), v.get("p1", 0.0)]
    if any(v.get(key) for key in ("p3", "p4")):
        raise RigError(f"{where}: p3 and p4 of its lens are not read: align with 'fit p3, p4' off, and export again")
    if kind != "frame":
        if any(p):
            raise RigError(f"{where}: p1 and p2 of a fisheye lens are not read: align with 'fit p1, p2' off")
        return (K, (width, height), fisheye_lens(k, where), True), ()
    if k[3]:
        lens, notes = polynomial_lens(k, p, K, (width, height), where)
        return (K, (width, height), lens, False), notes
    return (K, (width, height), pinhole_lens([k[0], k[1], *p, k[2]], where), False), ()


_NUMBERS = {"f", "fx", "fy", "cx", "cy", "skew", "b1", "b2", "k1", "k2", "k3", "k4", "p1", "p2", "p3", "p4"}
