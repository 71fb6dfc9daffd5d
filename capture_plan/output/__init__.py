"""The one way in which files are written: whole or not at all, and nothing of a person's is lost."""

from capture_plan.output.leavings import sweep
from capture_plan.output.places import refuse_folder, refuse_place, same
from capture_plan.output.together import refuse_another, refuse_plan, written_together
from capture_plan.output.whole import replace_whole, whole_file, write_whole

__all__ = [
    "refuse_another",
    "refuse_folder",
    "refuse_place",
    "refuse_plan",
    "replace_whole",
    "same",
    "sweep",
    "whole_file",
    "write_whole",
    "written_together",
]
