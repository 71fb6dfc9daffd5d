"""Which standard a blendshape's name follows, and what it says in plain words.

    recognise("eyeBlink_L")                       ARKit      eyeBlinkLeft  left   "eye closed (left)"
    recognise("au_12_l")                          FACS       AU12          left   "lip corner puller (left)"
    recognise("CTRL_expressions_mouthFunnelUL")   MetaHuman  mouthFunnelUL left   "mouth funnel (upper left)"
    recognise("Expressions_mouthSmile_max")       MB-Lab     mouthSmile    none   "mouth smile, upper end of its slider"
    recognise("blink_l")                          VRM        blinkLeft     left   "left eye closed"
    recognise("Fcl_EYE_Close_L")                  VRoid      Fcl_EYE_Close left   "eye closed (left)"
    recognise("brow_raise")                       plain words               none   "inner brow raised"
    recognise("eyes_leftEye_blink")               Faceware   eyes_leftEye_blink   left   "eye closed (left)"

Confidence  1 the standard's own spelling; 0.9 a house spelling of it; 0.7 a word of the standard that others use too
            ("happy"); 0.6 the shape of a name only,
            or words of any language (0.63 at most). What the user's own name map says has confidence 1.
Names are hints for people and for recorded weights; which blendshapes are partners, geometry decides
(`anatomy/blendshape_pairs.py`).
"""

import re
import tomllib
from collections.abc import Callable, Collection
from dataclasses import dataclass, replace
from functools import cache
from importlib.resources import files
from typing import Any

from capture_plan.names.arkit import INTENSITY, UNIT, WORD, Side, arkit_name, side_of
from capture_plan.names.movements import SURE, Movement, movement_of, movements_of, nearest_of, said_of
from capture_plan.names.name_map import NameMap
from capture_plan.names.paired_sides import with_sides
from capture_plan.names.tokens import side_words, split_words

OWN, HOUSE, SHARED, SHAPE = 1.0, 0.9, 0.7, 0.6
WORDS = 0.7  # of the confidence that plain words have among themselves: 0.63 at most
IN_WORDS = "plain words"
ANY_SPELLING = ("MikuMikuDance", "Visemes")  # the others are told by how they write
CONTROL = re.compile(r"(?:.*[:|.])?CTRL_expressions[_.]")
ENDS = re.compile(r"(?P<base>[A-Za-z]*[a-z](?:Left|Right)?)(?P<quadrant>[UD]?(?:IN|OUT)?[LRCUDM]?)(?P<phase>Ph\d)?")
NUMBERED = re.compile(r"\d+\.")  # 13.mouth_leftMouth_smile
SLIDER = re.compile(r"(?P<prefix>Expressions_)?(?P<base>[A-Za-z]\w*?\d*)_(?P<end>min|max)")
PLACES = {"U": "upper", "D": "lower", "IN": "inner", "OUT": "outer", "C": "centre", "L": "left", "R": "right"}


@dataclass(frozen=True)
class Recognised:
    """`name` as the standard spells it, the subject's `side`, plain `words`, `confidence` from 0 to 1.

    `arkit` are the ARKit blendshapes that do nearly the same, for recorded weights; none where there is none like it.
    `part` is "upper" or "lower" where the name says one lip of a movement, as the end of Lip_Funneler_LB does.
    """

    standard: str
    name: str
    side: Side | None
    words: str
    confidence: float
    arkit: tuple[str, ...] = ()
    part: str = ""


def recognise(name: str, *, mine: NameMap | None = None) -> Recognised | None:
    """What `name` means: by the user's own map, else by the standard that it fits best; None where by none."""
    if mine is not None and (meant := mine.meaning(name)):
        found = recognise(meant)
        return replace(found, confidence=OWN) if found else Recognised("yours", meant, side_of(meant), meant, OWN)
    readings = [found for reader in READERS if (found := reader(name))]
    return max(readings, key=lambda found: found.confidence, default=None)


def recognise_all(names: Collection[str], *, mine: NameMap | None = None) -> dict[str, Recognised | None]:
    """Every name's meaning, each read beside the others: AU12_r is a right side where there is an AU12_l.

    So is blink_d where there is a blink_g (`paired_sides.py`).
    """
    found = {name: recognise(name, mine=mine) for name in names}
    for name, movement in zip(names, movements_of(tuple(names)), strict=True):
        meaning = found[name]
        if meaning is None or meaning.standard == IN_WORDS:
            found[name] = _in_words(name, movement)
    for name, spelled in with_sides(names).items():
        one, sided = found[name], recognise(spelled)
        if (
            one
            and one.side is None
            and len(one.arkit) > 1
            and sided
            and sided.side
            and set(sided.arkit) < set(one.arkit)
        ):
            found[name] = replace(sided, name=name if sided.standard == IN_WORDS else sided.name)
    for name, meaning in found.items():
        if meaning and INTENSITY.fullmatch(name) and name[:-1] + "l" in found:
            found[name] = _unit(int(name[2:4]), "right", HOUSE)
    return found


