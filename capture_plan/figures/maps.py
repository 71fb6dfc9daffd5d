"""Values at vertices as colours on the head, from the front and from the side, with their scale."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float, Int
from matplotlib import colormaps
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from capture_plan.figures.heads import ASPECT, Sitter
from capture_plan.figures.layouts import show
from capture_plan.figures.style import TITLE_PT, WIDTH_IN, blank, box, caption, house
from capture_plan.sheets.style import INK
from capture_plan.sheets.view import FRONT, LEFT, RIGHT

TITLE_IN, BAR_IN, GAP_IN = 0.3, 0.62, 0.25
RING_PT2 = 60.0  # area of the ring around a marked landmark, square points
GOOD, BAD, LIGHT = "viridis", "magma_r", "gray"  # perceptually uniform: equal steps of a value look equal


@dataclass(frozen=True, eq=False)
class HeadMap:
    """Values on a head, NaN where there are none; `meaning` says what they are, with the unit; `marked` landmarks."""

    sitter: Sitter
    title: str
    values: Float[np.ndarray, " v"]
    meaning: str
    limits: tuple[float, float] = (0.0, 1.0)
    colours: str = GOOD
    marked: Int[np.ndarray, " m"] = field(default_factory=lambda: np.empty(0, dtype=int))


def maps_figure(maps: Sequence[HeadMap], *, columns: int = 2) -> Figure:
    """Each map on two views of the head, above its scale."""
    rows = -(-len(maps) // columns)
    wide = (WIDTH_IN - (columns - 1) * GAP_IN) / columns
    width = wide / 2
    tall = TITLE_IN + width / ASPECT + BAR_IN
    with house():
        figure = blank(min(columns, len(maps)) * (wide + GAP_IN) - GAP_IN, rows * tall)
        for i, one in enumerate(maps):
            row, column = divmod(i, columns)
            left, top = column * (wide + GAP_IN), row * tall
            caption(figure, left, top + 0.05, one.title, size=TITLE_PT, bold=True)
            _two_views(figure, one, left, top + TITLE_IN, width)
            _scale(figure, one, left + 0.15 * wide, top + TITLE_IN + width / ASPECT + 0.08, 0.7 * wide)
    return figure


def shared_maps_figure(maps: Sequence[HeadMap], *, columns: int = 2) -> Figure:
    """Maps that all have the scale of the first one, which stands once below them."""
    rows = -(-len(maps) // columns)
    wide = (WIDTH_IN - (columns - 1) * GAP_IN) / columns
    width = wide / 2
    tall = TITLE_IN + width / ASPECT
    with house():
        figure = blank(min(columns, len(maps)) * (wide + GAP_IN) - GAP_IN, rows * tall + BAR_IN)
        for i, one in enumerate(maps):
            row, column = divmod(i, columns)
            left, top = column * (wide + GAP_IN), row * tall
            caption(figure, left, top + 0.05, one.title, size=TITLE_PT, bold=True)
            _two_views(figure, one, left, top + TITLE_IN, width)
        across = figure.get_size_inches()[0]
        _scale(figure, maps[0], 0.25 * across, rows * tall + 0.1, 0.5 * across)
    return figure


def _two_views(figure: Figure, one: HeadMap, left: float, top: float, width: float) -> None:
    norm, colours = Normalize(*one.limits, clip=True), colormaps[one.colours]
    posed = one.sitter.painted(one.values, lambda values: colours(norm(values))[:, :3])
    x = one.sitter.rig.neutral[one.marked, 0].sum()
    for n, view in enumerate((FRONT, LEFT if x >= 0 else RIGHT)):
        shown = one.sitter.close_up(view, posed)
        axes = show(figure, left + n * width, top, width, shown)
        places, there = one.sitter.places(view, shown, one.marked)
        axes.scatter(*places[there].T, s=RING_PT2, facecolors="none", edgecolors="white", linewidths=2.4)
        axes.scatter(*places[there].T, s=RING_PT2, facecolors="none", edgecolors=INK, linewidths=1.1)


def _scale(figure: Figure, one: HeadMap, left: float, top: float, width: float) -> None:
    axes = box(figure, left, top, width, 0.09)
    bar = figure.colorbar(ScalarMappable(Normalize(*one.limits), one.colours), cax=axes, orientation="horizontal")
    bar.outline.set_linewidth(0.4)
    bar.set_label(one.meaning)
