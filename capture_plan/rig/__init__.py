"""Rigs: the record, one reader per format, names, skin, pairs and the audit."""

from capture_plan.rig.read import read_rig
from capture_plan.rig.record import Rig
from capture_plan.rig.sample import sample_rig

__all__ = ["Rig", "read_rig", "sample_rig"]
