"""What a mask is made of, before and after it is a solid.

Letters: v vertices, f triangles; millimetres, +y up, facing +z, the subject's left +x.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from capture_plan.errors import PlanError

LEAST_WALL_MM = 1.6  # four lines of a 0.4 mm nozzle: thinner shells of plastic crack when they are put on and off
GAP_MM = (0.4, 0.8)  # below, the plastic rubs off the dots just set; above, a pen slides under it


@dataclass(frozen=True)
class MaskSettings:
    """How a mask is made, millimetres: the space between skin and shell, the thickness of the shell, the box that the
    printer fills (width, depth, height); `halves` cuts it along the midline."""

    gap_mm: float = 0.6
    wall_mm: float = 2.2
    volume_mm: tuple[float, float, float] = (220.0, 220.0, 250.0)
    halves: bool = False

    def __post_init__(self) -> None:
        if not GAP_MM[0] <= self.gap_mm <= GAP_MM[1]:
            raise PlanError(
                f"a gap of {self.gap_mm:g} mm: give {GAP_MM[0]:g} to {GAP_MM[1]:g} mm between skin and mask"
            )
        if not LEAST_WALL_MM + 0.2 <= self.wall_mm <= 4:
            raise PlanError(f"a wall of {self.wall_mm:g} mm: give {LEAST_WALL_MM + 0.2:g} to 4 mm")
        if not all(60 <= side < np.inf for side in self.volume_mm):
            size = "x".join(f"{side:g}" for side in self.volume_mm)
            raise PlanError(f"a print volume of {size} mm: give three lengths of at least 60 mm, as in 220x220x250")


@dataclass(frozen=True, eq=False)
class Dot:
    """A dot that asks for a hole: its name in the plan, what is engraved for it, where it stands on the skin, and
    whether that is the neck."""

    name: str
    text: str
    position: Float[np.ndarray, " 3"]
    on_neck: bool = False


@dataclass(frozen=True, eq=False)
class Hole:
    """A hole for a dot: around it the inside of the mask is flat at `foot_mm` along the axis from the dot; from there a
    cylinder of `radius_mm` to `land_mm`, then a cone to the flat top of a raised eyelet at `top_mm`. `axis` is a unit
    vector out of the skin."""

    dot: Dot
    axis: Float[np.ndarray, " 3"]
    radius_mm: float
    foot_mm: float
    land_mm: float
    top_mm: float

    @property
    def mouth_mm(self) -> float:
        """Radius of the cone where it opens at the top of the eyelet."""
        return self.radius_mm + FLARE_MM

    @property
    def rim_mm(self) -> float:
        """Radius of the flat ring around that."""
        return self.mouth_mm + RING_MM

    @property
    def around_mm(self) -> float:
        """Radius of the eyelet where its sides meet the shell."""
        return self.rim_mm + RISE_MM

    @property
    def flat_mm(self) -> float:
        """Radius of what is flat on the inside: rays through the wall beside the hole run along it, not into it."""
        return self.radius_mm + FLAT_MM

    @property
    def ring_mm(self) -> float:
        """How far from the axis the shell reaches at least, whatever opening is near."""
        return max(self.flat_mm + 1.6, self.rim_mm)

    @property
    def eyelet_mm(self) -> float:
        """How far from the axis the shell reaches where an opening or the rim is near and there is room."""
        return self.ring_mm + 0.4


FLARE_MM = 0.9  # by which a cone is wider than its hole
RING_MM = 0.9
FLAT_MM = 1.3
RISE_MM = 1.0  # of an eyelet over the shell


@dataclass(frozen=True, eq=False)
class Label:
    """A flat pad with an engraved number: its middle and the plane's axes as rows (along the line of the number, up,
    outward); size of the letters, of the pad, and how high its top lies over `place`."""

    name: str
    text: str
    place: Float[np.ndarray, " 3"]
    frame: Float[np.ndarray, "3 3"]
    height_mm: float
    size_mm: tuple[float, float]
    top_mm: float


@dataclass(frozen=True, eq=False)
class Mesh:
    """A closed surface of triangles, corners counted counter-clockwise from outside; millimetres."""

    vertices: Float[np.ndarray, "v 3"]
    triangles: Int[np.ndarray, "f 3"]


def level_frame(normal: Float[np.ndarray, " 3"]) -> Float[np.ndarray, "3 3"]:
    """Rows: along a line of writing, up, out of the surface, for who stands before it with the head upright; on skin
    that looks straight up or down, up is towards the face's front."""
    up = np.array([0.0, 1.0, 0.0]) if abs(normal[1]) < 0.9 else np.array([0.0, 0.0, np.sign(normal[1])]) * -1.0
    along = np.cross(up, normal)
    along /= np.linalg.norm(along)
    return np.stack([along, np.cross(normal, along), normal])
