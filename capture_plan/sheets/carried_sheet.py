"""One picture to judge by whether a plan came to lie right on an actor's head: the scan, shaded, from the front and
both sides, with the laid neutral as a net, its dots with their names, and the points that were picked.

Lengths are page millimetres from the top left corner, y down; heads are drawn in the rig's pose.
"""

import io
from collections.abc import Mapping

import numpy as np
import pypdfium2
from jaxtyping import Bool, Float
from PIL import Image

from capture_plan.face.anchors import face_anchors, face_surface
from capture_plan.mesh import edges, vertex_normals
from capture_plan.plan.carry import actor_words
from capture_plan.plan.record import ActorHead, Plan
from capture_plan.reader.head_scan import HeadScan
from capture_plan.rig import Rig
from capture_plan.sheets.head import SKIN, Posed, Shown
from capture_plan.sheets.markers import unhidden
from capture_plan.sheets.number_places import place_numbers
from capture_plan.sheets.page import MARGIN_MM, POINT_MM, Booklet, PaperSize
from capture_plan.sheets.shots import on_page
from capture_plan.sheets.style import ACCENT, INK, SOFT, region_looks
from capture_plan.sheets.view import (
    FRONT,
    LEFT_PROFILE,
    RIGHT_PROFILE,
    Picture,
    PictureFrame,
    Viewpoint,
    picture,
    pixels,
)
from capture_plan.visibility import hemisphere_visibility

VIEWS = (RIGHT_PROFILE, FRONT, LEFT_PROFILE)  # as one walks round the head, from its right to its left
HEAD_MM = (124.0, 159.0)  # of paper for each view
HEADER_MM, FOOTER_MM = 26.0, 12.0
DPI = 200
AROUND = 0.12  # of the box around the laid face, on each side
MOST_LINES = 6000
SHADE_RAYS = 48
MOST_SHADED = 60_000  # vertices; a finer scan is shaded by its normals alone
DOT_MM, NAME_PT = 0.9, 7.0
UPRIGHT = "the scan as it was read, with the laid net on it; sides are the actor's own"


def carried_picture(
    plan: Plan,
    rig: Rig,
    neutral: Float[np.ndarray, "v 3"],
    head: HeadScan,
    points: Mapping[str, tuple[float, float, float]],
) -> bytes:
    """The picture as PNG; `neutral` is the rig's on the head, millimetres, `points` in the head file's coordinates.

    Raises:
        RenderError: this machine cannot draw.
    """
    assert plan.actor is not None
    title = f"{len(plan.actor.dots)} dots on {plan.actor.name}"
    width = len(VIEWS) * HEAD_MM[0] + 2 * MARGIN_MM
    book = Booklet(PaperSize("carried", width, HEADER_MM + HEAD_MM[1] + FOOTER_MM), title)
    book.add_page(title)
    book.text(MARGIN_MM, 11, title, 15, bold=True)
    book.text(MARGIN_MM, 16.6, actor_words(plan.actor), 9, colour=INK)
    book.text(MARGIN_MM, 21.2, UPRIGHT, 7.4, colour=SOFT)
    posed = scan_as_the_rig_stands(head, plan.actor)
    skin = _face(rig)
    picked = _upright(np.array(list(points.values())).reshape(-1, 3), plan.actor)
    for i, view in enumerate(VIEWS):
        frame = _framed(neutral[skin], view)
        shown = picture(posed, view, frame, size_px=pixels(*HEAD_MM, DPI))
        corner = (MARGIN_MM + i * HEAD_MM[0], HEADER_MM)
        book.image(shown.rgb, *corner, *HEAD_MM)
        _net(book, rig, neutral, skin, view, shown, corner)
        _dots(book, plan, rig, neutral, view, shown, corner)
        for at in on_page(shown, view.project(picked)[:, :2], *corner, HEAD_MM[0]):
            book.line((at[0] - 1.4, at[1]), (at[0] + 1.4, at[1]), width=0.35, colour=ACCENT)
            book.line((at[0], at[1] - 1.4), (at[0], at[1] + 1.4), width=0.35, colour=ACCENT)
        book.text(corner[0] + HEAD_MM[0] / 2, HEADER_MM + HEAD_MM[1] + 5, view.name, 9, bold=True, align="centre")
    if len(picked):
        words = f"crosses: the {len(picked)} points picked"
        book.text(MARGIN_MM, HEADER_MM + HEAD_MM[1] + 9.5, words, 7.4, colour=SOFT)
    document = pypdfium2.PdfDocument(book.bytes())
    image: Image.Image = document[0].render(scale=DPI / 72).to_pil()  # pyright: ignore[reportArgumentType]
    document.close()
    made = io.BytesIO()
    image.save(made, "PNG", compress_level=6, dpi=(DPI, DPI))
    return made.getvalue()


