"""Rigs: the record, one reader per format, names, skin, pairs and the audit."""

from capture_plan.rig.record import Rig
from capture_plan.rig.sample import sample_rig

__all__ = ["Rig", "sample_rig"]
