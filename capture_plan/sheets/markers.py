"""Marker sheets: each marker once, on the page where it is seen best, its number beside it, life size.

A page shows one view of the neutral between brow and chin, cropped to what is needed, and beside it a row for each of
its markers at about its height: number, place, and two distances to points that everybody finds on a face. Nothing
leads from row to marker but the number. Lengths are millimetres; page coordinates run from the top left corner, y down.

Scale    one for all pages of a booklet, 1:1 but for giants; a view that is wider than the paper takes several pages
Crowd    where numbers or rows have no room, the page's markers are shared out from top to bottom over several

Letters: n markers of a page.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.ndimage import minimum_filter

from capture_plan.anatomy.regions import mirrored_label
from capture_plan.anatomy.zones import DOT_MM
from capture_plan.errors import PlanError
from capture_plan.evaluation.rings import Direction
from capture_plan.face.anchors import Anchors
from capture_plan.layout.record import Landmark
from capture_plan.sheets.head import Posed
from capture_plan.sheets.number_places import NumberPlaces, place_numbers
from capture_plan.sheets.page import MARGIN_MM, Align, Booklet
from capture_plan.sheets.style import INK, SOFT, Look, Number
from capture_plan.sheets.tape import Measure, TapePoint, measured_from
from capture_plan.sheets.view import Picture, PictureFrame, Viewpoint, picture, pixels
from capture_plan.sheets.which_page import NOWHERE, VIEWS, page_of_each

SCALES = (1.0, 1.25, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 8.0, 10.0, 20.0, 50.0)  # head millimetres per page millimetre
TILES = 4  # pages of a view, before the scale gives way
HEADER_MM, FOOTER_MM = 31.0, 34.0
ROW_WIDTH_MM, ROW_MM, ROW_TOP_MM = 37.0, 7.2, 8.0
SYMBOL_MM = 1.45  # least radius of a marker's shape on the page
POINT_MM = 0.25  # radius of the dot in the middle of each shape: where the tip of the pen goes
NUMBER_PT, SMALL_PT = 12, 7.0
LETTER_HIGH = 0.72  # height of a capital over the size of its letters
CROSS_MM = 1.3  # half of the cross at a point to measure from
LETTER_MM = 1.6  # from the cross to the middle of its letter, sideways and in height
PROBE_DPI = 60  # of the quick picture that tells what is seen
SUNK_MM = 10.0  # a corner of an eye or of the mouth lies this deep in its fold
SEEN_MM = 2.0  # a marker this much behind the surface in front of it is hidden
FLAT = 0.5  # of a direction's length that a page shows, at least
GRAZING = 0.12  # least cosine between the skin's normal and the view; below it a dot is only a stroke
ABOVE_MM, BELOW_MM, BESIDE_MM = 25.0, 14.0, 13.0  # of the head shown around the markers of a page
FADE_MM = 9.0
SIDE_BLANK = 0.01  # what makes a picture fade at its sides too


@dataclass(frozen=True, eq=False)
class MarkedFace:
    """What every marker sheet draws: the neutral in its pose and its landmarks.

    `tape` are the points that places are measured from, `rings` how far a marker may stand from its place, millimetres,
    by its name, and `dot_mm` the diameter of a marker. `own`: the face is the actor's own, and no model to be scaled;
    `off_mm` is how far places on it are off, mostly.
    `strict` are directions in which a marker has to stand most exactly, `kept` is the share of crews within all rings
    that keep the error. `nobodys`: the face is a generic one, nothing is measured on it.
    """

    posed: Posed
    skin: Bool[np.ndarray, " v"]
    landmarks: tuple[Landmark, ...]
    looks: dict[str, Look]
    anchors: Anchors
    tape: tuple[TapePoint, ...] = ()
    rings: Mapping[str, float] = field(default_factory=dict)
    dot_mm: float = DOT_MM
    own: bool = False
    off_mm: float = 0.0
    strict: Mapping[str, Direction] = field(default_factory=dict)
    kept: float = 1.0
    nobodys: bool = False

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

    def rim_mm(self, landmark: Landmark) -> float:
        """Radius within which the whole dot lies wherever it may stand."""
        return self.dot_mm / 2 + self.rings.get(landmark.name, 0.0)

    def measure(self, landmark: Landmark) -> Measure | None:
        """From where the place of a marker is measured; None where it cannot be, or on nobody's face."""
        if self.nobodys:
            return None
        image = next((one for one in self.landmarks if one.label == mirrored_label(landmark.label)), landmark)
        twin = (image, self.posed.normals[image.vertex])
        return measured_from(landmark, self.posed.normals[landmark.vertex], self.tape, twin)


