"""Thin-shell layouts as pictures: errors over markers, iterations, unseen frames and the skin; nested layouts."""

from collections.abc import Mapping, Sequence

import numpy as np
from jaxtyping import Float, Int
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from capture_plan.figures.curves import MARKS, curve_axes
from capture_plan.figures.heads import ASPECT, Sitter
from capture_plan.figures.layouts import CAPTION_IN, DOT_PT2, GAP_IN, dots, show
from capture_plan.figures.maps import BAD, HeadMap, maps_figure
from capture_plan.figures.style import OTHERS, OURS, SMALL_PT, TITLE_PT, WIDTH_IN, blank, caption, house
from capture_plan.layout.shell import evaluate as methods
from capture_plan.layout.shell.evaluate import Scored, vertex_errors
from capture_plan.layout.shell.evaluation import Evaluation
from capture_plan.layout.shell.take import Take
from capture_plan.sheets.style import SOFT
from capture_plan.sheets.view import FRONT

TOP_SHARE = 0.99  # of the vertices whose error the scale of a map reaches


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
        axes.plot([one.markers for one in others], [one.rmse_mm for one in others], "+", color=SOFT, ms=8, mew=1.4)
        for one in others:
            words = one.method.partition(" (")
            said = words[2].rstrip(")") + f" {one.markers}"
            axes.annotate(said, (one.markers, one.rmse_mm), (4, 4), textcoords="offset points", size=SMALL_PT)
        axes.set_ylim(bottom=0)
        axes.legend(loc="upper left", bbox_to_anchor=(1.01, 1))
    return figure


def error_over_iterations(found: Evaluation) -> Figure:
    """RMSE (mm) of the published algorithm after each iteration, by start, beside ours (Fig. 3)."""
    m = found.counts[0]
    with house():
        figure, axes = curve_axes("iteration of the published algorithm", f"error of the take with M = {m}, mm (rms)")
        for n, row in enumerate(found.descents_mm):
            axes.plot(range(len(row)), row, "o-", color=OTHERS[n % len(OTHERS)], ms=3, lw=1.1, label=f"start {n + 1}")
        axes.axhline(found.rmse_mm(methods.OURS, m), color=OURS, lw=2.2, label=methods.OURS)
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
        axes.set_ylim(bottom=0)
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
        axes.set_xticks(found.counts)
        axes.set_ylim(bottom=0)
        axes.legend(loc="upper left", bbox_to_anchor=(1.01, 1))
    return figure


def error_maps(sitter: Sitter, take: Take, layouts: Mapping[str, Scored]) -> Figure:
    """Error of each vertex (mm, rms over the frames), one scale for all (Figs. 6 and 11)."""
    errors = {title: _on_head(take, one.vertices) for title, one in layouts.items()}
    top = max(float(np.nanquantile(values, TOP_SHARE)) for values in errors.values())
    return maps_figure(
        [
            HeadMap(
                sitter,
                f"{title}: {layouts[title].rmse_mm:.2f} mm",
                values,
                "error, mm (rms over the frames)",
                (0.0, top),
                BAD,
            )
            for title, values in errors.items()
        ]
    )


def nested_layouts(sitter: Sitter, layouts: Sequence[Scored]) -> Figure:
    """Layouts each inside the next: inherited markers red, new ones blue (Fig. 7)."""
    width = (WIDTH_IN - (len(layouts) - 1) * GAP_IN) / len(layouts)
    height = width / ASPECT
    area = DOT_PT2 * (4 / len(layouts)) ** 2
    with house():
        figure = blank(WIDTH_IN, height + CAPTION_IN)
        before: Int[np.ndarray, " m"] = np.empty(0, dtype=int)
        for i, one in enumerate(layouts):
            left, vertices = i * (width + GAP_IN), np.array(one.vertices)
            axes = show(figure, left, 0.0, width, sitter.front)
            new = np.setdiff1d(vertices, before)
            dots(axes, sitter, FRONT, sitter.front, before, area=area, colour=OTHERS[0])
            dots(axes, sitter, FRONT, sitter.front, new, area=area)
            title = f"M = {one.markers}"
            caption(figure, left + width / 2, height + 0.02, title, size=TITLE_PT, bold=True, centred=True)
            said = f"{one.rmse_mm:.3f} mm, {len(new)} new"
            caption(figure, left + width / 2, height + 0.2, said, size=SMALL_PT, centred=True)
            before = vertices
    return figure


def _on_head(take: Take, vertices: Sequence[int]) -> Float[np.ndarray, " v"]:
    """The errors at the rig's vertices, NaN beyond the shell."""
    values = np.full(len(take.rig.neutral), np.nan)
    values[take.at] = vertex_errors(take.shell, take.motion, take.places(np.array(vertices)))
    return values
