"""How figures look, and how they become files: one style, held by a lock, because Matplotlib keeps it in one global.

Inches as Matplotlib counts them; letters are given in points, as in print.
"""

import io
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import matplotlib
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.font_manager import fontManager

from capture_plan.output import write_whole
from capture_plan.sheets.lettering import FONTS, font_path
from capture_plan.sheets.style import ACCENT, FAINT, INK, SOFT

WIDTH_IN = 7.2  # two columns of a paper
DPI = 100.0
TITLE_PT, TEXT_PT, SMALL_PT = 10.0, 8.5, 7.5
OURS, OTHERS = ACCENT, ("#b3261e", "#0f7b4f", "#9a5b00", "#7b3fb5", "#00708a", "#5b5f66", "#a8326e", "#8aa300")
HOUSE: dict[Any, Any] = {
    "font.family": ["Roboto", "Noto Sans JP", "Noto Sans SC", "Noto Sans KR"],  # of the first that has a letter
    "font.size": TEXT_PT,
    "text.color": INK,
    "text.parse_math": False,  # names of blendshapes may hold dollars
    "axes.edgecolor": SOFT,
    "axes.labelcolor": INK,
    "axes.labelsize": TEXT_PT,
    "axes.linewidth": 0.7,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.titlesize": TITLE_PT,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "xtick.color": SOFT,
    "ytick.color": SOFT,
    "xtick.labelsize": SMALL_PT,
    "ytick.labelsize": SMALL_PT,
    "xtick.major.width": 0.7,
    "ytick.major.width": 0.7,
    "grid.color": FAINT,
    "grid.linewidth": 0.5,
    "legend.frameon": False,
    "legend.fontsize": SMALL_PT,
    "lines.linewidth": 1.6,
    "figure.facecolor": "white",
    "svg.hashsalt": "capture-plan",  # the same figure gives the same bytes
}
_lock = threading.RLock()


@contextmanager
def house() -> Iterator[None]:
    """Everything inside is drawn in the style of the house; other threads wait, so that theirs is not touched."""
    with _lock:
        for file in (*FONTS.values(), "Roboto-Bold.ttf"):
            path = font_path(file)
            if path not in {font.fname for font in fontManager.ttflist}:
                fontManager.addfont(path)
        with matplotlib.rc_context(HOUSE):
            yield


def blank(width_in: float, height_in: float) -> Figure:
    """An empty figure, without pyplot's list of open ones."""
    return Figure(figsize=(width_in, height_in), dpi=DPI)


def box(figure: Figure, left: float, top: float, width: float, height: float) -> Axes:
    """Axes at a place given in inches from the top left corner."""
    w, h = figure.get_size_inches()
    return figure.add_axes((left / w, 1 - (top + height) / h, width / w, height / h))


def caption(
    figure: Figure, left: float, top: float, words: str, *, size: float, bold: bool = False, centred: bool = False
) -> None:
    """Words below a place given in inches from the top left corner: bold ones in ink, the others softer."""
    w, h = figure.get_size_inches()
    figure.text(
        left / w,
        1 - top / h,
        words,
        size=size,
        weight="bold" if bold else "normal",
        color=INK if bold else SOFT,
        ha="center" if centred else "left",
        va="top",
    )


def png(figure: Figure, *, scale: float = 2.0) -> bytes:
    """The figure in pixels, `scale` for each of its own."""
    return _saved(figure, "png", DPI * scale)


def svg(figure: Figure) -> bytes:
    """The figure as curves, letters included; heads stay pictures."""
    return _saved(figure, "svg", 2 * DPI)


def write_figure(figure: Figure, path: Path) -> Path:
    """Write a figure, PNG or SVG by the name, whole or not at all.

    Raises:
        PlanError: the place cannot be written.
    """
    write_whole(path, svg(figure) if path.suffix == ".svg" else png(figure))
    return path


def _saved(figure: Figure, kind: str, dpi: float) -> bytes:
    with house():
        file = io.BytesIO()
        figure.savefig(file, format=kind, dpi=dpi, metadata={"Date": None} if kind == "svg" else {"Software": None})
        return file.getvalue()