class Row(NamedTuple):
    """What is said of a marker beside the face: where its row begins and whether that is on the left."""

    x: Number
    y: Number
    on_left: bool


@dataclass(frozen=True, eq=False)
class Placed:
    """One page: the picture and where it lies, its markers with their numbers and rows, points to measure from."""

    view: Viewpoint
    picture: Picture
    scale: Number
    corner: tuple[float, float]
    landmarks: tuple[Landmark, ...]
    points: Float[np.ndarray, "n 2"]
    numbers: NumberPlaces
    rows: tuple[Row, ...]
    crosses: tuple[tuple[TapePoint, tuple[float, float]], ...]

    def mirrored(self, width: Number) -> "Placed":
        """The page as the make-up mirror shows the face, on paper of this width."""
        turn = np.array([-1, 1])
        frame = self.picture.frame
        flipped = frame._replace(left=-frame.right, right=-frame.left)
        wide = frame.width / self.scale
        return replace(
            self,
            view=replace(self.view, mirrored=True),
            picture=Picture(np.ascontiguousarray(self.picture.rgb[:, ::-1]), self.picture.z[:, ::-1], flipped),
            corner=(width - self.corner[0] - wide, self.corner[1]),
            points=self.points * turn + [width, 0],
            numbers=NumberPlaces(self.numbers.middle * turn + [width, 0], self.numbers.ticks * turn + [width, 0]),
            rows=tuple(Row(width - row.x, row.y, not row.on_left) for row in self.rows),
            crosses=tuple((point, (width - x, y)) for point, (x, y) in self.crosses),
        )


def seen(face: MarkedFace, view: Viewpoint, shown: Picture) -> Bool[np.ndarray, " n"]:
    """Which landmarks face the viewer with nothing in front of them."""
    return unhidden(face.positions, face.normals, view, shown)


def unhidden(
    positions: Float[np.ndarray, "n 3"], normals: Float[np.ndarray, "n 3"], view: Viewpoint, shown: Picture
) -> Bool[np.ndarray, " n"]:
    """Which points of the skin face the viewer of a picture with nothing in front of them."""
    return in_front(view.project(positions), shown) & (view.project(normals)[:, 2] > GRAZING)


def in_front(places: Float[np.ndarray, "n 3"], shown: Picture, *, deep: float = SEEN_MM) -> Bool[np.ndarray, " n"]:
    """Which places of view space a picture shows with nothing in front of them but what is no deeper, millimetres."""
    pixel = np.floor(shown.pixel(places)).astype(int)
    height, width = shown.z.shape
    inside = (pixel >= 0).all(axis=1) & (pixel[:, 0] < width) & (pixel[:, 1] < height)
    column, row = np.clip(pixel, 0, [width - 1, height - 1]).T
    # the skin of a nose's wing goes back by millimetres within a pixel: what lies behind it lies behind all around it
    front = minimum_filter(np.where(np.isfinite(shown.z), shown.z, -np.inf), size=3)
    return inside & (places[:, 2] > front[row, column] - deep)


