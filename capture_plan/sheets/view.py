"""Orthographic views of a head, and the one place where a point in space becomes a place on a picture.

View space: x to the picture's right, y up, z towards the viewer; millimetres, the origin that of the rig. A mirrored
view shows what the make-up mirror shows: x changes its sign, for the picture and for the points alike.

Letters: n points, v vertices, p q pixel rows and columns.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, UInt8
from scipy.ndimage import binary_erosion

from capture_plan.sheets.gl import LitSurface, draw
from capture_plan.sheets.head import Posed, Shown
from capture_plan.sheets.light import lit
from capture_plan.sheets.style import Number
from capture_plan.sheets.style import rgb as rgb_of

MM_PER_INCH, WHITE = 25.4, "#ffffff"
SIDE_FADE = 1.6  # the back of a head is rounder than a neck and wants a longer fade


@dataclass(frozen=True)
class Viewpoint:
    """Seen from `azimuth` degrees towards the subject's own left, 0 from the front, and `elevation` degrees above."""

    name: str
    azimuth: float
    mirrored: bool = False
    elevation: float = 0.0

    @property
    def rotation(self) -> Float[np.ndarray, "3 3"]:
        """Rows: right, up, towards the viewer."""
        s, c = np.sin(np.radians(self.azimuth)), np.cos(np.radians(self.azimuth))
        t, d = np.sin(np.radians(self.elevation)), np.cos(np.radians(self.elevation))
        return np.array([[1, 0, 0], [0, d, -t], [0, t, d]]) @ np.array([[c, 0, -s], [0, 1, 0], [s, 0, c]])

    def project(self, points: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3"]:
        """Points of the rig in the view's own axes."""
        seen = points @ self.rotation.T
        return seen * np.array([-1, 1, 1]) if self.mirrored else seen


FRONT = Viewpoint("Front", 0.0)
LEFT = Viewpoint("Left three-quarter", 42.0)
RIGHT = Viewpoint("Right three-quarter", -42.0)
LEFT_PROFILE = Viewpoint("Left profile", 90.0)
RIGHT_PROFILE = Viewpoint("Right profile", -90.0)
CHIN_UP = Viewpoint("Chin up", 0.0, elevation=-50.0)


class PictureFrame(NamedTuple):
    """The part of view space that a picture shows, millimetres.

    Along its lower and upper border it fades to white over `fade` and `fade_top`. It is blank along its left and right
    border as far as `blank_left` and `blank_right`, and fades over `SIDE_FADE` times `fade` beside a blank.
    """

    left: float
    right: float
    bottom: float
    top: float
    fade: float = 0.0
    blank_left: float = 0.0
    blank_right: float = 0.0
    fade_top: float = 0.0

    @property
    def width(self) -> float:
        """Width of what is shown, millimetres."""
        return self.right - self.left

    @property
    def height(self) -> float:
        """Height of what is shown, millimetres."""
        return self.top - self.bottom


class Picture(NamedTuple):
    """Pixels over the ground, and how far towards the viewer the surface of each lies (mm, -inf beside the head)."""

    rgb: UInt8[np.ndarray, "p q 3"]
    z: Float[np.ndarray, "p q"]
    frame: PictureFrame

    def pixel(self, points: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 2"]:
        """Column and row, in pixels from the top left corner, of points in view space."""
        height, width = self.z.shape
        column = (points[:, 0] - self.frame.left) / self.frame.width * width
        row = (self.frame.top - points[:, 1]) / self.frame.height * height
        return np.stack([column, row], axis=1)


def pixels(width_mm: Number, height_mm: Number, dpi: Number) -> tuple[int, int]:
    """Width and height in pixels."""
    return round(width_mm * dpi / MM_PER_INCH), round(height_mm * dpi / MM_PER_INCH)


def picture(
    posed: Posed, view: Viewpoint, frame: PictureFrame, *, size_px: tuple[int, int], ground: str = WHITE
) -> Picture:
    """Draw a head into `size_px` (width, height) pixels, before a ground of this colour ('#rrggbb')."""
    middle = (frame.left + frame.right) / 2 * (-1 if view.mirrored else 1)
    surfaces = tuple(_lit(piece, view.rotation) for piece in posed.pieces)
    centre = (middle, (frame.bottom + frame.top) / 2)
    rgba, z = draw(surfaces, centre=centre, size_mm=(frame.width, frame.height), size_px=size_px)
    if view.mirrored:
        rgba, z = rgba[:, ::-1], z[:, ::-1]
    return Picture(_over_ground(rgba, z, frame, ground), z, frame)


def _lit(piece: Shown, rotation: Float[np.ndarray, "3 3"]) -> LitSurface:
    normals, material = piece.normals @ rotation.T, piece.material
    rgb = lit(normals, piece.openness, piece.colours, gloss=material.gloss, sharp=material.sharp)
    return LitSurface(piece.vertices @ rotation.T, piece.triangles, np.c_[rgb, piece.opacity])


def _over_ground(
    rgba: UInt8[np.ndarray, "p q 4"], z: Float[np.ndarray, "p q"], frame: PictureFrame, ground: str
) -> UInt8[np.ndarray, "p q 3"]:
    """Where the neck or the back of the head fades, along a smooth step, it gives way to the ground."""
    rgb = np.ascontiguousarray(rgba[..., :3])
    behind = np.array(rgb_of(ground), dtype=np.float32)
    if ground != WHITE:
        rgb = _before(rgb, rgba[..., 3], z, behind)
    rows, columns = rgb.shape[:2]
    y = (rows - np.arange(rows) - 0.5) / rows * frame.height
    x = (np.arange(columns) + 0.5) / columns * frame.width
    _fade(rgb, (_step(y, frame.fade) * _step(frame.height - y, frame.fade_top))[:, None], behind)
    for blank, distance in ((frame.blank_left, x), (frame.blank_right, frame.width - x)):
        if blank > 0:
            _fade(rgb, _step(distance - blank, SIDE_FADE * frame.fade)[None], behind)
    return rgb


def _before(
    rgb: UInt8[np.ndarray, "p q 3"],
    alpha: UInt8[np.ndarray, "p q"],
    z: Float[np.ndarray, "p q"],
    behind: Float[np.ndarray, " 3"],
) -> UInt8[np.ndarray, "p q 3"]:
    """What was drawn over white, over another ground; lashes lower the alpha of the lid below, which covers all."""
    inside = binary_erosion(np.isfinite(z), iterations=2)
    share = np.where(inside, 1, alpha / 255).astype(np.float32)[..., None]
    return np.clip(np.round(rgb - (1 - share) * (255 - behind)), 0, 255).astype(np.uint8)


def _step(distance: Float[np.ndarray, " n"], width: float) -> Float[np.ndarray, " n"]:
    t = np.clip(distance / width, 0, 1) if width > 0 else np.ones_like(distance)
    return t * t * (3 - 2 * t)


def _fade(rgb: UInt8[np.ndarray, "p q 3"], retained: Float[np.ndarray, "a b"], behind: Float[np.ndarray, " 3"]) -> None:
    """Keep the share `retained` of each row or column of the picture before what is behind it, in place."""
    touched = np.flatnonzero(retained.ravel() < 1)
    part = np.s_[touched] if retained.shape[1] == 1 else np.s_[:, touched]
    share = retained[part][..., None].astype(np.float32)
    rgb[part] = np.round(behind - (behind - rgb[part].astype(np.float32)) * share).astype(np.uint8)
