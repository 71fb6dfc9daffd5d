"""Where a camera stands to the face, as a technician sets it up with a tape and a level.

Data       p          the upper philtrum (mm), which a head-mounted camera is aimed at;  C, R  place and rotation
Place      C - p in the head's axes: to the actor's left (+x), above (+y), ahead (+z)
Looks      f = the third row of R:  down asin(-f_y),  to the actor's left atan2(f_x, -f_z);  roll of the picture's up
Field      angle between the rays through the middles of opposite edges
Covers     what the picture spans across the axis at the depth of p, by the rays of its edges
Sharp      depths at which the blur of a point (`Camera.blur_px`) stays below `SHARP_PX`
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from capture_plan.camera.camera import Camera

SHARP_PX = 2.0


class Mounting(NamedTuple):
    """Lengths in millimetres, angles in degrees; `sharp` from and to, None where the camera's focus is not known."""

    away_mm: float
    left_mm: float
    above_mm: float
    ahead_mm: float
    down_degrees: float
    leftward_degrees: float
    roll_degrees: float
    field_degrees: tuple[float, float]
    covers_mm: tuple[float, float]
    pixel_mm: float
    sharp_mm: tuple[float, float] | None


def mounting(camera: Camera, philtrum: Float[np.ndarray, "3"]) -> Mounting:
    """How the camera stands to an upper philtrum."""
    way, forward, up = camera.position - philtrum, camera.rotation[2], camera.rotation @ [0.0, 1.0, 0.0]
    depth = float(-way @ forward)
    width, height = camera.size_px
    middle = (np.array(camera.size_px) - 1) / 2
    edges = np.array([[-0.5, middle[1]], [width - 0.5, middle[1]], [middle[0], -0.5], [middle[0], height - 0.5]])
    rays = camera.rays(edges) @ camera.rotation.T
    angles = [float(np.degrees(np.arccos(np.clip(a @ b, -1, 1)))) for a, b in (rays[:2], rays[2:])]
    flat = rays[:, :2] / rays[:, 2:] * depth
    covers = float(np.ptp(flat[:2, 0])), float(np.ptp(flat[2:, 1]))
    return Mounting(
        away_mm=float(np.linalg.norm(way)),
        left_mm=float(way[0]),
        above_mm=float(way[1]),
        ahead_mm=float(way[2]),
        down_degrees=float(np.degrees(np.arcsin(np.clip(-forward[1], -1, 1)))),
        leftward_degrees=float(np.degrees(np.arctan2(forward[0], -forward[2]))),
        roll_degrees=float(np.degrees(np.arctan2(up[0], -up[1]))),
        field_degrees=(angles[0], angles[1]),
        covers_mm=covers,
        pixel_mm=depth / float(camera.intrinsics[0, 0]),
        sharp_mm=sharp(camera),
    )


def sharp(camera: Camera) -> tuple[float, float] | None:
    """Depths (mm) from and to which the blur is below `SHARP_PX`: K |z - s| / z <= b, K = fx (f / N) / (s - f)."""
    if not camera.optics:
        return None
    s, f = camera.optics.focus_mm, camera.focal_mm
    K = camera.intrinsics[0, 0] * f / camera.optics.f_number / (s - f)
    return s * K / (K + SHARP_PX), s * K / (K - SHARP_PX) if K > SHARP_PX else np.inf


def between(one: Camera, other: Camera, philtrum: Float[np.ndarray, "3"]) -> tuple[float, float]:
    """How far two cameras are apart, millimetres, and the angle between them as the face sees it, degrees."""
    a, b = (camera.position - philtrum for camera in (one, other))
    cosine = a @ b / np.linalg.norm(a) / np.linalg.norm(b)
    return float(np.linalg.norm(a - b)), float(np.degrees(np.arccos(np.clip(cosine, -1, 1))))
