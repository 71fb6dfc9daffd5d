"""What was understood of a face: every answer with the signs that it rests on, and whether they suffice.

A sign is one piece of evidence: the format's own statement, a name, a motion, a shape, a proportion. Its weight is how
many nats of log-likelihood it adds to the answer taken over the best other one; below 0 it speaks against the answer.
An answer that is not sure is for people to look at, never for a program to build on in silence.
"""

from msgspec import Struct

Vector = tuple[float, float, float]


class Sign(Struct, frozen=True, forbid_unknown_fields=True):
    """One piece of evidence: its `name` in words ("the jaw opens downwards"), what it `says`, its weight in nats."""

    name: str
    says: str
    weight: float


class Axes(Struct, frozen=True, forbid_unknown_fields=True):
    """Signed axes of the file that point up and where the face looks; `turned_degrees` where the head lay askew."""

    up: str
    facing: str
    sure: bool
    signs: tuple[Sign, ...] = ()
    turned_degrees: float = 0.0


class Unit(Struct, frozen=True, forbid_unknown_fields=True):
    """Millimetres in one unit of the file."""

    mm: float
    sure: bool
    signs: tuple[Sign, ...] = ()


class Understood(Struct, frozen=True, forbid_unknown_fields=True):
    """What was understood of a file when it was read, in the file's own axes and unit.

    `left_out` names the parts of the file that do not belong to the rig that is shown (hidden meshes, spare heads);
    `set_aside` the blendshapes that do not move the face itself (hats, bodies, whole heads), which decide nothing here.
    """

    axes: Axes
    unit: Unit
    left_out: tuple[str, ...] = ()
    set_aside: tuple[str, ...] = ()


class Eyes(Struct, frozen=True, forbid_unknown_fields=True):
    """Middles of the eyes, the subject's own left and right, millimetres in the rig's frame; None where not found."""

    left: Vector | None
    right: Vector | None
    sure: bool
    signs: tuple[Sign, ...] = ()


class Spot(Struct, frozen=True, forbid_unknown_fields=True):
    """One point of the face, millimetres in the rig's frame; None where it was not found."""

    at: Vector | None
    sure: bool
    signs: tuple[Sign, ...] = ()


class Sides(Struct, frozen=True, forbid_unknown_fields=True):
    """Whether names and geometry agree on the subject's left: `sure`, and which blendshapes they disagree about.

    A name disagrees that moves the other side of the face than it says, or its jaw, lips or gaze the other way.
    """

    sure: bool
    disagree: tuple[str, ...] = ()
    signs: tuple[Sign, ...] = ()


class Reading(Struct, frozen=True, forbid_unknown_fields=True):
    """How a rig was understood. Points are in the rig's frame: millimetres, +y up, facing +z, the subject's left +x.

    `left_out` names the parts of the file that do not belong to the rig that is shown (hidden meshes, spare heads);
    `set_aside` the blendshapes that do not move the face itself (hats, bodies, whole heads), which decide nothing here.
    """

    axes: Axes
    unit: Unit
    eyes: Eyes
    mouth: Spot
    nose: Spot
    chin: Spot
    ears: Eyes
    sides: Sides
    left_out: tuple[str, ...] = ()
    set_aside: tuple[str, ...] = ()

    @property
    def sure(self) -> bool:
        """Whether axes, unit, eyes, mouth and sides are all beyond reasonable doubt."""
        return all((self.axes.sure, self.unit.sure, self.eyes.sure, self.mouth.sure, self.sides.sure))
