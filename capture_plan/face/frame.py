"""Unit and axes of a rig: what a person gives, else what the format and the face itself speak for, with a doubt."""

from dataclasses import dataclass

import numpy as np

from capture_plan.errors import RigError
from capture_plan.face.axes import Vote, axes_matrix, decide
from capture_plan.face.channels import Channels, find_channels
from capture_plan.face.points import Points, find_points
from capture_plan.face.shape import Shape
from capture_plan.face.unit import find_unit
from capture_plan.face.votes import all_votes, names_agree
from capture_plan.formats.naming import listed
from capture_plan.formats.raw import RawRig
from capture_plan.rig.read_options import AS_FOUND, ReadOptions
from capture_plan.rig.record import HowFound
from capture_plan.rig.understood import Axes, Sign, Unit

ANOTHER = 5  # blendshapes named for a face that lie elsewhere: fewer may have misleading names


@dataclass(frozen=True, eq=False)
class Frame:
    """Unit and axes of a file with their signs, how each was found, and a sentence where a person should know one.

    `channels` and `votes` are in the file's axes and unit; `points` in the rig's axes and the file's unit.
    """

    axes: Axes
    unit: Unit
    unit_found: HowFound
    up_found: HowFound
    facing_found: HowFound
    note: str
    channels: Channels
    votes: tuple[Vote, ...]
    points: Points

    @property
    def unit_mm(self) -> float:
        """Millimetres in one unit of the file."""
        return self.unit.mm

    @property
    def up(self) -> str:
        """Signed axis of the file that points up."""
        return self.axes.up

    @property
    def facing(self) -> str:
        """Signed axis of the file that the face looks along."""
        return self.axes.facing


def find_frame(raw: RawRig, given: ReadOptions = AS_FOUND, *, shape: Shape | None = None) -> Frame:
    """Unit and axes of `raw`: what a person states, else what its format says where that can be, else what is found.

    `shape` is that of `raw`, where it is known already.
    """
    shape = shape or head_shape(raw)
    stated = (raw.up, raw.facing) if raw.up and raw.facing else None
    turned = bool(given.up or given.facing)
    votes = tuple(all_votes(shape, int(np.argmax(shape.mirror))))
    axes = decide(
        votes,
        shape.mirror,
        stated=None if turned else stated,
        given=given,
        speaking=int(shape.channels.facial.sum()),
    )
    points = find_points(shape.turned(axes_matrix(axes.up, axes.facing)), named=names_agree(shape.channels))
    pupils = drop = None
    if points.eyes.places is not None and points.eyes.sure:
        pupils = float(np.linalg.norm(points.eyes.places[0] - points.eyes.places[1]))
        if points.mouth.places is not None and points.mouth.sure:
            drop = float(np.linalg.norm(points.eyes.places.mean(axis=0) - points.mouth.places[0]))
    unit_mm = given.unit_mm
    unit = Unit(unit_mm, True, (Sign("given", f"{unit_mm:g} mm", 0.0),)) if unit_mm else None
    moves = shape.channels
    unit = unit or find_unit(raw.unit_mm, pupils, moves.rho, moves.extent, drop=drop, few=moves.few)
    agrees = stated == (axes.up, axes.facing) and not turned
    found: tuple[HowFound, ...] = tuple("given" if one else "detected" for one in (given.up, given.facing))
    return Frame(
        axes=axes,
        unit=unit,
        unit_found="given" if unit_mm else "format" if unit.mm == raw.unit_mm else "detected",
        up_found="format" if agrees else found[0],
        facing_found="format" if agrees else found[1],
        note="; ".join(
            [
                *axes_note(raw, axes, given=turned),
                *unit_note(raw, unit, unit_mm),
                *heads_note(raw, shape),
            ]
        ),
        channels=shape.channels,
        votes=votes,
        points=points,
    )


def head_shape(raw: RawRig) -> Shape:
    """What the blendshapes move, and the shape near it, in the file's own axes. RigError where nothing moves."""
    try:
        channels = find_channels(raw.neutral, raw.triangles, raw.deltas, raw.names)
    except RigError as error:
        raise RigError(f"{raw.name}: {error}") from error
    return Shape(raw.neutral, raw.triangles, raw.deltas, channels, raw.parts, raw.part_names)


def axes_note(raw: RawRig, axes: Axes, *, given: bool) -> list[str]:
    """What a person should know of the axes."""
    if given:
        return []
    notes = []
    if raw.up and (raw.up, raw.facing) != (axes.up, axes.facing):
        against = sorted((sign for sign in axes.signs if sign.weight > 0), key=lambda sign: -sign.weight)
        message = ", ".join(sign.name for sign in against[:3])
        notes.append(
            f"the format says {raw.up} up and facing {raw.facing}, this head has {axes.up} up and faces {axes.facing}"
            f" ({message})"
        )
    if not axes.sure:
        notes.append(
            f"not sure how the head lies: {axes.up} up and facing {axes.facing} was taken; "
            "look at the picture of the audit, and give --up and --facing where it is wrong"
        )
    return notes


def unit_note(raw: RawRig, unit: Unit, given: float | None) -> list[str]:
    """What a person should know of the unit; how far apart the pupils then are, only the reading says."""
    if given:
        return []
    if raw.unit_mm and unit.mm != raw.unit_mm:
        message = f"one unit is {raw.unit_mm:g} mm by the file, of which no face built like this one has the size"
        return [f"{message}; taken as {unit.mm:g} mm, give --unit-mm where it is not"]
    if unit.sure:
        return []
    if unit.signs and unit.signs[0].name.startswith("no usual unit"):
        return [
            f"fits no usual unit: scaled to the size of a human face, one unit is {unit.mm:.4g} mm; "
            "give --unit-mm where that is wrong"
        ]
    message = "the file's own unit" if unit.mm == raw.unit_mm else "not sure how long a unit is: one unit"
    return [f"{message} was taken as {unit.mm:g} mm; give --unit-mm where it is not"]


def heads_note(raw: RawRig, shape: Shape) -> list[str]:
    """What a person should know of a second head in the file."""
    if shape.doubled:
        return ["two heads move in this file: export one of them alone"]
    if shape.parted:
        return ["two things apart from each other move in this file, two heads perhaps: export one head alone"]
    names = [name for name, other in zip(raw.names, shape.channels.elsewhere, strict=True) if other]
    if len(names) < ANOTHER:
        return []
    message = "blendshapes are named for a face and move something far from this one"
    return [f"{len(names)} {message}, another head perhaps ({listed(names)}): export one head alone"]


def votes_of(raw: RawRig, sides: int) -> list[Vote]:
    """Every sign of a head's pose, whose two sides mirror each other along the axis `sides`."""
    return all_votes(head_shape(raw), sides)