def slider_pairs(names: Collection[str]) -> tuple[tuple[str, str], ...]:
    """(min, max) names that are the two ends of one MB-Lab slider: opposite weights of one movement."""
    present = set(names)
    return tuple(
        (name, name[:-3] + "max") for name in names if SLIDER.fullmatch(name) and name[:-3] + "max" in present - {name}
    )


def _arkit(name: str) -> Recognised | None:
    found = arkit_name(name)
    if found is None:
        return None
    table = _data("arkit")
    base = found if found in table else found.removesuffix("Left").removesuffix("Right")
    side: Side | None = None if found in table else "left" if found.endswith("Left") else "right"
    halved = side is not None and table[base]["sides"] != "both"
    own = not halved and name in (found, found[0].upper() + found[1:])  # Live Link opens with a capital
    return Recognised("ARKit", found, side, _with(table[base]["words"], side), OWN if own else HOUSE, (found,))


def _facs(name: str) -> Recognised | None:
    match = UNIT.fullmatch(name)
    if match is None or f"AU{int(match['number'])}" not in _data("facs"):
        return None
    number, word = int(match["number"]), (match["side"] or match["before"] or "").lower()
    if INTENSITY.fullmatch(name):
        return _unit(number, None, SHARED)
    side: Side | None = "left" if word.startswith("l") else "right" if word.startswith("r") else None
    return _unit(number, side, OWN if re.fullmatch(r"AU\d+[LR]?", name) else HOUSE)


def _unit(number: int, side: Side | None, confidence: float) -> Recognised:
    entry = _data("facs")[f"AU{number}"]
    nearest = tuple(name for base in entry["arkit"] for name in _sided(base, side))
    return Recognised("FACS", f"AU{number}", side, _with(entry["words"], side), confidence, nearest)


def _metahuman(name: str) -> Recognised | None:
    prefix = CONTROL.match(name)
    short = name[prefix.end() :] if prefix else name
    match = ENDS.fullmatch(short)
    table = _data("metahuman")
    if match is None or not (prefix or match["base"] in table):
        return None
    base, quadrant = match["base"], match["quadrant"]
    known = base in table
    side: Side | None = {"L": "left", "R": "right"}.get(quadrant[-1:])  # type: ignore[assignment]
    places = [PLACES[letters] for letters in re.findall("IN|OUT|[UDCLR]", quadrant)]
    words = " ".join(word.lower() for word in WORD.findall(base)) + (f" ({' '.join(places)})" if places else "")
    if match["phase"]:
        words += f", phase {match['phase'][2:]}"
    if base.startswith("eyeLook") and base[7:] in ("Left", "Right") and side:
        way = "Out" if base[7:].lower() == side else "In"
        nearest: tuple[str, ...] = (f"eyeLook{way}{side.capitalize()}",)
    else:
        nearest = _sided(table[base], side) if table.get(base) else ()
    confidence = OWN if prefix and known else SHAPE if prefix else SHARED
    return Recognised("MetaHuman", short, side, words, confidence, nearest)


def _vrm(name: str) -> Recognised | None:
    for preset, entry in _data("vrm").items():
        if name in (preset, preset.capitalize()) or name.lower() in (
            *(preset.lower(), entry.get("vrm0")),
            *entry.get("also", ()),
        ):
            sided = preset.endswith(("Left", "Right")) and not preset.startswith("look")
            side: Side | None = side_of(preset) if sided else None
            own = OWN if name == preset and any(map(str.isupper, name)) else SHARED if len(name) > 1 else SHAPE
            return Recognised("VRM", preset, side, entry["words"], own, tuple(entry["arkit"]))
    return None


def _mblab(name: str) -> Recognised | None:
    match = SLIDER.fullmatch(name)
    if match is None:
        return None
    end = {"min": "lower", "max": "upper"}[match["end"]]
    side = side_of(match["base"])
    words = " ".join(word.lower() for word in WORD.findall(match["base"]) if word not in ("L", "R"))
    words = f"{_with(words, side)}, {end} end of its slider"
    return Recognised("MB-Lab", f"{match['base']}_{match['end']}", side, words, OWN if match["prefix"] else SHAPE)


def _house(name: str) -> Recognised | None:
    """A name of VRoid, Reallusion, MikuMikuDance and others, whole or after a prefix that ends in a dot or colon."""
    for tail in (name, *(name.rpartition(mark)[2] for mark in ".:|/" if mark in name)):
        words = _without_viseme(split_words(tail))
        sides: list[Side] = [side_words()[word] for word in words if word in side_words()]
        bare = " ".join(word for word in words if word not in side_words())
        half: Side | None = sides[0] if len(sides) == 1 else None
        if whole := _house_names().get(" ".join(words)):
            return _of_house(tail, *whole, None)
        if known := _house_names().get(bare):
            return _of_house(tail, *known, half)
    return None


