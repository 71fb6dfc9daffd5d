"""Digits and letters as closed outlines, from the bundled font, for cutting into plastic."""

from functools import cache

import numpy as np
from fontTools.pens.basePen import BasePen
from fontTools.ttLib import TTFont
from jaxtyping import Float

from capture_plan.sheets.lettering import font_path

FACE = "Roboto-Bold.ttf"
SQUEEZE = 0.86  # width of the letters over the font's own: strokes of 0.8 mm, and pads that fit between dots
CURVE = np.linspace(0, 1, 6)[1:, None]  # points on a curve of the font


class _Outline(BasePen):
    """Collects outlines as polygons, curves broken into short lines."""

    def __init__(self, glyphs: object) -> None:
        super().__init__(glyphs)
        self.polygons: list[list[np.ndarray]] = []

    def _moveTo(self, pt: tuple[float, float]) -> None:  # noqa: N802  fontTools names it
        self.polygons.append([np.array(pt, dtype=float)])

    def _lineTo(self, pt: tuple[float, float]) -> None:  # noqa: N802
        self.polygons[-1].append(np.array(pt, dtype=float))

    def _qCurveToOne(self, pt1: tuple[float, float], pt2: tuple[float, float]) -> None:  # noqa: N802
        a, b, c = self.polygons[-1][-1], np.array(pt1, dtype=float), np.array(pt2, dtype=float)
        self.polygons[-1] += list((1 - CURVE) ** 2 * a + 2 * CURVE * (1 - CURVE) * b + CURVE**2 * c)


def outlines(text: str, height: float, advance: float) -> list[Float[np.ndarray, "c 2"]]:
    """Polygons of a line of digits and capitals, so high and each so wide, its middle at 0; even-odd filled."""
    made = []
    for i, letter in enumerate(text):
        polygons, wide, tall = _glyph(letter)
        middle = (i - (len(text) - 1) / 2) * advance
        made += [(p - [wide / 2, tall / 2]) * height / tall * [SQUEEZE, 1] + [middle, 0] for p in polygons]
    return made


@cache
def _glyph(letter: str) -> tuple[tuple[Float[np.ndarray, "c 2"], ...], float, float]:
    """Outlines of one letter in the font's unit, its advance, and the height of capitals."""
    font = TTFont(font_path(FACE))
    glyphs, name = font.getGlyphSet(), (font.getBestCmap() or {})[ord(letter)]
    pen = _Outline(glyphs)
    glyphs[name].draw(pen)
    return (
        tuple(np.array(p) for p in pen.polygons),
        float(glyphs[name].width),
        float(getattr(font["OS/2"], "sCapHeight")),  # noqa: B009  pyright knows no tables
    )
