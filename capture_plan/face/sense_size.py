"""Whether the size of a face makes sense: pupils as far apart as a person's, or a reason why they are not.

A reason is that the file itself states its unit and the reading believes it, or that the face is built unlike a
person's, so that no unit could give it a person's size, and lies within what cartoons have. What a person gave is no
reason: it is what is asked about.
"""

import numpy as np

from capture_plan.face.of_rig import rig_channels
from capture_plan.face.reading import face_reading
from capture_plan.face.sense import Sense
from capture_plan.face.unit import CARTOON_MM, HUMAN_MM, PUPILS_MM, apart_words, human_apart
from capture_plan.formats.raw import UNITS_MM
from capture_plan.rig.record import Rig

HUMAN_PUPILS = (0.95, 1.5)  # pupil distance over the size of what moves: six human heads 1.08 to 1.26, a fox 0.82
SIZE_MM = (25.0, 140.0)  # of what moves where no eyes are found: human heads 49 to 77


def size_sense(rig: Rig) -> Sense:
    """The one question about the unit."""
    read, rho = face_reading(rig), rig_channels(rig).rho
    if read.eyes.left is None or read.eyes.right is None:
        found = f"no eyes were found; what moves lies {rho:.0f} mm from its middle (root mean square)"
        return Sense("the face has the size of a face", SIZE_MM[0] <= rho <= SIZE_MM[1], found, "size")
    p = float(np.linalg.norm(np.subtract(read.eyes.left, read.eyes.right)))
    human = human_apart(p)
    reason = "" if human else size_reason(rig)
    return Sense(
        f"the pupils are {HUMAN_MM[0]:g} to {HUMAN_MM[1]:g} mm apart, or there is a reason why not",
        human or bool(reason),
        f"the pupils are {apart_words(p)}" + (f"; {reason}" if reason else ""),
        "size",
        (("--unit-mm", f"{likely_unit(rig.unit_mm, p):g}"),),
    )


def likely_unit(unit_mm: float, pupils: float) -> float:
    """The usual unit that would make pupils of so many millimetres a person's, else the one that does so exactly."""
    scale = PUPILS_MM / pupils * unit_mm
    usual = min(UNITS_MM.values(), key=lambda unit: abs(np.log(unit / scale)))
    return usual if human_apart(pupils * usual / unit_mm) else float(f"{scale:.3g}")


def size_reason(rig: Rig) -> str:
    """Why a face whose eyes were found may be larger or smaller than a person's; nothing where it may not."""
    eyes, rho = face_reading(rig).eyes, rig_channels(rig).rho
    if eyes.left is None or eyes.right is None:
        return ""
    proportion = float(np.linalg.norm(np.subtract(eyes.left, eyes.right))) / rho
    if rig.unit_found == "format" and face_reading(rig).unit.sure:
        return f"the file itself states its unit, {rig.unit_mm:g} mm"
    possible = CARTOON_MM[0] <= proportion * rho <= CARTOON_MM[1]
    if possible and not HUMAN_PUPILS[0] <= proportion <= HUMAN_PUPILS[1]:
        return f"built unlike a person: {proportion:.2f} of the size of what moves, a person's are 1.1 to 1.3"
    return ""
