"""Marker layouts for dense motion, chosen with a thin shell that the markers bend (Le et al. 2013)."""

from capture_plan.shell.boundary import Boundary, find_boundary
from capture_plan.shell.model import Shell
from capture_plan.shell.motion import Motion, motion_from_rig, motion_of, stack_sessions, with_mirror_image
from capture_plan.shell.optimise import MarkerProblem, Result, nested, optimise

__all__ = [
    "Boundary",
    "MarkerProblem",
    "Motion",
    "Result",
    "Shell",
    "find_boundary",
    "motion_from_rig",
    "motion_of",
    "nested",
    "optimise",
    "stack_sessions",
    "with_mirror_image",
]
