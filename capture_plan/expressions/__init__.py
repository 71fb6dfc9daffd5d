"""Reference expressions: which blendshapes are performed together, in which order, and how few expressions do."""

from capture_plan.expressions.active_sets import active_sets
from capture_plan.expressions.certificate import packing_faults
from capture_plan.expressions.record import Expression, Overlap, Packing
from capture_plan.expressions.rules import Rules, default_rules, read_rules
from capture_plan.expressions.settings import DistortionForm, Edits, PackingSettings

__all__ = [
    "DistortionForm",
    "Edits",
    "Expression",
    "Overlap",
    "Packing",
    "PackingSettings",
    "Rules",
    "active_sets",
    "default_rules",
    "packing_faults",
    "read_rules",
]
