"""How a face was understood, drawn: the head from the front and from its left, as upright as it was read.

A head that was read wrongly is shown wrongly, which is the point: nobody has to know axes to see that it lies down.
Drawn on it: the file's axes, a bar of a round length, eyes, mouth, nose, chin and ears, regions in soft colours, skin
against the rest.

Page lengths are millimetres from the top left corner, y down. Letters: v vertices, n labels.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from capture_plan.anatomy.regions import NO_REGION, FaceRegions, face_regions
from capture_plan.face.axes import axes_matrix
from capture_plan.face.facts import ReadingFacts
from capture_plan.rig import Rig
from capture_plan.sheets.head import SKIN, Posed, make_head, pose, spread_over
from capture_plan.sheets.leaders import assign_anchors
from capture_plan.sheets.markers import unhidden
from capture_plan.sheets.page import Booklet
from capture_plan.sheets.style import LOOKS, SOFT, Look, Number, rgb
from capture_plan.sheets.view import FRONT, Picture, PictureFrame, Viewpoint, picture, pixels

SIDE = Viewpoint("Side", 90.0)
VIEWS = (FRONT, SIDE)
EXPECTED = {
    FRONT: "FRONT: the face should look at you, upright",
    SIDE: "SIDE: the face should look to the left, upright",
}
COLUMN_MM, PITCH_MM, LABEL_PT = 25.0, 3.9, 7.0  # of names beside a head
BARS = (1.0, 2.0, 5.0)  # times a power of ten, millimetres of the head
BAR_SHARE = 0.6  # of a view's width that the bar takes at most: what is left is the axes'
ROUND_MM = 6.0  # of the head's surroundings shown around skin and points
FADE, BLANK_MM = 0.04, 0.1  # of the height, where the rig goes on; of its side border, so that it fades there too
PROBE_PX = 300  # height of the quick picture that tells what is seen
CLAY, PLAIN_SKIN, REST = (0.90, 0.89, 0.87), (0.95, 0.79, 0.68), (0.40, 0.42, 0.46)  # display colours
TINT, SCALP_TINT = 0.42, 0.12  # share of a region's own colour; that of the scalp is grey, as what is no skin
POINT = Look("#d6006c", "circle")
POINT_MM = 1.15
AXIS_COLOURS = {"x": "#b3261e", "y": "#0f7b4f", "z": "#0b57d0"}  # as modelling programs show them
ARROW_MM, TRIAD_MM = 11.0, 15.0


class Label(NamedTuple):
    """A name beside the head and the place on the head that it names; `point` tells eyes and mouth from regions."""

    name: str
    at: Float[np.ndarray, " 3"]
    colour: str
    point: bool
    sure: bool


@dataclass(frozen=True, eq=False)
class UnderstoodHead:
    """A rig and how it was understood, ready to draw; without regions where eyes or mouth are not certain."""

    rig: Rig
    read: ReadingFacts
    posed: Posed
    regions: FaceRegions | None


def understood(rig: Rig, read: ReadingFacts) -> UnderstoodHead:
    """Colour the head by its regions, or by what is skin where they are not known."""
    head, regions = make_head(rig), face_regions(rig) if read.regions_known else None
    posed, colours = pose(head, rig.neutral), skin_colours(rig, regions)
    pieces = tuple(
        replace(shown, colours=np.stack([spread_over(piece, channel) for channel in colours.T], axis=1) ** 2.2)
        if piece.material is SKIN
        else shown
        for piece, shown in zip(head.pieces, posed.pieces, strict=True)
    )
    return UnderstoodHead(rig, read, Posed(posed.vertices, posed.normals, pieces), regions)


def skin_colours(rig: Rig, regions: FaceRegions | None) -> Float[np.ndarray, "v 3"]:
    """Display colours 0 to 1: soft ones of regions, one for all skin where they are not known, grey else."""
    colours = np.tile(REST, (len(rig.neutral), 1))
    if regions is None:
        colours[rig.skin] = PLAIN_SKIN
        return colours
    soft = np.array([soft_colour(name) for name in regions.names])
    named = regions.of_vertex != NO_REGION
    colours[named] = soft[regions.of_vertex[named]]
    return colours


def soft_colour(region: str) -> Float[np.ndarray, " 3"]:
    """A region's colour mixed into clay."""
    share = SCALP_TINT if region == "scalp" else TINT
    return (1 - share) * np.array(CLAY) + share * np.array(rgb(LOOKS[region].colour)) / 255


def draw_understood(
    book: Booklet, shown: UnderstoodHead, x: Number, y: Number, w: Number, h: Number, *, dpi: Number
) -> None:
    """Both views side by side, of one scale, in a box of the page."""
    each = w / len(VIEWS)
    boxes = [(x + i * each + COLUMN_MM, y, each - 2 * COLUMN_MM, h) for i in range(len(VIEWS))]
    frames = head_frames(shown, boxes[0][2] / boxes[0][3])
    for view, frame, box in zip(VIEWS, frames, boxes, strict=True):
        _draw_view(book, shown, view, frame, box, dpi)


