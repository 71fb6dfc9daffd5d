"""Takes: the record, one reader per format, the mapping of recorded weights, and the head held still."""

from capture_plan.curves.frames import Frames
from capture_plan.curves.mapping import Drive, WeightMapping, map_weights
from capture_plan.sequence.read import read_sequence
from capture_plan.sequence.record import Sequence

__all__ = ["Drive", "Frames", "Sequence", "WeightMapping", "map_weights", "read_sequence"]
