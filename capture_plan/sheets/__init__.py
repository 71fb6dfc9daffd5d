"""What people see and print: marker sheets, expression sheets, their pictures."""

from capture_plan.sheets.gl import RenderError
from capture_plan.sheets.on_set import write_on_set
from capture_plan.sheets.pictures import ExpressionPictures, expression_pictures, image_of, marker_pictures
from capture_plan.sheets.placement import placement_picture
from capture_plan.sheets.style import Look, region_looks
from capture_plan.sheets.write import write_marker_sheets, write_sheets

__all__ = [
    "ExpressionPictures",
    "Look",
    "RenderError",
    "expression_pictures",
    "image_of",
    "marker_pictures",
    "placement_picture",
    "region_looks",
    "write_marker_sheets",
    "write_on_set",
    "write_sheets",
]
