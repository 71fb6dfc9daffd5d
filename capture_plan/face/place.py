"""Where a face is, for what it tells of the skin around it."""

import numpy as np

from capture_plan.face.channels import Channels
from capture_plan.face.face_skin import FacePlace
from capture_plan.face.points import Points
from capture_plan.face.votes import names_agree

SIDEWAYS = ("gaze left", "gaze right", "gaze in", "gaze out")


def face_place(points: Points, channels: Channels, unit: float = 1.0) -> FacePlace | None:
    """Eyes and mouth of a head in the rig's axes, `unit` millimetres long each; None where they are not sure."""
    if not (points.eyes.sure and points.mouth.sure) or points.eyes.places is None or points.mouth.places is None:
        return None
    looks = np.isin(np.arange(len(channels.weight)), channels.of(*SIDEWAYS) if names_agree(channels) else [])
    return FacePlace(unit * points.eyes.places, unit * points.mouth.places[0], unit * points.x0, looks[channels.facial])
