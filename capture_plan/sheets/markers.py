"""Marker sheets: where each marker goes on the actor's face, life size wherever the paper allows.

A sheet shows one view of the neutral with the markers that are seen in it, each with a leader line to its name in a
column beside the head. Lengths are millimetres; page coordinates run from the top left corner, y down.

Letters: n markers seen in a view, s places for labels.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from capture_plan.layout.record import Landmark
from capture_plan.rig.anchors import Anchors
from capture_plan.sheets.head import Posed
from capture_plan.sheets.leaders import assign_anchors
from capture_plan.sheets.page import MARGIN_MM, Booklet
from capture_plan.sheets.style import INK, SOFT, Look
from capture_plan.sheets.view import Frame, Picture, View, picture, pixels

SCALES = (1.0, 1.25, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 8.0, 10.0, 20.0)  # head millimetres per page millimetre
HEADER_MM, FOOTER_MM = 31.0, 34.0
MARKER_MM = 1.45  # radius on the page
LABEL_PT, NAME_PT = 8.5, 6.2
SEEN_MM = 2.0  # a marker this much behind the surface in front of it is hidden
GRAZING = 0.12  # least cosine between the skin's normal and the view; below it a dot is only a stroke
BELOW_MM, FADE_MM = 38.0, 22.0  # of neck shown below the lowest place that matters, and how long it fades


@dataclass(frozen=True, eq=False)
class Face:
    """What every marker sheet draws: the neutral in its pose, its landmarks, and the parts that stay clear."""

    posed: Posed
    skin: Bool[np.ndarray, " v"]
    landmarks: tuple[Landmark, ...]
    looks: dict[str, Look]
    anchors: Anchors

    @property
    def positions(self) -> Float[np.ndarray, "n 3"]:
        return np.array([landmark.position for landmark in self.landmarks]).reshape(-1, 3)

    @property
    def normals(self) -> Float[np.ndarray, "n 3"]:
        return self.posed.normals[[landmark.vertex for landmark in self.landmarks]]


@dataclass(frozen=True, eq=False)
class Placed:
    """One view on one page: the picture, the page place of its markers, and where their labels stand."""

    picture: Picture
    scale: float
    origin: tuple[float, float]
    landmarks: tuple[Landmark, ...]
    points: Float[np.ndarray, "n 2"]
    ends: Float[np.ndarray, "n 2"]


def seen(face: Face, view: View, shown: Picture) -> Bool[np.ndarray, " n"]:
    """Which landmarks face the viewer with nothing in front of them."""
    places = view.project(face.positions)
    pixel = np.floor(shown.pixel(places)).astype(int)
    height, width = shown.z.shape
    inside = (pixel >= 0).all(axis=1) & (pixel[:, 0] < width) & (pixel[:, 1] < height)
    column, row = np.clip(pixel, 0, [width - 1, height - 1]).T
    facing = view.project(face.normals)[:, 2] > GRAZING
    return inside & facing & (places[:, 2] > shown.z[row, column] - SEEN_MM)


def place(face: Face, view: View, book: Booklet, *, dpi: float) -> Placed:
    """The largest scale at which the head and its labels fit on the page, and every label's place."""
    area = (MARGIN_MM, HEADER_MM, book.paper.width - 2 * MARGIN_MM, book.paper.height - HEADER_MM - FOOTER_MM)
    column = max((_label_width(book, landmark) for landmark in face.landmarks), default=0.0) + 1.0
    for scale in SCALES:
        frame = _frame(face, view, area[2] * scale, area[3] * scale, column * scale)
        if frame is None and scale < SCALES[-1]:
            continue
        assert frame is not None
        shown = picture(face.posed, view, frame, size_px=pixels(frame.width / scale, frame.height / scale, dpi))
        visible = seen(face, view, shown)
        landmarks = tuple(m for m, there in zip(face.landmarks, visible.tolist(), strict=True) if there)
        origin = (area[0], area[1])
        points = _on_page(view.project(face.positions[visible]), frame, scale, origin)
        anchors = _free_places(shown, scale, area, column, len(landmarks))
        if len(anchors) >= len(landmarks) or scale == SCALES[-1]:
            clear = _clear(face, view, frame, scale, origin)
            ends = anchors[assign_anchors(points, anchors, clear)]
            return Placed(shown, scale, origin, landmarks, points, ends)
    raise AssertionError("the last scale returns or raises")


