"""Cameras from a TOML file of our own: one [[cameras]] table each, in OpenCV's convention, in the rig's millimetres.

    [[cameras]]
    name = "boom top"
    width = 1536                        # pixels
    height = 2048
    fx = 2100.0                         # focal lengths, pixels
    fy = 2100.0
    cx = 767.5                          # image centre, pixels; left out: the middle of the image
    cy = 1023.5
    dist = [0.0, 0.0, 0.0, 0.0, 0.0]    # k1 k2 p1 p2 k3, or 4, 8, 12 or 14 numbers as OpenCV has them; left out: none
    fisheye = false                     # true where dist is k1 k2 k3 k4 of OpenCV's fisheye lens
    R = [[1, 0, 0], [0, -1, 0], [0, 0, -1]]   # world to camera, or rvec = [rx, ry, rz] in radians (Rodrigues)
    t = [0.0, 760.0, 400.0]             # millimetres: camera = R world + t
    focus_mm = 260.0                    # distance in focus; with the next two, or all three left out: all is in focus
    f_number = 5.6
    pixel_um = 3.45                     # pitch of the sensor's pixels, micrometres
    noise_px = 0.5                      # standard deviation of a dot's middle in a picture, pixels; left out: 0.5
    slip_mm = 0.0                       # how far the head may leave its place, or the helmet slip on it, in any way;
    slip_degrees = 0.0                  # and how far it may turn; left out: 0

Who has measured with a tape only writes, instead of R and t, where the camera stands and what its image centre shows:

    position = [0.0, 740.0, 400.0]      # millimetres, in the rig's frame: +y up, the face looks along +z
    look_at = [0.0, 690.0, 140.0]
"""

import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from capture_plan.camera.calibration import Calibration
from capture_plan.camera.camera import NOISE_PX, Camera, Optics, Slip, look_at
from capture_plan.camera.fields import distinct, fisheye_lens, matrix, numbers, pinhole_lens, turned, whole_pixels
from capture_plan.errors import RigError

OPTICS = ("focus_mm", "f_number", "pixel_um")
SLIP = ("slip_mm", "slip_degrees")
POSES = ("R and t", "rvec and t", "position and look_at")
KEYS = {
    "name",
    "width",
    "height",
    "fx",
    "fy",
    "cx",
    "cy",
    "dist",
    "fisheye",
    "focus_mm",
    "f_number",
    "pixel_um",
    "noise_px",
    *SLIP,
    "R",
    "rvec",
    "t",
    "position",
    "look_at",
    "convention",
}


def read_own(content: dict[str, Any], path: Path) -> Calibration:
    """The cameras of its [[cameras]] tables."""
    tables = content.get("cameras")
    if not isinstance(tables, list) or not tables or not all(isinstance(table, dict) for table in tables):
        raise RigError(f"{path}: has no cameras: write one [[cameras]] table for each, or one [head_mounted] table")
    cameras = tuple(camera_from(table, f"{path}, camera {number}") for number, table in enumerate(tables, start=1))
    return Calibration("[[cameras]]", distinct(cameras, str(path)), "millimetres", in_head_frame=True)


def camera_from(table: dict[str, Any], where: str) -> Camera:
    """The camera that one [[cameras]] table describes; `where` opens the lines of its errors."""
    if unknown := sorted(set(table) - KEYS):
        raise RigError(f"{where}: unknown key '{unknown[0]}': known are {', '.join(sorted(KEYS))}")
    if table.get("convention", "opencv") != "opencv":
        raise RigError(
            f"{where}: convention is '{table['convention']}', only 'opencv' is read: convert the camera first"
        )
    width, height = (whole_pixels(table, key, where) for key in ("width", "height"))
    fx, fy = (float(numbers(table, key, where)) for key in ("fx", "fy"))
    cx = float(numbers(table, "cx", where)) if "cx" in table else (width - 1) / 2
    cy = float(numbers(table, "cy", where)) if "cy" in table else (height - 1) / 2
    if not isinstance(fisheye := table.get("fisheye", False), bool):
        raise RigError(f"{where}: 'fisheye' must be true or false, found {str(fisheye)[:60]}")
    given = numbers(table, "dist", where, *[(n,) for n in (4, 5, 8, 12, 14)]) if "dist" in table else np.zeros(0)
    position, rotation = _pose(table, where)
    return Camera(
        name=str(table.get("name", where.rpartition(", ")[2])),
        position=position,
        rotation=rotation,
        intrinsics=matrix(fx, fy, cx, cy),
        size_px=(width, height),
        distortion=fisheye_lens(given, where) if fisheye else pinhole_lens(given, where),
        fisheye=fisheye,
        optics=optics_of(table, where),
        noise_px=float(numbers(table, "noise_px", where)) if "noise_px" in table else NOISE_PX,
        slip=slip_of(table, where),
    )


