"""The picture that a camera will take: the head through its lens, and every dot as the ellipse that it becomes.

Each vertex is put where the camera's own projection has it, lens errors included, and drawn from there without a
perspective: triangles are small beside what a lens bends.

Letters: n points, m corners of an outline, p q pixel rows and columns. Pixels are the camera's: x right, y down.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, UInt8
from scipy.ndimage import gaussian_filter

from capture_plan.camera import Camera
from capture_plan.sheets.gl import LitSurface, draw
from capture_plan.sheets.head import Posed, Shown
from capture_plan.sheets.light import lit
from capture_plan.visibility.hemisphere import tangent_frames

GROUND = 236  # of 255: paper that nobody takes for skin
CORNERS = 32  # of an ellipse
BLUR = 1 / 4  # standard deviation of a disc of diameter 1


class Crop(NamedTuple):
    """A part of a camera's picture, in its pixels."""

    left: float
    top: float
    width: float
    height: float

    @classmethod
    def whole(cls, camera: Camera) -> "Crop":
        """All of a camera's picture."""
        width, height = camera.size_px
        return cls(-0.5, -0.5, float(width), float(height))


class LensPicture(NamedTuple):
    """Colours, and how deep along the optical axis lies what each pixel shows, millimetres; inf beside the head."""

    rgb: UInt8[np.ndarray, "p q 3"]
    depth: Float[np.ndarray, "p q"]


def through_lens(posed: Posed, camera: Camera, crop: Crop, width_px: int) -> LensPicture:
    """What the camera sees of a posed head, `width_px` wide, blurred as far as its focus blurs the face."""
    turn = camera.rotation * np.array([[1.0], [-1.0], [-1.0]])  # right, up, towards the camera
    surfaces = tuple(one for piece in posed.pieces if (one := _flat(piece, camera, turn)))
    height_px = max(round(width_px * crop.height / crop.width), 1)
    rgb = np.full((height_px, width_px, 3), GROUND, dtype=np.uint8)
    if not surfaces:
        return LensPicture(rgb, np.full(rgb.shape[:2], np.inf))
    centre = crop.left + crop.width / 2, -(crop.top + crop.height / 2)
    rgba, z = draw(surfaces, centre=centre, size_mm=(crop.width, crop.height), size_px=(width_px, height_px))
    rgb = np.where(np.isfinite(z)[..., None], rgba[..., :3], rgb)
    sigma = BLUR * float(np.median(camera.blur_px(posed.vertices))) * width_px / crop.width
    return LensPicture(gaussian_filter(rgb, (sigma, sigma, 0)) if sigma > 0.3 else rgb, -z)


def dot_outlines(
    camera: Camera, points: Float[np.ndarray, "n 3"], normals: Float[np.ndarray, "n 3"], dot_mm: float
) -> Float[np.ndarray, "n m 2"]:
    """The rim of a round dot at each point as the camera sees it, pixels; NaN where it does not."""
    angle = 2 * np.pi * np.arange(CORNERS) / CORNERS
    rim = np.stack([np.cos(angle), np.sin(angle)], axis=1) * dot_mm / 2
    across = tangent_frames(normals)[:, :2]
    rims = points[:, None] + np.einsum("mi,nix->nmx", rim, across)
    return camera.project(rims.reshape(-1, 3)).reshape(len(points), CORNERS, 2)


def _flat(piece: Shown, camera: Camera, turn: Float[np.ndarray, "3 3"]) -> LitSurface | None:
    """A piece of the head where the camera's pixels have it; None where it has none of it before it."""
    pixels = camera.project(piece.vertices)
    depth = (piece.vertices - camera.position) @ camera.rotation[2]
    there = np.all(np.isfinite(pixels), axis=1)
    triangles = piece.triangles[there[piece.triangles].all(axis=1)]
    if not len(triangles):
        return None
    material = piece.material
    rgb = lit(piece.normals @ turn.T, piece.openness, piece.colours, gloss=material.gloss, sharp=material.sharp)
    flat = np.where(there[:, None], np.column_stack([pixels[:, 0], -pixels[:, 1], -depth]), 0.0)
    used, local = np.unique(triangles, return_inverse=True)
    return LitSurface(flat[used], local.reshape(-1, 3), np.c_[rgb, piece.opacity][used])
