"""A head that sits for its figures: drawn once for each view, painted with a value at every vertex.

Letters: v vertices of the rig, u vertices shown, n points, p q pixel rows and columns. Pixels from the top left corner.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float, Int

from capture_plan.anatomy.regions import face_regions
from capture_plan.face.anchors import Anchors
from capture_plan.rig import Rig
from capture_plan.sheets.expression_page import portrait
from capture_plan.sheets.head import Head, Posed, Shown, make_head, pose, spread_over
from capture_plan.sheets.markers import unhidden
from capture_plan.sheets.view import FRONT, Picture, PictureFrame, Viewpoint, picture

ASPECT = 0.8  # width over height
HEIGHT_PX = 880  # 2.2 inches of print at 400 dots an inch
SIZE_PX = (round(ASPECT * HEIGHT_PX), HEIGHT_PX)
ABOVE, BELOW = 1.25, 0.4  # pupil distances above the eyes and below the chin that a close-up shows
EDGE = 1e-3  # pupil distances: blank beside a close-up, so that cut ears fade away
FLAT = 0.5  # how much of the shade a map keeps: enough for the form, little enough for the colours
Colours = Callable[[Float[np.ndarray, " u"]], Float[np.ndarray, "u 3"]]


@dataclass(frozen=True, eq=False)
class Sitter:
    """The neutral head of a rig, ready to be drawn."""

    rig: Rig
    head: Head
    posed: Posed
    anchors: Anchors

    @cached_property
    def front(self) -> Picture:
        """From the front, in clay."""
        return picture(self.posed, FRONT, portrait(self.rig, self.anchors, FRONT, ASPECT), size_px=SIZE_PX)

    def close_up(self, view: Viewpoint, posed: Posed) -> Picture:
        """The face without the skull above it."""
        return picture(posed, view, self.face_frame(view), size_px=SIZE_PX)

    def face_frame(self, view: Viewpoint) -> PictureFrame:
        """From the forehead to below the chin."""
        u = self.anchors.pupils
        top, bottom = float(self.anchors.eye_left[1]) + ABOVE * u, float(self.anchors.chin[1]) - BELOW * u
        width = ASPECT * (top - bottom)
        face = view.project(self.rig.neutral[self.rig.skin])
        between = face[(face[:, 1] > bottom + BELOW * u) & (face[:, 1] < top)][:, 0]
        middle = (between.min() + between.max()) / 2
        towards = float(view.project(np.array([[0.0, 0.0, u]]))[0, 0])  # the face lies before the middle of the head
        middle += 0.4 * towards
        return PictureFrame(middle - width / 2, middle + width / 2, bottom, top, 0.2 * u, EDGE * u, EDGE * u, 0.3 * u)

    def painted(self, values: Float[np.ndarray, " v"], colours: Colours) -> Posed:
        """The head in the colours (0 to 1, as displayed) of the values at its vertices; clay where they are NaN."""
        pieces = tuple(
            _painted(shown, spread_over(piece, np.where(self.rig.skin, values, np.nan)), colours)
            for piece, shown in zip(self.head.pieces, self.posed.pieces, strict=True)
        )
        return replace(self.posed, pieces=pieces)

    def places(
        self, view: Viewpoint, shown: Picture, vertices: Int[np.ndarray, " n"]
    ) -> tuple[Float[np.ndarray, "n 2"], Bool[np.ndarray, " n"]]:
        """Column and row of the vertices in a picture, and which of them nothing hides."""
        points, normals = self.rig.neutral[vertices], self.posed.normals[vertices]
        return shown.pixel(view.project(points)), unhidden(points, normals, view, shown)


def sit(rig: Rig) -> Sitter:
    """Make the neutral of a rig ready."""
    head = make_head(rig)
    return Sitter(rig, head, pose(head, rig.neutral), face_regions(rig).anchors)


def _painted(shown: Shown, values: Float[np.ndarray, " u"], colours: Colours) -> Shown:
    on = np.isfinite(values)
    if not on.any():
        return shown
    linear, openness = shown.colours.copy(), shown.openness.copy()
    linear[on] = colours(values[on]) ** 2.2
    openness[on] = 1 - FLAT * (1 - openness[on])
    return replace(shown, colours=linear, openness=openness)
