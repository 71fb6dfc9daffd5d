"""What a camera file holds: cameras in the file's own world, and what its format says of that world."""

from dataclasses import dataclass

from capture_plan.camera.camera import Camera

UNITS = {"millimetres": 1.0, "centimetres": 10.0, "metres": 1000.0, "inches": 25.4}  # each in millimetres


@dataclass(frozen=True, eq=False)
class Calibration:
    """Cameras as a file of `format` gives them, x right, y down, z forward.

    `unit`: one of `UNITS` in which the file measures; nothing where the format leaves it open, and the cameras' numbers
    are taken for millimetres. `in_head_frame`: the file is written in the rig's own millimetres, +y up, facing +z.
    `notes`: what was assumed or left out, a sentence each.
    """

    format: str
    cameras: tuple[Camera, ...]
    unit: str | None
    in_head_frame: bool = False
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "notes", tuple(dict.fromkeys(self.notes)))  # each said once
