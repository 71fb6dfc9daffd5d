"""The unit and the axes that a file is written in, as it says them itself."""

from dataclasses import dataclass

import numpy as np

from capture_plan.rig import Rig

Z_UP = np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]])  # of the plan's axes those with +z up, the face along -y
WORDS = {1: "millimetre", 10: "centimetre", 100: "decimetre", 1000: "metre", 25.4: "inch", 304.8: "foot"}


@dataclass(frozen=True)
class Frame:
    """A unit `unit_mm` millimetres long; signed axes that point up and that the face looks along."""

    unit_mm: float
    up: str
    facing: str

    @property
    def unit(self) -> str:
        """The unit's name: 'centimetre', or '216.5 mm' where it has none."""
        return WORDS.get(self.unit_mm, f"{self.unit_mm:g} mm")

    def words(self) -> str:
        """'unit: centimetre; +y up, the face looks along +z'."""
        return f"unit: {self.unit}; {self.up} up, the face looks along {self.facing}"

    def record(self) -> dict[str, str | float]:
        """Unit and axes as entries of a JSON file."""
        return {"unit": self.unit, "unit_mm": self.unit_mm, "up": self.up, "facing": self.facing}


def frame_of_plan() -> Frame:
    """The frame of every plan: millimetres, +y up, facing +z."""
    return Frame(1, "+y", "+z")


def frame_of_file(rig: Rig) -> Frame:
    """The frame of the artist's file."""
    return Frame(rig.unit_mm, rig.up, rig.facing)
