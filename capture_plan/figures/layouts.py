"""Layouts on heads, side by side: the teaser, layouts of several rigs, layouts under each term."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Int
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from capture_plan.figures.heads import ASPECT, HEIGHT_PX, Sitter
from capture_plan.figures.style import OURS, SMALL_PT, TITLE_PT, WIDTH_IN, blank, box, caption, house
from capture_plan.sheets.view import FRONT, Picture, Viewpoint

CAPTION_IN, GAP_IN = 0.42, 0.06
DOT_PT2 = 26.0  # area of a dot on a head of a quarter of the width


@dataclass(frozen=True, eq=False)
class Captioned:
    """A layout on a head, what it is called, and what stands beside the number of its landmarks."""

    sitter: Sitter
    title: str
    note: str
    vertices: Int[np.ndarray, " m"]


def layouts_figure(layouts: Sequence[Captioned], *, columns: int = 4) -> Figure:
    """Heads from the front with their landmarks; under each its title, M and the note."""
    rows = -(-len(layouts) // columns)
    width = (WIDTH_IN - (columns - 1) * GAP_IN) / columns
    height = width / ASPECT
    with house():
        across = min(columns, len(layouts)) * (width + GAP_IN) - GAP_IN
        figure = blank(across, rows * (height + CAPTION_IN))
        for i, one in enumerate(layouts):
            row, column = divmod(i, columns)
            left, top = column * (width + GAP_IN), row * (height + CAPTION_IN)
            axes = show(figure, left, top, width, one.sitter.front)
            dots(axes, one.sitter, FRONT, one.sitter.front, one.vertices, area=DOT_PT2 * (4 / columns) ** 2)
            caption(figure, left + width / 2, top + height + 0.02, one.title, size=TITLE_PT, bold=True, centred=True)
            said = f"M = {len(one.vertices)}" + (f", {one.note}" if one.note else "")
            caption(figure, left + width / 2, top + height + 0.2, said, size=SMALL_PT, centred=True)
    return figure


def show(figure: Figure, left: float, top: float, width: float, shown: Picture) -> Axes:
    """A picture of a head, `width` inches wide; its axes count pixels."""
    axes = box(figure, left, top, width, width / ASPECT)
    axes.imshow(shown.rgb, interpolation="hanning", extent=(0, ASPECT * HEIGHT_PX, HEIGHT_PX, 0))
    axes.set_axis_off()
    return axes


def dots(
    axes: Axes,
    sitter: Sitter,
    view: Viewpoint,
    shown: Picture,
    vertices: Int[np.ndarray, " m"],
    *,
    area: float = DOT_PT2,
    colour: str = OURS,
) -> None:
    """The landmarks that are seen, each a dot with a white rim, `area` in square points."""
    places, there = sitter.places(view, shown, vertices)
    axes.scatter(*places[there].T, s=area, c=colour, edgecolors="white", linewidths=0.6 * (area / DOT_PT2) ** 0.5)
