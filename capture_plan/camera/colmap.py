"""Cameras of a COLMAP model, as text or binary: cameras and images, side by side; each image is a camera here.

    cameras.txt   CAMERA_ID MODEL WIDTH HEIGHT PARAMS...
    images.txt    IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME, and a line of the points in it
World to camera, quaternion w first, x right, y down, z forward. The centre of the first pixel is (0.5, 0.5), so 0.5 is
taken from the principal point. The scale is arbitrary unless it was set.
"""

import struct
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from capture_plan.camera.calibration import Calibration
from capture_plan.camera.fields import (
    MOST_CAMERAS,
    distinct,
    fisheye_lens,
    matrix,
    numbers,
    pinhole_lens,
    placed,
    quaternion,
)
from capture_plan.errors import RigError

PIXEL = 0.5  # COLMAP's centre of the first pixel
NAMES = (  # in the order of the numbers that stand for them in binary files
    "SIMPLE_PINHOLE",
    "PINHOLE",
    "SIMPLE_RADIAL",
    "RADIAL",
    "OPENCV",
    "OPENCV_FISHEYE",
    "FULL_OPENCV",
    "FOV",
    "SIMPLE_RADIAL_FISHEYE",
    "RADIAL_FISHEYE",
    "THIN_PRISM_FISHEYE",
)
Row = Float[np.ndarray, " n"]


class Model(NamedTuple):
    """A lens model: how many focal lengths and numbers of the lens, these in OpenCV's order, and whether a fisheye."""

    focal: int
    lens: int
    ordered: Callable[[Row], Row] = lambda k: k
    fisheye: bool = False


MODELS = {
    "SIMPLE_PINHOLE": Model(1, 0),
    "PINHOLE": Model(2, 0),
    "SIMPLE_RADIAL": Model(1, 1, lambda k: np.array([k[0], 0, 0, 0])),
    "RADIAL": Model(1, 2, lambda k: np.array([k[0], k[1], 0, 0])),
    "OPENCV": Model(2, 4),
    "FULL_OPENCV": Model(2, 8),
    "OPENCV_FISHEYE": Model(2, 4, fisheye=True),
    "SIMPLE_RADIAL_FISHEYE": Model(1, 1, fisheye=True),
    "RADIAL_FISHEYE": Model(1, 2, fisheye=True),
}


class Image(NamedTuple):
    """Pose of an image: quaternion w first, t, the number of its camera, and its name."""

    wxyz: Row
    t: Row
    camera: int
    name: str


Sensor = tuple[str, int, int, Row]  # model, width, height, parameters


def read_colmap_text(cameras: str, images: str, path: Path) -> Calibration:
    """The cameras of cameras.txt and images.txt."""
    return _cameras(dict(_text_sensors(cameras, path)), list(_text_images(images, path)), path, "COLMAP text")


def read_colmap_binary(cameras: bytes, images: bytes, path: Path) -> Calibration:
    """The cameras of cameras.bin and images.bin."""
    try:
        return _cameras(dict(_binary_sensors(cameras, path)), list(_binary_images(images, path)), path, "COLMAP binary")
    except (struct.error, IndexError, UnicodeDecodeError):
        raise RigError(f"{path}: cameras.bin or images.bin ends too early: export the model again") from None


def _cameras(sensors: dict[int, Sensor], images: list[Image], path: Path, called: str) -> Calibration:
    found = []
    for image in images:
        where = f"{path}, {image.name[:60]}"
        if image.camera not in sensors:
            raise RigError(f"{where}: its camera {image.camera} is not among the {len(sensors)} of cameras.txt or .bin")
        name, width, height, parameters = sensors[image.camera]
        if name not in MODELS:
            raise RigError(
                f"{where}: the lens model {name[:40]} is not read: expected one of {', '.join(MODELS)}; undistort the "
                "images, or calibrate them with OPENCV or OPENCV_FISHEYE"
            )
        model = MODELS[name]
        values = numbers({name: parameters}, name, where, (model.focal + 2 + model.lens,))
        fx, fy = values[0], values[model.focal - 1]
        cx, cy = values[model.focal : model.focal + 2] - PIXEL
        lens = model.ordered(values[model.focal + 2 :]) if model.lens else np.zeros(0)
        found.append(
            placed(
                image.name.rpartition(".")[0] or image.name,
                matrix(fx, fy, cx, cy),
                (width, height),
                fisheye_lens(lens, where) if model.fisheye else pinhole_lens(lens, where),
                quaternion(numbers({"quaternion": image.wxyz}, "quaternion", where, (4,)), where),
                t=numbers({"t": image.t}, "t", where, (3,)),
                fisheye=model.fisheye,
            )
        )
    return Calibration(called, distinct(tuple(found), str(path)), None)


def _text_sensors(text: str, path: Path) -> Iterator[tuple[int, Sensor]]:
    for line in text.splitlines():
        if not line.strip() or line.startswith("#"):
            continue
        number, model, width, height, *rest = [*line.split(), "", "", "", ""][: max(len(line.split()), 4)]
        try:
            yield int(number), (model, int(width), int(height), np.array(rest, dtype=float))
        except ValueError:
            raise RigError(
                f"{path}: cameras.txt has the line '{line[:60]}', expected CAMERA_ID MODEL WIDTH HEIGHT PARAMS"
            ) from None


def _text_images(text: str, path: Path) -> Iterator[Image]:
    """Every other line is the points of the image above it, and may be empty."""
    lines = [line for line in text.splitlines() if not line.startswith("#")]
    while lines and not lines[0].strip():
        lines = lines[1:]
    for line in lines[::2][: MOST_CAMERAS + 1]:
        if not line.strip():
            continue
        parts = line.split(maxsplit=9)
        try:
            values = np.array(parts[1:8], dtype=float)
            yield Image(values[:4], values[4:], int(parts[8]), parts[9])
        except (ValueError, IndexError):
            raise RigError(
                f"{path}: images.txt has the line '{line[:60]}', expected IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME "
                "and a line of points below it"
            ) from None


def _binary_sensors(data: bytes, path: Path) -> Iterator[tuple[int, Sensor]]:
    (count,), at = struct.unpack_from("<Q", data), 8
    for _ in range(min(count, MOST_CAMERAS + 1)):
        number, kind, width, height = struct.unpack_from("<iiQQ", data, at)
        name = NAMES[kind] if 0 <= kind < len(NAMES) else f"number {kind}"
        if name not in MODELS:
            raise RigError(f"{path}: the lens model {name} is not read: calibrate with OPENCV or OPENCV_FISHEYE")
        n = MODELS[name].focal + 2 + MODELS[name].lens
        parameters = np.array(struct.unpack_from(f"<{n}d", data, at + 24))
        at += 24 + 8 * n
        yield number, (name, min(width, 10**9), min(height, 10**9), parameters)


def _binary_images(data: bytes, path: Path) -> Iterator[Image]:
    (count,), at = struct.unpack_from("<Q", data), 8
    for _ in range(min(count, MOST_CAMERAS + 1)):
        _, *pose, camera = struct.unpack_from("<i7di", data, at)
        end = data.find(b"\0", at + 64)
        if end < 0:
            raise struct.error
        name = data[at + 64 : end].decode("utf-8")
        (points,) = struct.unpack_from("<Q", data, end + 1)
        at = end + 9 + 24 * points  # x, y and the number of each point
        if at > len(data):
            raise struct.error
        yield Image(np.array(pose[:4]), np.array(pose[4:]), camera, name)
