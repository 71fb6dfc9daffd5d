"""The corners of the eyes: the ends of the lids' borders, nearest to the midline and furthest from it."""

from capture_plan.face.anchors import Anchors
from capture_plan.rig import Rig

FEWEST = 6  # vertices of a lid border: of fewer the ends are no corners
SIDES = {"left": 1, "right": -1}


def eye_corners(rig: Rig, anchors: Anchors) -> dict[tuple[str, str], int]:
    """Vertices by end and side, ("inner", "left") and its like; those of a side whose lids were not found are missing.

    Example:
        >>> rig = sample_rig()
        >>> corners = eye_corners(rig, face_anchors(rig))
        >>> [round(float(rig.neutral[corners[end, "left"], 0])) for end in ("inner", "outer")]
        [19, 41]
    """
    found: dict[tuple[str, str], int] = {}
    if "eyes" not in anchors.found:
        return found
    for side, sign in SIDES.items():
        aside = sign * (rig.neutral[anchors.lids, 0] - anchors.midline)
        lids, aside = anchors.lids[aside > 0], aside[aside > 0]
        if len(lids) >= FEWEST:
            found["inner", side], found["outer", side] = int(lids[aside.argmin()]), int(lids[aside.argmax()])
    return found
