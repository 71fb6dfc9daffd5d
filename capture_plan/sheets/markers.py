"""Marker sheets: where each marker goes on the actor's face, life size wherever the paper allows.

A sheet shows one view of the neutral with the markers that are seen in it, each with a leader line to its name in a
column beside the head. Lengths are millimetres; page coordinates run from the top left corner, y down.

Letters: n markers seen in a view, s places for labels.
"""

from dataclasses import dataclass, replace
from itertools import product
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float
from scipy.ndimage import minimum_filter

from capture_plan.errors import PlanError
from capture_plan.face.anchors import Anchors
from capture_plan.layout.record import Landmark
from capture_plan.sheets.head import Posed
from capture_plan.sheets.leaders import assign_anchors
from capture_plan.sheets.page import MARGIN_MM, Align, Booklet
from capture_plan.sheets.style import INK, SOFT, Look, Number
from capture_plan.sheets.view import Picture, PictureFrame, Viewpoint, picture, pixels

SCALES = (1.0, 1.25, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 8.0, 10.0, 20.0)  # head millimetres per page millimetre
HEADER_MM, FOOTER_MM = 31.0, 34.0
MARKER_MM = 1.45  # radius on the page
SQUEEZE, LONGEST_LEADER = 0.78, 0.52  # share of a label's width it can do with; of the page's width
LONGEST_LABEL_MM, LEAST_ROOM_MM = 26.0, 9.0
PROBE_DPI = 60  # of the quick picture that tells what is seen and where labels have room
SEEN_MM = 2.0  # a marker this much behind the surface in front of it is hidden
GRAZING = 0.12  # least cosine between the skin's normal and the view; below it a dot is only a stroke
BARE_MM, LEAST_NECK_MM = 35.0, 12.0  # shown above the highest and below the lowest marker
NEAR_MM = 16.0  # room beside the outermost marker
BELOW_MM, FADE_MM = 38.0, 22.0  # of neck shown below the lowest place that matters, and how long it fades


class Area(NamedTuple):
    """The part of the page that a view and its labels have."""

    x: Number
    y: Number
    width: Number
    height: Number


class LabelStyle(NamedTuple):
    """How a marker's number and name stand beside the head, the name left out at 0 pt; `least` and `most` are heights
    from label to label."""

    lines: int
    number_pt: float
    name_pt: float
    least: float
    most: float

    def width(self, book: Booklet, landmark: Landmark) -> Number:
        """Width of a marker's label on paper, millimetres."""
        number = book.width(landmark.name, self.number_pt, bold=True)
        if not self.name_pt:
            return 1.2 + number
        name = min(book.width(landmark.label, self.name_pt), LONGEST_LABEL_MM)
        return 1.2 + (max(number, name) if self.lines == 2 else number + 1.2 + name)

    def pitch(self, area: Area, n: int) -> float:
        """Half as many places again as are needed, if there is room for them."""
        return float(np.clip((area.height - 17) * 2 / max(1.5 * n, 1), self.least, self.most))

    def draw(self, book: Booklet, landmark: Landmark, look: Look, x: float, y: float, room: float) -> None:
        """Beside the end of the leader at (x, y), away from the head."""
        on_left = x < book.paper.width / 2
        align: Align = "right" if on_left else "left"
        x += -0.8 if on_left else 0.8
        down = 0.2 if self.lines == 2 else 0.9
        wide = book.text(x, y + down, landmark.name, self.number_pt, bold=True, align=align, colour=look.colour)
        if self.lines == 2:
            book.text(x, y + 2.7, landmark.label, self.name_pt, align=align, colour=SOFT, fit=room - 0.8)
        elif self.name_pt and room - wide > 4:
            x += -(wide + 1.2) if on_left else wide + 1.2
            book.text(x, y + 0.9, landmark.label, self.name_pt, align=align, colour=SOFT, fit=room - wide - 2)


TWO_LINES = LabelStyle(2, 8.5, 6.2, 6.2, 8.0)
ONE_LINE = LabelStyle(1, 7.0, 5.6, 2.6, 6.0)
NUMBERS = LabelStyle(1, 5.2, 0, 1.9, 4.0)  # of so many markers that their names have no room: the table has these


@dataclass(frozen=True, eq=False)
class MarkedFace:
    """What every marker sheet draws: the neutral in its pose, its landmarks, and the parts that stay clear."""

    posed: Posed
    skin: Bool[np.ndarray, " v"]
    landmarks: tuple[Landmark, ...]
    looks: dict[str, Look]
    anchors: Anchors

    @property
    def solid(self) -> Posed:
        """Without lashes, which hide no marker."""
        return replace(self.posed, pieces=tuple(p for p in self.posed.pieces if p.opacity.min() == 1))

    @property
    def positions(self) -> Float[np.ndarray, "n 3"]:
        """Places of the markers in the neutral, millimetres."""
        return np.array([landmark.position for landmark in self.landmarks]).reshape(-1, 3)

    @property
    def normals(self) -> Float[np.ndarray, "n 3"]:
        """Directions that the skin faces at the markers."""
        return self.posed.normals[[landmark.vertex for landmark in self.landmarks]]