def _of_house(name: str, standard: str, own: str, entry: Any, side: Side | None) -> Recognised | None:
    """What a name means by its entry in houses.toml; a single sign of MikuMikuDance only where it says a movement."""
    if standard == "MikuMikuDance" and len(own) == 1 and movement_of(name) is None:
        return None
    if standard not in ANY_SPELLING and not _same_letters(name, own):
        return None
    confidence = SHARED if standard in ANY_SPELLING else HOUSE
    if isinstance(entry, str) and entry:
        nearest = _sided(entry, side) if entry in _data("arkit") else (entry,)
        base = entry if entry in _data("arkit") else entry.removesuffix("Left").removesuffix("Right")
        half: Side | None = side if base == entry else "left" if entry.endswith("Left") else "right"
        return Recognised(standard, own, half, _with(_data("arkit")[base]["words"], half), confidence, nearest)
    said = entry["words"] if isinstance(entry, dict) else " ".join(split_words(own))
    return Recognised(standard, own, side, _with(said, side), confidence)


def _words(name: str) -> Recognised | None:
    """A name that says its movement in the words of some language."""
    return _in_words(name, movement_of(name))


def _in_words(name: str, movement: Movement | None) -> Recognised | None:
    if movement is None:
        return None
    bases, side, part = nearest_of(movement), movement.side, movement.part or ""
    sure = round(WORDS * movement.confidence, 3)
    words = " and ".join(_data("arkit")[base]["words"] for base in bases)
    nearest = _looks(movement) or tuple(name for base in bases for name in _sided(base, side))
    words = _with(words, side) if bases else said_of(movement)
    return Recognised(IN_WORDS, name, side, words, sure, nearest, part)


def _looks(movement: Movement) -> tuple[str, ...]:
    """ARKit's blendshapes of eyes that look left or right: out for the one, in for the other."""
    if movement.kind not in ("gaze left", "gaze right") or movement.confidence < SURE:
        return ()
    goes = movement.kind.removeprefix("gaze ")
    sides: tuple[Side, ...] = (movement.side,) if movement.side else ("left", "right")
    return tuple(f"eyeLook{'Out' if side == goes else 'In'}{side.capitalize()}" for side in sides)


@cache
def _house_names() -> dict[str, tuple[str, str, Any]]:
    """(standard, own spelling, entry) of every name of a house, by its words in small letters."""
    return {
        " ".join(split_words(own)): (standard, own, entry)
        for standard, names in reversed(_data("houses").items())
        for own, entry in names.items()
    }


def _without_viseme(words: tuple[str, ...]) -> tuple[str, ...]:
    """VRChat's v_aa as viseme_aa; V_Open is Reallusion's own."""
    short = words[1:] if words[:1] == ("v",) else words[2:] if words[:2] == ("vrc", "v") else ()
    spelled = ("viseme", *short)
    return spelled if short and " ".join(spelled) in _house_names() else words


def _same_letters(name: str, own: str) -> bool:
    """Whether a name is spelled as its standard does, but for its side."""
    letters = own.replace("_", "")
    return name.replace("_", "").startswith(letters)


def _faceware(name: str) -> Recognised | None:
    short = NUMBERED.sub("", name).lower()
    for known, entry in _data("faceware").items():
        if short == known.lower():
            side: Side | None = {"(left)": "left", "(right)": "right"}.get(entry["words"].rpartition(" ")[2])  # type: ignore[assignment]
            shared = len(known.split("_")) == 2 and not known.startswith(("brows", "eyes"))  # jaw_open, mouth_up
            confidence = SHARED if shared else OWN
            return Recognised("Faceware", known, side, entry["words"], confidence, tuple(entry["arkit"]))
    return None


READERS: tuple[Callable[[str], Recognised | None], ...] = (
    _arkit,
    _facs,
    _metahuman,
    _vrm,
    _mblab,
    _faceware,
    _house,
    _words,
)


@cache
def _data(standard: str) -> dict[str, Any]:
    return tomllib.loads(files("capture_plan.names").joinpath("data", f"{standard}.toml").read_text(encoding="utf-8"))


def _sided(base: str, side: Side | None) -> tuple[str, ...]:
    """ARKit's names for a movement without a side: the one asked for, both, or the undivided one."""
    if _data("arkit")[base]["sides"] == "direction":
        return (base,)
    if side is not None:
        return (base + side.capitalize(),)
    return (base,) if _data("arkit")[base]["sides"] == "none" else (base + "Left", base + "Right")


def _with(words: str, side: Side | None) -> str:
    return f"{words} ({side})" if side else words
