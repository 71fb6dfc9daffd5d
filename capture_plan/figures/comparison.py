"""A comparison of layouts as pictures: error against budget, error against noise, and the layouts on the head.

Of ours the free one stands for all in the curves; layouts with a number of their own are levels or single marks.
"""

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from capture_plan.evaluation.baselines import BASELINES
from capture_plan.evaluation.compare import FREE, MIXES, PLACED, STUDIO, WORN, Comparison, Row
from capture_plan.evaluation.compare_report import design_noise
from capture_plan.figures.curves import Curve, draw_error_against_budget, error_against_noise
from capture_plan.figures.heads import sit
from capture_plan.figures.layouts import Captioned, layouts_figure
from capture_plan.figures.style import write_figure
from capture_plan.rig import Rig

MEASURED = "error of weights solved from 0 to 1"
SHOWN = 34  # landmarks of the layouts on the head and of the curves over noise, or the budget nearest to it


def write_comparison_figures(found: Comparison, rig: Rig, folder: Path) -> list[Path]:
    """`error-against-budget`, `error-against-noise` and `layouts` as PNG and SVG in a folder."""
    figures = {
        "error-against-budget": budget_figure(found),
        "error-against-noise": noise_figure(found),
        "layouts": heads_figure(found, rig),
    }
    return [
        write_figure(figure, folder / f"{name}.{kind}") for name, figure in figures.items() for kind in ("png", "svg")
    ]


def budget_figure(found: Comparison) -> Figure:
    """Error of the skin over random mixes against M, at the noise that ours are designed for."""
    n = found.noises_mm.index(design_noise(found))
    curves: dict[str, Curve] = {}
    for name in (FREE, WORN, *BASELINES):
        rows = [row for row in found.rows if row.method == name]
        curves[name] = ([row.landmarks for row in rows], [row.scores[MIXES][n].rmse_mm for row in rows])
    levels = {
        row.method.removesuffix(PLACED): row.scores[MIXES][n].rmse_mm
        for row in found.rows
        if row.method.startswith("68") and row.method.endswith(PLACED)
    }
    shown = {name: curve for name, curve in curves.items() if curve[0]}
    return draw_error_against_budget(
        shown, ours=FREE, meaning=f"{MEASURED} at {found.noises_mm[n]:g} mm noise, mm (rms)", levels=levels
    )


def noise_figure(found: Comparison) -> Figure:
    """Error of the skin against noise, for the layouts of one budget."""
    budget = nearest_budget(found)
    rows = [row for row in found.rows if row.landmarks == budget and (row.method in BASELINES or row.method == FREE)]
    curves: dict[str, Curve] = {
        row.method: (found.noises_mm, [score.rmse_mm for score in row.scores[MIXES]]) for row in rows
    }
    return error_against_noise(curves, ours=FREE, meaning=f"{MEASURED} with M = {budget}, mm (rms)")


def heads_figure(found: Comparison, rig: Rig) -> Figure:
    """The layouts of one budget, our studio layout and the empirical ones, on the head."""
    n, budget, sitter = found.noises_mm.index(design_noise(found)), nearest_budget(found), sit(rig)

    def shown(row: Row) -> bool:
        return (row.landmarks == budget and row.method in (FREE, WORN, *BASELINES)) or (
            row.method == STUDIO or row.method.endswith(PLACED)
        )

    rows = [row for row in found.rows if shown(row)]
    return layouts_figure(
        [
            Captioned(sitter, *_titles(row, row.scores[MIXES][n].rmse_mm), np.array(row.vertices))
            for row in sorted(rows, key=lambda row: row.scores[MIXES][n].rmse_mm)
        ],
        columns=5,
    )


def _titles(row: Row, error_mm: float) -> tuple[str, str]:
    """'68 points', '0.131 mm, iBUG': what fits below a head."""
    name, _, more = row.method.removesuffix(PLACED).removeprefix("ours: ").partition(" (")
    return name[0].upper() + name[1:], ", ".join([f"{error_mm:.3f} mm", *([more.rstrip(")")] if more else [])])


def nearest_budget(found: Comparison) -> int:
    """The compared budget nearest to `SHOWN`."""
    return min(found.budgets, key=lambda budget: abs(budget - SHOWN))