@dataclass(frozen=True, eq=False)
class Placed:
    """One view on one page: the picture, the page place of its markers, and the room of their labels.

    A room is the place where its leader ends and how wide the label may be (x, y, width).
    """

    picture: Picture
    scale: Number
    area: Area
    style: LabelStyle
    landmarks: tuple[Landmark, ...]
    points: Float[np.ndarray, "n 2"]
    rooms: Float[np.ndarray, "n 3"]


def seen(face: MarkedFace, view: Viewpoint, shown: Picture) -> Bool[np.ndarray, " n"]:
    """Which landmarks face the viewer with nothing in front of them."""
    return unhidden(face.positions, face.normals, view, shown)


def unhidden(
    positions: Float[np.ndarray, "n 3"], normals: Float[np.ndarray, "n 3"], view: Viewpoint, shown: Picture
) -> Bool[np.ndarray, " n"]:
    """Which points of the skin face the viewer of a picture with nothing in front of them."""
    places = view.project(positions)
    pixel = np.floor(shown.pixel(places)).astype(int)
    height, width = shown.z.shape
    inside = (pixel >= 0).all(axis=1) & (pixel[:, 0] < width) & (pixel[:, 1] < height)
    column, row = np.clip(pixel, 0, [width - 1, height - 1]).T
    facing = view.project(normals)[:, 2] > GRAZING
    # the skin of a nose's wing goes back by millimetres within a pixel: what lies behind it lies behind all around it
    front = minimum_filter(np.where(np.isfinite(shown.z), shown.z, -np.inf), size=3)
    return inside & facing & (places[:, 2] > front[row, column] - SEEN_MM)


def place(face: MarkedFace, view: Viewpoint, book: Booklet, *, dpi: Number) -> Placed:
    """The largest scale at which the head and its labels fit on the page, and every label's place."""
    area = Area(MARGIN_MM, HEADER_MM, book.paper.width - 2 * MARGIN_MM, book.paper.height - HEADER_MM - FOOTER_MM)
    named, bare = product(SCALES, (TWO_LINES, ONE_LINE)), product(SCALES, (NUMBERS,))
    for scale, style in (*named, *bare):
        widths = {m.name: style.width(book, m) for m in face.landmarks}
        column = max(widths.values(), default=0.0)
        frame = _frame(face, view, area.width * scale, area.height * scale, column * scale)
        if frame is None:
            continue
        probe = picture(face.solid, view, frame, size_px=pixels(frame.width / scale, frame.height / scale, PROBE_DPI))
        visible = seen(face, view, probe)
        landmarks = tuple(m for m, there in zip(face.landmarks, visible.tolist(), strict=True) if there)
        rooms = _free_rooms(probe, scale, area, column, style.pitch(area, len(landmarks)))
        if len(rooms) < len(landmarks):
            continue
        points = _on_page(view.project(face.positions[visible]), frame, scale, area)
        labels = np.array([widths[m.name] for m in landmarks])
        chosen = assign_anchors(points, rooms[:, :2], _clear(face, view, frame, scale, area), labels, rooms[:, 2])
        if scale < SCALES[-1] and not _readable(points, rooms[chosen], labels, area):
            continue
        shown = picture(face.posed, view, frame, size_px=pixels(frame.width / scale, frame.height / scale, dpi))
        return Placed(shown, scale, area, style, landmarks, points, rooms[chosen])
    raise PlanError(f"{len(face.landmarks)} markers do not fit on {book.paper.name} paper: plan fewer landmarks")


def draw_markers(book: Booklet, placed: Placed, looks: dict[str, Look]) -> None:
    """The head, leaders, markers, and labels on the last page."""
    frame = placed.picture.frame
    book.image(
        placed.picture.rgb, placed.area.x, placed.area.y, frame.width / placed.scale, frame.height / placed.scale
    )
    ends = placed.rooms[:, :2]
    for point, end in zip(placed.points, ends, strict=True):
        book.line(point, end, width=0.7, colour="#ffffff")
    for point, end in zip(placed.points, ends, strict=True):
        book.line(point, end, width=0.16, colour=INK)
    for landmark, point, (x, y, room) in zip(placed.landmarks, placed.points, placed.rooms.tolist(), strict=True):
        look = looks[landmark.region]
        book.marker(float(point[0]), float(point[1]), look, radius=MARKER_MM, hollow=landmark.role == "backup")
        placed.style.draw(book, landmark, look, float(x), float(y), float(room))


