"""A picture of a solid to judge by: from the front, from its left, from behind, and its middle twice as large, on one
white page with a bar of 50 mm.

Letters: v vertices, f triangles, g corners of triangles; millimetres, +y up, facing +z.
"""

from io import BytesIO

import numpy as np
from jaxtyping import Float, Int, UInt8
from PIL import Image, ImageDraw, ImageFont

from capture_plan.mesh.geometry import triangle_cross, vertex_normals
from capture_plan.sheets.gl import LitSurface, draw
from capture_plan.sheets.lettering import font_path
from capture_plan.sheets.light import lit
from capture_plan.sheets.view import FRONT, LEFT, LEFT_PROFILE, Viewpoint
from capture_plan.visibility import hemisphere_visibility

COLOUR = (0.72, 0.75, 0.80)
PX_PER_MM = 5.0
CREASE = 0.93  # cosine from which on two triangles meet in an edge
RAYS = 32
EDGE_MM = 6.0
CLOSE_MM, CLOSE = 46.0, 3.0  # side of what the close view shows, and how much larger
BEHIND = Viewpoint("Inside", 180.0)
BAR_MM = 50.0


def solid_picture(vertices: Float[np.ndarray, "v 3"], triangles: Int[np.ndarray, "f 3"], title: str) -> bytes:
    """PNG of a closed surface in five views."""
    surface = _Shaded(vertices, triangles)
    whole = [surface.seen(view) for view in (FRONT, LEFT_PROFILE, LEFT, BEHIND)]
    middle = (vertices.max(axis=0) + vertices.min(axis=0)) / 2
    low = np.array([middle[0] + 14.0, middle[1] - 0.22 * np.ptp(vertices[:, 1]), middle[2]])
    close = surface.close(Viewpoint("Close", 20.0), low)
    head, gap = 60, 30
    high = max(image.shape[0] for image in whole)
    page = Image.new("RGB", (sum(i.shape[1] for i in whole) + close.shape[1] + 6 * gap, high + head + 80), "white")
    pen, font = ImageDraw.Draw(page), ImageFont.truetype(font_path("Roboto-Regular.ttf"), 26)
    pen.text((gap, 16), title, "black", font)
    x = gap
    named = zip((*whole, close), ("front", "left side", "three-quarter", "inside", "close, 3 times"), strict=True)
    for image, name in named:
        page.paste(Image.fromarray(image), (x, head + (high - image.shape[0]) // 2))
        pen.text((x + EDGE_MM, head + high + 6), name, "#555555", font)
        x += image.shape[1] + gap
    bar, y = round(BAR_MM * PX_PER_MM), head + high + 60
    pen.line([(gap, y), (gap + bar, y)], "black", 4)
    pen.text((gap + bar + 12, y - 16), f"{BAR_MM:.0f} mm", "black", font)
    made = BytesIO()
    page.save(made, "PNG", compress_level=4)
    return made.getvalue()


class _Shaded:
    """Corners of triangles with normals that keep creases sharp, and how open each lies."""

    def __init__(self, vertices: Float[np.ndarray, "v 3"], triangles: Int[np.ndarray, "f 3"]) -> None:
        cross = triangle_cross(vertices, triangles)
        flat = cross / np.maximum(np.linalg.norm(cross, axis=1, keepdims=True), 1e-12)
        corner = vertex_normals(vertices, triangles)[triangles]
        sharp = np.einsum("fcx,fx->fc", corner, flat) < CREASE
        self.normals = np.where(sharp[..., None], flat[:, None], corner).reshape(-1, 3)
        self.points = vertices[triangles].reshape(-1, 3)
        self.triangles = np.arange(len(self.points)).reshape(-1, 3)
        openness = hemisphere_visibility(vertices, triangles, np.arange(len(vertices)), rays=RAYS)
        self.openness = openness[triangles].reshape(-1)

    def seen(self, view: Viewpoint) -> UInt8[np.ndarray, "p q 3"]:
        """All of it."""
        flat = view.project(self.points)[:, :2]
        low, high = flat.min(axis=0) - EDGE_MM, flat.max(axis=0) + EDGE_MM
        return self._drawn(view, (low + high) / 2, high - low, PX_PER_MM)

    def close(self, view: Viewpoint, middle: Float[np.ndarray, " 3"]) -> UInt8[np.ndarray, "p q 3"]:
        """A square around a place."""
        side = np.array([CLOSE_MM, CLOSE_MM])
        return self._drawn(view, view.project(middle[None])[0, :2], side, CLOSE * PX_PER_MM)

    def _drawn(
        self, view: Viewpoint, centre: Float[np.ndarray, " 2"], size: Float[np.ndarray, " 2"], scale: float
    ) -> UInt8[np.ndarray, "p q 3"]:
        normals = self.normals @ view.rotation.T
        colours = np.tile(COLOUR, (len(normals), 1))
        rgb = lit(normals, self.openness, colours, gloss=0.05, sharp=20.0)
        surface = LitSurface(self.points @ view.rotation.T, self.triangles, np.c_[rgb, np.ones(len(rgb))])
        width, height = (round(float(side) * scale) for side in size)
        rgba, _ = draw(
            (surface,),
            centre=(float(centre[0]), float(centre[1])),
            size_mm=(float(size[0]), float(size[1])),
            size_px=(width, height),
        )
        share = rgba[..., 3:] / 255
        return np.round(rgba[..., :3] * share + 255 * (1 - share)).astype(np.uint8)