def scan_as_the_rig_stands(head: HeadScan, actor: ActorHead) -> Posed:
    """The scan ready to be drawn, millimetres, +y up and facing +z, its normals outwards."""
    x = _upright(head.vertices, actor)
    normals = vertex_normals(x, head.triangles)
    openness = np.ones(len(x))
    if len(x) <= MOST_SHADED:
        openness = hemisphere_visibility(x, head.triangles, np.arange(len(x)), rays=SHADE_RAYS)
    colours = np.tile(SKIN.colour, (len(x), 1))
    return Posed(x, normals, (Shown(SKIN, x, normals, head.triangles, colours, np.ones(len(x)), openness),))


def _upright(x: Float[np.ndarray, "n 3"], actor: ActorHead) -> Float[np.ndarray, "n 3"]:
    R = np.reshape(actor.rotation, (3, 3))
    return (x * actor.unit_mm - np.array(actor.translation)) @ R


def _face(rig: Rig) -> Bool[np.ndarray, " v"]:
    """What the picture has to show: the face with the ears and some of the neck."""
    anchors, x = face_anchors(rig), rig.neutral
    u, y = anchors.pupils, rig.neutral[:, 1]
    low, high = anchors.chin[1] - 0.6 * u, anchors.eye_left[1] + 1.6 * u
    back = min(anchors.ear_left[2], anchors.ear_right[2]) - 0.5 * u
    return face_surface(rig) & (y > low) & (y < high) & (x[:, 2] > back)


def _framed(face: Float[np.ndarray, "n 3"], view: Viewpoint) -> PictureFrame:
    """What is shown, in the proportions of its place on paper."""
    seen = view.project(face)[:, :2]
    low, high = seen.min(axis=0), seen.max(axis=0)
    middle, half = (low + high) / 2, (high - low) * (0.5 + AROUND)
    scale = max(half[0] / HEAD_MM[0], half[1] / HEAD_MM[1])
    w, h = scale * HEAD_MM[0], scale * HEAD_MM[1]
    return PictureFrame(middle[0] - w, middle[0] + w, middle[1] - h, middle[1] + h, fade=0.06 * h)


def _net(
    book: Booklet,
    rig: Rig,
    neutral: Float[np.ndarray, "v 3"],
    skin: Bool[np.ndarray, " v"],
    view: Viewpoint,
    shown: Picture,
    corner: tuple[float, float],
) -> None:
    """The edges of the laid skin that face the viewer and that the scan does not hide."""
    some = edges(rig.triangles[skin[rig.triangles].all(axis=1)])
    normals = vertex_normals(neutral, rig.triangles)
    free = unhidden(neutral, normals, view, shown)
    some = some[free[some].all(axis=1)]
    some = some[:: max(1, len(some) // MOST_LINES)]
    at = on_page(shown, view.project(neutral)[:, :2], *corner, HEAD_MM[0])
    inside = np.all((at >= corner) & (at <= np.add(corner, HEAD_MM)), axis=1)
    for a, b in some[inside[some].all(axis=1)].tolist():
        book.line(tuple(at[a]), tuple(at[b]), width=0.07, colour="#2f6f9f")


def _dots(
    book: Booklet,
    plan: Plan,
    rig: Rig,
    neutral: Float[np.ndarray, "v 3"],
    view: Viewpoint,
    shown: Picture,
    corner: tuple[float, float],
) -> None:
    """Every dot that is seen, in the shape and colour of its region, with its name beside it."""
    assert plan.actor is not None
    markers = plan.layout.markers
    x = np.array([dot.position for dot in plan.actor.dots])
    normals = vertex_normals(neutral, rig.triangles)[[m.vertex for m in markers]]
    looks = region_looks(markers)
    there = unhidden(x, normals, view, shown)
    places = on_page(shown, view.project(x)[:, :2], *corner, HEAD_MM[0])
    shown_dots = np.flatnonzero(there)
    high = NAME_PT * POINT_MM
    sizes = np.array([(book.width(markers[i].name, NAME_PT, bold=True), 0.72 * high) for i in shown_dots])
    radii = np.full(len(shown_dots), DOT_MM + 0.3)
    room = (corner[0], corner[1], corner[0] + HEAD_MM[0], corner[1] + HEAD_MM[1])
    numbers = place_numbers(places[shown_dots], sizes.reshape(-1, 2), radii, np.zeros((0, 4)), room)
    beside = places[shown_dots] + [DOT_MM + 0.5 + high, 0] if numbers is None else numbers.middle
    for start, end in () if numbers is None else numbers.ticks:
        book.line(start, end, width=0.2)
    for i, (x_mm, y_mm) in zip(shown_dots, beside.tolist(), strict=True):
        book.marker(places[i, 0], places[i, 1], looks[markers[i].region], radius=DOT_MM)
        book.text(x_mm, y_mm + 0.36 * high, markers[i].name, NAME_PT, bold=True, align="centre", halo="#ffffff")
