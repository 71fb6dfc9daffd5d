"""The reading of a face as an audit and a plan carry it: short, and every point in the file's own coordinates too.

Points are (x, y, z), `mm` in the rig's frame (millimetres, +y up, facing +z, the subject's left +x) and `file` in the
axes, the unit and the origin of the artist's file.
"""

import numpy as np
from msgspec import Struct

from capture_plan.face.reading import face_reading
from capture_plan.face.sense import contradicted
from capture_plan.rig.record import Rig
from capture_plan.rig.understood import Axes, Eyes, Sides, Sign, Spot, Unit, Vector

SIGNS = 6  # that a plan keeps of an answer: the strongest, whichever way they speak
DIGITS = 6  # significant digits of a coordinate of the file


class Place(Struct, frozen=True, forbid_unknown_fields=True):
    """A point of the face in the rig's frame, millimetres, and in the file's own coordinates."""

    mm: Vector
    file: Vector


class PairFacts(Struct, frozen=True, forbid_unknown_fields=True):
    """The subject's own left and right of something; None where it was not found."""

    left: Place | None
    right: Place | None
    sure: bool
    signs: tuple[Sign, ...] = ()

    @property
    def found(self) -> bool:
        """Whether both of the pair are known."""
        return self.left is not None and self.right is not None

    @property
    def apart_mm(self) -> float | None:
        """Distance between the two, millimetres."""
        if self.left is None or self.right is None:
            return None
        return float(np.linalg.norm(np.subtract(self.left.mm, self.right.mm)))


class SpotFacts(Struct, frozen=True, forbid_unknown_fields=True):
    """One point of the face; None where it was not found."""

    mm: Vector | None
    file: Vector | None
    sure: bool
    signs: tuple[Sign, ...] = ()


class ReadingFacts(Struct, frozen=True, forbid_unknown_fields=True):
    """How a rig was understood, what each answer rests on, and what was left out or set aside (see `Reading`).

    `turn` are our axes in the file, the subject's left, up and forward: mm = unit_mm * turn @ file. `against` is what
    the face itself says against how it was read to lie, whoever said so (`sense.py`).
    """

    axes: Axes
    unit: Unit
    eyes: PairFacts
    mouth: SpotFacts
    nose: SpotFacts
    chin: SpotFacts
    ears: PairFacts
    sides: Sides
    left_out: tuple[str, ...] = ()
    set_aside: tuple[str, ...] = ()
    against: tuple[str, ...] = ()
    turn: tuple[Vector, ...] = ()

    @property
    def no_face(self) -> bool:
        """Whether no eye was found, and no mouth beyond doubt."""
        eyes = self.eyes.left is not None or self.eyes.right is not None
        return not eyes and (self.mouth.mm is None or not self.mouth.sure)

    @property
    def regions_known(self) -> bool:
        """Whether places on the face may be called by the names of its regions."""
        return self.axes.sure and self.eyes.sure and self.mouth.sure and not self.against


def reading_facts(rig: Rig) -> ReadingFacts:
    """What was understood of a rig."""
    read = face_reading(rig)
    return ReadingFacts(
        axes=Axes(read.axes.up, read.axes.facing, read.axes.sure, _short(read.axes.signs), read.axes.turned_degrees),
        unit=Unit(read.unit.mm, read.unit.sure, _short(read.unit.signs)),
        eyes=_pair(rig, read.eyes),
        mouth=_spot(rig, read.mouth),
        nose=_spot(rig, read.nose),
        chin=_spot(rig, read.chin),
        ears=_pair(rig, read.ears),
        sides=Sides(read.sides.sure, read.sides.disagree, _short(read.sides.signs)),
        left_out=read.left_out,
        set_aside=read.set_aside,
        against=contradicted(rig),
        turn=_turn(rig),
    )


def _turn(rig: Rig) -> tuple[Vector, ...]:
    """The rows of the rig's rotation, rounded."""
    x, y, z = (tuple(round(c, DIGITS) for c in row) for row in np.reshape(rig.turn, (3, 3)).tolist())
    return x, y, z


def _pair(rig: Rig, eyes: Eyes) -> PairFacts:
    return PairFacts(_place(rig, eyes.left), _place(rig, eyes.right), eyes.sure, _short(eyes.signs))


def _spot(rig: Rig, spot: Spot) -> SpotFacts:
    place = _place(rig, spot.at)
    return SpotFacts(place and place.mm, place and place.file, spot.sure, _short(spot.signs))


def _place(rig: Rig, at: Vector | None) -> Place | None:
    if at is None:
        return None
    x, y, z = (float(f"{c:.{DIGITS}g}") for c in rig.in_file(np.array(at)))
    return Place(at, (x, y, z))


def _short(signs: tuple[Sign, ...]) -> tuple[Sign, ...]:
    """The strongest signs, in their order, weights with one decimal."""
    strongest = sorted(signs, key=lambda sign: -abs(sign.weight))[:SIGNS]
    return tuple(Sign(sign.name, sign.says, round(sign.weight, 1)) for sign in signs if sign in strongest)
