"""What a person states of a rig's file, in place of what would be found of it."""

from dataclasses import dataclass

from capture_plan.errors import RigError

AXES = ("+x", "-x", "+y", "-y", "+z", "-z")
UNITS_MM = (1e-9, 1e9)  # what a file can count in: beyond it squares are lost


@dataclass(frozen=True)
class ReadOptions:
    """Unit, axes, skin and names of a rig's file as a person states them; what is None is found from the file.

    `unit_mm` is how long one unit of the file is, `up` and `facing` are signed axes of the file ("+y", "-z"). `skin`
    says where markers may go: names of parts, separated by commas, or a text file of vertex numbers. `names` is a TOML
    file that says what blendshapes are.

    Raises:
        RigError: an axis that is none, two that are one line, or a unit that no file counts in.
    """

    unit_mm: float | None = None
    up: str | None = None
    facing: str | None = None
    skin: str | None = None
    names: str | None = None

    def __post_init__(self) -> None:
        for what, axis in (("up", self.up), ("facing", self.facing)):
            if axis is not None and axis not in AXES:
                raise RigError(f"{what} is '{axis}', expected one of {', '.join(AXES)}")
        if self.up and self.facing and self.up[1] == self.facing[1]:
            raise RigError(f"up is {self.up} and facing is {self.facing}: choose two different axes")
        if isinstance(self.unit_mm, bool) or not isinstance(self.unit_mm, int | float | None):
            raise RigError(f"the unit is {self.unit_mm!r}, expected a number of millimetres, such as 10 for cm")
        if self.unit_mm is not None and not UNITS_MM[0] <= self.unit_mm <= UNITS_MM[1]:
            between = f"{UNITS_MM[0]:g} to {UNITS_MM[1]:g}"
            raise RigError(
                f"the unit is {self.unit_mm} mm, expected a length above 0 ({between}), such as 10 for centimetres"
            )


AS_FOUND = ReadOptions()
