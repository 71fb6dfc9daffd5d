"""One picture to judge a layout by: named dots on the face from the front and from both sides.

Every dot is drawn wherever it is seen, and named once: from the front or its own side, as it faces most. Dots have the
colour and the shape of their region. Lengths are page millimetres from the top left corner, y down.

Letters: n points, m points named in a view, w views.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pypdfium2
from jaxtyping import Bool, Float, Int
from PIL import Image

from capture_plan.anatomy.regions import FaceRegions, face_regions
from capture_plan.errors import PlanError
from capture_plan.rig import Rig
from capture_plan.sheets.expression_page import portrait
from capture_plan.sheets.furniture import legend
from capture_plan.sheets.head import Posed, make_head, pose
from capture_plan.sheets.leaders import assign_anchors
from capture_plan.sheets.markers import unhidden
from capture_plan.sheets.page import MARGIN_MM, Booklet, PaperSize
from capture_plan.sheets.style import INK, SOFT, Look, looks_of
from capture_plan.sheets.view import FRONT, LEFT, RIGHT, Viewpoint, picture, pixels

VIEWS = (RIGHT, FRONT, LEFT)  # as one walks round the face, from its right to its left
HEAD_MM = (84.0, 112.0)  # of paper for each head, width and height
HEADER_MM, FOOTER_MM = 27.0, 14.0
PITCH_MM, NAME_PT = 2.75, 6.2  # 40 names along each side of a head
LONGEST_NAME_MM = 34.0
BETWEEN_MM = 5.0  # of white between the names of two heads
DOT_MM = 0.95


class _Dots(NamedTuple):
    """A layout on a face, ready to draw; `looks` by region, `region` of every point."""

    names: tuple[str, ...]
    positions: Float[np.ndarray, "n 3"]
    normals: Float[np.ndarray, "n 3"]
    region: tuple[str, ...]
    looks: dict[str, Look]


def placement_picture(
    rig: Rig, title: str, names: tuple[str, ...], vertices: Int[np.ndarray, " n"], *, subtitle: str, dpi: int
) -> Image.Image:
    """Named vertices on a rig's face. `subtitle` says what a reader should know, such as the residual in millimetres.

    Raises:
        PlanError: there are not as many names as vertices, or more than have room beside a head.
    """
    if len(names) != len(vertices):
        raise PlanError(f"{title}: {len(names)} names for {len(vertices)} points: give every point one name")
    posed, regions = pose(make_head(rig), rig.neutral), face_regions(rig)
    dots = _dots(posed, regions, names, vertices)
    book = Booklet(PaperSize("placement", 1000.0, 200.0), title)
    column = (
        min(max((book.width(name, NAME_PT, bold=True) for name in names), default=0.0), LONGEST_NAME_MM) + BETWEEN_MM
    )
    panel = HEAD_MM[0] + 2 * column
    book = Booklet(
        PaperSize("placement", len(VIEWS) * panel + 2 * MARGIN_MM, HEADER_MM + HEAD_MM[1] + FOOTER_MM), title
    )
    book.add_page(title)
    book.text(MARGIN_MM, 11, title, 15, bold=True)
    book.paragraph(MARGIN_MM, 13.2, subtitle, 8.2, width=book.paper.width - 2 * MARGIN_MM, lines=2, colour=SOFT)
    seen = _draw_views(book, rig, posed, regions, dots, column, dpi)
    _draw_foot(book, dots, seen)
    document = pypdfium2.PdfDocument(book.bytes())
    image = document[0].render(scale=dpi / 72).to_pil()  # pyright: ignore[reportArgumentType]
    document.close()
    return image


def _dots(posed: Posed, regions: FaceRegions, names: tuple[str, ...], vertices: Int[np.ndarray, " n"]) -> _Dots:
    of_point = tuple(regions.region(vertex) for vertex in vertices.tolist())
    return _Dots(names, posed.vertices[vertices], posed.normals[vertices], of_point, looks_of(of_point))


def _draw_views(
    book: Booklet, rig: Rig, posed: Posed, regions: FaceRegions, dots: _Dots, column: float, dpi: int
) -> Bool[np.ndarray, " n"]:
    """The three heads side by side; which points are seen in any."""
    aspect, size = HEAD_MM[0] / HEAD_MM[1], pixels(*HEAD_MM, dpi)
    solid = replace(posed, pieces=tuple(piece for piece in posed.pieces if piece.opacity.min() == 1))
    frames = [portrait(rig, regions.anchors, view, aspect) for view in VIEWS]
    probes = [picture(solid, view, frame, size_px=size) for view, frame in zip(VIEWS, frames, strict=True)]
    seen = np.stack([unhidden(dots.positions, dots.normals, view, p) for view, p in zip(VIEWS, probes, strict=True)])
    best = named_in(seen, dots.normals, dots.positions[:, 0] - regions.anchors.midline)
    for i, (view, frame) in enumerate(zip(VIEWS, frames, strict=True)):
        left = MARGIN_MM + i * (HEAD_MM[0] + 2 * column) + column
        shown = picture(posed, view, frame, size_px=size)
        book.image(shown.rgb, left, HEADER_MM, *HEAD_MM)
        book.text(left + HEAD_MM[0] / 2, HEADER_MM - 2, _said(view), 7.4, colour=SOFT, align="centre")
        points = shown.pixel(view.project(dots.positions)) * HEAD_MM[0] / size[0] + np.array([left, HEADER_MM])
        named = np.flatnonzero(seen[i] & (best == i))
        _draw_names(book, dots, points, named, left, column)
        for n in np.flatnonzero(seen[i]):
            book.marker(float(points[n, 0]), float(points[n, 1]), dots.looks[dots.region[n]], radius=DOT_MM)
    return np.any(seen, axis=0)


def named_in(
    seen: Bool[np.ndarray, "w n"], normals: Float[np.ndarray, "n 3"], x: Float[np.ndarray, " n"]
) -> Int[np.ndarray, " n"]:
    """The view that names each point, an index into `VIEWS`: of the front and its own side, the one that it faces."""
    facing = np.stack([view.project(normals)[:, 2] for view in VIEWS])
    own_side = np.stack([view.azimuth * x >= 0 for view in VIEWS])
    return np.where(seen, facing + 2 * own_side, -2).argmax(axis=0)


def _draw_names(
    book: Booklet,
    dots: _Dots,
    points: Float[np.ndarray, "n 2"],
    named: Int[np.ndarray, " m"],
    left: float,
    column: float,
) -> None:
    """A line from each dot to its name on the nearer side of the head, no two crossing."""
    rows = HEADER_MM + PITCH_MM * (np.arange(int(HEAD_MM[1] / PITCH_MM)) + 0.5)
    ends = np.array([(x, y) for x in (left, left + HEAD_MM[0]) for y in rows])
    chosen = assign_anchors(points[named], ends)
    for n, (x, y) in zip(named, ends[chosen].tolist(), strict=True):
        book.line(points[n], (x, y), width=0.5, colour="#ffffff")
    for n, (x, y) in zip(named, ends[chosen].tolist(), strict=True):
        colour = dots.looks[dots.region[n]].colour
        book.line(points[n], (x, y), width=0.12, colour=INK)
        on_left = x == left
        place, align = (x - 0.8, "right") if on_left else (x + 0.8, "left")
        book.text(
            place, y + 0.8, dots.names[n], NAME_PT, bold=True, colour=colour, align=align, fit=column - BETWEEN_MM / 2
        )


def _draw_foot(book: Booklet, dots: _Dots, seen: Bool[np.ndarray, " n"]) -> None:
    """What the shapes mean, and the names of what no view shows."""
    y = book.paper.height - FOOTER_MM + 5
    counts = {region: dots.region.count(region) for region in dots.looks}
    legend(book, MARGIN_MM, y, book.paper.width - 2 * MARGIN_MM, dots.looks, counts)
    if hidden := ", ".join(name for name, there in zip(dots.names, seen, strict=True) if not there):
        book.text(MARGIN_MM, y + 5.6, f"seen in none of the views: {hidden}", 7, colour=SOFT)


def _said(view: Viewpoint) -> str:
    return {RIGHT: "from the subject's right", FRONT: "front", LEFT: "from the subject's left"}[view]
