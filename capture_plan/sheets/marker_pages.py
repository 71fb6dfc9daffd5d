"""The pages that say where markers go: one for each view of the face, then the table.

Data     a layout on the mesh that is drawn, sentences on what it is worth, what the table says last of each marker
Pages    front, actor's left, actor's right, in the mirror; as many pages of the table as it takes
"""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from capture_plan.anatomy.regions import UNNAMED, face_regions
from capture_plan.face.anchors import Anchors
from capture_plan.layout.record import Layout, MotionFit
from capture_plan.layout.spacing import nearest_straight, nearest_two
from capture_plan.mesh import surface_graph
from capture_plan.plan.predicted import headline_words
from capture_plan.progress import track
from capture_plan.rig import Rig
from capture_plan.sheets.furniture import HeadLine, check_bar, head_line, legend, sides
from capture_plan.sheets.head import Head, pose
from capture_plan.sheets.marker_table import Column, draw_table, rows_per_page
from capture_plan.sheets.markers import HEADER_MM, MarkedFace, draw_markers, place
from capture_plan.sheets.page import MARGIN_MM, Booklet
from capture_plan.sheets.style import SOFT, region_looks
from capture_plan.sheets.view import FRONT, LEFT, MIRROR, RIGHT, Viewpoint

TITLES = {
    FRONT: "MARKERS · FRONT",
    LEFT: "MARKERS · ACTOR'S LEFT",
    RIGHT: "MARKERS · ACTOR'S RIGHT",
    MIRROR: "MARKERS · IN THE MIRROR",
}
SLUGS = {FRONT: "markers-front", LEFT: "markers-left", RIGHT: "markers-right", MIRROR: "markers-mirror"}


def marked_face(rig: Rig, head: Head, layout: Layout) -> MarkedFace:
    """What the pages of markers draw; `head` is of the same rig."""
    looks = region_looks(layout.markers)
    return MarkedFace(pose(head, rig.neutral), rig.skin, layout.markers, looks, face_regions(rig).anchors)


def nearest_words(layout: Layout, rig: Rig) -> str:
    """' · nearest two 8.1 mm straight, 9.4 mm along the skin', as `check` measures them."""
    graph = surface_graph(rig.neutral, rig.triangles[rig.skin[rig.triangles].all(axis=1)])
    at = np.array([m.vertex for m in layout.markers], dtype=int)
    straight, along = nearest_straight(rig.neutral, at), nearest_two(graph, at)
    if not np.isfinite(straight):
        return ""
    return f" · nearest two {straight:.1f} mm straight" + (
        f", {along:.1f} mm along the skin" if np.isfinite(along) else ""
    )


def rig_words(layout: Layout, rig: Rig) -> str:
    """What the markers tell of the rig."""
    information = layout.information
    bare = f" · {len(layout.uncovered)} blendshapes have no marker" if layout.uncovered else ""
    head = f" + {len(layout.head)} on the head" if layout.head else ""
    markers = f"{information.landmarks} markers{head} · {headline_words(information, layout.predictions)}"
    return f"{markers}{bare}{nearest_words(layout, rig)}"


def take_words(fit: MotionFit) -> str:
    """What the markers leave of a take."""
    gone = f" · {len(fit.missing)} blendshapes are not in the take" if fit.missing else ""
    return f"Take of {fit.frames:,} frames: {fit.rmse_mm:.2f} mm of its motion are lost (root mean square){gone}"


@dataclass
class MarkerPages:
    """Draws the pages into a book; `add_page` begins one. `information` are at most two lines under each title."""

    book: Booklet
    face: MarkedFace
    information: HeadLine
    last: Column
    dpi: int
    shown: set[str] = field(default_factory=set)

    @property
    def count(self) -> int:
        """How many pages there will be."""
        return len(TITLES) + -(-len(self.face.landmarks) // rows_per_page(self.book))

    @property
    def anchors(self) -> Anchors:
        """Where eyes, mouth and ears are."""
        return self.face.anchors

    def draw(self, add_page: Callable[[str], None]) -> None:
        """Draw all marker pages into the book."""
        for view in track(tuple(TITLES), "Drawing marker sheets"):
            self._view(view, add_page)
        landmarks, per_page = self.face.landmarks, rows_per_page(self.book)
        for n, first in enumerate(range(0, len(landmarks), per_page)):
            add_page("marker-table" if n == 0 else f"marker-table-{n + 1}")
            some = landmarks[first : first + per_page]
            draw_table(self.book, some, landmarks, self.face.looks, self.anchors, self.information, self.last)
            self._unseen([m.name for m in some if m.name not in self.shown])

    def _view(self, view: Viewpoint, add_page: Callable[[str], None]) -> None:
        book, face = self.book, self.face
        placed = place(face, view, book, dpi=self.dpi)
        add_page(SLUGS[view])
        draw_markers(book, placed, face.looks)
        head_line(book, TITLES[view], self.information)
        sides(book, HEADER_MM - 0.5, left_on_right=not view.mirrored)
        y = book.paper.height - 27
        size = "LIFE SIZE 1:1" if placed.scale == 1 else f"SCALE 1:{placed.scale:g}"
        check_bar(book, MARGIN_MM, y)
        book.text(MARGIN_MM, y + 13.2, size, 15, bold=True)
        counts = {region: sum(m.region == region for m in face.landmarks) for region in face.looks}
        x = MARGIN_MM + 66
        legend(book, x, y + 1.2, book.paper.width - MARGIN_MM - x, face.looks, counts)
        self.shown |= {landmark.name for landmark in placed.landmarks}
        notes = ["hollow: a spare"] if any(m.role == "backup" for m in placed.landmarks) else []
        if any(m.role == "head" for m in placed.landmarks):
            notes.append("H: for the head's own motion")
        if any(m.region == UNNAMED for m in face.landmarks):
            notes.append("places have no names: eyes or mouth of the rig are not certain")
        if len(placed.landmarks) < len(face.landmarks):
            notes.append(f"{len(placed.landmarks)} of {len(face.landmarks)} markers are seen from here")
        book.text(book.paper.width - MARGIN_MM, y + 13.2, "  ·  ".join(notes), 7.4, align="right", colour=SOFT)

    def _unseen(self, names: list[str]) -> None:
        if names:
            book, text = self.book, f"Seen on none of the sheets, place by the table: {', '.join(names)}"
            book.text(MARGIN_MM, book.paper.height - 12, text, 8, bold=True, fit=book.paper.width - 2 * MARGIN_MM)
