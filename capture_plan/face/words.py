"""What was understood of a face, in sentences for people: each answer, the signs it rests on, and every doubt with what
a person can give to settle it.
"""

from collections.abc import Iterable, Sequence
from typing import NamedTuple

from capture_plan.face.facts import PairFacts, ReadingFacts, SpotFacts
from capture_plan.face.unit import HUMAN_MM, apart_words, human_apart
from capture_plan.names.movements import movement_of
from capture_plan.rig.understood import Sign

SPOKEN = 3  # signs that a line names
NOT_FOUND = "not found"
NAMED = 6  # parts or blendshapes that a line calls by their names


class Answer(NamedTuple):
    """One thing that was understood: what, the signs it rests on, and whether it is certain.

    Of what not every head shows (nose, chin, ears), "not found" is an answer and no doubt.
    """

    label: str
    text: str
    signs: tuple[Sign, ...]
    sure: bool

    @property
    def status(self) -> str:
        """'sure', 'not sure' or, of what was not found, nothing more."""
        if self.text == NOT_FOUND:
            return NOT_FOUND
        return "sure" if self.sure else "not sure"


def answers(read: ReadingFacts) -> list[Answer]:
    """Every answer of a reading, in words."""
    pupils = read.eyes.apart_mm
    apart = "" if pupils is None else f"; pupils {apart_words(pupils)}"
    axes_sure = read.axes.sure and not read.against
    return [
        Answer("Axes", _axes_words(read), read.axes.signs, axes_sure),
        Answer("Unit", f"1 unit of the file is {read.unit.mm:g} mm{apart}", _unit_signs(read), read.unit.sure),
        Answer("Eyes", _pair_words(read.eyes), read.eyes.signs, read.eyes.sure),
        Answer("Mouth", _spot_words(read.mouth), read.mouth.signs, read.mouth.sure),
        Answer("Nose", _spot_words(read.nose), read.nose.signs, read.nose.sure or read.nose.mm is None),
        Answer("Chin", _spot_words(read.chin), read.chin.signs, read.chin.sure or read.chin.mm is None),
        Answer("Ears", _pair_words(read.ears), read.ears.signs, read.ears.sure or not read.ears.found),
        Answer("Sides", _side_words(read), read.sides.signs, read.sides.sure),
    ]


def _unit_signs(read: ReadingFacts) -> tuple[Sign, ...]:
    """Signs of the unit; one that speaks against it says which unit it would fit, which is no distance, where a face of
    that unit would have the size of a person's."""
    return tuple(
        Sign(f"{sign.name} would fit {_unit_words(read, sign)}", "", sign.weight) if sign.weight < 0 else sign
        for sign in read.unit.signs
    )


def _unit_words(read: ReadingFacts, sign: Sign) -> str:
    """'1 unit = 25.4 mm', or another unit without its length where the pupils would then be no person's."""
    pupils, length = read.eyes.apart_mm, sign.says.removesuffix(" mm")
    fits = pupils is None or length == sign.says or human_apart(pupils * float(length) / read.unit.mm)
    return f"1 unit = {sign.says}" if fits else "another unit"


def _axes_words(read: ReadingFacts) -> str:
    axes = read.axes
    if not axes.turned_degrees:
        return f"{axes.up} of the file is up, the face looks along {axes.facing}"
    return (
        f"the head lies turned by {axes.turned_degrees:.0f} degrees in its file and was put upright; nearest to up is "
        f"{axes.up} of the file, nearest to where the face looks {axes.facing}"
    )


def signs_words(signs: Sequence[Sign], most: int = SPOKEN) -> str:
    """'rests on: the format, the jaw opens downwards and 2 more; against it: ...': the strongest signs of an answer."""
    messages = sorted(signs, key=lambda sign: -abs(sign.weight))
    speak = [sign.name for sign in messages if sign.weight > 0] + [
        "what was given" for s in messages if s.name == "given"
    ]
    against = [f"{sign.name} ({sign.says})" if sign.says else sign.name for sign in messages if sign.weight < 0]
    words = [f"rests on: {some(speak, most)}"] if speak else []
    return "; ".join([*words, f"against it: {some(against, most)}"] if against else words)


def doubts(read: ReadingFacts) -> list[str]:
    """Everything that is not certain, one sentence each, with what a person can give."""
    if read.no_face:
        return [no_face_words()]
    return [sentence for sentence in (*_frame_doubts(read), *_face_doubts(read), *_side_doubts(read)) if sentence]


def no_face_words() -> str:
    """What to do with a thing that has neither eyes nor a mouth."""
    return (
        "No face was found: neither eyes nor a mouth. Export the face mesh with its blendshapes; if this is one, say "
        "how it lies with --up and --facing, how large it is with --unit-mm, and what is skin with --skin."
    )


