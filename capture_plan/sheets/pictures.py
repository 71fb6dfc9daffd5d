"""The same pictures for the screen: each expression, and the markers on the face, without page or names."""

from typing import NamedTuple

import numpy as np
from jaxtyping import UInt8
from PIL import Image, ImageDraw

from capture_plan.anatomy.regions import face_regions
from capture_plan.plan.record import Plan
from capture_plan.progress import track
from capture_plan.rig import Rig
from capture_plan.sheets.expression_page import Sizes, portrait, shoot
from capture_plan.sheets.head import make_head, pose
from capture_plan.sheets.markers import MarkedFace, seen
from capture_plan.sheets.style import outline, region_looks
from capture_plan.sheets.view import FRONT, LEFT, RIGHT, Picture, Viewpoint, picture

ASPECT = 0.76  # width over height
MARKER = 0.009  # radius of a marker over the picture's height
FINER = 4  # markers are drawn this much larger and scaled down, for smooth edges


class ExpressionPictures(NamedTuple):
    """One expression; the colours of `heat` run from 0 to `scale_mm`."""

    front: Image.Image
    three_quarter: Image.Image
    heat: Image.Image
    scale_mm: float


def image_of(pixels: UInt8[np.ndarray, "p q 3"]) -> Image.Image:
    """An image of pixels as they are."""
    return Image.fromarray(pixels)


def expression_pictures(plan: Plan, rig: Rig, *, height_px: int) -> dict[str, ExpressionPictures]:
    """Pictures of every expression by its name."""
    head, anchors = make_head(rig), face_regions(rig).anchors
    size = (round(ASPECT * height_px), height_px)
    made = {}
    for e in track(plan.packing.expressions, "Drawing expressions"):
        shot = shoot(head, anchors, e, mu=plan.settings.expressions.mu, sizes=Sizes(size, size, size))
        images = (Image.fromarray(each.rgb) for each in (shot.front, shot.three_quarter, shot.heat))
        made[e.name] = ExpressionPictures(*images, scale_mm=shot.scale_mm)
    return made


def marker_pictures(plan: Plan, rig: Rig, *, height_px: int) -> dict[str, Image.Image]:
    """The neutral with its markers: `front`, `left` (the subject's left three-quarter) and `right`."""
    anchors, landmarks = face_regions(rig).anchors, plan.layout.markers
    face = MarkedFace(pose(make_head(rig), rig.neutral), rig.skin, landmarks, region_looks(landmarks), anchors)
    size = (round(ASPECT * height_px), height_px)
    return {
        name: _with_markers(face, view, picture(face.posed, view, portrait(rig, anchors, view, ASPECT), size_px=size))
        for name, view in (("front", FRONT), ("left", LEFT), ("right", RIGHT))
    }


def _with_markers(face: MarkedFace, view: Viewpoint, shown: Picture) -> Image.Image:
    """The picture with the markers that are seen in it."""
    height, width = shown.z.shape
    solid = picture(face.solid, view, shown.frame, size_px=(width, height))
    image = Image.fromarray(shown.rgb)
    places = shown.pixel(view.project(face.positions))
    for landmark, place, there in zip(face.landmarks, places, seen(face, view, solid).tolist(), strict=True):
        if there:
            look = face.looks[landmark.region]
            _stamp(image, place, look.shape, look.colour, MARKER * height)
    return image


def _stamp(image: Image.Image, place: np.ndarray, shape: str, colour: str, radius: float) -> None:
    """A shape with a white rim, its centre at `place` (column, row) to a fraction of a pixel."""
    corner = np.floor(place - 2 * radius - 1).astype(int)
    side = int(np.ceil(4 * radius + 3))
    corners = (outline(shape) * radius + place - corner) * FINER
    for grown, fill in ((1.45, "#ffffff"), (1.0, colour)):
        mask = Image.new("L", (side * FINER, side * FINER))
        middle = (place - corner) * FINER
        ImageDraw.Draw(mask).polygon([tuple(c) for c in ((corners - middle) * grown + middle).tolist()], fill=255)
        image.paste(fill, (int(corner[0]), int(corner[1])), mask.resize((side, side), Image.Resampling.BOX))
