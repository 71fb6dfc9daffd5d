"""One hole for each dot: its axis, how deep it is, and which dots can have none.

Axis     the mean normal of the skin around the dot, Gaussian weights of `NORMAL_MM`: noise of a scan does not tilt it;
         through the dot itself
Foot     as far over the dot as the skin stands highest beside it, and the gap: there the inside is flat around the hole
Land     from there the hole is a cylinder of `LAND_MM`; above, a cone opens to the flat top of the eyelet
Path     a pen comes along the axis: where other skin is in its way the axis is turned towards the front, by no more
         than `TURN` degrees

Letters: n points of the skin, m dots.
"""

import numpy as np
from jaxtyping import Bool, Float

from capture_plan.mask.record import FLAT_MM, LEAST_WALL_MM, RISE_MM, Dot, Hole, MaskSettings
from capture_plan.mask.skin import Skin

NORMAL_MM = 4.0
CLEARANCE_MM = 0.2  # around a dot, of radius: plastic shrinks holes by about as much
LAND_MM = LEAST_WALL_MM + 0.25
AROUND_MM = 2.2  # beyond the hole, where the skin beside it still decides how high its eyelet stands
PATH_MM = (4.0, 40.0)  # of the pen before the dot, which no skin may come as near to as its radius
PEN_MM = 5.5  # radius of that
TURN = (0.0, 10.0, 20.0, 30.0, 40.0)
BACKWARDS = -0.30  # forward part of a normal, 17 degrees backwards: the mask comes from the front
OFF_MM = 3.0  # further from its own skin a dot is none of this head


def holes_for(
    dots: tuple[Dot, ...], skin: Skin, dot_mm: float, settings: MaskSettings
) -> tuple[tuple[Hole, ...], dict[str, str]]:
    """Holes for the dots that can have one, and why the others cannot, by name."""
    holes: list[Hole] = []
    without: dict[str, str] = {}
    for dot in dots:
        away = skin.tree.query(dot.position)[0]
        if away > OFF_MM:
            without[dot.name] = f"it stands {away:.0f} mm off the skin that the mask lies on"
        elif (found := _hole(dot, skin, dot_mm / 2 + CLEARANCE_MM, settings)) is None:
            without[dot.name] = "a pen does not reach it straight: other parts of the face are in its way"
        elif found.axis[2] < BACKWARDS:
            without[dot.name] = "it looks backwards, and the mask is put on from the front"
        elif near := _too_near(found, holes):
            without[dot.name] = f"its hole would run into that of {near}"
        else:
            holes.append(found)
    return tuple(holes), without


def _too_near(hole: Hole, others: list[Hole]) -> str:
    least = 2 * hole.radius_mm + LEAST_WALL_MM
    return next((one.dot.name for one in others if np.linalg.norm(one.dot.position - hole.dot.position) < least), "")


def _hole(dot: Dot, skin: Skin, radius: float, settings: MaskSettings) -> Hole | None:
    offset = skin.points - dot.position
    near = np.linalg.norm(offset, axis=1) <= 3 * NORMAL_MM
    weights = np.exp(-0.5 * (np.linalg.norm(offset[near], axis=1) / NORMAL_MM) ** 2)
    normal = _unit(weights @ skin.normals[near])
    front = np.array([0.0, 0.0, 1.0])
    aside = _unit(front - (front @ normal) * normal)
    for turn in np.radians(TURN):
        axis = np.cos(turn) * normal + np.sin(turn) * aside
        along = offset @ axis
        if not _in_the_way(offset, along).any():
            own = near & (np.abs(along) < PEN_MM) & (skin.normals @ axis > 0)
            around, out = offset[own], settings.gap_mm * skin.normals[own]
            foot = _highest(around + out, axis, radius + FLAT_MM, settings.gap_mm)
            over = _highest(around, axis, radius + AROUND_MM, 0.0) + settings.gap_mm + settings.wall_mm
            top = max(foot + LAND_MM, over) + RISE_MM
            return Hole(dot, axis, radius, foot, foot + LAND_MM, top)
    return None


def _highest(offset: Float[np.ndarray, "n 3"], axis: Float[np.ndarray, " 3"], within: float, least: float) -> float:
    """How far along an axis the points reach that lie within a distance of it; `least` at least."""
    along = offset @ axis
    beside = np.linalg.norm(offset - along[:, None] * axis, axis=1)
    return float(along[beside <= within].max(initial=least))


def _in_the_way(offset: Float[np.ndarray, "n 3"], along: Float[np.ndarray, " n"]) -> Bool[np.ndarray, " n"]:
    """Points of the skin in the path of the pen, which is a cone of the pen's radius that grows from the dot on."""
    beside = np.sqrt(np.maximum(np.einsum("nx,nx->n", offset, offset) - along**2, 0))
    return (along > PATH_MM[0]) & (along < PATH_MM[1]) & (beside < PEN_MM)


def _unit(v: Float[np.ndarray, " 3"]) -> Float[np.ndarray, " 3"]:
    return v / max(float(np.linalg.norm(v)), 1e-12)