def left_out_words(read: ReadingFacts, most: int | None = None) -> list[tuple[str, str]]:
    """Label and text of what does not belong to the face that is shown; `most` names of each, or all."""
    rows = []
    if read.left_out:
        names = some(read.left_out, most or len(read.left_out))
        rows.append(("Left out", f"{names}: no part of the rig that is shown"))
    if read.set_aside:
        names = some(read.set_aside, most or len(read.set_aside))
        rows.append(
            (
                "Set aside",
                f"{names}: not used to find the face; each moves nothing, something else, or more than a face",
            )
        )
    return rows


def some(names: Iterable[str], most: int = NAMED) -> str:
    """'a, b and 3 more'."""
    names = list(names)
    return ", ".join(names[:most]) + (f" and {len(names) - most} more" if len(names) > most else "")


def _pair_words(pair: PairFacts) -> str:
    if pair.left is None and pair.right is None:
        return NOT_FOUND
    messages = [
        f"{side} at {_point(place.file)}"
        for side, place in (("left", pair.left), ("right", pair.right))
        if place is not None
    ]
    only = "" if pair.found else "only the "
    return f"{only}{', '.join(messages)}, in units of the file"


def _spot_words(spot: SpotFacts) -> str:
    return NOT_FOUND if spot.file is None else f"at {_point(spot.file)}, in units of the file"


def _point(point: tuple[float, float, float]) -> str:
    finest = 1e-4 * max(abs(c) for c in point)  # less of a coordinate is rounding
    return f"({', '.join(f'{c:.4g}' if abs(c) > finest else '0' for c in point)})"


def _side_words(read: ReadingFacts) -> str:
    if not read.sides.signs:
        return "by the shape and the axes alone: no names tell left from right"
    if not read.sides.disagree:
        return "names and movements agree on left and right" if read.sides.sure else "left and right are not certain"
    return f"{len(read.sides.disagree)} blendshapes move the other side, or the other way, than their names say"


def _frame_doubts(read: ReadingFacts) -> list[str]:
    axes, unit, pupils = read.axes, read.unit, read.eyes.apart_mm
    found = []
    if read.against:
        found.append(
            f"Against this reading: {'; '.join(read.against[:SPOKEN])}. Give --up and --facing, or leave out what you "
            "gave of them (`capture-plan audit RIG -o audit.png` shows how the head was read)."
        )
    elif not axes.sure:
        found.append(
            f"How the head lies in its file is not certain: {axes.up} was taken for up and {axes.facing} for forward. "
            "If the picture shows it lying, upside down or from behind, give --up and --facing."
        )
    if not unit.sure:
        far = "" if pupils is None else f", which puts the pupils {apart_words(pupils)}"
        found.append(f"The size is not certain: one unit was taken as {unit.mm:g} mm{far}. Give --unit-mm if it errs.")
    elif pupils is not None and not human_apart(pupils):
        found.append(
            f"The pupils are {apart_words(pupils)}, a person's {HUMAN_MM[0]:g} to {HUMAN_MM[1]:g} mm: give --unit-mm "
            "if one unit of the file is not "
            f"{unit.mm:g} mm."
        )
    return found


def _face_doubts(read: ReadingFacts) -> list[str]:
    missing = [word for word, gone in (("eyes", not read.eyes.found), ("mouth", read.mouth.mm is None)) if gone]
    unsure = [
        word for word, answer in (("eyes", read.eyes), ("mouth", read.mouth)) if not answer.sure and word not in missing
    ]
    found = []
    if missing:
        found.append(f"No {' and no '.join(missing)} found: say with --skin what is face, if clothes or hair mislead.")
    if unsure and _lies(read):
        are = "is" if unsure == ["mouth"] else "are"
        found.append(f"Where {' and '.join(unsure)} {are}, is not certain: look at the picture, and try --skin.")
    if not (read.chin.sure or missing or unsure or read.chin.mm is None):
        found.append(
            "The chin is not certain: what lies lowest and foremost below the mouth is no usual place for it, or the "
            "mouth gapes."
        )
    if not read.regions_known:
        found.append("So places on the face go without the names of regions: markers have a number and a side.")
    return found


def _side_doubts(read: ReadingFacts) -> list[str]:
    if read.sides.disagree and _lies(read):
        looks = [name for name in read.sides.disagree if _says_height(name)]
        sides = [name for name in read.sides.disagree if name not in looks]
        behind = ", or give --facing if the picture shows the head from behind"
        both = (("up and down", looks, ""), ("left and right", sides, behind))
        return [
            f"Names and movements disagree about {what} in {some(names)}: exchange these names{otherwise}."
            for what, names, otherwise in both
            if names
        ]
    certain = read.sides.sure or not _lies(read)
    return [] if certain else ["Left and right are not certain: compare the picture, and give --facing."]


def _says_height(name: str) -> bool:
    """Whether a name says that eyes look up or down."""
    movement = movement_of(name)
    return movement is not None and movement.kind in ("gaze up", "gaze down")


def _lies(read: ReadingFacts) -> bool:
    """Whether how the head lies is beyond doubt; where it is not, nothing else can be, and one sentence says so."""
    return read.axes.sure and not read.against