def _probe(face: MarkedFace, view: Viewpoint) -> Picture:
    """A quick picture of all that faces the viewer near the markers."""
    places = view.project(face.positions)
    low, high = places[:, :2].min(axis=0) - BESIDE_MM, places[:, :2].max(axis=0) + BESIDE_MM
    frame = PictureFrame(float(low[0]), float(high[0]), float(low[1]), float(high[1]))
    size = pixels(min(frame.width, 600.0), min(frame.height, 600.0), PROBE_DPI)
    return picture(face.solid, view, frame, size_px=(max(size[0], 8), max(size[1], 8)))


def place_all(face: MarkedFace, book: Booklet, *, dpi: Number) -> tuple[list[Placed], tuple[Landmark, ...]]:
    """Every page of markers, all of one scale, and the markers that no view shows.

    Raises:
        PlanError: the markers do not fit on the paper.
    """
    of_each = page_of_each(face.normals, np.stack([seen(face, view, _probe(face, view)) for view in VIEWS]))
    groups = [(view, np.flatnonzero(of_each == w)) for w, view in enumerate(VIEWS) if (of_each == w).any()]
    scale, tiles = _tiles(face, groups, book)
    pages = [page for view, at in tiles for page in _pages(face, view, at, book, scale, dpi)]
    return pages, tuple(face.landmarks[n] for n in np.flatnonzero(of_each == NOWHERE))


def _tiles(
    face: MarkedFace, groups: list[tuple[Viewpoint, Int[np.ndarray, " n"]]], book: Booklet
) -> tuple[float, list[tuple[Viewpoint, Int[np.ndarray, " n"]]]]:
    """The scale of all pages, and the markers of each: at 1:1 but for a giant's head, which would take more than TILES
    pages a view."""
    wide, high = _room(book)
    for scale in SCALES:
        tiles = [(view, _fitting(face, view, at, (wide * scale, high * scale))) for view, at in groups]
        if all(len(parts) <= TILES for _, parts in tiles):
            return scale, [(view, part) for view, parts in tiles for part in parts]
    raise PlanError(f"{len(face.landmarks)} markers do not fit on {book.paper.name} paper: take a larger paper")


