"""What people see and print: marker sheets, expression sheets, their pictures."""

from capture_plan.sheets.gl import RenderError
from capture_plan.sheets.write import write_sheets

__all__ = ["RenderError", "write_sheets"]
