"""The sculptor's pages: neutral and every expression all around at one scale, and what moves how far.

Data     d_k (v 3)   delta of blendshape k, v vertices, millimetres
Movement max_v |d_k[v]| over the skin, at full weight, with the place of that v and the way it goes; where a blendshape
         moves no skin, over all vertices (eyeballs, teeth, tongue)
Letters  v vertices, k blendshapes; lengths on the page are millimetres from the top left corner, y down
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from capture_plan.anatomy.regions import FaceRegions, face_regions
from capture_plan.expressions.record import Expression
from capture_plan.expressions.session import shot_title
from capture_plan.face.anchors import Anchors
from capture_plan.plan.carry import as_worn
from capture_plan.plan.inputs import PlanInputs
from capture_plan.plan.record import Plan, head_words, number_of
from capture_plan.progress import track
from capture_plan.rig import Rig
from capture_plan.sheets.expression_page import close_up, movement, portrait
from capture_plan.sheets.furniture import SheetSource, foot_line, head_line
from capture_plan.sheets.head import Posed, make_head, pose
from capture_plan.sheets.page import MARGIN_MM, Booklet, landscape, paper
from capture_plan.sheets.style import FAINT, SOFT, WASH, Number
from capture_plan.sheets.view import (
    FRONT,
    LEFT,
    LEFT_PROFILE,
    RIGHT,
    RIGHT_PROFILE,
    PictureFrame,
    Viewpoint,
    picture,
    pixels,
)

TURNTABLE = (RIGHT_PROFILE, RIGHT, FRONT, LEFT, LEFT_PROFILE)  # as one walks around the head
TOP_MM, GAP_MM, ROW_MM, FOOT_MM, LABEL_MM = 27.0, 2.0, 5.2, 12.0, 5.0
PICTURE_SHARE, WHOLE_SHARE = 0.42, 0.33  # of the page's height
BEFORE = 0.3  # pupil distances before the nose: lips and jaw come forward
LEAST_MM = 0.05  # of movement that is seen
WAYS = (("left", "right"), ("up", "down"), ("forward", "back"))  # along x, y, z; the subject's own left
# Left edge of each column, shares of the width between the margins.
COLUMNS = {"name": 0.01, "words": 0.2, "mm": 0.54, "where": 0.6, "vertex": 0.74, "way": 0.82}
HEADS = {
    "name": "at full",
    "words": "what it does",
    "mm": "mm",
    "where": "where most",
    "vertex": "vertex",
    "way": "which way",
}


class Moved(NamedTuple):
    """What moves most: how far (mm), at which place, which vertex of the artist's file, and which way."""

    name: str
    words: str
    mm: float
    where: str
    vertex: int
    way: str


def draw_sculptor(plan: Plan, inputs: PlanInputs, *, sheet: str, dpi: int, mirrored: bool) -> Booklet:
    """A page of the neutral and one of each expression, in the order of shooting; never `mirrored`, for it is no actor
    who works by them."""
    book = Booklet(
        landscape(paper(sheet)), f"{inputs.rig.name}: for the sculptor", inputs.rig.names, draft="; ".join(plan.draft)
    )
    shown, worn = as_worn(plan, inputs)
    head, regions = make_head(worn), face_regions(worn)
    (wide, high), expressions = _plate(book), shown.in_session
    near = [facing_in(worn, regions.anchors, view, wide / high) for view in TURNTABLE]
    whole = turntable(worn, regions.anchors, wide / (WHOLE_SHARE * book.paper.height))
    says = {one.name: one.words for one in plan.audit.details}
    rows = {e.name: moved_by(worn, regions, e, says) for e in expressions}
    titles = {item.name: f"{shot_title(item)} · {item.name}" for item in shown.session.items}
    pages = 1 + sum(len(_chunks(book, rows[e.name])) for e in expressions)
    source = SheetSource(head_words(plan, generic=inputs.generic), f"plan {number_of(plan)}", pages)

    def draw(posed: Posed, frames: list[PictureFrame], top: Number) -> None:
        """Five pictures of one height in a row."""
        tall = wide * frames[0].height / frames[0].width
        for k, (view, frame) in enumerate(zip(TURNTABLE, frames, strict=True)):
            one = picture(posed, view, frame, size_px=pixels(wide, tall, dpi))
            book.image(one.rgb, MARGIN_MM + k * (wide + GAP_MM), top, wide, tall)

    relaxed = pose(head, worn.neutral)
    apart = f"pupils {regions.anchors.pupils:.1f} mm apart"
    scales = f"close up {scale_words(near[0].width / wide)}, whole {scale_words(whole[0].width / wide)}"
    _begin(book, source, "NEUTRAL", f"{apart} · {scales}")
    draw(relaxed, near, TOP_MM)
    _name_views(book)
    draw(relaxed, whole, TOP_MM + high + LABEL_MM)
    for e in track(expressions, "Drawing turntables"):
        for part, some in enumerate(_chunks(book, rows[e.name])):
            title = f"{titles[e.name]}, continued" if part else titles[e.name]
            _begin(book, source, title, f"{e.sentence} · {scale_words(near[0].width / wide)}")
            if part == 0:
                draw(pose(head, movement(worn, e)[0]), near, TOP_MM)
                _name_views(book)
            _table(book, some, TOP_MM + (0 if part else high + LABEL_MM))
    return book


