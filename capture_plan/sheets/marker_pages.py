"""The pages that say where markers go: one for each view that shows some, each with its mirror image, then the table.

Data     a layout on the mesh that is drawn, sentences on what it is worth, what the table says last of each marker
Pages    front, three-quarters, profiles, chin up, as far as they are needed; behind each what the make-up mirror shows;
         as many pages of the table as it takes
"""

from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from capture_plan.anatomy.regions import UNNAMED, face_regions
from capture_plan.anatomy.zones import DOT_MM
from capture_plan.evaluation.fallen import Falling
from capture_plan.evaluation.rings import PROMISED
from capture_plan.face.anchors import Anchors
from capture_plan.layout.record import Landmark, Layout, MotionFit
from capture_plan.layout.spacing import nearest_straight, nearest_two
from capture_plan.mesh import surface_graph
from capture_plan.progress import track
from capture_plan.rig import Rig
from capture_plan.sheets.care_card import care_rows, draw_care
from capture_plan.sheets.furniture import HeadLine, check_bar, head_line, legend, sides
from capture_plan.sheets.head import Head, pose
from capture_plan.sheets.marker_table import Column, draw_table, rows_per_page
from capture_plan.sheets.markers import HEADER_MM, MarkedFace, Placed, draw_markers, place_all
from capture_plan.sheets.page import MARGIN_MM, Booklet
from capture_plan.sheets.style import ACCENT, SOFT, region_looks
from capture_plan.sheets.tape import tape_points
from capture_plan.sheets.view import CHIN_UP, FRONT, LEFT, LEFT_PROFILE, RIGHT, RIGHT_PROFILE

TITLES = {
    FRONT: "MARKERS · FRONT",
    LEFT: "MARKERS · ACTOR'S LEFT",
    RIGHT: "MARKERS · ACTOR'S RIGHT",
    LEFT_PROFILE: "MARKERS · LEFT PROFILE",
    RIGHT_PROFILE: "MARKERS · RIGHT PROFILE",
    CHIN_UP: "MARKERS · CHIN UP",
}
SLUGS = {
    FRONT: "markers-front",
    LEFT: "markers-left",
    RIGHT: "markers-right",
    LEFT_PROFILE: "markers-left-profile",
    RIGHT_PROFILE: "markers-right-profile",
    CHIN_UP: "markers-chin-up",
}
EXACT_MM = 1.0  # what a steady hand places a dot to
MEASURED = "On the face, with callipers, straight, own side, {mm}, from "
MODEL, OWN = "the model's mm (factor: see the table)", "the actor's own mm"
TIMES_FACTOR = "These are the model's mm: multiply by the factor, see the table."
KEY_SHARE = 0.5  # of the paper's width: from there on the key to the letters
EACH_S = 35.0  # to measure, dot and check a marker: an assumption of ours, as are all times
NOT_FOR_PLACING = "NOT FOR PLACING"
ORDER_MM = 24.0  # of height for the order in which dots are placed
SIDE_WORDS_MM = 52.0  # as wide as ACTOR'S RIGHT with its arrow
FOOT_MM = 27.0  # above the lower edge of the paper


def marked_face(
    rig: Rig, head: Head, layout: Layout, rings: Mapping[str, float] | None = None, dot_mm: float = DOT_MM
) -> MarkedFace:
    """What the pages of markers draw; `head` is of the same rig, `rings` say how far each may stand from its place."""
    looks, regions = region_looks(layout.markers), face_regions(rig)
    tape = tape_points(rig, regions)
    return MarkedFace(
        pose(head, rig.neutral), rig.skin, layout.markers, looks, regions.anchors, tape, rings or {}, dot_mm
    )


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


def placing_words(layout: Layout, dot_mm: float, rings: Mapping[str, float] | None = None) -> str:
    """'34 dots of 3 mm · 9 of them to the millimetre · about 20 min to place': what a make-up artist plans by."""
    count, heads = len(layout.markers), len(layout.head)
    spare = sum(marker.role == "backup" for marker in layout.markers)
    parts = [f"{count} dots of {dot_mm:g} mm"]
    exact = len(exact_ones(rings or {}))
    parts += [f"{exact} of them within less than {EXACT_MM:g} mm"] if exact else []
    parts += [f"{heads} of them for the head's own motion"] if heads else []
    parts += [f"{spare} of them spare"] if spare else []
    return " · ".join([*parts, f"about {max(round(count * EACH_S / 60), 1)} min to place"])


def exact_ones(rings: Mapping[str, float]) -> set[str]:
    """Dots that have to stand nearer to their places than a steady hand puts them, as their rings are printed."""
    return {name for name, ring in rings.items() if round(ring, 1) < EXACT_MM}