def _fitting(
    face: MarkedFace, view: Viewpoint, at: Int[np.ndarray, " n"], room: tuple[float, float]
) -> list[Int[np.ndarray, " n"]]:
    """The markers of a view in as many parts as have room in a picture, halved where they reach furthest."""
    need = _needed(face, view, at)
    over = need.width / room[0], need.height / room[1]
    if max(over) <= 1 or len(at) == 1:
        return [at]
    along = view.project(face.positions[at])[:, int(over[1] > over[0])]
    order = at[np.argsort(-along, kind="stable")]
    halves = (order[: len(order) // 2], order[len(order) // 2 :])
    return [part for half in halves for part in _fitting(face, view, np.sort(half), room)]


def _room(book: Booklet) -> tuple[float, float]:
    """Width and height of the picture, millimetres of paper."""
    wide = book.paper.width - 2 * (MARGIN_MM + ROW_WIDTH_MM)
    return float(wide), float(book.paper.height - HEADER_MM - FOOTER_MM - ROW_TOP_MM)


def _needed(face: MarkedFace, view: Viewpoint, at: Int[np.ndarray, " n"]) -> PictureFrame:
    """The part of view space that holds the page's markers with the face around them."""
    places = view.project(face.positions[at])
    low, high = places[:, :2].min(axis=0), places[:, :2].max(axis=0)
    bottom, top = float(low[1]) - BELOW_MM, float(high[1]) + BESIDE_MM
    return PictureFrame(float(low[0]) - BESIDE_MM, float(high[0]) + BESIDE_MM, bottom, top)


def _frame(face: MarkedFace, view: Viewpoint, at: Int[np.ndarray, " n"], wide: float, high: float) -> PictureFrame:
    """What a page shows of view space: its markers, from brow to chin where there is room, as wide as there is room."""
    need, a = _needed(face, view, at), face.anchors
    features = np.stack([a.eye_left, a.eye_right, a.mouth, a.chin, a.nose_tip])
    marks = view.project(face.positions)
    y = view.project(features)[:, 1]
    skin = view.project(face.posed.vertices[face.skin])
    top = min(max(need.top, float(max(y.max(), marks[:, 1].max())) + ABOVE_MM), need.bottom + high)
    top = max(min(top, float(skin[:, 1].max()) + 2), need.top)
    bottom = max(min(need.bottom, float(y.min()) - BELOW_MM), top - high)
    x = view.project(features)[:, 0]
    left, right = min(need.left, float(x.min()) - BESIDE_MM), max(need.right, float(x.max()) + BESIDE_MM)
    middle = float(x.mean()) if view.azimuth == 0 else (left + right) / 2
    middle = float(np.clip(middle, need.right - wide / 2, need.left + wide / 2))
    return PictureFrame(middle - wide / 2, middle + wide / 2, bottom, top, FADE_MM, SIDE_BLANK, SIDE_BLANK, FADE_MM)


def _pages(
    face: MarkedFace, view: Viewpoint, at: Int[np.ndarray, " n"], book: Booklet, scale: float, dpi: Number
) -> list[Placed]:
    """The page of a view, or two or more where its markers are too many for one."""
    wide, high = _room(book)
    frame = _frame(face, view, at, wide * scale, high * scale)
    corner = (float(MARGIN_MM + ROW_WIDTH_MM), HEADER_MM + ROW_TOP_MM)
    points = _on_page(view.project(face.positions[at]), frame, scale, corner)
    rows = _rows(points[:, 0], points[:, 1], book)
    crosses = _crosses(face, view, at, frame, scale, corner)
    sizes = np.array([_number_size(book, face.landmarks[n]) for n in at]).reshape(-1, 2)
    held = np.array([_cross_box(x, y) for _, (x, y) in crosses]).reshape(-1, 4)
    edges = (corner[0], corner[1], corner[0] + wide, corner[1] + frame.height / scale)
    rims = np.array([face.rim_mm(face.landmarks[n]) for n in at]) / scale
    crowded = np.full(len(at), face.dot_mm / 2 / scale)
    numbers = None
    for radii in (rims, crowded) if rows else ():  # numbers may lie on a ring, where there is no other place
        numbers = numbers or place_numbers(points, sizes, np.maximum(radii, SYMBOL_MM), held, edges)
    if numbers is None and len(at) > 1:
        order = at[np.argsort(-view.project(face.positions[at])[:, 1], kind="stable")]
        halves = (order[: len(order) // 2], order[len(order) // 2 :])
        return [page for half in halves for page in _pages(face, view, np.sort(half), book, scale, dpi)]
    if numbers is None or rows is None:
        raise PlanError(f"a marker's number has no room on {book.paper.name} paper: take a larger paper")
    shown = picture(face.posed, view, frame, size_px=pixels(wide, frame.height / scale, dpi))
    landmarks = tuple(face.landmarks[n] for n in at)
    return [Placed(view, shown, scale, corner, landmarks, points, numbers, rows, crosses)]


def _number_size(book: Booklet, landmark: Landmark) -> tuple[float, float]:
    """Width and height of a marker's number on paper, millimetres."""
    high = NUMBER_PT * 25.4 / 72 * LETTER_HIGH
    return float(book.width(landmark.name, NUMBER_PT, bold=True)) + 0.5, high + 0.5


def _cross_box(x: float, y: float) -> tuple[float, float, float, float]:
    """What a cross and its letter take, wherever that stands: middle, half width and half height."""
    return x, y, LETTER_MM + 0.8, LETTER_MM + 0.8


def _crosses(
    face: MarkedFace,
    view: Viewpoint,
    at: Int[np.ndarray, " n"],
    frame: PictureFrame,
    scale: float,
    corner: tuple[float, float],
) -> tuple[tuple[TapePoint, tuple[float, float]], ...]:
    """The points that this page's markers are measured from, where the picture shows them, with their places on it."""
    measures = [face.measure(face.landmarks[n]) for n in at]
    used = list(dict.fromkeys(p for measure in measures if measure for p in measure.points))
    if not used:
        return ()
    places = view.project(np.array([p.position for p in used]))
    size = pixels(min(frame.width, 600.0), min(frame.height, 600.0), PROBE_DPI)
    shown = in_front(places, picture(face.solid, view, frame, size_px=size), deep=SUNK_MM)
    on_page = _on_page(places, frame, scale, corner).tolist()
    return tuple((used[i], (on_page[i][0], on_page[i][1])) for i in np.flatnonzero(shown))


def _rows(x: Float[np.ndarray, " n"], y: Float[np.ndarray, " n"], book: Booklet) -> tuple[Row, ...] | None:
    """A row for each marker beside the face, near its height and on its side; None where they have no room."""
    top, bottom = HEADER_MM + ROW_TOP_MM + 2.0, book.paper.height - FOOTER_MM - ROW_MM + 3.0
    room = int((bottom - top) // ROW_MM) + 1
    middle = book.paper.width / 2
    left = x < middle - 0.5
    for n in np.flatnonzero(np.abs(x - middle) <= 0.5)[np.argsort(y[np.abs(x - middle) <= 0.5], kind="stable")]:
        left[n] = 2 * left.sum() < len(x)
    for side in (True, False):  # what has no room on its side goes to the other, those of the middle first
        while (left == side).sum() > room:
            here = np.flatnonzero(left == side)
            left[here[np.abs(x[here] - middle).argmin()]] = not side
            if (left != side).sum() > room:
                return None
    ends = np.zeros(len(x))
    for side in (True, False):
        here = np.flatnonzero(left == side)
        here = here[np.argsort(y[here], kind="stable")]
        ends[here] = _spread(y[here], top, bottom)
    right = book.paper.width - MARGIN_MM
    return tuple(
        Row(MARGIN_MM if on_left else right, float(end), bool(on_left)) for on_left, end in zip(left, ends, strict=True)
    )


def _spread(y: Float[np.ndarray, " m"], top: float, bottom: float) -> Float[np.ndarray, " m"]:
    """Heights ROW_MM apart, in the same order and between top and bottom, with the least sum of squared moves."""
    offset = ROW_MM * np.arange(len(y))
    blocks: list[tuple[float, int]] = []  # means of neighbours that would be too close
    for value in (y - offset).tolist():
        mean, count = value, 1
        while blocks and blocks[-1][0] > mean:
            other, more = blocks.pop()
            mean, count = (mean * count + other * more) / (count + more), count + more
        blocks.append((mean, count))
    level = np.concatenate([np.full(count, mean) for mean, count in blocks]) if blocks else np.zeros(0)
    return np.clip(level, top, bottom - offset[-1] if len(y) else bottom) + offset


def draw_markers(book: Booklet, placed: Placed, face: MarkedFace) -> None:
    """The head, the markers with their numbers and rings, the points to measure from, and the rows."""
    frame, scale = placed.picture.frame, placed.scale
    book.image(placed.picture.rgb, *placed.corner, frame.width / scale, frame.height / scale)
    for point, (x, y) in placed.crosses:
        _draw_cross(book, point, x, y, placed.points)
    for start, end in placed.numbers.ticks:
        if (start != end).any():
            book.line(start, end, width=0.9, colour="#ffffff")
            book.line(start, end, width=0.25, colour=INK)
    radius = max(SYMBOL_MM, face.dot_mm / 2 / scale)
    for landmark, (x, y), (at_x, at_y) in zip(
        placed.landmarks, placed.points.tolist(), placed.numbers.middle.tolist(), strict=True
    ):
        look, hollow = face.looks[landmark.region], landmark.role == "backup"
        if landmark.name in face.rings:
            rim = face.rim_mm(landmark) / scale
            book.ring(x, y, rim, colour=look.colour)
            if (angle := seen_angle(face.strict.get(landmark.name), placed.view)) is not None:
                book.thick_ends(x, y, rim, angle, colour=look.colour)
        book.marker(x, y, look, radius=radius * 0.95, hollow=hollow)
        book.ring(x, y, POINT_MM, colour=INK if hollow else "#ffffff", filled=True)
        high = NUMBER_PT * 25.4 / 72 * LETTER_HIGH
        colour = look.colour
        book.text(
            at_x, at_y + high / 2, landmark.name, NUMBER_PT, bold=True, align="centre", colour=colour, halo="#ffffff"
        )
    for landmark, row in zip(placed.landmarks, placed.rows, strict=True):
        _draw_row(book, landmark, row, face)


def seen_angle(direction: Direction | None, view: Viewpoint) -> Number | None:
    """Where a direction along the skin leads on a page, degrees from its right counter-clockwise; None where it leads
    towards the viewer."""
    if direction is None:
        return None
    x, y, _ = view.project(np.array([direction]))[0].tolist()
    return float(np.degrees(np.arctan2(y, x))) if np.hypot(x, y) > FLAT else None


def _draw_cross(book: Booklet, point: TapePoint, x: float, y: float, marks: Float[np.ndarray, "n 2"]) -> None:
    """A cross, its letter in the quarter that is furthest from every marker."""
    for width, colour in ((0.8, "#ffffff"), (0.25, INK)):
        book.line((x - CROSS_MM, y), (x + CROSS_MM, y), width=width, colour=colour)
        book.line((x, y - CROSS_MM), (x, y + CROSS_MM), width=width, colour=colour)
    quarters = np.array([x, y]) + LETTER_MM * np.array([(1, -1), (-1, -1), (1, 1), (-1, 1)])
    free = np.linalg.norm(marks[None] - quarters[:, None], axis=2).min(axis=1, initial=np.inf)
    at_x, at_y = quarters[free.argmax()].tolist()
    book.text(at_x, at_y + 0.9, point.letter, 9, align="centre", colour=INK, halo="#ffffff")


def _draw_row(book: Booklet, landmark: Landmark, row: Row, face: MarkedFace) -> None:
    """Number and place, and below it the two distances."""
    look, align = face.looks[landmark.region], "left" if row.on_left else "right"
    aligned: Align = align
    away, room = (1, ROW_WIDTH_MM - 1) if row.on_left else (-1, ROW_WIDTH_MM - 1)
    wide = book.text(row.x, row.y, landmark.name, 9, bold=True, align=aligned, colour=look.colour)
    book.text(
        row.x + away * (wide + 1.4), row.y, landmark.label, SMALL_PT, align=aligned, colour=INK, fit=room - wide - 2
    )
    book.text(row.x, row.y + 3.1, measure_words(face.measure(landmark)), 7.6, align=aligned, colour=SOFT, fit=room)


def measure_words(measure: Measure | None) -> str:
    """'a 23 mm · d 41 mm'; nothing where it cannot be measured."""
    if measure is None:
        return ""
    return " · ".join(
        f"{point_words(p, measure)} {mm:.1f} mm" for p, mm in zip(measure.points, measure.mm, strict=True)
    )


def point_words(point: TapePoint, measure: Measure) -> str:
    """The letter of a point, with its side for a marker that has none."""
    return f"{point.letter} {point.side}" if measure.middle and point.side != "middle" else point.letter


def _on_page(
    places: Float[np.ndarray, "n 3"], frame: PictureFrame, scale: Number, corner: tuple[float, float]
) -> Float[np.ndarray, "n 2"]:
    x = corner[0] + (places[:, 0] - frame.left) / scale
    y = corner[1] + (frame.top - places[:, 1]) / scale
    return np.stack([x, y], axis=1)
