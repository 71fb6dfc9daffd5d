"""Expressions as figures: their number over mu, what the importance terms show first, what a list is worth, the list.

Errors are those of the rebuilt rig, root mean square over blendshapes and skin, millimetres.
"""

from collections.abc import Mapping, Sequence

import numpy as np
from jaxtyping import Int
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from capture_plan.evaluation.carrigan2020.mu_sweep import AblationRow, MuRow
from capture_plan.expressions import Expression
from capture_plan.figures.heads import ASPECT, HEIGHT_PX, SIZE_PX, Sitter
from capture_plan.figures.layouts import show
from capture_plan.figures.style import OTHERS, OURS, SMALL_PT, TITLE_PT, WIDTH_IN, blank, box, caption, house
from capture_plan.sheets.expression_page import portrait
from capture_plan.sheets.head import pose
from capture_plan.sheets.style import INK, SOFT, rgb
from capture_plan.sheets.view import FRONT, LEFT, picture

HEIGHT_IN = 2.9
PANEL_IN = 2.5
KEY_IN = 0.55
CAPTION_IN, GAP_IN = 0.42, 0.06
MARKS = "s^Dv<>Phx"
STATIC, SMOOTHING, ACTIVE = "#cdd1d8", "#e6a817", "#c22f25"  # grey, amber, red: apart in lightness too
KINDS = (("static", STATIC), ("smoothing", SMOOTHING), ("active", ACTIVE))
FIRST = (5, 10, 15, 20)


def number_against_mu(rows: Mapping[str, Sequence[MuRow]], *, mu: float) -> Figure:
    """A panel for each entry: the fewest expressions with their bound, and those of two other methods, over mu."""
    with house():
        figure = _wide(HEIGHT_IN)
        panels = figure.subplots(1, len(rows), sharey=True, squeeze=False)[0]
        for axes, (title, some) in zip(panels, rows.items(), strict=True):
            x = [row.mu for row in some]
            axes.plot(x, [row.greedy for row in some], "^--", color=OTHERS[1], ms=7, mfc="none", lw=1, label="greedy")
            axes.plot(
                x, [row.sequential for row in some], "s--", color=OTHERS[0], ms=6, mfc="none", lw=1, label="sequential"
            )
            proven = all(row.bound == row.minimum for row in some)
            label = "minimum, proven" if proven else "minimum found"
            axes.plot(x, [row.minimum for row in some], "o-", color=OURS, ms=3.5, lw=1.8, label=label)
            if not proven:
                axes.plot(x, [row.bound for row in some], ":", color=OURS, label="no list is shorter")
            axes.axvline(mu, color=OURS, lw=0.8, alpha=0.5, zorder=1)
            axes.set(title=title, xlabel="mu, share of the largest movement")
            axes.grid(axis="y")
            axes.legend(loc="lower left")
        panels[0].set_ylabel("expressions J")
        panels[0].set_ylim(0, 1.08 * max(row.greedy for some in rows.values() for row in some))
        panels[0].yaxis.set_major_locator(MaxNLocator(integer=True))
    return figure


def shown_by_terms(rows: Sequence[AblationRow], *, blendshapes: int) -> Figure:
    """What each order has shown after every expression: displacement strength, and blendshapes, both in per cent."""
    with house():
        figure = _wide(HEIGHT_IN)
        panels = figure.subplots(1, 2, sharey=True)
        for number, row in enumerate(rows):
            x = range(len(row.shown) + 1)
            colour = [*OTHERS, OURS][number % (len(OTHERS) + 1)]
            for axes, share in zip(panels, (row.strength, [n / blendshapes for n in row.shown]), strict=True):
                percents = [0.0, *(100 * part for part in share)]
                axes.plot(x, percents, MARKS[number % len(MARKS)] + "-", color=colour, ms=3, lw=1.1, label=row.terms)
        for axes, what in zip(panels, ("displacement strength", "blendshapes"), strict=True):
            axes.set(xlabel="expressions scanned", ylabel=f"{what} shown, %", ylim=(0, 102))
            axes.set_xticks([0, *FIRST])
            axes.grid(axis="both")
        panels[1].legend(loc="lower right")
    return figure


