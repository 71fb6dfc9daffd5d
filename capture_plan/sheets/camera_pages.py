"""Pages for who sets cameras up and reads the dots: what each camera sees, where it stands, what it does not read.

First page   the neutral as the camera takes it, dots as the ellipses that they become, the expression in which it reads
             fewest of them beside it, where to mount it in figures and from the side and from above
Next         a table of dots and expressions: read, or the letter of the reason
Lengths on the page are millimetres from the top left corner, y down; pixels are the camera's.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from capture_plan.camera import Camera, mounting
from capture_plan.layout.dot_contact import NEUTRAL
from capture_plan.sheets.camera_picture import Crop, through_lens
from capture_plan.sheets.camera_reads import ASIDE, CameraReads, numbers_beside, sided
from capture_plan.sheets.furniture import head_line
from capture_plan.sheets.head import pose
from capture_plan.sheets.page import MARGIN_MM, Booklet
from capture_plan.sheets.style import ACCENT, FAINT, INK, SOFT, WASH, Number
from capture_plan.sheets.view import LEFT_PROFILE, PictureFrame, Viewpoint, picture, pixels
from capture_plan.visibility import FEWEST_PIXELS, MOST_DEGREES, Sight

ABOVE = Viewpoint("Above", 0.0, elevation=90.0)
TOP_MM, LARGE_MM, SMALL_MM, GAP_MM = 28.0, (122.0, 150.0), (58.0, 74.0), 5.0
ROW_MM, COLUMNS_MM, NAME_MM, LAST_MM, HEAD_MM = 4.4, (6.0, 7.4), 34.0, 14.0, 7.0
LETTERS = {
    Sight.READ: "",
    Sight.OUTSIDE: "O",
    Sight.TURNED: "T",
    Sight.HIDDEN: "H",
    Sight.EDGE_ON: "E",
    Sight.SMALL: "S",
    Sight.BLURRED: "F",
}
LEGEND = (
    "Filled: the camera reads the dot. H hidden by the face · T turned away · "
    f"E edge-on, more than {MOST_DEGREES:g}° off · O out of the picture · S narrower than {FEWEST_PIXELS:g} px · "
    "F out of focus · least px: the narrowest that it becomes"
)


@dataclass(frozen=True, eq=False)
class CameraPages:
    """The pages of what cameras read, on a booklet."""

    reads: CameraReads
    book: Booklet

    def tables(self) -> list[range]:
        """Which markers stand in the table of each page."""
        room = int((self.book.paper.height - TOP_MM - HEAD_MM - 26) // ROW_MM)
        return [range(k, min(k + room, len(self.reads.marks))) for k in range(0, len(self.reads.marks), room)]

    def blocks(self) -> list[range]:
        """Which expressions, the neutral among them, stand beside each other in a table."""
        room = int((self.book.paper.width - 2 * MARGIN_MM - NAME_MM - LAST_MM) // COLUMNS_MM[0])
        return [range(k, min(k + room, 1 + len(self.reads.poses))) for k in range(0, 1 + len(self.reads.poses), room)]

    def count(self) -> int:
        """How many pages all cameras take."""
        return len(self.reads.cameras) * (1 + len(self.tables()) * len(self.blocks()))

    def draw(self, dpi: Number, add_page: Callable[[str], None]) -> None:
        """All pages, camera by camera."""
        for c, camera in enumerate(self.reads.cameras):
            slug = "".join(letter if letter.isalnum() else "-" for letter in camera.name.lower())
            add_page(f"camera-{slug}")
            self._first(c, dpi)
            for block in self.blocks():
                for rows in self.tables():
                    add_page(f"camera-{slug}-reads")
                    self._table(c, rows, block)

    def _first(self, c: int, dpi: Number) -> None:
        camera, how = self.reads.cameras[c], self.reads.views.how[:, c]
        always, marks = self.reads.always(c), len(self.reads.marks)
        width, height = camera.size_px
        head_line(
            self.book,
            f"Camera: {camera.name}",
            (
                f"reads {always} of {marks} dots in the neutral and all expressions · "
                f"pictures of {width} \N{MULTIPLICATION SIGN} {height} px",
            ),
        )
        wide, high = _fit(camera, LARGE_MM)
        self._picture(c, 0, (MARGIN_MM, TOP_MM, wide, high), dpi)
        text = "Neutral, as the camera takes it. Filled: read. Outlined: seen, but not well enough."
        below = self.book.paragraph(MARGIN_MM, TOP_MM + high + 1.5, text, 7.5, width=LARGE_MM[0], lines=2, colour=SOFT)
        beside = self._figures(c, MARGIN_MM + LARGE_MM[0] + GAP_MM)
        y, e = min(max(below, beside) + 6, TOP_MM + LARGE_MM[1] + 12), self.reads.worst(c)
        wide, high = _fit(camera, SMALL_MM)
        self._picture(c, e, (MARGIN_MM, y, wide, high), dpi)
        words = f"{self.reads.shot(e)}: it reads fewest here, {int((how[e] == Sight.READ).sum())} of {marks}"
        if always == marks:
            words = f"{self.reads.shot(e)}: as in all others, it reads every dot"
        self.book.paragraph(MARGIN_MM, y + high + 1.5, words, 7.5, width=SMALL_MM[0], lines=2, colour=SOFT)
        for k, view in enumerate((LEFT_PROFILE, ABOVE)):
            x = MARGIN_MM + (k + 1) * (SMALL_MM[0] + GAP_MM + 3)
            self._sketch(c, view, (x, y, *SMALL_MM), dpi)

    def _picture(self, c: int, e: int, at: tuple[Number, Number, Number, Number], dpi: Number) -> None:
        """The picture of a camera in an expression on the page with its dots, all of them numbered at rest, else those
        that it does not read."""
        (x, y, wide, high), camera = at, self.reads.cameras[c]
        view = self.reads.view(c, e, pixels(wide, high, dpi)[0])
        self.book.image(view.rgb, x, y, wide, high)
        self.book.box(x, y, wide, high, line=SOFT, width=0.2)
        rims = (view.rims - [view.crop.left, view.crop.top]) * (wide / view.crop.width) + [x, y]
        for rim, read in zip(rims[view.seen], view.read[view.seen], strict=True):
            self.book.polygon(rim, fill=INK if read else None, line="#ffffff" if read else ACCENT, width=0.15)
        named = view.seen if e == 0 else view.seen & ~view.read
        bounds = (float(x), float(y), float(x + wide), float(y + high))
        whose, placed = numbers_beside(rims, named, bounds)
        for n, (left, top), (start, end) in zip(whose, placed.middle.tolist(), placed.ticks.tolist(), strict=True):
            if start != end:
                self.book.line(start, end, width=0.15)
            name = self.reads.marks[n].name
            self.book.text(left, top + 0.9, name, 7, bold=True, align="centre", halo="#ffffff")
        if view.crop != Crop.whole(camera):
            self._inset(camera, view.crop, e, at, dpi)

    def _inset(
        self,
        camera: Camera,
        crop: Crop,
        e: int,
        at: tuple[Number, Number, Number, Number],
        dpi: Number,
    ) -> None:
        """The whole picture in a corner, with the part that is shown."""
        x, y, wide, high = at
        w, h = _fit(camera, (wide / 4, high / 4))
        left, top = x + wide - w - 1, y + high - h - 1
        posed = self.reads.neutral if e == 0 else pose(self.reads.head, self.reads.vertices(e))
        self.book.image(through_lens(posed, camera, Crop.whole(camera), pixels(w, h, dpi)[0]).rgb, left, top, w, h)
        self.book.box(left, top, w, h, line=SOFT, width=0.2)
        scale = w / camera.size_px[0]
        self.book.box(
            left + scale * (crop.left + 0.5),
            top + scale * (crop.top + 0.5),
            scale * crop.width,
            scale * crop.height,
            line=ACCENT,
            width=0.3,
        )

    def _figures(self, c: int, x: Number) -> Number:
        """Where to mount the camera, and how it stands to the others; returns the y below."""
        width = self.book.paper.width - MARGIN_MM - x
        y = TOP_MM + 2
        self.book.text(x, y + 1.5, "Where it stands", 10, bold=True)
        y += 4
        for term, words in [*self.reads.mounting_rows(c), *self.reads.label_rows(c), *self.reads.measured_rows()]:
            y = self.book.paragraph(x, y + 1.2, term, 7.5, width=width, lines=2, colour=SOFT)
            y = self.book.paragraph(x, y, words, 9, width=width, lines=4)
        return y

    def _sketch(self, c: int, view: Viewpoint, at: tuple[Number, Number, Number, Number], dpi: Number) -> None:
        """Head and cameras from the side or from above, to scale."""
        x, y, wide, high = at
        head = view.project(self.reads.rig.neutral[self.reads.rig.skin])[:, :2]
        lenses = view.project(np.stack([camera.position for camera in self.reads.cameras]))[:, :2]
        everything = np.concatenate([head, lenses])
        low, top = everything.min(axis=0), everything.max(axis=0)
        middle, extent = (low + top) / 2, (top - low) * 1.1
        scale = max(extent[0] / wide, extent[1] / high)
        half = np.array([wide, high]) * scale / 2
        frame = PictureFrame(middle[0] - half[0], middle[0] + half[0], middle[1] - half[1], middle[1] + half[1])
        self.book.image(picture(self.reads.neutral, view, frame, size_px=pixels(wide, high, dpi)).rgb, x, y, wide, high)
        self.book.box(x, y, wide, high, line=FAINT, width=0.2)

        def on_page(points: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 2"]:
            flat = view.project(points)[:, :2]
            return np.column_stack([x + (flat[:, 0] - frame.left) / scale, y + (frame.top - flat[:, 1]) / scale])

        aim = on_page(self.reads.philtrum[None])[0]
        for k, camera in enumerate(self.reads.cameras):
            place = on_page(camera.position[None])[0]
            mine = k == c
            self.book.line(place, aim, width=0.25 if mine else 0.1, colour=ACCENT if mine else FAINT)
            way = on_page((camera.position + 10 * camera.rotation[2])[None])[0] - place
            length = float(np.linalg.norm(way))
            way = way / length if length > 0.05 else np.array([0.0, 0.0])
            side = np.array([-way[1], way[0]])
            corners = place + np.stack([-2.2 * way, 1.2 * way + 1.5 * side, 1.2 * way - 1.5 * side])
            self.book.polygon(corners, fill=ACCENT if mine else "#ffffff", line=ACCENT if mine else SOFT, width=0.2)
        m = mounting(self.reads.cameras[c], self.reads.philtrum)
        words = ", ".join([f"{m.ahead_mm:.0f} mm ahead", *sided(m.above_mm, "above", "below")])
        if view is ABOVE:
            words = ", ".join([f"{m.ahead_mm:.0f} mm ahead", *sided(m.left_mm, *ASIDE)])
        title = "From the actor's left" if view is LEFT_PROFILE else "From above"
        self.book.paragraph(x, y + high + 1.5, f"{title}: {words}", 7.5, width=wide, lines=2, colour=SOFT)

    def _table(self, c: int, rows: range, block: range) -> None:
        """Markers down, expressions across."""
        camera, how = self.reads.cameras[c], self.reads.views.how[:, c]
        names = ("neutral", *self.reads.poses)
        head_line(self.book, f"Camera: {camera.name}", ("which dots it reads in which expression",))
        room = self.book.paper.width - 2 * MARGIN_MM
        self.book.paragraph(MARGIN_MM, TOP_MM - 2, LEGEND, 7.5, width=room, lines=2, colour=SOFT)
        left, top = MARGIN_MM + NAME_MM, TOP_MM + 8 + HEAD_MM
        wide = min((room - NAME_MM - LAST_MM) / len(block), COLUMNS_MM[1])
        for k, e in enumerate(block):
            word = "rest" if names[e] == NEUTRAL else names[e]
            self.book.text(left + (k + 0.5) * wide, top - 1.6, word, 7, bold=True, align="centre")
        px = self.reads.views.pixels[c]
        last = left + len(block) * wide + LAST_MM
        self.book.text(last, top - 1.6, "least px", 7, bold=True, align="right")
        for k, n in enumerate(rows):
            y = top + k * ROW_MM
            if k % 2:
                self.book.box(MARGIN_MM, y, last - MARGIN_MM, ROW_MM, fill=WASH, line=None)
            self.book.text(MARGIN_MM + 0.5, y + 3.2, self.reads.marks[n].name, 7.5, bold=True)
            self.book.text(MARGIN_MM + 9, y + 3.2, self.reads.marks[n].label, 7, colour=SOFT, fit=NAME_MM - 10)
            self.book.text(last, y + 3.2, f"{px[n]:.1f}" if px[n] else "never", 7, align="right")
            for j, e in enumerate(block):
                x, sight = left + (j + 0.5) * wide, Sight(int(how[e, n]))
                if sight == Sight.READ:
                    self.book.ring(x, y + ROW_MM / 2, 0.9, colour=INK, filled=True)
                else:
                    self.book.text(x, y + 3.2, LETTERS[sight], 8, bold=True, align="centre", colour=ACCENT)
        below = top + len(rows) * ROW_MM
        self.book.line((MARGIN_MM, below), (last, below), width=0.2, colour=SOFT)
        self.book.text(MARGIN_MM + 0.5, below + 3.6, "read", 7.5, bold=True)
        for j, e in enumerate(block):
            read = int((how[e] == Sight.READ).sum())
            self.book.text(left + (j + 0.5) * wide, below + 3.6, str(read), 7.5, bold=True, align="centre")


def _fit(camera: Camera, room: tuple[Number, Number]) -> tuple[Number, Number]:
    """Width and height of its picture in a room, millimetres."""
    scale = min(room[0] / camera.size_px[0], room[1] / camera.size_px[1])
    return camera.size_px[0] * scale, camera.size_px[1] * scale
