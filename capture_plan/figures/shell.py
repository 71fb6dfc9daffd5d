"""Thin-shell layouts as curves: errors over markers, iterations, people and unseen frames (Le et al. 2013)."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from capture_plan.evaluation.le2013 import methods
from capture_plan.evaluation.le2013.evaluation import Evaluation
from capture_plan.figures.curves import MARKS, curve_axes
from capture_plan.figures.style import OTHERS, OURS, SMALL_PT, house
from capture_plan.sheets.style import SOFT

CUT = 1.4  # of the worst error after one iteration: the top of Fig. 3
WIDE = 1.25  # of a usual diagram: names of methods are long


def error_against_markers(found: Evaluation) -> Figure:
    """RMSE (mm) of every method by number of markers; layouts with a number of their own as single signs (Fig. 12)."""
    names = [methods.OURS, *(name for name in methods.METHODS if name != methods.OURS), methods.RIG]
    with house():
        figure, axes = curve_axes("markers M", "error of the take, mm (rms)")
        for n, name in enumerate(names):
            values = [found.rmse_mm(name, m) for m in found.counts]
            own = name == methods.OURS
            colour, mark = (OURS, "o") if own else (OTHERS[(n - 1) % len(OTHERS)], MARKS[(n - 1) % len(MARKS)])
            axes.plot(found.counts, values, mark + "-", color=colour, lw=2.2 if own else 1.1, ms=4, label=name)
        others = [one for one in found.scored if one.method not in (*names, methods.NESTED)]
        for n, one in enumerate(sorted(others, key=lambda one: one.markers)):
            label = f"{one.method}, {one.markers} of them here" if one.left_out else one.method
            letter = chr(ord("A") + n)
            axes.text(one.markers, one.rmse_mm, letter, ha="center", va="center", size=SMALL_PT, weight="bold")
            axes.plot(one.markers, one.rmse_mm, ls="", label=f"{letter}: {label}")
        figure.set_figwidth(WIDE * figure.get_figwidth())
        _numbers(axes, found.counts)
        axes.legend(loc="upper left", bbox_to_anchor=(1.01, 1))
    return figure


def error_over_iterations(found: Evaluation) -> Figure:
    """RMSE (mm) of the published algorithm after every move of a marker, by start, beside ours (Fig. 3)."""
    m, rows = found.descents.markers, found.descents.errors_mm
    with house():
        figure, axes = curve_axes("iteration of the published algorithm", f"error of the take with M = {m}, mm (rms)")
        for n, row in enumerate(rows):
            axes.plot(np.arange(len(row)) / m, row, color=OTHERS[n % len(OTHERS)], lw=1.1, label=f"start {n + 1}")
        axes.axhline(found.rmse_mm(methods.OURS, m), color=OURS, lw=2.2, label=methods.OURS)
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
        # what a start at random misses is off the scale where that hides the rest
        axes.set_ylim(0, CUT * max(row[m] for row in rows))
        axes.legend(loc="upper left", bbox_to_anchor=(1.01, 1))
    return figure


def error_between_people(found: Evaluation) -> Figure:
    """Each person under a layout from the others, and under an own one, mm, by number of markers (Fig. 10)."""
    assert found.subjects is not None, "there are other people"
    rows = found.subjects.left_out
    with house():
        figure, axes = curve_axes("markers M", "error of each person's take, mm (rms)")
        for n, name in enumerate(dict.fromkeys(one.subject for one in rows)):
            own = [one for one in rows if one.subject == name]
            m, colour = [one.markers for one in own], [OURS, *OTHERS][n % (1 + len(OTHERS))]
            axes.plot(m, [one.others_mm for one in own], MARKS[n % len(MARKS)] + "-", color=colour, ms=4, label=name)
            axes.plot(m, [one.own_mm for one in own], ls=(0, (3, 2)), color=colour, lw=1.1)
            axes.plot(m, [one.random_mm for one in own], ls=":", color=colour, lw=1.1)
        for words, style in (("layout from the others", "-"), ("own layout", (0, (3, 2))), ("random layouts", ":")):
            axes.plot([], [], ls=style, color=SOFT, lw=1.1, label=words)
        _numbers(axes, found.counts)
        axes.legend(loc="upper left", bbox_to_anchor=(1.01, 1))
    return figure


def error_on_unseen_frames(found: Evaluation) -> Figure:
    """Mean and standard deviation (mm) over five parts that the layout was not chosen from (Fig. 13)."""
    names = list(dict.fromkeys(one.method for one in found.folds))
    step = 0.12 * min(np.diff(found.counts), default=10)
    with house():
        figure, axes = curve_axes("markers M", "error on unseen frames, mm (rms)")
        for n, name in enumerate(names):
            rows = [one for one in found.folds if one.method == name]
            x = np.array([one.markers for one in rows]) + (n - (len(names) - 1) / 2) * step
            colour = OURS if name == methods.OURS else OTHERS[(n - 1) % len(OTHERS)]
            mean, sd = [one.mean_mm for one in rows], [one.sd_mm for one in rows]
            axes.errorbar(x, mean, sd, fmt="o", color=colour, ms=4, lw=1.3, capsize=3, label=name)
        _numbers(axes, found.counts)
        axes.legend(loc="upper left", bbox_to_anchor=(1.01, 1))
    return figure


def _numbers(axes: Axes, counts: Sequence[int]) -> None:
    axes.set_xticks(counts)
    axes.set_ylim(bottom=0)
