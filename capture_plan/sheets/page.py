"""Pages in millimetres: text, lines, shapes and pictures on paper of a true size, written as PDF.

The PDF is the one description of a page; its PNG is that PDF rasterised, so that screen and paper cannot differ.
Coordinates are millimetres from the top left corner of the sheet, y down; text sizes are points (1/72 inch).
"""

import io
from collections.abc import Iterable, Sequence
from datetime import UTC, datetime
from typing import Literal, NamedTuple

import numpy as np
from fpdf import FPDF
from jaxtyping import Float, UInt8
from PIL import Image

from capture_plan.errors import PlanError
from capture_plan.sheets.lettering import FONTS, SANS, Labels, font_path, font_runs
from capture_plan.sheets.style import INK, Look, Number, outline, rgb

Align = Literal["left", "centre", "right"]

JPEG_QUALITY = 92  # no block is seen at 300 dpi on clay; a page of pictures stays near half a megabyte
THICK_MM, THICK_DEGREES = 0.7, 28.0  # of the parts of a ring that are exacter
POINT_MM = 25.4 / 72
DRAFT, DRAFT_PT, DRAFT_TURN = "DRAFT", 170, 52  # points and degrees: from corner to corner of either paper
DRAFT_INK, DRAFT_OPACITY = "#b3261e", 0.2  # what lies below is still read
LEAST_PT = 7.0  # of any letter on paper
HALO_MM = 0.9  # of white around letters on a picture, both sides together
MARGIN_MM = 8.0  # what common printers leave white, and a little


class PaperSize(NamedTuple):
    """A sheet of paper by its name, width and height in millimetres."""

    name: str
    width: Number
    height: Number


PAPERS = {
    "a4": PaperSize("a4", 210.0, 297.0),
    "letter": PaperSize("letter", 215.9, 279.4),
    "a3": PaperSize("a3", 297.0, 420.0),
}


def landscape(sheet: PaperSize) -> PaperSize:
    """A sheet of paper turned to lie on its long side."""
    return PaperSize(sheet.name, max(sheet.width, sheet.height), min(sheet.width, sheet.height))


def paper(name: str) -> PaperSize:
    """The paper of this name, 'a4', 'letter' or 'a3', in capitals or not."""
    if name.lower() not in PAPERS:
        raise PlanError(f"paper '{name}' is not known: choose one of {', '.join(PAPERS)}")
    return PAPERS[name.lower()]


