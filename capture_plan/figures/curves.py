"""Curves: how many landmarks an epsilon asks for, and what is left of the error at a budget or under noise."""

from collections.abc import Mapping, Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, FuncFormatter, MaxNLocator, NullFormatter

from capture_plan.evaluation.zell2022.epsilon_sweep import EpsilonRow
from capture_plan.figures.style import OTHERS, OURS, SMALL_PT, WIDTH_IN, blank, house
from capture_plan.sheets.style import SOFT

HEIGHT_IN = 3.3
MARKS = "s^Dv<>Phx"
Curve = tuple[Sequence[float | int], Sequence[float]]  # x and y


def number_against_epsilon(rows: Sequence[EpsilonRow]) -> Figure:
    """M of the fewest (with its proven bound) and of the paper's sum; an epsilon with uncovered blendshapes is said."""
    x = [row.epsilon for row in rows]
    with house():
        figure, axes = curve_axes("epsilon", "landmarks M")
        paper = [len(row.paper_vertices) for row in rows]
        axes.plot(x, paper, "s-", color=OTHERS[0], ms=4, label="the paper's sum (eq. 5a)")
        proven = all(row.proven_optimal for row in rows)
        label = "fewest, proven" if proven else "fewest found"
        axes.plot(x, [row.fewest for row in rows], "o-", color=OURS, ms=4, label=label)
        if not proven:
            axes.plot(x, [row.bound for row in rows], ":", color=OURS, label="no cover has fewer")
        for row, m in zip(rows, paper, strict=True):
            if row.uncovered:
                said = f"{len(row.uncovered)} uncovered"
                axes.annotate(said, (row.epsilon, m), (0, 7), textcoords="offset points", ha="center", size=SMALL_PT)
        axes.set_ylim(bottom=0)
        axes.yaxis.set_major_locator(MaxNLocator(integer=True))
        axes.legend(loc="upper left")
    return figure


def draw_error_against_budget(
    curves: Mapping[str, Curve], *, ours: str, meaning: str, levels: Mapping[str, float] = {}, budget: int = 0
) -> Figure:
    """An error (mm), which `meaning` says, by number of landmarks; `levels`, dashed lines, are layouts with a number of
    their own."""
    with house():
        figure, axes = curve_axes("landmarks M", meaning)
        _methods(axes, curves, ours)
        end = max(max(x) for x, _ in curves.values())
        for name, level in levels.items():
            axes.axhline(level, color=SOFT, lw=0.8, ls=(0, (4, 3)), zorder=1)
            axes.annotate(name, (end, level), (0, 2), textcoords="offset points", ha="right", size=SMALL_PT, color=SOFT)
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
        if budget:
            axes.axvline(budget, color=OURS, lw=0.8, alpha=0.5, zorder=1)
        _log_y(axes)
    return figure


def error_against_noise(curves: Mapping[str, Curve], *, ours: str, meaning: str) -> Figure:
    """An error (mm), which `meaning` says, by the noise of a landmark coordinate."""
    with house():
        figure, axes = curve_axes("noise of a landmark coordinate, mm", meaning)
        _methods(axes, curves, ours)
        axes.set_ylim(bottom=0)
    return figure


def curve_axes(x: str, y: str) -> tuple[Figure, Axes]:
    """An empty diagram with room for its legend on the right."""
    figure = blank(WIDTH_IN * 0.72, HEIGHT_IN)
    figure.set_layout_engine("constrained")
    axes = figure.add_subplot()
    axes.set(xlabel=x, ylabel=y)
    axes.grid(axis="y")
    return figure, axes


def _methods(axes: Axes, curves: Mapping[str, Curve], ours: str) -> None:
    others = [name for name in curves if name != ours]
    for number, name in enumerate(others):
        colour, mark = OTHERS[number % len(OTHERS)], MARKS[number % len(MARKS)]
        axes.plot(*curves[name], mark + "-", color=colour, ms=3.5, lw=1.1, label=name)
    axes.plot(*curves[ours], "o-", color=OURS, ms=4 if len(curves[ours][0]) < 15 else 0, lw=2.2, label=ours, zorder=4)
    handles, labels = axes.get_legend_handles_labels()
    axes.legend([handles[-1], *handles[:-1]], [labels[-1], *labels[:-1]], loc="upper left", bbox_to_anchor=(1.01, 1))


def _log_y(axes: Axes) -> None:
    """Decades with 1, 2 and 5 written out."""
    axes.set_yscale("log")
    steps = [m * 10.0**e for e in range(-4, 3) for m in (1, 2, 5)]
    low, high = axes.get_ylim()
    axes.yaxis.set_major_locator(FixedLocator([s for s in steps if low <= s <= high]))
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.yaxis.set_minor_formatter(NullFormatter())
    axes.set_ylim(low, high)
