"""Figures as a paper shows them: heads with landmarks, maps on heads, curves, bars and matrices, in one house style.

Each function takes what the rooms below answered and returns a Matplotlib figure; `png` and `svg` turn it into a file.
"""

from matplotlib.figure import Figure

from capture_plan.figures.bars import blendshape_bars, incidence
from capture_plan.figures.comparison import write_comparison_figures
from capture_plan.figures.curves import draw_error_against_budget, error_against_noise, number_against_epsilon
from capture_plan.figures.heads import Sitter, sit
from capture_plan.figures.layouts import Captioned, layouts_figure
from capture_plan.figures.maps import HeadMap, maps_figure
from capture_plan.figures.packing import (
    error_by_scans,
    expressions_figure,
    number_against_mu,
    roles_figure,
    shown_by_terms,
)
from capture_plan.figures.paper import discarded, models, named_layouts, occlusion, replacements, seeds, suited, teaser
from capture_plan.figures.shell import (
    error_against_markers,
    error_between_people,
    error_on_unseen_frames,
    error_over_iterations,
)
from capture_plan.figures.shell_heads import (
    constraints,
    error_maps,
    layouts_over_iterations,
    nested_layouts,
    recovered_layouts,
    shared_layouts,
)
from capture_plan.figures.style import png, svg, write_figure

__all__ = [
    "Captioned",
    "Figure",
    "HeadMap",
    "Sitter",
    "blendshape_bars",
    "constraints",
    "discarded",
    "draw_error_against_budget",
    "error_against_markers",
    "error_against_noise",
    "error_between_people",
    "error_by_scans",
    "error_maps",
    "error_on_unseen_frames",
    "error_over_iterations",
    "expressions_figure",
    "incidence",
    "layouts_figure",
    "layouts_over_iterations",
    "maps_figure",
    "models",
    "named_layouts",
    "nested_layouts",
    "number_against_epsilon",
    "number_against_mu",
    "occlusion",
    "png",
    "recovered_layouts",
    "replacements",
    "roles_figure",
    "seeds",
    "shared_layouts",
    "shown_by_terms",
    "sit",
    "suited",
    "svg",
    "teaser",
    "write_comparison_figures",
    "write_figure",
]