def optics_of(table: dict[str, Any], where: str) -> Optics | None:
    """Focus, f-number and pixel pitch of a table; None where it has none of them."""
    given = [key for key in OPTICS if key in table]
    if not given:
        return None
    if len(given) < len(OPTICS):
        raise RigError(f"{where}: has {' and '.join(given)}: sharpness needs {', '.join(OPTICS)}, or none of them")
    values = [float(numbers(table, key, where)) for key in OPTICS]
    if min(values) <= 0:
        raise RigError(f"{where}: {', '.join(OPTICS)} must be above 0, found {', '.join(f'{x:g}' for x in values)}")
    return Optics(*values)


def slip_of(table: dict[str, Any], where: str) -> Slip | None:
    """How far the head of a table's camera may slip, about the origin as long as no head is known; None where it may
    not."""
    mm, degrees = (float(numbers(table, key, where)) if key in table else 0.0 for key in SLIP)
    return Slip(mm, degrees, (0.0, 0.0, 0.0)) if mm or degrees else None


def _pose(table: dict[str, Any], where: str) -> tuple[np.ndarray, np.ndarray]:
    """Position in millimetres and world-to-camera rotation."""
    given = {key for key in ("R", "rvec", "t", "position", "look_at") if key in table}
    if given == {"position", "look_at"}:
        position = numbers(table, "position", where, (3,))
        try:
            return position, look_at(position, numbers(table, "look_at", where, (3,)))
        except RigError as error:
            raise RigError(f"{where}: {error}") from error
    if given == {"R", "t"}:
        rotation = numbers(table, "R", where, (3, 3))
    elif given == {"rvec", "t"}:
        rotation = turned(numbers(table, "rvec", where, (3,)), where)
    else:
        found = ", ".join(sorted(given)) or "nothing"
        raise RigError(f"{where}: its pose is given by {found}: give {' or '.join(POSES)}")
    return -rotation.T @ numbers(table, "t", where, (3,)), rotation


def own_text(cameras: Iterable[Camera], note: str = "") -> str:
    """Cameras as a file of our own, with `note` in its first line."""
    lines = [f"# {note}"] if note else []
    for camera in cameras:
        K, (width, height) = camera.intrinsics, camera.size_px
        rows = ", ".join(_row(row) for row in camera.rotation)
        lines += [
            "[[cameras]]",
            f"name = {json.dumps(camera.name, ensure_ascii=False)}",
            f"width = {width}",
            f"height = {height}",
            *(f"{key} = {value:.6f}" for key, value in zip(("fx", "fy"), np.diag(K)[:2], strict=True)),
            *(f"{key} = {value:.6f}" for key, value in zip(("cx", "cy"), K[:2, 2], strict=True)),
            f"dist = {_row(camera.distortion)}",
            *(["fisheye = true"] if camera.fisheye else []),
            f"R = [{rows}]",
            f"t = {_row(camera.translation)}",
            f"noise_px = {camera.noise_px:g}",
        ]
        if camera.optics:
            values = (camera.optics.focus_mm, camera.optics.f_number, camera.optics.pixel_um)
            lines += [f"{key} = {value:g}" for key, value in zip(OPTICS, values, strict=True)]
        if camera.slip:
            lines += [f"slip_mm = {camera.slip.mm:g}", f"slip_degrees = {camera.slip.degrees:g}"]
        lines.append("")
    return "\n".join(lines)


def _row(values: Iterable[float]) -> str:
    return f"[{', '.join(repr(round(float(x), 9)) for x in values)}]"
