"""Cameras as OpenCV's FileStorage keeps them (YAML, XML or JSON), and as ROS and short scripts write them.

    camera_matrix, K, M1 ...            3x3, pixels
    distortion_coefficients, D1 ...     4, 5, 8, 12 or 14 numbers, or 4 of a fisheye lens
    image_width, image_height           or image_size, size, resolution
    R, T                                of a stereo pair: camera 2 = R camera 1 + T, in the unit of the board; the world
                                        is the first camera
                                        of one camera (also rvec, tvec): camera = R world + T
R1, R2, P1, P2 and Q are of the rectified pair and are not read. Several cameras: a mapping of each, by its name.
"""

import re
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element

import numpy as np

from capture_plan.camera.calibration import Calibration
from capture_plan.camera.camera import Camera
from capture_plan.camera.fields import (
    distinct,
    fisheye_lens,
    middle_size,
    numbers,
    pinhole_lens,
    placed,
    rigid,
    rotation,
    words,
)
from capture_plan.errors import RigError

MATRIX = (
    "camera_matrix",
    "cameramatrix",
    "intrinsic_matrix",
    "intrinsics",
    "intrinsic",
    "matrix",
    "mtx",
    "k",
    "m",
    "cm",
)
LENS = ("distortion_coefficients", "distcoeffs", "dist_coeffs", "distortions", "distortion", "dist", "d", "kc")
TURN = ("r", "rotation", "rvec", "rot", "rotation_matrix", "rotation_vector")
MOVE = ("t", "translation", "tvec", "trans", "translation_vector")
POSE = ("extrinsics", "extrinsics_matrix", "extrinsic_matrix", "extrinsic", "rt")
SIZE = ("image_size", "imagesize", "size", "resolution", "size_px")
FIRST = re.compile(r"^(.*?)_?(?:1|left|l)$|^(?:left|cam1|l)_(.*)$")
SECOND = re.compile(r"^(.*?)_?(?:2|right|r)$|^(?:right|cam2|r)_(.*)$")


def read_opencv(document: Any, path: Path) -> Calibration:
    """The cameras of a document that FileStorage, ROS or a script wrote."""
    if not isinstance(document, dict):
        raise RigError(
            f"{path}: expected camera_matrix and distortion_coefficients by their names: write them as these"
        )
    flat = {str(key).lower(): _array(value) for key, value in document.items()}
    if _has(flat, MATRIX):
        return _single(flat, str(document.get("camera_name", path.stem)), path)
    first, second = _numbered(flat, FIRST), _numbered(flat, SECOND)
    if _has(first, MATRIX) and _has(second, MATRIX):
        return _stereo(flat, first, second, path)
    several = {name: value for name, value in document.items() if isinstance(value, dict)}
    if len(several) == 1 and not _is_camera(next(iter(several.values()))):
        return read_opencv(next(iter(several.values())), path)
    several = {name: value for name, value in several.items() if _is_camera(value)}
    if not several:
        found = ", ".join(map(str, list(document)[:5])) or "nothing"
        raise RigError(f"{path}: has no cameras: found {found}, expected camera_matrix or K, of each camera")
    parts = [_single({k.lower(): _array(v) for k, v in value.items()}, str(n), path) for n, value in several.items()]
    cameras = distinct(tuple(camera for part in parts for camera in part.cameras), str(path))
    return Calibration("OpenCV", cameras, None, notes=tuple(note for part in parts for note in part.notes))


def storage(root: Element) -> dict[str, Any]:
    """The document in the XML of FileStorage: matrices as OpenCV's mapping, everything else as words."""
    return {child.tag: _storage_value(child) for child in root}


def _storage_value(element: Element) -> Any:
    if element.get("type_id") in ("opencv-matrix", "opencv-nd-matrix"):
        found = {part.tag: (part.text or "").strip() for part in element}
        data = words(found.get("data", ""), element.tag, element.tag, len(found.get("data", "").split()))
        if "rows" not in found:
            return data.tolist()
        return {"rows": _whole(found["rows"]), "cols": _whole(found.get("cols")), "data": data.tolist()}
    if len(element):
        named = len({part.tag for part in element}) == len(element) and element[0].tag != "_"
        return {part.tag: _storage_value(part) for part in element} if named else [_storage_value(p) for p in element]
    parts = (element.text or "").split()
    try:
        values = [float(part) for part in parts]
    except ValueError:
        return (element.text or "").strip()
    return values[0] if len(values) == 1 else values


def _whole(text: str | None) -> int | None:
    return int(text) if text and text.isdecimal() and len(text) < 10 else None


def _array(value: Any) -> Any:
    """A matrix of FileStorage or ROS as nested lists; everything else as it is."""
    if isinstance(value, dict) and {"sizes", "data"} <= set(value):  # a row, as OpenCV 5 writes it
        return value["data"]
    if not isinstance(value, dict) or not {"rows", "cols", "data"} <= set(value):
        return value
    rows, columns, data = value["rows"], value["cols"], value["data"]
    if not isinstance(data, list) or not isinstance(rows, int) or not isinstance(columns, int):
        return None
    if rows * columns != len(data) or not data:
        return data
    return [data[row * columns : (row + 1) * columns] for row in range(rows)]