def take_words(fit: MotionFit) -> str:
    """What the markers leave of a take."""
    gone = f" · {len(fit.missing)} blendshapes are not in the take" if fit.missing else ""
    return f"Take of {fit.frames:,} frames: {fit.rmse_mm:.2f} mm of its motion are lost (root mean square){gone}"


@dataclass
class MarkerPages:
    """Draws the pages into a book; `add_page` begins one. `placing` are at most two lines under the title of
    every page, and `table` under that of the table. With `fallen` there is a card on what to do when a dot falls
    off; `says` are the movements of blendshapes in words, `agreed` lines for the first page, `code` what
    a telephone reads on each."""

    book: Booklet
    face: MarkedFace
    placing: HeadLine
    table: HeadLine
    last: Column
    dpi: int
    fallen: Falling | None = None
    says: Mapping[str, str] = field(default_factory=dict)
    agreed: tuple[str, ...] = ()
    code: str = ""
    shown: set[str] = field(default_factory=set)

    @cached_property
    def placed(self) -> tuple[list[Placed], tuple[Landmark, ...]]:
        """Every page of markers, and the markers on none of them."""
        return place_all(self.face, self.book, dpi=self.dpi)

    @property
    def count(self) -> int:
        """How many pages there will be."""
        several = len(self.face.landmarks)
        cards = -(-several // care_rows(self.book)) if self.fallen else 0
        return 2 * len(self.placed[0]) + -(-several // rows_per_page(self.book)) + cards

    @property
    def anchors(self) -> Anchors:
        """Where eyes, mouth and ears are."""
        return self.face.anchors

    def draw(self, add_page: Callable[[str], None]) -> None:
        """Draw all marker pages into the book."""
        pages, hidden = self.placed
        number, of = Counter[str](), Counter(page.view.name for page in pages)
        for page in track(pages, "Drawing marker sheets"):
            number[page.view.name] += 1
            parts = of[page.view.name]
            part = f" {number[page.view.name]} OF {parts}" if parts > 1 else ""
            slug = SLUGS[page.view] + (f"-{number[page.view.name]}" if parts > 1 else "")
            add_page(slug)
            self._page(page, TITLES[page.view] + part)
            add_page(f"{slug}-mirror")
            self._page(page.mirrored(self.book.paper.width), f"{TITLES[page.view]}{part} · MIRROR")
        landmarks, per_page = self.face.landmarks, rows_per_page(self.book)
        for n, first in enumerate(range(0, len(landmarks), per_page)):
            add_page("marker-table" if n == 0 else f"marker-table-{n + 1}")
            some = landmarks[first : first + per_page]
            draw_table(self.book, some, self.face, self.table, self.last)
            self._unseen([m.name for m in some if m in hidden])
        step = care_rows(self.book)
        for n, first in enumerate(range(0, len(landmarks) if self.fallen else 0, step)):
            add_page("care-card" if n == 0 else f"care-card-{n + 1}")
            assert self.fallen is not None
            draw_care(self.book, landmarks[first : first + step], self.fallen, self.face, self.placing, self.says)

    def _page(self, page: Placed, title: str) -> None:
        book, face = self.book, self.face
        draw_markers(book, page, face)
        head_line(book, title, self.placing, code=self.code)
        if page.view.mirrored:  # nobody takes the one for the other
            book.box(MARGIN_MM, 23.6, book.paper.width - 2 * MARGIN_MM, 1.6, fill=ACCENT, line=None)
            words, middle = "AS THE MIRROR SHOWS IT", book.paper.width / 2
            book.text(middle, HEADER_MM - 0.5, words, 10, bold=True, align="centre", colour=ACCENT)
        sides(book, HEADER_MM - 0.5, left_on_right=not page.view.mirrored)
        if len(book.titles) == 1:
            self._agreed()
        keyed = self._beside(page)
        y = book.paper.height - FOOT_MM
        if self.face.nobodys:
            size = NOT_FOR_PLACING
        else:
            check_bar(book, MARGIN_MM, y)
            size = "LIFE SIZE 1:1" if page.scale == 1 else f"SCALE 1:{page.scale:g}"
        book.text(MARGIN_MM, y + 13.2, size, 15, bold=True)
        x = MARGIN_MM + 66
        wide = book.paper.width - MARGIN_MM - x
        counts = Counter(m.region for m in page.landmarks)
        legend(book, x, y + 0.4, wide, {name: look for name, look in face.looks.items() if counts[name]}, counts)
        book.paragraph(x, y + 7.3, self._notes(page, keyed=keyed), 7.2, width=wide, lines=3, colour=SOFT)

    def _agreed(self) -> None:
        """What was agreed with the actor, between the words that tell the sides."""
        book, y = self.book, 23.6
        room = book.paper.width - 2 * (MARGIN_MM + SIDE_WORDS_MM)
        for words in self.agreed:
            y += 3.1
            book.text(book.paper.width / 2, y, words, 7, colour=SOFT, align="centre", fit=room)

    def _beside(self, page: Placed) -> bool:
        """In which order the dots of a page are placed, and from where they are measured, where there is room below the
        face; says whether there was."""
        book = self.book
        below = page.corner[1] + page.picture.frame.height / page.scale
        y = book.paper.height - FOOT_MM - ORDER_MM
        if max(below, *(row.y + 5 for row in page.rows)) > y - 4:
            return False
        if len(page.landmarks) > 1:
            self._order(page, y)
        self._key(page, y)
        return True

    def _order(self, page: Placed, y: float) -> None:
        book, face, left = self.book, self.face, MARGIN_MM
        exact = exact_ones(face.rings)
        middle = [m.name for m in page.landmarks if m.side == "middle"]
        near = [m.name for m in page.landmarks if m.name in exact and m.name not in middle]
        rest = [m.name for m in page.landmarks if m.name not in middle and m.name not in near]
        book.text(left, y, "PLACE IN THIS ORDER", 8, bold=True)
        steps = {"the middle line": middle, f"what has to be within {EXACT_MM:g} mm": near, "the others": rest}
        for n, (what, names) in enumerate([(what, names) for what, names in steps.items() if names]):
            words = f"{n + 1}  {what}: {', '.join(names)}"
            book.text(left, y + 4.6 * (n + 1), words, 8, fit=KEY_SHARE * book.paper.width - MARGIN_MM - 3)

    def _points(self, page: Placed) -> list[tuple[str, str]]:
        """Letter and name of each point that the dots of a page are measured from."""
        drawn = {(p.letter, p.name) for p, _ in page.crosses}
        measures = [self.face.measure(m) for m in page.landmarks]
        used = {(p.letter, p.name) for measure in measures if measure for p in measure.points}
        return [(a, name if (a, name) in drawn else f"{name} (not here)") for a, name in sorted(used)]

    def _key(self, page: Placed, y: float) -> None:
        """What the letters stand for, and what is done with the millimetres."""
        book, points = self.book, self._points(page)
        if not points:
            return
        x = KEY_SHARE * book.paper.width
        column = (book.paper.width - MARGIN_MM - x) / 2
        book.text(x, y, "MEASURE FROM, WITH CALLIPERS, STRAIGHT, ON ITS OWN SIDE", 8, bold=True, fit=2 * column)
        for n, (letter, name) in enumerate(points):
            at_x, at_y = x + column * (n % 2), y + 4.6 * (n // 2 + 1)
            book.text(at_x, at_y, letter, 8, bold=True)
            book.text(at_x + 3, at_y, name, 8, fit=column - 4)
        words = "These are the actor's own mm." if self.face.own else TIMES_FACTOR
        book.text(x, y + 4.6 * (-(-len(points) // 2) + 1), words, 8, bold=True, fit=2 * column)

    def _notes(self, page: Placed, *, keyed: bool) -> str:
        """What the signs on a page mean."""
        points = self._points(page)
        notes = (
            [MEASURED.format(mm=OWN if self.face.own else MODEL) + ", ".join(f"{a} {name}" for a, name in points)]
            if points and not keyed
            else []
        )
        if any(m.name in self.face.rings for m in page.landmarks):
            thick = any(m.name in self.face.strict for m in page.landmarks)
            notes.append("the whole dot stays within its ring" + (", exactest along its thick ends" if thick else ""))
            if self.face.kept < PROMISED:
                notes.append(
                    f"only {self.face.kept:.0%} of crews then keep the error: measure each dot where it stands"
                )
        notes.append("every dot is round, its sign tells the region")
        if self.face.off_mm:
            notes.append(f"the printed place itself may be off by {self.face.off_mm:.1f} mm: trust your eye")
        if any(m.role == "backup" for m in page.landmarks):
            notes.append("hollow: a spare")
        if any(m.role == "head" for m in page.landmarks):
            notes.append("H: for the head's own motion")
        if any(m.region == UNNAMED for m in self.face.landmarks):
            notes.append("places have no names: eyes or mouth of the rig are not certain")
        rest = len(self.face.landmarks) - len(page.landmarks)
        notes.append(
            f"on this page: {len(page.landmarks)} of {len(self.face.landmarks)} dots"
            if rest
            else "on this page: all dots"
        )
        return " · ".join(notes)

    def _unseen(self, names: list[str]) -> None:
        if names:
            book, text = self.book, f"Hidden in every view, place by the table: {', '.join(names)}"
            book.text(MARGIN_MM, book.paper.height - 12, text, 8, bold=True, fit=book.paper.width - 2 * MARGIN_MM)