def turntable(rig: Rig, anchors: Anchors, aspect: float) -> list[PictureFrame]:
    """A frame for each view with the whole head, all of one scale and height, of width = `aspect` x height."""
    found = [portrait(rig, anchors, view, aspect) for view in TURNTABLE]
    largest = max(found, key=lambda frame: frame.height)
    half, middles = largest.width / 2, [(frame.left + frame.right) / 2 for frame in found]
    return [largest._replace(left=middle - half, right=middle + half) for middle in middles]


def facing_in(rig: Rig, anchors: Anchors, view: Viewpoint, aspect: float) -> PictureFrame:
    """The face close up, of width = `aspect` x height; from the side with room before the nose, where nothing fades."""
    frame = close_up(anchors, view, aspect)
    if view.azimuth == 0:
        return frame
    height = rig.neutral[:, 1]
    on_face = rig.skin & (height > anchors.chin[1]) & (height < anchors.eye_left[1])
    x, room = view.project(rig.neutral[on_face])[:, 0], BEFORE * anchors.pupils
    if view.azimuth > 0:
        left = float(x.min()) - room
        return frame._replace(left=left, right=left + frame.width, blank_left=0.0)
    right = float(x.max()) + room
    return frame._replace(left=right - frame.width, right=right, blank_right=0.0)


def moved_by(rig: Rig, regions: FaceRegions, e: Expression, says: dict[str, str]) -> list[Moved]:
    """A row for each blendshape at full, the farthest first, and one for all at once where these are several; `says`
    are movements in words."""
    rows = []
    for name, weight in e.pose.items():
        held = ", held besides" if name in e.drivers else ""
        delta = weight * rig.deltas[rig.names.index(name)]
        rows.append(_most(rig, regions, delta, name, f"{says.get(name, '')}{held}".strip(", ")))
    rows.sort(key=lambda row: -row.mm)
    if len(rows) > 1:
        rows.append(_most(rig, regions, movement(rig, e)[0] - rig.neutral, "all at once", ""))
    return rows


def way_words(x: Float[np.ndarray, " 3"]) -> str:
    """'31 mm down, 4 mm back': the parts of a movement that are a quarter of it or more, the largest first."""
    parts = [i for i in np.argsort(-np.abs(x)).tolist() if abs(x[i]) >= 0.25 * np.linalg.norm(x) > 0]
    return ", ".join(f"{abs(x[i]):.1f} {WAYS[i][int(x[i] < 0)]}" for i in parts)


def _most(rig: Rig, regions: FaceRegions, delta: Float[np.ndarray, "v 3"], name: str, words: str) -> Moved:
    away = np.linalg.norm(delta, axis=1)
    on_skin = np.where(rig.skin, away, 0)
    skinned = float(on_skin.max()) >= LEAST_MM
    v = int((on_skin if skinned else away).argmax())
    where = regions.label(v) if skinned else rig.part_names[int(rig.parts[v])]
    return Moved(name, words, float(away[v]), where, int(rig.source_index[v]), way_words(delta[v]))


def _plate(book: Booklet) -> tuple[Number, Number]:
    """Width and height of a picture on the page."""
    wide = book.paper.width - 2 * MARGIN_MM - GAP_MM * (len(TURNTABLE) - 1)
    return wide / len(TURNTABLE), PICTURE_SHARE * book.paper.height


def _chunks(book: Booklet, rows: list[Moved]) -> list[list[Moved]]:
    """The rows of each page: below the pictures first, then on pages of their own."""
    room = book.paper.height - TOP_MM - FOOT_MM - ROW_MM
    first, rest = int((room - _plate(book)[1] - LABEL_MM) // ROW_MM), int(room // ROW_MM)
    return [rows[:first], *(rows[k : k + rest] for k in range(first, len(rows), rest))]


def _begin(book: Booklet, source: SheetSource, title: str, words: str) -> None:
    book.add_page(title)
    foot_line(book, source)
    head_line(book, title, (words,), fields=False)


def scale_words(scale: float) -> str:
    """'1 : 2.50' where the page shows the head 2.5 times smaller than it is."""
    return f"1 : {scale:.2f}" if scale >= 1 else f"{1 / scale:.2f} : 1"


def _name_views(book: Booklet) -> None:
    """'right three-quarter' below each picture: the subject's own side."""
    wide, high = _plate(book)
    for k, view in enumerate(TURNTABLE):
        x = MARGIN_MM + k * (wide + GAP_MM) + wide / 2
        book.text(x, TOP_MM + high + 3.4, view.name.lower(), 8, align="centre", colour=SOFT)


def _table(book: Booklet, rows: list[Moved], y: Number) -> None:
    left, wide = MARGIN_MM, book.paper.width - 2 * MARGIN_MM
    at = {key: left + share * wide for key, share in COLUMNS.items()}
    ends = [*list(at.values())[1:], left + wide]
    for key, x in at.items():
        book.text(x, y + 3.6, HEADS[key], 7.4, bold=True)
    book.line((left, y + ROW_MM - 0.4), (left + wide, y + ROW_MM - 0.4), width=0.3)
    for number, row in enumerate(rows, start=1):
        top = y + number * ROW_MM
        if number % 2 == 0:
            book.box(left, top, wide, ROW_MM, fill=WASH, line=None)
        cells = (row.name, row.words, f"{row.mm:.1f}", row.where, f"{row.vertex:,}", row.way)
        for k, (x, end, cell) in enumerate(zip(at.values(), ends, cells, strict=True)):
            book.text(x, top + 3.7, cell, 8, bold=k in (0, 2), fit=end - x - 2)
        book.line((left, top + ROW_MM), (left + wide, top + ROW_MM), width=0.1, colour=FAINT)