def _first(table: dict[str, Any], names: tuple[str, ...]) -> str | None:
    return next((name for name in names if table.get(name) is not None), None)


def _has(table: dict[str, Any], names: tuple[str, ...]) -> bool:
    """Whether it holds a matrix of 3x3 numbers under one of these names."""
    key = _first(table, names)
    return key is not None and np.size(np.array(table[key], dtype=object)) == 9


def _is_camera(value: dict[str, Any]) -> bool:
    return _has({str(key).lower(): _array(entry) for key, entry in value.items()}, MATRIX)


def _numbered(flat: dict[str, Any], which: re.Pattern[str]) -> dict[str, Any]:
    """The entries of one camera of a pair, by their names without its number or side."""
    found = {}
    for key, value in flat.items():
        if match := which.match(key):
            found[(match[1] or match[2] or "").strip("_")] = value
    return {key: value for key, value in found.items() if key not in TURN and key not in MOVE}  # R1 is rectification


def _lens(table: dict[str, Any], where: str) -> tuple[np.ndarray, bool]:
    """Numbers of the lens, and whether it is a fisheye."""
    model = str(table.get("distortion_model", table.get("model", table.get("camera_model", "")))).lower()
    fisheye = table.get("fisheye") in (True, 1) or any(word in model for word in ("fisheye", "equidistant", "kannala"))
    if any(word in model for word in ("omni", "mei", "division", "fov")):
        raise RigError(f"{where}: the lens model '{model[:40]}' is not read: calibrate it as plumb_bob or fisheye")
    key = _first(table, LENS)
    given = np.ravel(np.array(table[key], dtype=object)).tolist() if key else []
    return (fisheye_lens if fisheye else pinhole_lens)(given, where), fisheye


def _size(table: dict[str, Any], intrinsics: np.ndarray, where: str) -> tuple[tuple[int, int], tuple[str, ...]]:
    """Image size, and what to say where it is not in the file."""
    for wide, high in (("image_width", "image_height"), ("width", "height"), ("w", "h")):
        if wide in table and high in table:
            width, height = (float(numbers(table, key, where)) for key in (wide, high))
            return (round(width), round(height)), ()
    if key := _first(table, SIZE):
        flat = np.ravel(np.array(table[key], dtype=object)).tolist()
        width, height = numbers({key: flat}, key, where, (2,))
        return (round(width), round(height)), ()
    size = middle_size(intrinsics, where)
    return size, (
        f"the image size is not in the file and is taken as {size[0]} x {size[1]}, twice the principal point",
    )


def _camera(
    table: dict[str, Any], name: str, where: str, turn: np.ndarray, t: np.ndarray
) -> tuple[Camera, tuple[str, ...]]:
    key = _first(table, MATRIX)
    assert key is not None
    flat = np.ravel(np.array(table[key], dtype=object)).tolist()
    intrinsics = numbers({key: flat}, key, where, (9,)).reshape(3, 3)
    size, notes = _size(table, intrinsics, where)
    lens, fisheye = _lens(table, where)
    return placed(name, intrinsics, size, lens, turn, t=t, fisheye=fisheye), notes


def _single(table: dict[str, Any], name: str, path: Path) -> Calibration:
    where = f"{path}, {name}"
    turn, move, pose = _first(table, TURN), _first(table, MOVE), _first(table, POSE)
    if pose:
        R, t = rigid(table[pose], pose, where)
    elif turn and move:
        R = rotation(table[turn], turn, where)
        flat = np.ravel(np.array(table[move], dtype=object)).tolist()
        t = numbers({move: flat}, move, where, (3,))
    else:
        raise RigError(
            f"{where}: has a lens and not where the camera stands: add R and T (camera = R world + T), or write its "
            "numbers into a [[cameras]] table with position and look_at"
        )
    camera, notes = _camera(table, name, where, R, t)
    return Calibration("OpenCV", (camera,), None, notes=notes)


def _stereo(flat: dict[str, Any], first: dict[str, Any], second: dict[str, Any], path: Path) -> Calibration:
    """A pair whose world is its first camera."""
    turn, move = _first(flat, TURN), _first(flat, MOVE)
    if not (turn and move):
        raise RigError(f"{path}: has two lenses and not how they stand to each other: add R and T of stereoCalibrate")
    shared = {key: value for key, value in flat.items() if key in {*SIZE, "image_width", "image_height", "fisheye"}}
    T = numbers({move: np.ravel(np.array(flat[move], dtype=object)).tolist()}, move, str(path), (3,))
    one, notes = _camera(shared | first, "camera 1", f"{path}, camera 1", np.eye(3), np.zeros(3))
    two, more = _camera(shared | second, "camera 2", f"{path}, camera 2", rotation(flat[turn], turn, str(path)), T)
    return Calibration("OpenCV stereo pair", (one, two), None, notes=tuple(notes + more))
