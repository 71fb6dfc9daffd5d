"""The reading of a rig as a whole: how its file was understood, and where its eyes, mouth, nose, chin and ears are."""

import math

import numpy as np
from jaxtyping import Float
from msgspec.structs import replace

from capture_plan.face.anchors import Anchors, face_anchors
from capture_plan.face.channels import Channels
from capture_plan.face.misexported import misexported
from capture_plan.face.of_rig import rig_channels, rig_points
from capture_plan.face.points import ALONE, NEAR, Found, Points
from capture_plan.names.movements import Movement, movements_of
from capture_plan.once import once
from capture_plan.rig import Rig
from capture_plan.rig.understood import Axes, Eyes, Reading, Sides, Sign, Spot, Understood, Unit, Vector

PUPILS, FORMAT = "the distance between the pupils", "the format"  # what may speak for a unit (`face/unit.py`)
ASIDE = 0.1  # rho from the midline: what is called left and lies nearer than that says nothing of the sides
ALONG = 0.2  # of a direction of length 1; sideways jaws, lips and looks of four heads 0.25 to 0.8
MOST = 0.8  # of the names with a side
DECIMALS, FINE_MM = 3, 10.0  # of a place in millimetres; one more for every tenth that the pupils are nearer than this


@once
def face_reading(rig: Rig) -> Reading:
    """How `rig` was understood; what rests on eyes and mouth is only sure where they are."""
    anchors, points, channels = face_anchors(rig), rig_points(rig), rig_channels(rig)
    file = rig.understood or by_hand(rig)
    mouth_sure = points.mouth.sure and not anchors.against_mouth
    eyes_sure = eyes_hold(points.eyes, anchors.against_mouth) and not anchors.against_eyes
    both = eyes_sure and mouth_sure and file.axes.sure
    wrong = frozenset(one.name for one in misexported(rig))
    ears = "ears" in anchors.found and both
    found = points.eyes.places is not None

    def vector(point: Float[np.ndarray, " 3"]) -> Vector:
        return _vector(point, DECIMALS + max(0, math.ceil(np.log10(FINE_MM / max(anchors.pupils, 1e-9)))))

    return Reading(
        axes=file.axes,
        unit=file.unit if eyes_sure and file.axes.sure else without_eyes(file.unit),
        eyes=Eyes(
            left=vector(anchors.eye_left) if found else None,
            right=vector(anchors.eye_right) if found else None,
            sure=eyes_sure and file.axes.sure,
            signs=points.eyes.signs + anchors.against_eyes,
        ),
        mouth=Spot(
            at=None if points.mouth.places is None else vector(_lips(anchors, points)),
            sure=mouth_sure and file.axes.sure,
            signs=points.mouth.signs + anchors.against_mouth,
        ),
        nose=Spot(vector(anchors.nose_tip) if both else None, sure=both),
        chin=Spot(vector(anchors.chin) if both else None, sure=both and anchors.chin_sure),
        ears=Eyes(vector(anchors.ear_left) if ears else None, vector(anchors.ear_right) if ears else None, sure=ears),
        sides=find_sides(channels, _meant(rig, channels), points.x0, sure=file.axes.sure, but=wrong),
        left_out=file.left_out,
        set_aside=file.set_aside,
    )


def without_eyes(unit: Unit) -> Unit:
    """A unit where the eyes are in doubt: no longer sure if their distance speaks for it and no file states it."""
    names = {sign.name for sign in unit.signs if sign.weight > 0}
    return replace(unit, sure=unit.sure and (PUPILS not in names or FORMAT in names))


def eyes_hold(eyes: Found, against_mouth: tuple[Sign, ...]) -> bool:
    """Whether eyes are sure: where something speaks against the mouth that they were chosen for, only by a sign that is
    enough alone."""
    return eyes.sure and (not against_mouth or any(sign.weight >= ALONE for sign in eyes.signs))


def _lips(anchors: Anchors, points: Points) -> Float[np.ndarray, " 3"]:
    """The middle of the lips by their border; else where the skin parts, if that lies at the mouth that was found."""
    eyes, mouth, refined = points.eyes.places, points.mouth.places, anchors.mouth
    if mouth is None or eyes is None or len(anchors.lips):
        return refined
    near = np.linalg.norm(refined - mouth[0]) < NEAR * np.linalg.norm(eyes[0] - eyes[1])
    return refined if near else mouth[0]


def by_hand(rig: Rig) -> Understood:
    """What is known of a rig that no file gave: its own word."""
    return Understood(
        axes=Axes(rig.up, rig.facing, sure=True, signs=(Sign("given", f"up {rig.up}, facing {rig.facing}", 0.0),)),
        unit=Unit(rig.unit_mm, sure=True, signs=(Sign("given", f"{rig.unit_mm:g} mm", 0.0),)),
        set_aside=tuple(np.array(rig.names)[~rig_channels(rig).facial].tolist()),
    )


def find_sides(
    channels: Channels,
    means: dict[str, Movement | None],
    x0: float,
    *,
    sure: bool,
    but: frozenset[str] = frozenset(),
) -> Sides:
    """Whether blendshapes move the subject's left, and to the left, where their names say so; which do not. `means`
    are the movements that the names stand for, in their order; those in `but` say nothing."""
    agrees = {
        name: agree
        for (name, movement), centre, direction in zip(means.items(), channels.centre, channels.direction, strict=True)
        if movement is not None
        and name not in but
        and (agree := _as_called(movement, float(centre[0] - x0) / channels.rho, direction)) is not None
    }
    agree, several = sum(agrees.values()), len(agrees)
    sign = Sign("names of one side", f"{agree} of {several} move the side that they are called by", float(agree))
    return Sides(
        sure=sure and agree >= MOST * several,
        disagree=tuple(name for name, right in agrees.items() if not right),
        signs=(sign,) if several else (),
    )


def _meant(rig: Rig, channels: Channels) -> dict[str, Movement | None]:
    """The movement that each name stands for, by the person's own map where that has it."""
    mine = dict(rig.meanings)
    said = movements_of(tuple(mine.get(name, name) for name in rig.names))
    message = zip(rig.names, said, channels.movements, strict=True)
    return {name: own if name in mine else named for name, own, named in message}


def _as_called(movement: Movement, aside: float, direction: Float[np.ndarray, " 3"]) -> bool | None:
    """Whether a blendshape moves the side, or to the side, that its name says; None where that says nothing.

    `aside` is how far its centre lies to the subject's left of the middle, rho.
    """
    towards = _towards(movement)
    if towards is not None:
        along = float(direction @ towards)
        return None if abs(along) < ALONG else along > 0
    if movement.side is None or movement.kind.startswith("gaze") or abs(aside) < ASIDE:
        return None
    return (movement.side == "left") == (aside > 0)


def _towards(movement: Movement) -> Float[np.ndarray, " 3"] | None:
    """Which way a name says that what it moves goes, where it says left, right or the way of a gaze."""
    left, up = np.array([1.0, 0, 0]), np.array([0, 1.0, 0])
    outwards = left if movement.side == "left" else -left
    ways = {"gaze up": up, "gaze down": -up, "gaze left": left, "gaze right": -left}
    if movement.kind in ("gaze in", "gaze out"):
        return None if movement.side is None else outwards if movement.kind == "gaze out" else -outwards
    if movement.kind in ("jaw side", "mouth side", "tongue") and movement.towards is not None:
        return left if movement.towards == "left" else -left
    return ways.get(movement.kind)


def _vector(point: Float[np.ndarray, " 3"], decimals: int) -> Vector:
    x, y, z = (round(float(c), decimals) for c in point)
    return x, y, z
