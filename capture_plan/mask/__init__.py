"""A shell for the face of an actor, printed in plastic, with a conical hole for every dot and its number beside it.

`write_mask(plan, inputs, "mask")` writes STL, 3MF and a picture; `make_mask(head, dots, dot_mm=3.0)` gives the solid,
what it measures, and which dots have no hole and why.
"""

from capture_plan.mask.make import Mask, make_mask
from capture_plan.mask.record import Dot, MaskSettings
from capture_plan.mask.write import mask_lines, write_mask

__all__ = ["Dot", "Mask", "MaskSettings", "make_mask", "mask_lines", "write_mask"]