def head_frames(shown: UnderstoodHead, aspect: float) -> tuple[PictureFrame, ...]:
    """What each view shows of the head: skin and points with a little around them, all at one scale."""
    rig = shown.rig
    places = np.concatenate([rig.neutral[rig.skin], *([label.at[None] for label in _points_of(shown, FRONT)])])
    boxes = [(p.min(axis=0) - ROUND_MM, p.max(axis=0) + ROUND_MM) for p in (view.project(places) for view in VIEWS)]
    height = max(float(max(high[1] - low[1], (high[0] - low[0]) / aspect)) for low, high in boxes)
    seen = zip(VIEWS, boxes, strict=True)
    return tuple(_frame(view.project(rig.neutral), low + high, aspect * height, height) for view, (low, high) in seen)


def _frame(
    places: Float[np.ndarray, "v 3"], ends: Float[np.ndarray, " 3"], width: float, height: float
) -> PictureFrame:
    """A frame around the middle between two ends; it fades where the rig goes on beyond it, as a body does."""
    left, bottom = float(ends[0] - width) / 2, float(ends[1] - height) / 2
    x, y = places[:, 0], places[:, 1]
    beyond = [bool(one.any()) for one in (x < left, x > left + width, y < bottom, y > bottom + height)]
    fade, fade_top = (FADE * height if goes_on else 0.0 for goes_on in (any(beyond[:3]), beyond[3]))
    on_left, on_right = (BLANK_MM if goes_on else 0.0 for goes_on in beyond[:2])
    return PictureFrame(left, left + width, bottom, bottom + height, fade, on_left, on_right, fade_top)


def _points_of(shown: UnderstoodHead, view: Viewpoint) -> list[Label]:
    """Eyes, mouth, nose, chin and ears where they were found; from the side the subject's left ones alone."""
    read, labels = shown.read, []
    for name, pair in (("eye", read.eyes), ("ear", read.ears)):
        for side, place in (("left", pair.left), ("right", pair.right)):
            if place is not None and (view is FRONT or side == "left"):
                labels.append(Label(f"{side} {name}", np.array(place.mm), POINT.colour, True, pair.sure))
    for name, spot in (("mouth", read.mouth), ("nose", read.nose), ("chin", read.chin)):
        if spot.mm is not None:
            labels.append(Label(name, np.array(spot.mm), POINT.colour, True, spot.sure))
    return labels


def _draw_view(
    book: Booklet,
    shown: UnderstoodHead,
    view: Viewpoint,
    frame: PictureFrame,
    box: tuple[Number, Number, Number, Number],
    dpi: Number,
) -> None:
    x, y, w, h = box
    drawn = picture(shown.posed, view, frame, size_px=pixels(w, h, dpi))
    book.image(drawn.rgb, x, y, w, h)
    labels = _points_of(shown, view) + _regions_in(shown, view)
    places = _on_page(drawn, view, labels, box)
    _draw_labels(book, labels, places, box)
    for label, (column, row) in zip(labels, places.tolist(), strict=True):
        if label.point:
            book.marker(column, row, POINT, radius=POINT_MM, hollow=not label.sure)
    _draw_bar(book, x + w, y + h + 4.5, w / frame.width, bar_mm(frame.width))
    _draw_axes(book, shown.read, view, x - COLUMN_MM + 1.5, y + h + 3.2)
    book.text(x + w / 2, y - 2.2, EXPECTED[view], 7.4, bold=True, align="centre", colour=SOFT)


def _on_page(
    drawn: Picture, view: Viewpoint, labels: list[Label], box: tuple[Number, Number, Number, Number]
) -> Float[np.ndarray, "n 2"]:
    at = np.array([label.at for label in labels]).reshape(-1, 3)
    scale = box[2] / drawn.z.shape[1]
    return drawn.pixel(view.project(at)) * scale + np.array(box[:2])


def _regions_in(shown: UnderstoodHead, view: Viewpoint) -> list[Label]:
    """Names of the regions that this view shows better than the other, on the subject's left half."""
    if shown.regions is None:
        return []
    seen = np.stack([_seen(shown, each) for each in VIEWS])
    labels = []
    for number, name in enumerate(shown.regions.names):
        mine = (shown.regions.of_vertex == number) & (shown.regions.side >= 0) & seen
        best = VIEWS[int(mine.sum(axis=1).argmax())]
        at = shown.rig.neutral[mine[VIEWS.index(view)]]
        if best is view and len(at):
            middle = at[np.linalg.norm(at - at.mean(axis=0), axis=1).argmin()]
            labels.append(Label(name, middle, LOOKS[name].colour, False, True))
    return labels


