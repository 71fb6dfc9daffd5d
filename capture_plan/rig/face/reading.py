"""The reading of a rig as a whole: how its file was understood, and where its eyes, mouth, nose, chin and ears are."""

from functools import lru_cache

import numpy as np

from capture_plan.rig.anchors import face_anchors
from capture_plan.rig.face.record import Axes, Eyes, Reading, Sides, Spot, Unit, Vector
from capture_plan.rig.record import Rig


@lru_cache(maxsize=8)
def face_reading(rig: Rig) -> Reading:
    """How `rig` was understood."""
    a = face_anchors(rig)
    eyes, mouth, ears = ("eyes" in a.found, "mouth" in a.found, "ears" in a.found)
    return Reading(
        axes=Axes(rig.up, rig.facing, sure=True),
        unit=Unit(rig.unit_mm, sure=True),
        eyes=Eyes(_vector(a.eye_left) if eyes else None, _vector(a.eye_right) if eyes else None, sure=eyes),
        mouth=Spot(_vector(a.mouth) if mouth else None, sure=mouth),
        nose=Spot(_vector(a.nose_tip), sure=eyes and mouth),
        chin=Spot(_vector(a.chin), sure=eyes and mouth),
        ears=Eyes(_vector(a.ear_left) if ears else None, _vector(a.ear_right) if ears else None, sure=ears),
        sides=Sides(sure=True),
    )


def _vector(point: np.ndarray) -> Vector:
    x, y, z = (round(float(c), 3) for c in point)
    return x, y, z
