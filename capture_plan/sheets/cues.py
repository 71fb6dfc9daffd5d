"""What stands before the actor: items of the session with their portraits, and sentences as large as fit.

In a mirrored portrait picture and arrows change sides, as in a mirror; sides in sentences stay the actor's own.

Rule     letters are read as far away as 200 times their cap height (17 minutes of arc, over three times the 5 that
         normal sight resolves)
Letters  a arrows; lengths are page millimetres from the top left corner, y down
"""

from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from capture_plan.anatomy.regions import face_regions
from capture_plan.expressions.session import TURN_DEGREES, Item
from capture_plan.face.anchors import Anchors
from capture_plan.plan.record import Plan
from capture_plan.progress import tell, track
from capture_plan.rig import Rig
from capture_plan.sheets.expression_page import arrows_of, close_up, movement
from capture_plan.sheets.head import Posed, make_head, pose
from capture_plan.sheets.page import POINT_MM, Booklet
from capture_plan.sheets.shots import draw_arrow, on_page
from capture_plan.sheets.style import INK, Number
from capture_plan.sheets.view import WHITE, Picture, Viewpoint, picture

READ_AT = 200  # distance over cap height
CAP = 1456 / 2048  # cap height of Roboto over its size
LEADING = 1.17  # from line to line, over the size
SIDES_PT, SIDES_MM = 22, 3.0  # of the words that name sides, and from the edge of the picture
FINEST_PT, LEAST_FIT_PT = 0.25, 12.0
YOUR_SIDES = ("your right", "your left")  # below a portrait, as they are seen from before it
AS_IN_A_MIRROR = "as in a mirror: your left is on the left"


class Portrait(NamedTuple):
    """How portraits are drawn: pixels (width, height), as in a mirror or not, the colour behind them ('#rrggbb')."""

    size_px: tuple[int, int]
    mirrored: bool = False
    ground: str = WHITE


class Cue(NamedTuple):
    """An item of the session, the `words` for it, its portrait where it has one, and the arrows on that, from where to
    where in millimetres of view space."""

    item: Item
    words: str
    front: Picture | None
    arrows: Float[np.ndarray, "a 2 2"]


class Fitted(NamedTuple):
    """Lines of text and the size in points at which they fill their place."""

    lines: list[str]
    size: Number

    @property
    def height(self) -> Number:
        """From the top of the first line to the foot of the last, millimetres."""
        return len(self.lines) * self.size * POINT_MM * LEADING

    @property
    def cap_mm(self) -> Number:
        """Height of a capital, millimetres."""
        return CAP * self.size * POINT_MM


def cues(plan: Plan, worn: Rig, items: Iterable[Item], how: Portrait) -> Iterator[Cue]:
    """The cue of each item, in turn; `worn` is the rig as pages show it (`plan.carry.as_worn`)."""
    head, anchors = make_head(worn), face_regions(worn).anchors
    of = {expression.name: expression for expression in plan.packing.expressions}
    relaxed, none = pose(head, worn.neutral), np.zeros((0, 2, 2))
    for item in track(list(items), "Drawing portraits"):
        if item.kind == "expression":
            expression = of[item.name]
            vertices, _ = movement(worn, expression)
            posed = pose(head, vertices)
            front = _front(posed, anchors, 0.0, how)
            arrows = arrows_of(worn, expression, vertices, posed.normals, anchors) * ([-1, 1] if how.mirrored else 1)
            yield Cue(item, expression.sentence, front, _within(front, arrows))
        elif item.kind in ("neutral", "turned"):
            front = _front(relaxed, anchors, _turned(item), how)
            yield Cue(item, item.sentence, front, none)
        else:
            yield Cue(item, item.sentence, None, none)


def draw_portrait(book: Booklet, cue: Cue, x: Number, y: Number, width: Number, *, scale: Number = 1) -> None:
    """The picture and its arrows, which are `scale` times as heavy as on an actor's page."""
    if cue.front is None:
        return
    rows, columns = cue.front.rgb.shape[:2]
    book.image(cue.front.rgb, x, y, width, width * rows / columns)
    for arrow in cue.arrows:
        start, end = on_page(cue.front, arrow, x, y, width)
        draw_arrow(book, start, end, scale)


def name_sides(
    book: Booklet, cue: Cue, x: Number, y: Number, width: Number, *, mirrored: bool, colour: str = INK
) -> None:
    """At the foot of a portrait, where it has faded, which side is the reader's left."""
    if cue.front is None:
        return
    rows, columns = cue.front.rgb.shape[:2]
    words, foot = YOUR_SIDES[::-1] if mirrored else YOUR_SIDES, y + width * rows / columns - SIDES_MM
    book.text(x + SIDES_MM, foot, words[0], SIDES_PT, bold=True, colour=colour)
    book.text(x + width - SIDES_MM, foot, words[1], SIDES_PT, bold=True, colour=colour, align="right")


def fitted(book: Booklet, text: str, width: Number, height: Number, *, most_pt: Number) -> Fitted:
    """The largest size up to `most_pt` at which bold `text` fits into a place, and its lines there."""
    low, high = LEAST_FIT_PT, float(most_pt)
    best = Fitted(book.broken(text, low, width=width, bold=True), low)
    while high - low > FINEST_PT:
        size = (low + high) / 2
        one = Fitted(book.broken(text, size, width=width, bold=True), size)
        widest = max(book.width(line, size, bold=True) for line in one.lines)
        if one.height <= height and widest <= width:
            low, best = size, one
        else:
            high = size
    return best


def draw_fitted(book: Booklet, x: Number, y: Number, text: Fitted, width: Number, *, colour: str = INK) -> None:
    """The lines from y down."""
    step = text.size * POINT_MM
    for n, line in enumerate(text.lines):
        base = y + step * (LEADING * n + (LEADING + CAP) / 2)
        book.text(x, base, line, text.size, bold=True, colour=colour, fit=width)


def tell_small(named: Iterable[tuple[str, Fitted]], distance_mm: Number, enlarged: Number = 1) -> None:
    """Say which sentences are too long to be read at this distance, pages being shown so much enlarged, and how far
    they are read."""
    for name, text in named:
        if (read_mm := READ_AT * text.cap_mm * enlarged) < distance_mm:
            read = f"is read from {read_mm / 1000:.1f} m, not from {distance_mm / 1000:.1f} m"
            tell([f"note: the sentence of {name} is long: it {read}"])


def _front(posed: Posed, anchors: Anchors, azimuth: float, how: Portrait) -> Picture:
    """A close-up from so many degrees towards the actor's own left."""
    wide, high = how.size_px
    frame = close_up(anchors, Viewpoint("Portrait", azimuth), wide / high)
    if how.mirrored:
        frame = frame._replace(left=-frame.right, right=-frame.left)
    view = Viewpoint("Portrait", azimuth, mirrored=how.mirrored)
    return picture(posed, view, frame, size_px=how.size_px, ground=how.ground)


def _turned(item: Item) -> float:
    """From where a head at rest looks as in this item; L1 is turned to the actor's own left."""
    return {"L1": -TURN_DEGREES, "R1": TURN_DEGREES}.get(item.name, 0.0)


def _within(front: Picture, arrows: Float[np.ndarray, "a 2 2"]) -> Float[np.ndarray, "a 2 2"]:
    """The arrows that lie on the picture with both ends."""
    frame = front.frame
    low, high = np.array([frame.left, frame.bottom]), np.array([frame.right, frame.top])
    return arrows[((arrows > low) & (arrows < high)).all(axis=(1, 2))]
