"""Figures as a paper shows them: heads with landmarks, maps on heads, curves, bars and matrices, in one house style.

Each function takes what the rooms below answered and returns a Matplotlib figure; `png` and `svg` turn it into a file.
"""

from capture_plan.figures.bars import blendshape_bars, incidence
from capture_plan.figures.curves import error_against_budget, error_against_noise, number_against_epsilon
from capture_plan.figures.heads import Sitter, sit
from capture_plan.figures.layouts import Captioned, layouts_figure
from capture_plan.figures.maps import HeadMap, maps_figure
from capture_plan.figures.style import png, svg, write_figure

__all__ = [
    "Captioned",
    "HeadMap",
    "Sitter",
    "blendshape_bars",
    "error_against_budget",
    "error_against_noise",
    "incidence",
    "layouts_figure",
    "maps_figure",
    "number_against_epsilon",
    "png",
    "sit",
    "svg",
    "write_figure",
]
