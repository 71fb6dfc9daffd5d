"""What notebooks share, as marimo shows it: the rig of the session, progress, errors, knobs, figures, heads, sheets.

A notebook is a chain of cells, each one call into the rooms below with one of these around it. Every name from a rig
passes through HTML escaping here or in what marimo builds.
"""

from capture_plan.notebooks_support.comparing import (
    OURS,
    budget_curves,
    comparison_table,
    comparison_tiles,
    landmarks_head,
    noise_curves,
    worst_blendshapes,
)
from capture_plan.notebooks_support.figures import (
    audit_view,
    landmark_table,
    layout_view,
    packing_view,
    visibility_view,
)
from capture_plan.notebooks_support.frame import chosen_rig, plain, rig_reference, wanted, working
from capture_plan.notebooks_support.handles import dragged_head, handle_knobs, handles
from capture_plan.notebooks_support.heads import blendshape_head, layout_head, packing_head, plan_view, visibility_head
from capture_plan.notebooks_support.knobs import (
    camera_knob,
    comparing_knobs,
    comparing_settings,
    cover_knobs,
    cover_settings,
    expression_knobs,
    knob_panel,
    landmark_knobs,
    landmark_settings,
    packing_settings,
    paper_knob,
    session_settings,
)
from capture_plan.notebooks_support.packing import (
    ablation_table,
    packing_worth_knobs,
    people_knob,
    worth_table,
    worth_words,
)
from capture_plan.notebooks_support.paper import downloads, page_gallery, sheet_download, sheet_pages
from capture_plan.notebooks_support.pictures import blendshape_knob, figure_view, incidence_figure, rigs_beside
from capture_plan.notebooks_support.shell import (
    chosen_take,
    layouts_inside_the_next,
    maps_of_counts,
    maps_of_methods,
    marker_counts_knob,
    other_people,
    people_table,
    said,
    skinning_table,
    views_table,
)
from capture_plan.report.page import openness

__all__ = [
    "OURS",
    "ablation_table",
    "audit_view",
    "blendshape_head",
    "blendshape_knob",
    "budget_curves",
    "camera_knob",
    "chosen_rig",
    "chosen_take",
    "comparing_knobs",
    "comparing_settings",
    "comparison_table",
    "comparison_tiles",
    "cover_knobs",
    "cover_settings",
    "downloads",
    "dragged_head",
    "expression_knobs",
    "figure_view",
    "handle_knobs",
    "handles",
    "incidence_figure",
    "knob_panel",
    "landmark_knobs",
    "landmark_settings",
    "landmark_table",
    "landmarks_head",
    "layout_head",
    "layout_view",
    "layouts_inside_the_next",
    "maps_of_counts",
    "maps_of_methods",
    "marker_counts_knob",
    "noise_curves",
    "openness",
    "other_people",
    "packing_head",
    "packing_settings",
    "packing_view",
    "packing_worth_knobs",
    "page_gallery",
    "paper_knob",
    "people_knob",
    "people_table",
    "plain",
    "plan_view",
    "rig_reference",
    "rigs_beside",
    "said",
    "session_settings",
    "sheet_download",
    "sheet_pages",
    "skinning_table",
    "views_table",
    "visibility_head",
    "visibility_view",
    "wanted",
    "working",
    "worst_blendshapes",
    "worth_table",
    "worth_words",
]
