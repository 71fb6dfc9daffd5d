"""Rigs: the record, one reader per format, names, skin, pairs and the audit."""

from capture_plan.rig.record import Rig

__all__ = ["Rig"]