def _seen(shown: UnderstoodHead, view: Viewpoint) -> np.ndarray:
    """Which vertices a view shows."""
    frame = head_frames(shown, 1.0)[VIEWS.index(view)]
    probe = picture(shown.posed, view, frame, size_px=(PROBE_PX, PROBE_PX))
    return unhidden(shown.posed.vertices, shown.posed.normals, view, probe)


def _draw_labels(
    book: Booklet, labels: list[Label], places: Float[np.ndarray, "n 2"], box: tuple[Number, Number, Number, Number]
) -> None:
    """A line from each place to its name on the nearer side, no two crossing."""
    x, y, w, h = box
    rows = y + PITCH_MM * (np.arange(int((h - ARROW_MM) / PITCH_MM)) + 0.5)
    ends = np.array([(column, row) for column in (x, x + w) for row in rows])
    chosen = ends[assign_anchors(places, ends)]
    for place, end in zip(places, chosen, strict=True):
        book.line(place, end, width=0.6, colour="#ffffff")
    for label, place, (column, row) in zip(labels, places, chosen.tolist(), strict=True):
        book.line(place, (column, row), width=0.16, colour=label.colour)
        on_left = column == x
        text = label.name if label.sure else f"{label.name}?"
        book.text(
            column + (-0.9 if on_left else 0.9),
            row + 0.9,
            text,
            LABEL_PT,
            bold=label.point,
            align="right" if on_left else "left",
            colour=label.colour,
            fit=COLUMN_MM - 2,
        )


def bar_mm(width_mm: float) -> float:
    """The longest of 1, 2, 5, 10, 20, ... mm that takes no more than BAR_SHARE of a view of this width."""
    most = BAR_SHARE * width_mm
    ten = 10.0 ** np.floor(np.log10(most))
    return float(max(step * ten for step in BARS if step * ten <= most * (1 + 1e-9)))


def _draw_bar(book: Booklet, right: Number, y: Number, page_per_mm: float, mm: float) -> None:
    """A length of `mm` of the head, at its scale."""
    left = right - mm * page_per_mm
    book.line((left, y), (right, y), width=0.7)
    for end in (left, right):
        book.line((end, y - 1.4), (end, y + 1.4), width=0.4)
    book.text((left + right) / 2, y - 1.3, f"{mm:,g} mm", 7.4, bold=True, align="centre")


def _draw_axes(book: Booklet, read: ReadingFacts, view: Viewpoint, x: Number, y: Number) -> None:
    """The axes of the file as they were understood; the one towards the viewer is a dot in a ring."""
    up, facing = read.axes.up, read.axes.facing
    names = (file_axis(axes_matrix(up, facing)[0]), up, facing)
    doubt = "" if read.axes.sure else "?"
    origin = np.array([x + (TRIAD_MM if view is SIDE else 2.0), y])
    for word, name, axis in zip(("left", "up", "forward"), names, np.eye(3), strict=True):
        colour, (right, above, near) = AXIS_COLOURS[name[1]], view.project(axis[None])[0].round(6)
        text = f"{word} {name}{doubt}"
        if near > 0.5:
            book.polygon(_ring(origin, 1.7), fill="#ffffff", line=colour, width=0.5)
            book.polygon(_ring(origin, 0.6), fill=colour, line=None)
            book.text(origin[0], origin[1] + 4.6, text, 6.6, bold=True, colour=colour, align="centre")
            continue
        tip = origin + ARROW_MM * np.array([right, -above])
        _arrow(book, origin, tip, colour)
        if above:
            book.text(tip[0], tip[1] - 1.2, text, 6.6, bold=True, colour=colour, align="centre")
        else:
            align = "left" if right > 0 else "right"
            book.text(tip[0], tip[1] - 1.6, text, 6.6, bold=True, colour=colour, align="centre" if align else align)


def _ring(middle: Float[np.ndarray, " 2"], radius: float) -> Float[np.ndarray, "n 2"]:
    angle = np.linspace(0, 2 * np.pi, 32, endpoint=False)
    return middle + radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)


def _arrow(book: Booklet, start: Float[np.ndarray, " 2"], tip: Float[np.ndarray, " 2"], colour: str) -> None:
    along = (tip - start) / np.linalg.norm(tip - start)
    across = np.array([-along[1], along[0]])
    book.line(start, tip - 2 * along, width=0.8, colour=colour)
    head = np.stack([tip, tip - 3 * along + 1.4 * across, tip - 3 * along - 1.4 * across])
    book.polygon(head, fill=colour, line=None)


def file_axis(direction: Float[np.ndarray, " 3"]) -> str:
    """(0, 0, -1) -> '-z'."""
    axis = int(np.abs(direction).argmax())
    return ("+" if direction[axis] > 0 else "-") + "xyz"[axis]