def roles_figure(sitter: Sitter, kinds: Int[np.ndarray, " v"], title: str) -> Figure:
    """Static, smoothing and active vertices (0, 1, 2) in three colours, from the front and from the side."""
    width = WIDTH_IN * 0.36
    colours = np.array([rgb(colour) for _, colour in KINDS]) / 255
    skin = sitter.rig.skin
    with house():
        figure = blank(2 * width, 0.3 + width / ASPECT + KEY_IN)
        caption(figure, 0.0, 0.05, title, size=TITLE_PT, bold=True)
        painted = sitter.painted(kinds.astype(float), lambda values: colours[np.round(values).astype(int)])
        for n, view in enumerate((FRONT, LEFT)):
            show(figure, n * width, 0.3, width, sitter.close_up(view, painted))
        key = [
            Patch(color=colour, label=f"{name}, {int((kinds[skin] == number).sum()):,} vertices")
            for number, (name, colour) in enumerate(KINDS)
        ]
        figure.legend(handles=key, loc="lower center", ncols=len(key), fontsize=SMALL_PT)
    return figure


def error_by_scans(
    errors: Mapping[str, Mapping[str, tuple[Sequence[int], Sequence[float]]]], *, ours: str, cut: str
) -> Figure:
    """A panel a target: error (mm) over scanned expressions; `cut` leaves the panel and says where it ends."""
    columns = 2
    rows = -(-len(errors) // columns)
    with house():
        figure = _wide(rows * PANEL_IN + KEY_IN)
        panels = figure.subplots(rows, columns, squeeze=False)
        for axes, (target, curves) in zip(panels.flat, errors.items(), strict=False):
            _panel(axes, target, curves, ours, cut)
        for axes in list(panels.flat)[len(errors) :]:
            axes.set_axis_off()
        for axes in panels[-1]:
            axes.set_xlabel("expressions scanned")
        for axes in panels[:, 0]:
            axes.set_ylabel("error of the rig, mm (rms)")
        handles, labels = panels[0, 0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=4)
    return figure


def expressions_figure(sitter: Sitter, expressions: Sequence[Expression], *, columns: int = 4) -> Figure:
    """Expressions from the front; under each its slate and the importance shown so far."""
    rows = -(-len(expressions) // columns)
    width = (WIDTH_IN - (columns - 1) * GAP_IN) / columns
    height = width / ASPECT
    frame = portrait(sitter.rig, sitter.anchors, FRONT, ASPECT)
    with house():
        across = min(columns, len(expressions)) * (width + GAP_IN) - GAP_IN
        figure = blank(across, rows * (height + CAPTION_IN))
        for i, one in enumerate(expressions):
            row, column = divmod(i, columns)
            left, top = column * (width + GAP_IN), row * (height + CAPTION_IN)
            weights = np.array([one.pose.get(name, 0.0) for name in sitter.rig.names])
            posed = pose(sitter.head, sitter.rig.pose(weights))
            axes = box(figure, left, top, width, height)
            shown = picture(posed, FRONT, frame, size_px=SIZE_PX)
            axes.imshow(shown.rgb, interpolation="hanning", extent=(0, ASPECT * HEIGHT_PX, HEIGHT_PX, 0))
            axes.set_axis_off()
            caption(figure, left + width / 2, top + height + 0.02, one.name, size=TITLE_PT, bold=True, centred=True)
            number = len(one.blendshapes)
            said = f"{number} blendshape{'s' if number > 1 else ''}, {100 * one.covered:.0f} % shown so far"
            caption(figure, left + width / 2, top + height + 0.2, said, size=SMALL_PT, centred=True)
    return figure


def _panel(
    axes: Axes, target: str, curves: Mapping[str, tuple[Sequence[int], Sequence[float]]], ours: str, cut: str
) -> None:
    end = max(x[-1] for name, (x, _) in curves.items() if name != cut)
    others = [name for name in curves if name != ours]
    nothing = curves[ours][1][0]
    axes.axhline(nothing, color=SOFT, lw=0.8, ls=(0, (4, 3)), zorder=1, label="deformation transfer alone")
    axes.plot(*curves[ours], "o-", color=OURS, ms=3.5, lw=3, label=ours, zorder=1.5)  # others may lie on it
    for number, name in enumerate(others):
        colour, mark = OTHERS[number % len(OTHERS)], MARKS[number % len(MARKS)]
        axes.plot(*curves[name], mark + "-", color=colour, ms=3, lw=1.1, label=name)
    if cut in curves and curves[cut][0][-1] > end:
        x, y = curves[cut]
        said = f"{cut} ends at {x[-1]} scans: {y[-1]:.3f} mm"
        axes.annotate(said, (0.99, 0.03), xycoords="axes fraction", ha="right", size=SMALL_PT, color=INK)
    axes.set(title=target.capitalize(), xlim=(-0.4, end + 0.6), ylim=(0, 1.08 * nothing))
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.grid(axis="y")


def _wide(height_in: float) -> Figure:
    figure = blank(WIDTH_IN, height_in)
    figure.set_layout_engine("constrained")
    return figure