class Booklet:
    """A PDF being drawn; every method draws on the last page.

    `names` are those of the rig's blendshapes: where the fonts lack their script, each is written by its meaning.
    `draft` is why nobody should work by these pages; it lies across each of them, nothing where it is empty.
    """

    def __init__(self, sheet: PaperSize, title: str, names: Sequence[str] = (), *, draft: str = "") -> None:
        self.paper = sheet
        self.titles: list[str] = []
        self._draft, self._stamped = draft, 0
        self._pdf = pdf = FPDF(unit="mm", format=(sheet.width, sheet.height))
        pdf.set_auto_page_break(False)
        pdf.set_margin(0)
        pdf.set_creation_date(datetime(2000, 1, 1, tzinfo=UTC))  # equal plans give equal bytes
        pdf.set_producer("capture_plan")
        for style, file in (("", FONTS[SANS]), ("B", "Roboto-Bold.ttf")):
            pdf.add_font(SANS, style, font_path(file))
        self._added, self._printable = {SANS}, Labels(names)
        pdf.set_font("sans", size=9)
        pdf.set_title(self._printable(title))

    def fill_screen(self) -> None:
        """Let viewers open the PDF without their frames, one page at a time."""
        self._pdf.page_mode = "FULL_SCREEN"
        self._pdf.set_display_mode("fullpage", "single")

    def add_page(self, title: str) -> None:
        """`title` names the page's PNG."""
        self._stamp()
        self.titles.append(title)
        self._pdf.add_page()

    def bytes(self) -> bytes:
        """The finished PDF file, as its bytes."""
        self._stamp()
        return bytes(self._pdf.output())

    def _stamp(self) -> None:
        """DRAFT across the last page, over all that is drawn there, and why at its top."""
        if not self._draft or self._stamped == len(self.titles):
            return
        self._stamped = len(self.titles)
        middle = self.paper.width / 2, self.paper.height / 2
        with self._pdf.local_context(fill_opacity=DRAFT_OPACITY), self._pdf.rotation(DRAFT_TURN, *middle):
            self.text(middle[0], middle[1] + 22, DRAFT, DRAFT_PT, bold=True, align="centre", colour=DRAFT_INK)
        why, wide = f"{DRAFT}, does not hold: {self._draft}", self.paper.width - 2 * MARGIN_MM
        self.text(MARGIN_MM, 6.8, why, 7.4, bold=True, colour=DRAFT_INK, fit=wide)

    def width(self, text: str, size: Number, *, bold: bool = False) -> Number:
        """Width of a text on paper, millimetres."""
        return sum(self._run_width(*run, size, bold) for run in font_runs(self._printable(text)))

    def text(
        self,
        x: Number,
        y: Number,
        text: str,
        size: Number,
        *,
        bold: bool = False,
        align: Align = "left",
        colour: str = INK,
        fit: Number | None = None,
        halo: str = "",
    ) -> Number:
        """One line with its baseline at y, no letter below LEAST_PT; smaller, then cut short, where it is wider than
        `fit`. A `halo` of that colour lies behind letters on a picture. Returns its width."""
        text, size = self._printable(text), max(size, LEAST_PT)
        if fit is not None:
            text, size = self._fitted(text, size, bold, fit)
        width = self.width(text, size, bold=bold)
        self._pdf.set_text_color(*rgb(colour))
        x -= {"left": 0, "centre": width / 2, "right": width}[align]
        for face, letters in font_runs(text):
            advance = self._run_width(face, letters, size, bold)
            if halo:
                with self._pdf.local_context(text_mode="STROKE", line_width=HALO_MM):
                    self._pdf.set_draw_color(*rgb(halo))
                    self._pdf.text(x, y, letters)
                self._pdf.set_text_color(*rgb(colour))
            self._pdf.text(x, y, letters)
            x += advance
        return width

    def paragraph(
        self,
        x: Number,
        y: Number,
        text: str,
        size: Number,
        *,
        width: Number,
        lines: int,
        bold: bool = False,
        colour: str = INK,
    ) -> Number:
        """Words broken into at most `lines` lines, smaller where they need more; returns the y below the last one."""
        broken = self.broken(text, size, width=width, bold=bold)
        while len(broken) > lines and size > LEAST_PT:
            size = max(0.94 * size, LEAST_PT)
            broken = self.broken(text, size, width=width, bold=bold)
        if len(broken) > lines:
            broken = [*broken[: lines - 1], broken[lines - 1] + " …"]
        for line in broken:
            y += size * POINT_MM * 1.18
            self.text(x, y - size * POINT_MM * 0.2, line, size, bold=bold, colour=colour, fit=width)
        return y

    def broken(self, text: str, size: Number, *, width: Number, bold: bool = False) -> list[str]:
        """The lines that a paragraph takes."""
        lines = [""]
        for word in self._printable(text).split():
            longer = f"{lines[-1]} {word}".strip()
            if lines[-1] and self.width(longer, size, bold=bold) > width:
                lines.append(word)
            else:
                lines[-1] = longer
        return lines

    def line(
        self, start: Iterable[float], end: Iterable[float], *, width: Number = 0.2, colour: str = INK, dash: Number = 0
    ) -> None:
        """Draw a line between two points of the page, millimetres."""
        self._pdf.set_draw_color(*rgb(colour))
        self._pdf.set_line_width(width)
        self._pdf.set_dash_pattern(dash=dash, gap=dash)
        self._pdf.line(*start, *end)
        self._pdf.set_dash_pattern()

    def box(
        self,
        x: Number,
        y: Number,
        w: Number,
        h: Number,
        *,
        fill: str | None = None,
        line: str | None = INK,
        width: Number = 0.25,
    ) -> None:
        """Draw a box from its top left corner, millimetres."""
        self._stroke(fill, line, width)
        self._pdf.rect(x, y, w, h, style=_style(fill, line))

    def polygon(
        self,
        corners: Float[np.ndarray, "n 2"],
        *,
        fill: str | None = None,
        line: str | None = INK,
        width: Number = 0.25,
    ) -> None:
        """Draw a polygon through its corners, millimetres."""
        self._stroke(fill, line, width)
        self._pdf.polygon([tuple(corner) for corner in corners.tolist()], style=_style(fill, line))

    def marker(self, x: Number, y: Number, look: Look, *, radius: Number, hollow: bool = False) -> None:
        """A region's shape with a white rim, so that it is seen on dark and light alike."""
        corners = outline(look.shape) * radius + np.array([x, y])
        self.polygon(corners, fill="#ffffff", line="#ffffff", width=0.75)
        self.polygon(corners, fill="#ffffff" if hollow else look.colour, line=look.colour, width=0.4 if hollow else 0.1)

    def ring(self, x: Number, y: Number, radius: Number, *, colour: str, filled: bool = False) -> None:
        """A circle around a place: a thin line, or a filled dot."""
        self._stroke(colour if filled else None, None if filled else colour, 0.18)
        self._pdf.circle(x, y, radius, style="F" if filled else "D")

    def thick_ends(self, x: Number, y: Number, radius: Number, angle: Number, *, colour: str) -> None:
        """The two parts of a circle that lie in a direction and against it, `angle` degrees from the page's right
        counter-clockwise, thick."""
        self._stroke(None, colour, THICK_MM)
        for middle in (-angle, 180 - angle):  # fpdf2 counts them clockwise
            self._pdf.arc(
                x - radius, y - radius, 2 * radius, middle - THICK_DEGREES, middle + THICK_DEGREES, clockwise=False
            )

    def image(self, pixels: UInt8[np.ndarray, "p q 3"], x: Number, y: Number, w: Number, h: Number) -> None:
        """Place a picture on the page, millimetres."""
        file = io.BytesIO()
        Image.fromarray(pixels).save(file, "JPEG", quality=JPEG_QUALITY, subsampling=0)
        self._pdf.image(file, x, y, w, h)

    def _run_width(self, face: str, letters: str, size: Number, bold: bool) -> Number:
        """Width of letters of one face, which is the face from here on; only the house's own has a bold cut."""
        if face not in self._added:
            self._pdf.add_font(face, "", font_path(FONTS[face]))
            self._added.add(face)
        self._pdf.set_font(face, "B" if bold and face == SANS else "", size)
        return self._pdf.get_string_width(letters)

    def _fitted(self, text: str, size: Number, bold: bool, fit: Number) -> tuple[str, Number]:
        wide = self.width(text, size, bold=bold)
        if wide <= fit:
            return text, size
        size = max(size * fit / wide, size * 0.72, LEAST_PT)
        while len(text) > 1 and self.width(text, size, bold=bold) > fit:
            text = text.rstrip("…")[:-1] + "…"
        return text, size

    def _stroke(self, fill: str | None, line: str | None, width: Number) -> None:
        if fill is not None:
            self._pdf.set_fill_color(*rgb(fill))
        if line is not None:
            self._pdf.set_draw_color(*rgb(line))
        self._pdf.set_line_width(width)


def _style(fill: str | None, line: str | None) -> str:
    return ("D" if line is not None else "") + ("F" if fill is not None else "")