def draw_markers(book: Booklet, placed: Placed, looks: dict[str, Look]) -> None:
    """The head, leaders, markers, and labels on the last page."""
    frame = placed.picture.frame
    book.image(placed.picture.rgb, *placed.origin, frame.width / placed.scale, frame.height / placed.scale)
    middle = book.paper.width / 2
    for point, end in zip(placed.points, placed.ends, strict=True):
        book.line(point, end, width=0.75, colour="#ffffff")
    for point, end in zip(placed.points, placed.ends, strict=True):
        book.line(point, end, width=0.16, colour=INK)
    for landmark, point, end in zip(placed.landmarks, placed.points, placed.ends, strict=True):
        book.marker(*point, looks[landmark.region], radius=MARKER_MM, hollow=landmark.role == "backup")
        on_left = end[0] < middle
        x, align = (end[0] - 0.8, "right") if on_left else (end[0] + 0.8, "left")
        book.text(x, end[1] + 0.2, landmark.name, LABEL_PT, bold=True, align=align, colour=looks[landmark.region].colour)
        book.text(x, end[1] + 2.7, landmark.label, NAME_PT, align=align, colour=SOFT)


def _label_width(book: Booklet, landmark: Landmark) -> float:
    return 0.8 + max(book.width(landmark.name, LABEL_PT, bold=True), min(book.width(landmark.label, NAME_PT), 24.0))


def _frame(face: Face, view: View, width: float, height: float, column: float) -> Frame | None:
    """The part of view space a picture of this size shows, or nothing where the face does not fit."""
    head = view.project(face.posed.vertices[face.skin])
    marks = view.project(face.positions)
    facing_up = view.project(face.posed.normals[face.skin])[:, 2]
    middle, unit = float(view.project(face.anchors.chin[None])[0, 0]), face.anchors.pupils
    top = head[:, 1].max() + 2
    low = min(marks[:, 1].min(), float(view.project(face.anchors.chin[None])[0, 1]))
    if top - (low - 12) > height:
        return None
    front = head[(np.abs(head[:, 0] - middle) < 0.3 * unit) & (head[:, 1] < low) & (facing_up > GRAZING)]
    neck_end = front[:, 1].min() if len(front) else low
    bottom = max(top - height, low - BELOW_MM, min(neck_end, low - 6))
    on = head[head[:, 1] > bottom + FADE_MM / 2]
    facing = marks[view.project(face.normals)[:, 2] > GRAZING]
    left, right = on[:, 0].min(), on[:, 0].max()
    need_left, need_right = facing[:, 0].min() - 4, facing[:, 0].max() + 4
    if right - left <= width:
        start = (left + right - width) / 2
        fade_left = fade_right = 0.0
        if need_right - need_left + 2 * column > width:
            return None
    elif need_left - left > right - need_right:  # the back of the head is on the picture's left
        start, fade_right = right + column - width, 0.0
        fade_left = column + 22
        if start + column > need_left:
            return None
    else:
        start, fade_left = left - column, 0.0
        fade_right = column + 22
        if start + width - column < need_right:
            return None
    return Frame(start, start + width, bottom, top, FADE_MM, fade_left, fade_right)


def _on_page(
    places: Float[np.ndarray, "n 3"], frame: Frame, scale: float, origin: tuple[float, float]
) -> Float[np.ndarray, "n 2"]:
    x = origin[0] + (places[:, 0] - frame.left) / scale
    y = origin[1] + (frame.top - places[:, 1]) / scale
    return np.stack([x, y], axis=1)


def _free_places(
    shown: Picture, scale: float, area: tuple[float, float, float, float], column: float, n: int
) -> Float[np.ndarray, "s 2"]:
    """Ends of labels in the two columns, at least a label's height apart, where no head is drawn behind the label."""
    x, y, width, _ = area
    height = shown.frame.height / scale
    pitch = float(np.clip((height - 16) * 2 / max(1.6 * n, 1), 6.2, 8.0))
    drawn = (shown.rgb.min(axis=2) < 244) & np.isfinite(shown.z)
    per_mm = shown.z.shape[1] / width
    places = []
    for row in np.arange(y + 14, y + height - 4, pitch):
        rows = slice(max(int((row - y - 4) * per_mm), 0), int((row - y + 4) * per_mm))
        for end, columns in (
            (x + column, slice(0, int((column + 1) * per_mm))),
            (x + width - column, slice(int((width - column - 1) * per_mm), None)),
        ):
            if not drawn[rows, columns].any():
                places.append((end, row))
    return np.array(places).reshape(-1, 2)


def _clear(
    face: Face, view: View, frame: Frame, scale: float, origin: tuple[float, float]
) -> Float[np.ndarray, "d 4"]:
    """Ellipses on the page around the openings of the eyes and of the mouth."""
    a = face.anchors
    eye, mouth = 0.24 * a.pupils / scale, float(np.linalg.norm(a.corner_left - a.corner_right)) / 2 / scale
    squeeze = np.cos(np.radians(view.azimuth))
    centres = _on_page(view.project(np.stack([a.eye_left, a.eye_right, a.mouth])), frame, scale, origin)
    half = np.array([[eye * squeeze, eye * 0.5], [eye * squeeze, eye * 0.5], [mouth * squeeze, mouth * 0.35]])
    return np.concatenate([centres, half], axis=1)

