"""Pages for who sets cameras up and reads the dots: what each camera sees, where it stands, what it does not read.

First page   the neutral as the camera takes it, dots as the ellipses that they become, the expression in which it reads
             fewest of them beside it, where to mount it in figures and from the side and from above
Next         a table of dots and expressions: read, or the letter of the reason
Lengths on the page are millimetres from the top left corner, y down; pixels are the camera's.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float

from capture_plan.camera import Camera, Mounting, between, mounting, upper_philtrum
from capture_plan.layout.dot_contact import NEUTRAL
from capture_plan.layout.record import Landmark
from capture_plan.layout.unread import pose_deltas, pose_views
from capture_plan.mesh import vertex_normals
from capture_plan.plan.record import Plan, cameras_of
from capture_plan.rig import Rig
from capture_plan.sheets.camera_picture import Crop, dot_outlines, through_lens
from capture_plan.sheets.furniture import head_line
from capture_plan.sheets.head import Head, Posed, pose
from capture_plan.sheets.number_places import place_numbers
from capture_plan.sheets.page import MARGIN_MM, Booklet
from capture_plan.sheets.style import ACCENT, FAINT, INK, SOFT, WASH, Number
from capture_plan.sheets.view import LEFT_PROFILE, PictureFrame, Viewpoint, picture, pixels
from capture_plan.visibility import FEWEST_PIXELS, MOST_DEGREES, SEEN, Sight, Views

ABOVE = Viewpoint("Above", 0.0, elevation=90.0)
TOP_MM, LARGE_MM, SMALL_MM, GAP_MM = 28.0, (122.0, 150.0), (58.0, 74.0), 5.0
NUMBER_PT, HALF_LETTER = 7.0, (2.6, 1.4)
AROUND = 0.12  # of the dots' extent: what a crop leaves around them
CROPPED = 0.45  # of the picture: where dots take less in both directions, it is cropped to them
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
    """What cameras read of the markers of a plan on a head: the neutral first, then every expression as it is shot."""

    plan: Plan
    rig: Rig
    head: Head
    marks: tuple[Landmark, ...]

    @cached_property
    def cameras(self) -> tuple[Camera, ...]:
        """Those that the plan carries."""
        return cameras_of(self.plan)

    @cached_property
    def poses(self) -> dict[str, dict[str, float]]:
        """The expressions in the order of shooting."""
        return {one.name: dict(one.pose) for one in self.plan.in_session}

    @cached_property
    def views(self) -> Views:
        """How each camera sees each marker in each of them."""
        dot_mm = self.plan.settings.landmarks.dot_mm
        return pose_views(self.rig, self.marks, self.poses, self.cameras, dot_mm=dot_mm)

    @cached_property
    def philtrum(self) -> Float[np.ndarray, "3"]:
        """What head-mounted cameras are aimed at."""
        return upper_philtrum(self.rig.neutral[self.rig.skin])[0]

    @cached_property
    def neutral(self) -> Posed:
        """The head at rest."""
        return pose(self.head, self.rig.neutral)

    def vertices(self, e: int) -> Float[np.ndarray, "v 3"]:
        """Of the neutral (0), or of an expression."""
        if e == 0:
            return self.rig.neutral
        name = list(self.poses)[e - 1]
        return self.rig.neutral + pose_deltas(self.rig, {name: self.poses[name]})[0]

    def worst(self, c: int) -> int:
        """The expression in which camera c reads fewest markers, the neutral where it reads as many in all."""
        return int((self.views.how[:, c] == Sight.READ).sum(axis=1).argmin())

    def tables(self, book: Booklet) -> list[range]:
        """Which markers stand in the table of each page."""
        room = int((book.paper.height - TOP_MM - HEAD_MM - 26) // ROW_MM)
        return [range(k, min(k + room, len(self.marks))) for k in range(0, len(self.marks), room)]

    def blocks(self, book: Booklet) -> list[range]:
        """Which expressions, the neutral among them, stand beside each other in a table."""
        room = int((book.paper.width - 2 * MARGIN_MM - NAME_MM - LAST_MM) // COLUMNS_MM[0])
        return [range(k, min(k + room, 1 + len(self.poses))) for k in range(0, 1 + len(self.poses), room)]

    def count(self, book: Booklet) -> int:
        """How many pages all cameras take."""
        return len(self.cameras) * (1 + len(self.tables(book)) * len(self.blocks(book)))

    def draw(self, book: Booklet, dpi: Number, add_page: Callable[[str], None]) -> None:
        """All pages, camera by camera."""
        for c, camera in enumerate(self.cameras):
            slug = "".join(letter if letter.isalnum() else "-" for letter in camera.name.lower())
            add_page(f"camera-{slug}")
            self._first(book, c, dpi)
            for block in self.blocks(book):
                for rows in self.tables(book):
                    add_page(f"camera-{slug}-reads")
                    self._table(book, c, rows, block)

    def _first(self, book: Booklet, c: int, dpi: Number) -> None:
        camera, how = self.cameras[c], self.views.how[:, c]
        always, marks = int((how == Sight.READ).all(axis=0).sum()), len(self.marks)
        width, height = camera.size_px
        head_line(
            book,
            f"Camera: {camera.name}",
            (
                f"reads {always} of {marks} dots in the neutral and all expressions · "
                f"pictures of {width} \N{MULTIPLICATION SIGN} {height} px",
            ),
        )
        wide, high = _fit(camera, LARGE_MM)
        self._picture(book, c, 0, (MARGIN_MM, TOP_MM, wide, high), dpi)
        text = "Neutral, as the camera takes it. Filled: read. Outlined: seen, but not well enough."
        below = book.paragraph(MARGIN_MM, TOP_MM + high + 1.5, text, 7.5, width=LARGE_MM[0], lines=2, colour=SOFT)
        beside = self._figures(book, c, MARGIN_MM + LARGE_MM[0] + GAP_MM)
        y, e = min(max(below, beside) + 6, TOP_MM + LARGE_MM[1] + 12), self.worst(c)
        wide, high = _fit(camera, SMALL_MM)
        self._picture(book, c, e, (MARGIN_MM, y, wide, high), dpi)
        name = ("the neutral", *self.poses)[e]
        words = f"{name}: it reads fewest here, {int((how[e] == Sight.READ).sum())} of {marks}"
        if always == marks:
            words = f"{name}: as in all others, it reads every dot"
        book.paragraph(MARGIN_MM, y + high + 1.5, words, 7.5, width=SMALL_MM[0], lines=2, colour=SOFT)
        for k, view in enumerate((LEFT_PROFILE, ABOVE)):
            x = MARGIN_MM + (k + 1) * (SMALL_MM[0] + GAP_MM + 3)
            self._sketch(book, c, view, (x, y, *SMALL_MM), dpi)

    def _picture(self, book: Booklet, c: int, e: int, at: tuple[Number, Number, Number, Number], dpi: Number) -> None:
        """The picture of a camera in an expression on the page, with its dots and their numbers."""
        camera, (x, y, wide, high), dot_mm = self.cameras[c], at, self.plan.settings.landmarks.dot_mm
        vertices, how = self.vertices(e), self.views.how[e, c]
        posed = self.neutral if e == 0 else pose(self.head, vertices)
        vertex = np.array([mark.vertex for mark in self.marks])
        points, normals = vertices[vertex], vertex_normals(vertices, self.rig.triangles)[vertex]
        seen = np.isin(how, SEEN)
        rims = dot_outlines(camera, points, normals, dot_mm)
        seen &= np.isfinite(rims).all(axis=(1, 2))
        crop = crop_of(camera, rims[seen])
        book.image(through_lens(posed, camera, crop, pixels(wide, high, dpi)[0]).rgb, x, y, wide, high)
        book.box(x, y, wide, high, line=SOFT, width=0.2)
        on_page = (rims - [crop.left, crop.top]) * (wide / crop.width) + [x, y]
        for rim, read in zip(on_page[seen], how[seen] == Sight.READ, strict=True):
            book.polygon(rim, fill=INK if read else None, line="#ffffff" if read else ACCENT, width=0.15)
        named = seen if e == 0 else seen & (how != Sight.READ)
        self._numbers(book, on_page, named, (float(x), float(y), float(x + wide), float(y + high)))
        if crop != Crop.whole(camera):
            self._inset(book, camera, crop, posed, at, dpi)

    def _numbers(
        self,
        book: Booklet,
        rims: Float[np.ndarray, "n m 2"],
        seen: Bool[np.ndarray, " n"],
        bounds: tuple[float, float, float, float],
    ) -> None:
        """The number of each dot beside it; none of dots for which there is no room."""
        at = np.flatnonzero(seen)
        middles = rims[at].mean(axis=1)
        inside = ((middles > bounds[:2]) & (middles < bounds[2:])).all(axis=1) if len(at) else np.zeros(0, dtype=bool)
        at, middles = at[inside], middles[inside]
        radii = np.linalg.norm(rims[at] - middles[:, None], axis=2).max(axis=1) if len(at) else np.zeros(0)
        sizes = np.tile(2 * np.array(HALF_LETTER), (len(at), 1))
        placed = place_numbers(middles, sizes, np.maximum(radii, 0.6), np.zeros((0, 4)), bounds)
        if placed is None:
            return
        for n, (x, y), (start, end) in zip(at.tolist(), placed.middle.tolist(), placed.ticks.tolist(), strict=True):
            if start != end:
                book.line(start, end, width=0.15)
            name = self.marks[n].name
            book.text(x, y + 0.9, name, NUMBER_PT, bold=True, align="centre", halo="#ffffff")

    def _inset(
        self,
        book: Booklet,
        camera: Camera,
        crop: Crop,
        posed: Posed,
        at: tuple[Number, Number, Number, Number],
        dpi: Number,
    ) -> None:
        """The whole picture in a corner, with the part that is shown."""
        x, y, wide, high = at
        w, h = _fit(camera, (wide / 4, high / 4))
        left, top = x + wide - w - 1, y + high - h - 1
        book.image(through_lens(posed, camera, Crop.whole(camera), pixels(w, h, dpi)[0]).rgb, left, top, w, h)
        book.box(left, top, w, h, line=SOFT, width=0.2)
        scale = w / camera.size_px[0]
        book.box(
            left + scale * (crop.left + 0.5),
            top + scale * (crop.top + 0.5),
            scale * crop.width,
            scale * crop.height,
            line=ACCENT,
            width=0.3,
        )

    def _figures(self, book: Booklet, c: int, x: Number) -> Number:
        """Where to mount the camera, and how it stands to the others; returns the y below."""
        width = book.paper.width - MARGIN_MM - x
        y = TOP_MM + 2
        book.text(x, y + 1.5, "Where it stands", 10, bold=True)
        y += 4
        for term, words in [*self.mounting_rows(c), *self.measured_rows()]:
            y = book.paragraph(x, y + 1.2, term, 7.5, width=width, lines=2, colour=SOFT)
            y = book.paragraph(x, y, words, 9, width=width, lines=4)
        return y

    def mounting_rows(self, c: int) -> list[tuple[str, str]]:
        """Term and value of all that a technician measures."""
        camera = self.cameras[c]
        m = mounting(camera, self.philtrum)
        rows = [
            ("Lens to the upper philtrum (below the nose)", f"{m.away_mm:.0f} mm{away_words(m)}"),
            ("Looks", ", ".join(turn_words(m.down_degrees, m.leftward_degrees, m.roll_degrees))),
            (
                "Field of view, across and up",
                f"{m.field_degrees[0]:.0f}° \N{MULTIPLICATION SIGN} {m.field_degrees[1]:.0f}°",
            ),
            (
                "covers at the lips",
                f"{m.covers_mm[0]:.0f} \N{MULTIPLICATION SIGN} {m.covers_mm[1]:.0f} mm, {m.pixel_mm:.3f} mm a pixel",
            ),
            ("Sharp", sharp_words(m.sharp_mm)),
            ("A dot's middle is found to", f"{camera.noise_px:g} px (standard deviation, as stated or assumed)"),
        ]
        for other in self.cameras:
            if other is not camera and len(self.cameras) <= 4:
                apart, angle = between(camera, other, self.philtrum)
                rows.append((f"To {other.name}", f"{apart:.0f} mm apart, {angle:.0f}° seen from the face"))
        return rows

    def measured_rows(self) -> list[tuple[str, str]]:
        """How exactly all cameras together measure the markers."""
        known = [m.measured_mm for m in self.plan.layout.landmarks if len(m.measured_mm) == 3]
        if not known:
            return [("All cameras together", "no dot's depth is measured: one camera alone")]
        best, worst = np.median([one[0] for one in known]), np.median([one[2] for one in known])
        return [("Half of the dots are measured to", f"{best:.2f} mm at best, {worst:.2f} mm in depth")]

    def _sketch(
        self, book: Booklet, c: int, view: Viewpoint, at: tuple[Number, Number, Number, Number], dpi: Number
    ) -> None:
        """Head and cameras from the side or from above, to scale."""
        x, y, wide, high = at
        head = view.project(self.rig.neutral[self.rig.skin])[:, :2]
        lenses = view.project(np.stack([camera.position for camera in self.cameras]))[:, :2]
        everything = np.concatenate([head, lenses])
        low, top = everything.min(axis=0), everything.max(axis=0)
        middle, extent = (low + top) / 2, (top - low) * 1.1
        scale = max(extent[0] / wide, extent[1] / high)
        half = np.array([wide, high]) * scale / 2
        frame = PictureFrame(middle[0] - half[0], middle[0] + half[0], middle[1] - half[1], middle[1] + half[1])
        book.image(picture(self.neutral, view, frame, size_px=pixels(wide, high, dpi)).rgb, x, y, wide, high)
        book.box(x, y, wide, high, line=FAINT, width=0.2)

        def on_page(points: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 2"]:
            flat = view.project(points)[:, :2]
            return np.column_stack([x + (flat[:, 0] - frame.left) / scale, y + (frame.top - flat[:, 1]) / scale])

        aim = on_page(self.philtrum[None])[0]
        for k, camera in enumerate(self.cameras):
            place = on_page(camera.position[None])[0]
            mine = k == c
            book.line(place, aim, width=0.25 if mine else 0.1, colour=ACCENT if mine else FAINT)
            way = on_page((camera.position + 10 * camera.rotation[2])[None])[0] - place
            length = float(np.linalg.norm(way))
            way = way / length if length > 0.05 else np.array([0.0, 0.0])
            side = np.array([-way[1], way[0]])
            corners = place + np.stack([-2.2 * way, 1.2 * way + 1.5 * side, 1.2 * way - 1.5 * side])
            book.polygon(corners, fill=ACCENT if mine else "#ffffff", line=ACCENT if mine else SOFT, width=0.2)
        m = mounting(self.cameras[c], self.philtrum)
        words = ", ".join([f"{m.ahead_mm:.0f} mm ahead", *_sided(m.above_mm, "above", "below")])
        if view is ABOVE:
            words = ", ".join([f"{m.ahead_mm:.0f} mm ahead", *_sided(m.left_mm, *ASIDE)])
        title = "From the actor's left" if view is LEFT_PROFILE else "From above"
        book.paragraph(x, y + high + 1.5, f"{title}: {words}", 7.5, width=wide, lines=2, colour=SOFT)

    def _table(self, book: Booklet, c: int, rows: range, block: range) -> None:
        """Markers down, expressions across."""
        camera, how = self.cameras[c], self.views.how[:, c]
        names = ("neutral", *self.poses)
        head_line(book, f"Camera: {camera.name}", ("which dots it reads in which expression",))
        book.paragraph(MARGIN_MM, TOP_MM - 2, LEGEND, 7.5, width=book.paper.width - 2 * MARGIN_MM, lines=2, colour=SOFT)
        left, top = MARGIN_MM + NAME_MM, TOP_MM + 8 + HEAD_MM
        wide = min((book.paper.width - 2 * MARGIN_MM - NAME_MM - LAST_MM) / len(block), COLUMNS_MM[1])
        for k, e in enumerate(block):
            word = "rest" if names[e] == NEUTRAL else names[e]
            book.text(left + (k + 0.5) * wide, top - 1.6, word, 7, bold=True, align="centre")
        px = self.views.pixels[c]
        last = left + len(block) * wide + LAST_MM
        book.text(last, top - 1.6, "least px", 7, bold=True, align="right")
        for k, n in enumerate(rows):
            y = top + k * ROW_MM
            if k % 2:
                book.box(MARGIN_MM, y, last - MARGIN_MM, ROW_MM, fill=WASH, line=None)
            book.text(MARGIN_MM + 0.5, y + 3.2, self.marks[n].name, 7.5, bold=True)
            book.text(MARGIN_MM + 9, y + 3.2, self.marks[n].label, 7, colour=SOFT, fit=NAME_MM - 10)
            book.text(last, y + 3.2, f"{px[n]:.1f}" if px[n] else "never", 7, align="right")
            for j, e in enumerate(block):
                x, sight = left + (j + 0.5) * wide, Sight(int(how[e, n]))
                if sight == Sight.READ:
                    book.ring(x, y + ROW_MM / 2, 0.9, colour=INK, filled=True)
                else:
                    book.text(x, y + 3.2, LETTERS[sight], 8, bold=True, align="centre", colour=ACCENT)
        below = top + len(rows) * ROW_MM
        book.line((MARGIN_MM, below), (last, below), width=0.2, colour=SOFT)
        book.text(MARGIN_MM + 0.5, below + 3.6, "read", 7.5, bold=True)
        for j, e in enumerate(block):
            read = int((how[e] == Sight.READ).sum())
            book.text(left + (j + 0.5) * wide, below + 3.6, str(read), 7.5, bold=True, align="centre")


def away_words(m: Mounting) -> str:
    """': 230 mm ahead, 100 mm below', the parts of the way to a lens; ' straight ahead' where it is that alone."""
    beside = [*_sided(m.above_mm, "above", "below"), *_sided(m.left_mm, *ASIDE)]
    return f": {', '.join([f'{m.ahead_mm:.0f} mm ahead', *beside])}" if beside else " straight ahead"


ASIDE = ("to the actor's left", "to the actor's right")


def crop_of(camera: Camera, rims: Float[np.ndarray, "n m 2"]) -> Crop:
    """All of the picture, or where dots take little of it the part around them, of the same shape."""
    whole = Crop.whole(camera)
    if not len(rims):
        return whole
    low, high = rims.min(axis=(0, 1)), rims.max(axis=(0, 1))
    share = float(((high - low) / camera.size_px).max()) * (1 + 2 * AROUND)
    if share > CROPPED:
        return whole
    size = np.array(camera.size_px) * share
    corner = np.clip((low + high) / 2 - size / 2, [-0.5, -0.5], np.array(camera.size_px) - 0.5 - size)
    return Crop(float(corner[0]), float(corner[1]), float(size[0]), float(size[1]))


def turn_words(down: float, leftward: float, roll: float) -> list[str]:
    """'12° down, 5° towards the actor's left, rolled by 90°'; 'straight at the face' where none is a degree."""
    words = [f"{abs(down):.0f}° {'down' if down > 0 else 'up'}"] if abs(down) >= 0.5 else []
    if abs(leftward) >= 0.5:
        words.append(f"{abs(leftward):.0f}° towards the actor's {'left' if leftward > 0 else 'right'}")
    if abs(roll) >= 0.5:
        words.append(f"rolled by {roll:.0f}°")
    return words or ["straight back, level"]


def sharp_words(sharp_mm: tuple[float, float] | None) -> str:
    """From where to where it is in focus."""
    if sharp_mm is None:
        return "not known: state focus_mm, f_number and pixel_um"
    near, far = sharp_mm
    return f"from {near:.0f} mm " + (f"to {far:.0f} mm" if np.isfinite(far) else "on")


def _sided(mm: float, more: str, less: str) -> list[str]:
    """'12 mm above'; nothing below half a millimetre."""
    return [f"{abs(mm):.0f} mm {more if mm > 0 else less}"] if abs(mm) >= 0.5 else []


def _fit(camera: Camera, room: tuple[Number, Number]) -> tuple[Number, Number]:
    """Width and height of its picture in a room, millimetres."""
    scale = min(room[0] / camera.size_px[0], room[1] / camera.size_px[1])
    return camera.size_px[0] * scale, camera.size_px[1] * scale
