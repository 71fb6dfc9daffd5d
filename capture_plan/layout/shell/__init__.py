"""Marker layouts for dense motion, chosen with a thin shell that the markers bend (Le et al. 2013)."""

from capture_plan.layout.shell.model import Shell
from capture_plan.layout.shell.motion import Motion, motion_from_rig, motion_of, together
from capture_plan.layout.shell.optimise import Result, nested, optimise, optimise_together

__all__ = [
    "Motion",
    "Result",
    "Shell",
    "motion_from_rig",
    "motion_of",
    "nested",
    "optimise",
    "optimise_together",
    "together",
]
