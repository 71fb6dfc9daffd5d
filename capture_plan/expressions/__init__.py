"""Reference expressions: which blendshapes are performed together, in which order, and how few expressions do."""

from capture_plan.expressions.active import active_sets
from capture_plan.expressions.certificate import packing_faults
from capture_plan.expressions.record import Expression, Packing
from capture_plan.expressions.settings import PackingSettings

__all__ = ["Expression", "Packing", "PackingSettings", "active_sets", "packing_faults"]
