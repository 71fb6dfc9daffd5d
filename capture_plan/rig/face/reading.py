"""The reading of a rig as a whole: how its file was understood, and where its eyes, mouth, nose, chin and ears are."""

from functools import lru_cache

import numpy as np

from capture_plan.rig.anchors import face_anchors
from capture_plan.rig.face.channels import Channels
from capture_plan.rig.face.of_rig import REMEMBERED, rig_channels, rig_points
from capture_plan.rig.face.record import Axes, Eyes, Reading, Sides, Sign, Spot, Understood, Unit, Vector
from capture_plan.rig.record import Rig

ASIDE = 0.1  # rho from the midline: what is called left and lies nearer than that says nothing of the sides
MOST = 0.8  # of the names with a side


@lru_cache(maxsize=REMEMBERED)
def face_reading(rig: Rig) -> Reading:
    """How `rig` was understood; what rests on eyes and mouth is only sure where they are."""
    anchors, points, channels = face_anchors(rig), rig_points(rig), rig_channels(rig)
    file = rig.understood or by_hand(rig)
    both = points.eyes.sure and points.mouth.sure
    ears = "ears" in anchors.found and both
    found = points.eyes.places is not None
    return Reading(
        axes=file.axes,
        unit=file.unit,
        eyes=Eyes(
            left=_vector(anchors.eye_left) if found else None,
            right=_vector(anchors.eye_right) if found else None,
            sure=points.eyes.sure and file.axes.sure,
            signs=points.eyes.signs,
        ),
        mouth=Spot(
            at=None if points.mouth.places is None else _vector(anchors.mouth),
            sure=points.mouth.sure and file.axes.sure,
            signs=points.mouth.signs,
        ),
        nose=Spot(_vector(anchors.nose_tip) if both else None, sure=both),
        chin=Spot(_vector(anchors.chin) if both else None, sure=both and anchors.chin_sure),
        ears=Eyes(_vector(anchors.ear_left) if ears else None, _vector(anchors.ear_right) if ears else None, sure=ears),
        sides=find_sides(channels, rig.names, points.x0, sure=file.axes.sure),
        left_out=file.left_out,
        set_aside=file.set_aside,
    )


def by_hand(rig: Rig) -> Understood:
    """What is known of a rig that no file gave: its own word."""
    return Understood(
        axes=Axes(rig.up, rig.facing, sure=True, signs=(Sign("given", f"up {rig.up}, facing {rig.facing}", 0.0),)),
        unit=Unit(rig.unit_mm, sure=True, signs=(Sign("given", f"{rig.unit_mm:g} mm", 0.0),)),
        set_aside=tuple(np.array(rig.names)[~rig_channels(rig).facial].tolist()),
    )


def find_sides(channels: Channels, names: tuple[str, ...], x0: float, *, sure: bool) -> Sides:
    """Whether blendshapes that are called left move the subject's left, and which do not."""
    agree, disagree = 0, []
    for name, movement, centre in zip(names, channels.movements, channels.centre, strict=True):
        aside = float(centre[0] - x0) / channels.rho
        if movement is None or movement.side is None or movement.kind.startswith("gaze") or abs(aside) < ASIDE:
            continue
        if (movement.side == "left") == (aside > 0):
            agree += 1
        else:
            disagree.append(name)
    several = agree + len(disagree)
    most = several == 0 or agree >= MOST * several
    sign = Sign("names of one side", f"{agree} of {several} move the side that they are called by", float(agree))
    return Sides(sure=sure and most, disagree=tuple(disagree), signs=(sign,) if several else ())


def _vector(point: np.ndarray) -> Vector:
    x, y, z = (round(float(c), 3) for c in point)
    return x, y, z