def _readable(
    points: Float[np.ndarray, "n 2"], rooms: Float[np.ndarray, "n 3"], labels: Float[np.ndarray, " n"], area: Area
) -> bool:
    """No name has to be cut short, and no leader runs across much more than half the page."""
    length = np.linalg.norm(points - rooms[:, :2], axis=1)
    return bool((rooms[:, 2] >= SQUEEZE * labels).all() and (length < LONGEST_LEADER * area.width).all())


def _frame(face: MarkedFace, view: Viewpoint, width: Number, height: Number, column: Number) -> PictureFrame | None:
    """The part of view space a picture of this size shows, or nothing where the face does not fit."""
    head = view.project(face.posed.vertices[face.skin])
    marks = view.project(face.positions)
    facing_up = view.project(face.posed.normals[face.skin])[:, 2]
    middle, unit = float(view.project(face.anchors.chin[None])[0, 0]), face.anchors.pupils
    top = head[:, 1].max() + 2
    low = min(marks[:, 1].min(), float(view.project(face.anchors.chin[None])[0, 1]))
    crown = min(max(marks[:, 1].max() + BARE_MM, float(face.anchors.eye_left[1]) + unit), top)
    cut = top > low - LEAST_NECK_MM + height  # the crown bears no markers and may fade away
    top = min(top, low - LEAST_NECK_MM + height)
    if top < crown:
        return None
    front = head[(np.abs(head[:, 0] - middle) < 0.3 * unit) & (head[:, 1] < low) & (facing_up > GRAZING)]
    neck_end = front[:, 1].min() if len(front) else low
    bottom = max(top - height, low - BELOW_MM, min(neck_end, low - 6))
    on = head[head[:, 1] > bottom + FADE_MM / 2]
    towards = view.project(face.normals)[:, 2] > GRAZING
    facing = marks[towards] if towards.any() else marks
    left, right = on[:, 0].min(), on[:, 0].max()
    need_left, need_right = facing[:, 0].min() - 4, facing[:, 0].max() + 4
    start, blank_left, blank_right = (left + right - width) / 2, 0.0, 0.0
    if view.azimuth > 0:  # the profile keeps a column for labels, the back of the head gives way to another
        start = left - max(column, (width - (right - left)) / 2)
        blank_right = column if right + column > start + width else 0.0
    elif view.azimuth < 0:
        start = right + max(column, (width - (right - left)) / 2) - width
        blank_left = column if left - column < start else 0.0
    if need_left - start < NEAR_MM + blank_left or start + width - need_right < NEAR_MM + blank_right:
        return None
    return PictureFrame(start, start + width, bottom, top, FADE_MM, blank_left, blank_right, FADE_MM if cut else 0.0)


def _on_page(
    places: Float[np.ndarray, "n 3"], frame: PictureFrame, scale: Number, area: Area
) -> Float[np.ndarray, "n 2"]:
    x = area.x + (places[:, 0] - frame.left) / scale
    y = area.y + (frame.top - places[:, 1]) / scale
    return np.stack([x, y], axis=1)


def _free_rooms(probe: Picture, scale: float, area: Area, column: float, pitch: float) -> Float[np.ndarray, "s 3"]:
    """Rooms for labels along both edges, `pitch` apart, as wide as the head drawn beside them leaves free."""
    drawn = (probe.rgb.min(axis=2) < 246) & np.isfinite(probe.z)
    per_mm, least = probe.z.shape[1] / area.width, min(LEAST_ROOM_MM, column)
    rooms = []
    for row in np.arange(area.y + 13, area.y + area.height - 4, pitch):
        rows = slice(
            max(int((row - area.y - min(pitch / 2, 3.4)) * per_mm), 0),
            int((row - area.y + min(pitch / 2, 3.6)) * per_mm),
        )
        columns = np.flatnonzero(drawn[rows].any(axis=0))
        free = (columns[0], drawn.shape[1] - columns[-1]) if len(columns) else (drawn.shape[1],) * 2
        left, right = (min(column, edge / per_mm - 1.5) for edge in free)
        if left >= least:
            rooms.append((area.x + left, row, left))
        if right >= least:
            rooms.append((area.x + area.width - right, row, right))
    return np.array(rooms).reshape(-1, 3)


def _clear(
    face: MarkedFace, view: Viewpoint, frame: PictureFrame, scale: Number, area: Area
) -> Float[np.ndarray, "d 4"]:
    """Ellipses on the page around the openings of the eyes and of the mouth."""
    a = face.anchors
    eye, mouth = 0.24 * a.pupils / scale, float(np.linalg.norm(a.corner_left - a.corner_right)) / 2 / scale
    squeeze = np.cos(np.radians(view.azimuth))
    centres = _on_page(view.project(np.stack([a.eye_left, a.eye_right, a.mouth])), frame, scale, area)
    half = np.array([[eye * squeeze, eye * 0.5], [eye * squeeze, eye * 0.5], [mouth * squeeze, mouth * 0.35]])
    return np.concatenate([centres, half], axis=1)
